"""Which numbers of a datasheet cannot be together, and the numbers of a second-order valve that follow from several."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from ..base.errors import InputError
from ..base.units import from_si, usual_unit
from .together import pressure_problem
from .valve.second_order import SECOND_ORDER

TRAVEL = 1e-3
"""m: of a spool whose travel is not stated; only flow over travel matters."""
_LARGEST_SHARE = 0.2  # of the rated flow of a land, as leakage
_LARGEST_HOSE = 10.0  # of the volume that the piston sweeps


@dataclass(frozen=True)
class DatasheetRule:
    """A check of the numbers [SI] of these keys, which raises InputError; `doubted` are those that may be wrong, all
    where none is named."""

    keys: tuple[str, ...]
    check: Callable[..., object]
    doubted: tuple[str, ...] = ()


def check_together(rules: Iterable[DatasheetRule], values: Mapping[str, float]) -> None:
    """Raises InputError for the first rule, of those whose keys are all there, that these numbers [SI] break."""
    for rule in rules:
        if values.keys() >= set(rule.keys):
            rule.check(*(values[key] for key in rule.keys))


def damping(f3db: float, f90: float) -> float:
    """zeta of the second-order valve with these corners [Hz]: (1 - r^2)^2 + (2 zeta r)^2 = 2 with r = f3db/f90.

    Raises InputError where there is none.
    """
    ratio, spec = f3db / f90, SECOND_ORDER.numbers["zeta"]
    zeta = math.sqrt(max(2 - (1 - ratio**2) ** 2, 0)) / (2 * ratio)
    if spec.problem(zeta):
        raise InputError(
            f"no second-order valve has -3 dB at {f3db:g} Hz and -90 deg at {f90:g} Hz "
            f"(-3 dB lies below {math.sqrt(1 + math.sqrt(2)):.3f} of -90 deg); check f3db and f90"
        )
    return zeta


def lap(rated_flow: float, rated_drop: float, leakage: float, leakage_drop: float) -> float:
    """The lap [m] of a leakage at null, which is two such wide paths in parallel. Raises InputError for one that no
    valve has."""
    share = leakage / (2 * rated_flow) * math.sqrt(rated_drop / leakage_drop)
    if share > _LARGEST_SHARE:
        raise InputError(f"the leakage is {share:.0%} of the rated flow of a land; check both")
    return TRAVEL * share / (1 - share)


def _possible_lap(*figures: float) -> None:
    if problem := SECOND_ORDER.numbers["eps"].problem(lap(*figures)):
        raise InputError(f"such a leakage has a lap eps that no valve has: {problem}; check it and the rated flow")


def _count(n: float) -> None:
    if n != round(n):
        raise InputError(f"{n:g} is no number of valves; write a whole one, such as 1")


def _pressures(supply: float, tank: float) -> None:
    if problem := pressure_problem(supply, tank):
        raise InputError(f"a supply pressure of {problem}")


def _reference(reference: float, f3db: float, f90: float = math.inf) -> None:
    if reference >= min(f3db, f90):
        raise InputError(f"reference, {reference:g} Hz, must be below f3db and f90")


def _sides(bore: float, rod: float) -> None:
    if rod >= bore:
        sides = f"the area of the rod side, AB {_shown(rod, 'm^2')}, is not below that of the bore side, AA"
        raise InputError(f"{sides} {_shown(bore, 'm^2')}")


def _hose(hose: float, area: float, stroke: float) -> None:
    if hose > _LARGEST_HOSE * area * stroke:
        more = f"more than {_LARGEST_HOSE:g} times the {_shown(area * stroke, 'm^3')} that the piston sweeps"
        raise InputError(f"a hose of {_shown(hose, 'm^3')} holds {more}; write bore x length, such as 19 mm x 2 m")


def _shown(value: float, si: str) -> str:
    unit = usual_unit(value, si)
    return f"{from_si(value, unit, si):.4g} {unit}"


RULES = (
    DatasheetRule(("n",), _count),
    DatasheetRule(("Ps", "Pr"), _pressures),
    DatasheetRule(("reference", "f3db"), _reference),
    DatasheetRule(("reference", "f3db", "f90"), _reference),
    DatasheetRule(("AA", "AB"), _sides),
    DatasheetRule(("hose", "Aj", "S"), _hose, ("hose",)),
    DatasheetRule(("hose", "AA", "S"), _hose, ("hose",)),
)
"""Of every datasheet; the numbers of a response are those of one."""
SECOND_ORDER_RULES = (
    DatasheetRule(("f3db", "f90"), damping),
    DatasheetRule(("rated_flow", "rated_drop", "leakage", "leakage_drop"), _possible_lap),
)
"""Of a datasheet whose valve has one response."""
