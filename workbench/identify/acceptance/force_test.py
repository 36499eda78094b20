"""A load cell's sheet: every line of it from records, or with the reason why these records cannot say it.

Records `force-static...` hold levels, `force-sine...` play sines of force with rests between, both beside a reference
cell where there is one; `force-free...` move without a specimen, as any record of a rig does that declares none.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...records import Record
from ...rigs.rig import Rig
from .force_dynamic import ForcePoint, check_reference, force_points, free_mass, plain_frequency, referenced_mass
from .force_static import StaticTest, span_error, static_rows, static_test, widened
from .regression import Series, regress
from .row import AcceptanceLimit, Estimate, Row, measured, unsaid

_BEYOND = 1.5  # times the highest frequency that was played, up to which a band is said
_HELD_OUT = 4  # points, from which on each is compensated by a mass that the others say
_NO_FORCE = "no record force-sine with force: sines of force with rests between"


@dataclass(frozen=True, eq=False)
class ForceSheet:
    """The lines of a sheet, and the levels and sines behind them; `limits` that its dynamic errors are held against."""

    rows: list[Row]
    static: StaticTest | None
    points: list[ForcePoint]
    mass: Estimate | None
    limits: Mapping[str, AcceptanceLimit]


@dataclass(frozen=True)
class Reference:
    """Half of the reference cell's own 95 % interval, and the error that a band is to stay within; shares."""

    accuracy: float
    within: float


def force_sheet(records: Sequence[Record], rig: Rig, asked: Reference) -> ForceSheet:
    """Raises InputError for levels held too short a time, what is no sine, a reference that is slower than the rig."""
    static = static_test([r for r in records if r.name.startswith("force-static")], rig.limit("force"))
    span = span_error(static)
    points = force_points([r for r in records if r.name.startswith("force-sine")], rig)
    free = [r for r in records if r.name.startswith("force-free") or (not r.name.startswith("force") and not rig["ks"])]
    found = referenced_mass(points, span)
    mass, gain = found if found else (free_mass(free, rig) or _declared(rig), span.value if span else 0.0)
    check_reference(points, mass, gain, asked.within)
    rows = [*static_rows(static, asked.accuracy), _mass(mass, gain if found else 0.0, points)]
    names = _names(points)
    rows += [_error(name, point, mass, asked) for name, point in zip(names, points, strict=True)]
    rows += [_compensated(name, points, i, mass, span, asked) for i, name in enumerate(names)]
    rows += [_band(points, mass, asked), _noise(points, mass, rig)]
    if not points:
        rows.insert(-2, unsaid("dynamic_error", "error of the indicated force range", "%", _NO_FORCE))
    reach = 100 * asked.within
    held = {f"{kind}_{name}": AcceptanceLimit(None, -reach, reach) for kind in _KINDS for name in names}
    return ForceSheet(rows, static, points, mass, held)


_KINDS = ("dynamic_error", "compensated_error")


def _names(points: Sequence[ForcePoint]) -> list[str]:
    """What each point is called: frequency and record, which are the same whatever the noise."""
    names: list[str] = []
    for point in points:
        record = re.sub(r"\W+", "_", point.sine.record.name.removeprefix("force-")).lower()
        name = f"{plain_frequency(point.f)}hz_{record}".replace(".", "_")
        count = sum(other == name or other.startswith(f"{name}_again") for other in names)
        names.append(name if not count else f"{name}_again{count if count > 1 else ''}")
    return names


def _declared(rig: Rig) -> Estimate | None:
    """The mass as the rig file says, its bounds as a uniform spread; None where it says none."""
    if "Mg" not in rig:
        return None
    number = rig.numbers["Mg"]
    ends = (number.low, number.high)
    deviation = 0.0 if None in ends else (ends[1] - ends[0]) / np.sqrt(12)  # pyright: ignore
    return Estimate(number.value, float(deviation))


def _mass(mass: Estimate | None, gain: float, points: Sequence[ForcePoint]) -> Row:
    """The row of the mass that the cell shows, which an error `gain` of its span enlarges."""
    meaning = "mass between load cell and specimen"
    if mass is None:
        why = (
            "no sines beside a reference cell at three frequencies, no record force-free without a specimen, and the "
            "rig file declares none (Mg)"
        )
        return unsaid("mass", meaning, "kg", why)
    sources = sorted({point.source for point in points if point.source})
    meaning += f", acceleration by {' and '.join(sources)}" if sources else ""
    return measured("mass", meaning, "kg", mass, 1 / (1 + gain))


def _error(name: str, point: ForcePoint, mass: Estimate | None, asked: Reference) -> Row:
    id, error = f"dynamic_error_{name}", point.error(mass)
    meaning = f"error of the indicated force range at {plain_frequency(point.f)} Hz, {point.range / 1e3:.2g} kN"
    if error is None:
        return unsaid(id, meaning, "%", "no reference cell, and no mass times acceleration to correct it by")
    meaning += f", by {point.at_specimen(mass)[1]}"
    return widened(measured(id, meaning, "%", error, 100.0), 100 * asked.accuracy * (point.reference is not None))


def _compensated(
    name: str, points: Sequence[ForcePoint], which: int, mass: Estimate | None, span: Estimate | None, asked: Reference
) -> Row:
    """What is left where mass times acceleration is taken off; the mass by the other sines, where they are enough."""
    point, others = points[which], [point for i, point in enumerate(points) if i != which]
    id = f"compensated_error_{name}"
    meaning = f"error at {plain_frequency(point.f)} Hz, {point.range / 1e3:.2g} kN, less mass times acceleration"
    apart = referenced_mass(others, span) if len(points) >= _HELD_OUT else None
    error = point.error(apart[0] if apart else mass, compensated=True)
    if error is None:
        return unsaid(id, meaning, "%", "no reference cell that would say what compensation leaves")
    return widened(measured(id, meaning, "%", error, 100.0), 100 * asked.accuracy)


def _band(points: Sequence[ForcePoint], mass: Estimate | None, asked: Reference) -> Row:
    """The row of the frequency at which |e0 + c f^2| comes to the limit: inertia over an elastic force goes with
    f^2."""
    percent = f"{100 * asked.within:g}"
    id, meaning = "band", f"frequency up to which the error stays within {percent} %, by its growth with f^2"
    errors = [(point.f, error) for point in points if (error := point.error(mass)) is not None]
    if len({f for f, _ in errors}) < 3:
        return unsaid(id, meaning, "Hz", "fewer than three frequencies whose error is known")
    f = np.array([f for f, _ in errors])
    weight = 1 / np.array([max(error.deviation, 1e-6) for _, error in errors])
    x, y = np.column_stack((np.ones_like(f), f**2)), np.array([error.value for _, error in errors])
    series = [Series(weight[i : i + 1] * y[i], weight[i : i + 1, None] * x[i : i + 1], 1) for i in range(f.size)]
    fit = regress(series, np.zeros(2), np.full(2, np.inf), summed=False)
    edge = _edge(fit.coefficients, asked.within)
    if edge is None or edge > _BEYOND * f.max():
        return unsaid(id, meaning, "Hz", f"the error stays within {percent} % up to the highest sine, {f.max():.3g} Hz")
    if edge <= f.min() * 1e-3:
        return unsaid(id, meaning, "Hz", f"the error is beyond {percent} % at rest already")
    slope = np.array([_edge_slope(fit.coefficients, asked.within, i) for i in range(2)])
    deviation = float(np.hypot(fit.deviation(slope), asked.accuracy * abs(slope[0])))
    return measured(id, meaning, "Hz", Estimate(edge, deviation, fit.freedom), positive=True)


def _edge(coefficients: np.ndarray, within: float) -> float | None:
    """Frequency [Hz] at which the error leaves the limits; 0 where it never is inside, None where it never leaves."""
    constant, growth = coefficients
    if abs(constant) >= within:
        return 0.0
    square = (np.copysign(within, growth) - constant) / growth if growth else np.inf
    return None if not np.isfinite(square) else float(np.sqrt(square))


def _edge_slope(coefficients: np.ndarray, within: float, which: int) -> float:
    step = 1e-4 * (within if which == 0 else abs(float(coefficients[1])))
    moved = [_edge(coefficients + side * step * np.eye(2)[which], within) or 0.0 for side in (1.0, -1.0)]
    return (moved[0] - moved[1]) / (2 * step)


def _noise(points: Sequence[ForcePoint], mass: Estimate | None, rig: Rig) -> Row:
    id, meaning = "compensation_noise", "standard deviation that mass times the accelerometer's noise adds"
    sensor = rig.sensors.get("acceleration")
    if mass is None or sensor is None or not any(point.source == "accelerometer" for point in points):
        return unsaid(id, meaning, "N", "no accelerometer in these records")
    return measured(id, meaning, "N", Estimate(mass.value, mass.deviation, mass.freedom), sensor.noise)
