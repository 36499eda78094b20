"""A drawn rig with what is played on it: motions of the plant with effects, and what refits of the plant leave."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from workbench.base.errors import InputError
from workbench.engine import Engine
from workbench.plant import build
from workbench.records.excitation import Excitation
from workbench.rigs.rig import Rig
from workbench.rigs.rig_file import load_rig

from .cause import Cause, cause
from .misfit import Misfit
from .play import PlayedMotion, play, start
from .programme import Programme
from .second_order import SECOND_ORDER, second_order_rig

TOLERANCE = 1e-6  # of the simulation: far below what a fit resolves
SMALLER, TRIES = 0.8, 8  # where a drawn excitation is too much for the rig


@dataclass(frozen=True)
class Scene:
    """All that a plan decides but its effects: the rig, its true numbers, its sensors' noise, what is played.

    judged: what the errors of free runs are held against [SI], where records are scored by these.
    """

    rig: Rig
    true: Mapping[str, float]
    sigma: Mapping[str, float]
    programme: Programme
    judged: Mapping[str, float] | None = None

    @property
    def played(self) -> tuple[Excitation, ...]:
        """Every record's excitation."""
        return self.programme.played

    @property
    def moving(self) -> tuple[Excitation, ...]:
        """Those that move the rig."""
        return self.played[self.programme.resting :]

    @property
    def base(self) -> Engine:
        """The rig as described."""
        return engine_of(self.rig.name, self.rig.corrector, ())

    def misfit(self, p: np.ndarray, motions: Sequence[PlayedMotion]) -> Misfit:
        """What refits of the rig leave, with slopes along `motions` of plants with parameters p."""
        period, judging = self.played[0].period, self.programme.judging
        free_runs = self.judged is not None
        return Misfit(self.base, p, self.rig, self.judged or self.sigma, motions, period, judging, free_runs)

    def motions(
        self, mix: Mapping[Cause, Mapping[str, float]], played: Sequence[Excitation], heard: Sequence[np.ndarray] = ()
    ) -> list[PlayedMotion]:
        """Excitations played on the rig with these effects' numbers; `heard` [n] m is the noise of position, if any."""
        engine = engine_of(self.rig.name, self.rig.corrector, tuple(cause.key for cause in mix))
        given = {cause.effect.key(name): value for cause, numbers in mix.items() for name, value in numbers.items()}
        p = engine.plant.parameter_values(None, **self.true, **given)
        states = {**self.programme.start} | dict.fromkeys(self.programme.at_return, self.true.get("Pr", self.rig["Pr"]))
        for missing in mix:
            states |= missing.initial_states
        begin = start(engine, p, states, self.programme.balanced)
        loop, settings = self.programme.loop, self.programme.settings
        noises = heard or [np.zeros(len(excitation.reference)) for excitation in played]
        return [
            play(engine, p, begin, excitation, loop, noise, settings.get(excitation.name, {}))
            for excitation, noise in zip(played, noises, strict=True)
        ]


def within_limits(scene: Scene) -> Scene:
    """The scene with excitations so small that the rig stays within its stroke and no chamber falls below 0 bar."""
    for _ in range(TRIES):
        fitting = [fits(scene.rig, motion) for motion in scene.motions({}, scene.played)]
        if all(fitting):
            return scene
        smaller = [
            excitation if fit else excitation.scaled(SMALLER)
            for excitation, fit in zip(scene.played, fitting, strict=True)
        ]
        scene = replace(scene, programme=replace(scene.programme, played=tuple(smaller)))
    raise InputError(f"{scene.rig.name}: drawn excitations are too large at any size; check its limits")


def fits(rig: Rig, motion: PlayedMotion) -> bool:
    travelled = np.abs(motion.outputs["position"] - rig["xmid"]).max()
    return travelled < rig.limit("stroke") and motion.outputs["lowest_pressure"].min() > 0


@lru_cache(maxsize=4)
def drawn_rig(name: str, corrector: str) -> Rig:
    """A bundled rig by name, or one that is drawn: `second-order-SEED`."""
    kind, _, seed = name.rpartition("-")
    rig = second_order_rig(int(seed)) if kind == SECOND_ORDER else load_rig(name)
    return rig if corrector in ("", rig.corrector) else rig.with_corrector(corrector)


@lru_cache(maxsize=4)
def engine_of(rig: str, corrector: str, causes: tuple[tuple[str, str], ...]) -> Engine:
    described = drawn_rig(rig, corrector)
    return Engine(build(described, also=[cause(*key, described).effect for key in causes]), TOLERANCE)
