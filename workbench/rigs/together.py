"""What the numbers of a rig have to be to each other."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ..base.table import ConfigTable
from ..base.units import from_si
from .schema import SHARED

if TYPE_CHECKING:
    from .number import Number
    from .sensor import Sensor

_BLIND = 50.0  # times the speed limit: what the guard sees of a speed has to be below that


def problem_together(numbers: Mapping[str, "Number"], limits: Mapping[str, "Number"]) -> tuple[str, str, str] | None:
    """What is wrong with numbers of a rig that are possible one by one, but not beside each other: the table of a rig
    file, the number and a sentence."""
    supply, tank = numbers["Ps"], numbers["Pr"]
    if problem := pressure_problem(supply.value, tank.value):
        return "supply", "Ps", problem
    if len(given := [name for name in SHARED if name in numbers]) == 1:
        lacking = next(name for name in SHARED if name not in numbers)
        return "supply", given[0], f"another function needs {lacking} beside it; give both, or neither"
    mass, part = numbers["M"], next((numbers[name] for name in ("Mg", "Mr") if name in numbers), None)
    if part is not None and part.value > mass.value:
        return "load", part.name, f"{part.value:g} kg is part of M, {mass.value:g} kg; give less"
    stroke, travel = limits["stroke"], numbers["S"]
    longest = travel.value if travel.high is None else travel.high  # an uncertain stroke may be that long
    if stroke.value > longest / 2 * (1 + 1e-9):
        allowed, half = (f"{1e3 * value:.6g} mm" for value in (stroke.value, longest / 2))
        problem = f"{allowed} to each side of mid stroke is beyond the end stops, {half}; give half of S at most"
        return "limits", "stroke", problem
    return None


def pressure_problem(supply: float, tank: float) -> str:
    """What is wrong with two pressures [Pa]; nothing where oil would flow from one to the other."""
    if supply > tank:
        return ""
    low, high = (f"{from_si(value, 'bar', 'Pa'):.6g} bar" for value in (supply, tank))
    return f"{low} is not above the return pressure, {high}, so nothing would move; correct one of them"


def check_speed_guard(top: ConfigTable, sensors: Mapping[str, "Sensor"], move: float) -> None:
    """Raises InputError for a position sensor whose noise and resolution hide what is far above the speed limit.

    `move` (SI) is how far that limit lets the position go in a control period. What two readings scatter by at
    rest has to be allowed besides, see loop/guard.py.
    """
    if "position" not in sensors:
        return
    sensor = sensors["position"]
    hidden = sensor.scatter + sensor.resolution
    if hidden > _BLIND * move:
        loud = "noise" if sensor.scatter > sensor.resolution else "resolution"
        problem = (
            f"readings at rest may differ by {hidden / move:.3g} times what the speed limit allows in a period, so the "
            f"guard would see no speed; correct it, the speed limit or the period (up to {_BLIND:g} times)"
        )
        raise top.table("sensors").table("position").complaint(loud, problem)
