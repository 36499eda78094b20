"""Platforms whose joints or payload are drawn: friction, play, a joint elsewhere, a part that gives way, or nothing."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from workbench.commands.record.platform import platform_plan
from workbench.identify.wrench.candidates import PLACES, with_joint
from workbench.rigs.platform import LEGS, Platform, platform_effect
from workbench.rigs.platform.effects import FLEXIBLE, FRICTION, PLAY

from .platforms import PLATFORM, drawn_leg, leave_records, with_rigs

CLEAN = "clean"
KINDS = (FRICTION, PLAY, *PLACES, FLEXIBLE, CLEAN)
_MOMENT = (30.0, 200.0)  # N m
_WIDTH = (2e-4, 1e-3)  # m
_CONTACT = {"stiffness": 5e8, "damping": 0.2}
_OFF = (5e-3, 2e-2)  # m
_SHARE, _FREQUENCY, _DAMPING = (0.05, 0.4), (8.0, 25.0), (0.02, 0.06)
_HEIGHT = (0.3, 1.2)  # m


@dataclass(frozen=True)
class DrawnJoint:
    """A platform to draw: one of KINDS, in a leg counted from 1 where it is one of a leg; the rest is of the seed."""

    seed: int
    what: str
    leg: int

    @property
    def id(self) -> str:
        """The name of its folder."""
        return f"joint-{self.what}-{self.seed}"

    @property
    def label(self) -> str:
        """As a trace names it."""
        return self.what if self.what == FLEXIBLE else f"leg{self.leg}.{self.what}"

    def known(self) -> dict[str, Any]:
        """What is known before it is drawn, by the keys of truth.json."""
        clean = self.what == CLEAN
        return {
            "id": self.id,
            "kind": CLEAN if clean else "single",
            "seed": self.seed,
            "noise": "white",
            "effects": [] if clean else [self.label],
            "formula": [],
            "equations": [] if clean else ["force"],
        }

    def draw(self, folder: Path) -> dict[str, Any]:
        """Write its campaign's folder and return what it is short of. Raises InputError."""
        drawn = np.random.default_rng([self.seed, 1])
        plan = platform_plan(PLATFORM, self.seed)
        plan = with_rigs(plan, [drawn_leg(leg.rig, drawn) for leg in plan.platform.legs])
        platform, numbers = self._with_its_own(plan.platform, drawn)
        leave_records(replace(plan, platform=platform), folder)
        return self.known() | {"numbers": {f"{self.label}.{name}": value for name, value in numbers.items()}}

    def _with_its_own(self, platform: Platform, drawn: np.random.Generator) -> tuple[Platform, dict[str, float]]:
        """The platform as it truly is, and the numbers of that."""
        if self.what == CLEAN:
            return platform, {}
        if self.what in PLACES:
            way = drawn.standard_normal(3)
            by = _between(drawn, _OFF) * way / np.linalg.norm(way)
            moved = with_joint(platform, self.leg - 1, PLACES[self.what], by)
            return moved, dict(zip(("dx", "dy", "dz"), by.tolist(), strict=True))
        if self.what == FLEXIBLE:
            numbers = {
                "mass": _between(drawn, _SHARE) * platform["mass"],
                "frequency": _between(drawn, _FREQUENCY),
                "damping": _between(drawn, _DAMPING),
                "height": _between(drawn, _HEIGHT),
            }
            return replace(platform, effects=(platform_effect(FLEXIBLE, 0, **numbers),)), numbers
        numbers = {"moment": _between(drawn, _MOMENT)} if self.what == FRICTION else {"width": _between(drawn, _WIDTH)}
        every = numbers if self.what == FRICTION else numbers | _CONTACT
        return replace(platform, effects=(platform_effect(self.what, self.leg, **every),)), numbers


def joint_draws(count: int, seed: int) -> list[DrawnJoint]:
    """`count` of them, KINDS in turn, in legs that are drawn."""
    legs = np.random.default_rng([seed, 0]).integers(1, LEGS + 1, count)
    return [
        DrawnJoint(seed * 100_000 + number, KINDS[number % len(KINDS)], int(leg)) for number, leg in enumerate(legs)
    ]


def _between(drawn: np.random.Generator, ends: tuple[float, float]) -> float:
    """Log-uniform."""
    return float(np.exp(drawn.uniform(*np.log(ends))))
