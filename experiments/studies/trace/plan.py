"""What a study draws: which kinds of campaign, lacking what, by a seed."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from workbench.base.errors import InputError
from workbench.plant.effects import acts
from workbench.rigs.rig import Rig

from .campaigns.cause import LIBRARY_CAUSES, OTHER_FORMULA_CAUSES, UNNAMED_CAUSES, Cause, causes_on, number_causes
from .campaigns.draw import JACK, CampaignPlan, Kind
from .campaigns.noise import BLEMISHES, Noise
from .campaigns.scene import drawn_rig
from .campaigns.second_order import SECOND_ORDER
from .score import FAMILY

SHARES = {"single": 0.55, "clean": 0.15, "off": 0.15, "pair": 0.15}
NEIGHBOURS = "neighbours"  # no part of a plan: who is taken for whom within a family, in formulas that it lacks
DATASHEET_MISFIT = (2.0, 2000.0)  # people write when an effect is large
PUMP_SHARES = {"single": 0.4, "number": 0.2, "clean": 0.2, "off": 0.2}
MISFIT = (2.0, 15.0)  # held-out chi2 that a refit of the base model leaves, log-uniform
PUMP_MISFIT = (4.0, 20.0)  # of free runs, whose floor is above the noise
SHARP, TIMING_SHARP = (0.25, 1.0), (0.1, 0.25)  # late currents show far too well where the command is rough
NOISES: tuple[Noise, ...] = ("white", "white", "white", "tripled", "coloured")
FEW, POOR, SUPPLY, BLEMISHED = 0.08, 0.05, 0.5, 0.25  # of the campaigns
DATASHEET_FEW = 0.15
UNSEEN = tuple(
    f"number.{name}" for name in ("Pr", "kg", "pg", "Vg", "Kd", "Rl", "V0A", "V0B")
)  # which such cycles do not tell
SPEED, MOTOR = "speed", "motor"  # what drives a pump: its measured speed, or a voltage where the motor is in question


def default_plan(count: int, seed: int, rig: str = JACK, kind: str | None = None) -> list[CampaignPlan]:
    """`count` campaigns by the shares of a rig, or of one kind, shuffled, so that the first ones represent all.

    They are on a bundled rig, or each on a second-order rig of its own.
    The singles take the names of the library in turn, in formulas of the library and others; a wrong number is in turn
    each that has a range. Raises InputError for a kind that is not drawn on that rig.
    """
    shares, planned = {JACK: (SHARES, _valve_plan), SECOND_ORDER: (SHARES, _datasheet_plan)}.get(
        rig, (PUMP_SHARES, _pump_plan)
    )
    if kind is not None:
        kinds = [*shares] if planned is _pump_plan else [*shares, NEIGHBOURS]
        if kind not in kinds:
            raise InputError(f"--kind {kind}: campaigns on {rig} are {', '.join(kinds)}")
        shares = {kind: 1.0}
    parts = np.floor(np.cumsum([0.0, *shares.values()]) * count + 0.5).astype(int)
    kinds = np.repeat(list(shares), np.diff(parts))
    order = np.random.default_rng([seed, 0])
    described = drawn_rig(f"{rig}-0" if rig == SECOND_ORDER else rig, "")
    able = dict.fromkeys(cause.effect.name for cause in causes_on(described, LIBRARY_CAUSES))
    names = order.permutation(list(able)).tolist()
    return [planned(described, str(kinds[i]), seed, int(i), names) for i in order.permutation(count)]


def _datasheet_plan(rig: Rig, kind: str, seed: int, number: int, names: Sequence[str]) -> CampaignPlan:
    """The same on a rig of the campaign's own."""
    plan = _valve_plan(rig, kind, seed, number, names, DATASHEET_MISFIT, DATASHEET_FEW)
    return replace(plan, rig=f"{SECOND_ORDER}-{plan.seed}")


def _valve_plan(
    rig: Rig,
    kind: str,
    seed: int,
    number: int,
    names: Sequence[str],
    misfit: tuple[float, float] = MISFIT,
    fewer: float = FEW,
) -> CampaignPlan:
    """One campaign of a plan; everything about it follows from seed and number."""
    drawn = np.random.default_rng([seed, 1, number])
    causes, removed = _causes(rig, kind, number, names, drawn)
    timing = any(cause.effect.family == "drive timing" for cause in causes)
    few = kind == "single" and drawn.random() < fewer
    blemish = tuple(drawn.choice(BLEMISHES, drawn.integers(1, 4), replace=False).tolist())
    return CampaignPlan(
        seed=seed * 100_000 + number,
        kind=cast(Kind, "single" if kind == NEIGHBOURS else kind),
        effects=tuple(cause.key for cause in causes),
        removed=removed,
        misfit=_log_uniform(drawn, misfit),
        sharp=_log_uniform(drawn, TIMING_SHARP if timing else SHARP),
        noise=NOISES[drawn.integers(len(NOISES))],
        supply=bool(drawn.random() < SUPPLY),
        few=few,
        poor=kind == "single" and not few and bool(drawn.random() < POOR),
        blemish=blemish if drawn.random() < BLEMISHED else (),
    )


def _pump_plan(rig: Rig, kind: str, seed: int, number: int, names: Sequence[str]) -> CampaignPlan:
    """The same of a pump drive: whole cycles, white noise."""
    drawn = np.random.default_rng([seed, 1, number])
    causes, removed = _causes(rig, kind, number, names, drawn)
    by_speed = rig.with_corrector(SPEED)
    return CampaignPlan(
        seed=seed * 100_000 + number,
        kind=cast(Kind, kind),
        effects=tuple(cause.key for cause in causes),
        removed=removed,
        misfit=_log_uniform(drawn, PUMP_MISFIT),
        rig=rig.name,
        corrector=SPEED if all(acts(cause.effect, by_speed) for cause in causes) else MOTOR,
    )


def _causes(
    rig: Rig, kind: str, number: int, names: Sequence[str], drawn: np.random.Generator
) -> tuple[list[Cause], tuple[str, ...]]:
    """What a campaign is short of, and what the tracer's library is to be without."""
    if kind == "clean":
        return [], ()
    if kind == NEIGHBOURS:
        return _neighbours(rig, number)
    if kind == "number":
        return [_number(rig, number, drawn)], ()
    if kind == "off" and number % 2:
        unnamed = causes_on(rig, UNNAMED_CAUSES)
        return [unnamed[drawn.integers(len(unnamed))]], ()
    first = _formula(rig, names[number % len(names)], drawn)
    if kind == "single":
        return [first], ()
    kin = tuple(name for name, family in FAMILY.items() if family == FAMILY[first.effect.name])
    if kind == "off":
        return [first], kin
    others = [name for name in names if name not in kin]
    return [first, _formula(rig, others[drawn.integers(len(others))], drawn)], ()


def _neighbours(rig: Rig, number: int) -> tuple[list[Cause], tuple[str, ...]]:
    """In turn each formula that the library lacks of an effect with neighbours; the tracer has that family alone."""
    large = {family for family, count in Counter(FAMILY.values()).items() if count > 1}
    pool = [cause for cause in causes_on(rig, OTHER_FORMULA_CAUSES) if FAMILY[cause.effect.name] in large]
    drawn = pool[number % len(pool)]
    return [drawn], tuple(name for name, family in FAMILY.items() if family != FAMILY[drawn.effect.name])


def _number(rig: Rig, number: int, drawn: np.random.Generator) -> Cause:
    """A described number beyond one end of its range."""
    causes = number_causes(rig.with_corrector(SPEED))
    names = [name for name in dict.fromkeys(cause.effect.name for cause in causes) if name not in UNSEEN]
    sides = [cause for cause in causes if cause.effect.name == names[number % len(names)]]
    return sides[drawn.integers(len(sides))]


def _formula(rig: Rig, name: str, drawn: np.random.Generator) -> Cause:
    """A formula of a named effect: one of the library's or another, as likely, where there is another."""
    own, others = (
        [cause for cause in causes_on(rig, pool) if cause.effect.name == name]
        for pool in (LIBRARY_CAUSES, OTHER_FORMULA_CAUSES)
    )
    pool = own if drawn.random() < 0.5 or not others else others
    return pool[drawn.integers(len(pool))]


def _log_uniform(drawn: np.random.Generator, band: tuple[float, float]) -> float:
    return float(np.exp(drawn.uniform(*np.log(band))))
