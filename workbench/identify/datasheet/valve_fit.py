"""A valve's numbers from its datasheet: second-order in closed form, three-stage by a fit.

The fit starts from engineering estimates and minimises the errors of the corner frequencies and the pilot flow, each
over 1 %, together with every number's distance from its estimate over its range: figures that say nothing of a number
leave it where it was.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from ...base.errors import InputError
from ...base.units import usual_unit
from ...rigs.datasheet import Datasheet, build_rig, main_lands
from ...rigs.datasheet_rules import TRAVEL, damping, lap
from ...rigs.number import Number
from ...rigs.rig import Rig
from ...rigs.schema import SUPPLY
from ...rigs.tolerances import TOLERANCES
from ...rigs.valve import SECOND_ORDER, THREE_STAGE
from ...rigs.valve.lands import WIDTHS
from ..fit.determined import DETERMINED, Determination, FreeParameter, determine
from .corners import FigureErrors

Keep = Callable[[str, Callable[[], Any]], Any]
"""Computes a named part once; a resumed run gets the stored result."""

_TIGHT = 0.01  # weight of the fit: a figure off by this costs as much as a number at the end of its range
_STEPS = 12
_DIFFERENCE = 0.03  # of a range: the step of the slopes
_RUBBING = 0.01  # of rated torque: friction of a pilot whose hysteresis is not stated
_ORIFICE = 0.61 * np.sqrt(2 / 850)  # flow per area and root of pressure drop of a sharp-edged land, mineral oil


@dataclass(frozen=True)
class ValveFit:
    """A fitted rig, the rig of the estimates, the fit's own errors of the figures (logarithms), and what is determined.

    `start`: 0 when the engineering estimates led there, else the number of the random start.
    """

    rig: Rig
    estimate: Rig
    free: tuple[FreeParameter, ...]
    errors: Mapping[str, float]
    determination: Determination
    start: int


def second_order_numbers(sheet: Datasheet) -> dict[str, Number]:
    """f0, zeta, lands and lap of a second-order valve in closed form; several amplitudes: the mean of their logarithms.

    Raises InputError for corners or a leakage that no such valve has.
    """
    f3db, f90 = (_geometric_mean([getattr(r, k) for r in sheet.responses]) for k in ("f3db", "f90"))
    try:
        zeta, eps = damping(f3db, f90), _lap(sheet, sheet.valve["leakage"])
        laps = [_lap(sheet, end) for end in sheet.ranges.get("leakage", ())]
    except InputError as error:
        raise InputError(f"{sheet.name}: {error}") from None
    values = {
        "f0": (f90, "datasheet: -90 deg"),
        "zeta": (zeta, "datasheet: -3 dB over -90 deg"),
        "z0": (0.0, "datasheet: no offset stated"),
        "K3": (main_lands(sheet, TRAVEL, eps), "datasheet: rated flow at full travel"),
        "z3max": (TRAVEL, "declared here: the spool's travel is not stated"),
        "eps": (eps, _said(sheet, "leakage", "leakage at null")),
        "n": (sheet.valve["n"], "datasheet"),
    }
    numbers = {name: _number(name, value, source) for name, (value, source) in values.items()}
    least = SECOND_ORDER.numbers["eps"].low
    gain = numbers["K3"].value / sheet.valve["rated_flow"]
    stated = {
        "K3": tuple(gain * end for end in sheet.ranges.get("rated_flow", ())),
        "eps": tuple(max(end, least) for end in laps),
    }
    bounded = {name: replace(numbers[name], low=ends[0], high=ends[1]) for name, ends in stated.items() if ends}
    if widths := _widths(sheet):
        bounded["z0"] = _null(numbers["z0"], widths)
    return numbers | bounded


def _widths(sheet: Datasheet) -> dict[str, float]:
    """What hysteresis and threshold are at most, of full command, where the sheet states them."""
    return {key: max(sheet.ranges.get(key, (sheet.valve[key],))) for key in WIDTHS if key in sheet.valve}


def _said(sheet: Datasheet, key: str, what: str) -> str:
    """The source of a number that follows from a figure of the valve: what the figure is, and what its own source says
    of it."""
    entry = sheet.read["valve"][key]
    said = entry.get("source", "") if isinstance(entry, Mapping) else ""
    head, _, more = (said or "datasheet").partition(": ")
    return f"{head}: {what}" + (f", {more}" if more else "")


def _lap(sheet: Datasheet, leakage: float) -> float:
    valve = sheet.valve
    return lap(valve["rated_flow"], valve["rated_drop"], leakage, valve["leakage_drop"])


def _null(z0: Number, widths: Mapping[str, float]) -> Number:
    """The null of a valve whose spool stands anywhere in its loop of hysteresis and its threshold, of full command."""
    usual = TOLERANCES["z0"]
    far = usual.beside + sum(widths.values()) / 2
    said = f"{z0.source}; +-{far:.3g}: {usual.why}, and half of the {' and the '.join(widths)} lies to each side"
    return replace(z0, low=-far, high=far, source=said)


def _geometric_mean(values: list[float]) -> float:
    """The geometric mean; of one value, that value to the last bit."""
    return values[0] * float(np.exp(np.mean(np.log(np.divide(values, values[0])))))


def unknowns(sheet: Datasheet) -> tuple[FreeParameter, ...]:
    """What a three-stage valve's fit may move, with estimates from the geometry and the rated figures alone."""
    g, valve, supply = _geometry(sheet), sheet.valve, sheet.given["Ps"].value
    root = float(np.sqrt(valve["rated_drop"] / 2))
    pilot = valve["pilot_flow"] / g["K2"] / root  # m: opening of the pilot lands at rated flow
    torque = g["Kr2"] * g["L"] * (pilot - g["eps"])
    gain = torque / valve["imax"]
    travel = valve["rated_flow"] / root / (_ORIFICE * float(np.sqrt(4 * np.pi * g["S3"]))) - g["eps"]
    fastest = g["K2"] * pilot * float(np.sqrt(supply / 2)) / g["S3"]  # m/s: main spool with the pilot fully open
    loop = 2 * np.pi * max(r.f3db for r in sheet.responses if r.stage == "main") * travel / fastest
    stop, force = torque / g["l"] / g["xo"], g["rff3"] * g["K2"]
    spring, push = g["Kr2"] * g["L"] ** 2, g["S2"] * supply
    part, why = _rubbing(sheet, loop)
    free = [
        FreeParameter(
            "Km", gain, 0.8 * gain, 1.2 * gain, None, "rated torque holds the feedback spring at rated pilot flow"
        ),
        FreeParameter(
            "Knet", 0.0, -spring / 2, spring / 2, spring, "flexure and magnets cancel, to half the feedback spring"
        ),
        FreeParameter("kstop", stop, stop / 10, stop * 10, None, "rated torque pushes the flapper in by one gap"),
        FreeParameter("cff2", force, force / 2, force * 2, None, "theory of the flow force"),
        FreeParameter("Pr", 5e5, 0.0, 1e6, 5e5, "some bar in a return line"),
        FreeParameter("Kp", loop, loop / 2, loop * 2, None, "the main stage as one integrator"),
        FreeParameter("z3max", travel, 0.8 * travel, 1.2 * travel, None, "lands open all around the spool"),
        FreeParameter(
            "Fs1", part / 2 * torque, 0.0, part * torque, torque, f"up to {100 * part:.3g} % of rated torque{why}", True
        ),
        FreeParameter("Fs2", part / 8 * push, 0.0, part / 4 * push, push, f"{_on_spool(part)}{why}", True),
    ]
    free += [
        FreeParameter(name, g[name], g[name] - h, g[name] + h, None, "as printed", True)
        for name, h in sheet.rounding.items()
    ]
    return tuple(parameter for parameter in free if parameter.name not in sheet.given)


def _rubbing(sheet: Datasheet, loop: float) -> tuple[float, str]:
    """What friction in the pilot takes of its rated torque at most, and of what that follows.

    A main spool whose loop has the gain `loop` stands still until the pilot's current has crossed its own loop, twice
    the friction wide: hysteresis and threshold times gain. A quarter of that share, in parts of the supply pressure on
    its end, is what a spool's own friction costs.
    """
    if not (widths := _widths(sheet)):
        return _RUBBING, ""
    return loop * sum(widths.values()) / 2, f", by the stated {' and '.join(widths)}"


def _on_spool(part: float) -> str:
    return f"up to {100 * part / 4:.3g} % of supply pressure on the spool"


def fit_three_stage(
    sheet: Datasheet, starts: int, tolerance: float, keep: Keep, report_progress: Callable[[str], None]
) -> ValveFit:
    """Fit until every figure is within `tolerance` (part): from the estimates, then from random places in the ranges.

    The best of all starts when none gets there.
    """
    free = unknowns(sheet)
    middle = np.zeros(len(free))
    figures = FigureErrors(sheet, lambda x: _rig(sheet, free, x), middle)
    tried: list[tuple[float, int, np.ndarray]] = []
    while len(tried) < starts and not (tried and tried[-1][0] < tolerance):
        x = _search(figures, free, len(tried), keep, report_progress)
        tried.append((float(np.abs(figures.at(x)).max()), len(tried), x))
    _, start, x = min(tried, key=lambda each: each[0])
    slopes = keep("determination", lambda: figures.slopes(x, _differences(free, x)))
    determination = determine(slopes, free)
    errors = dict(zip(figures.names, figures.at(x).tolist(), strict=True))
    return ValveFit(_rig(sheet, free, x, determination), _rig(sheet, free, middle), free, errors, determination, start)


def source_of(free: FreeParameter, determination: Determination) -> str:
    """What a rig file says of where a fitted number is from."""
    if free.printed:
        kind = "moved inside its rounding" if free.reason == "as printed" else f"in its range: {free.reason}"
        return f"not determined by the datasheet; {kind}"
    if determination.marginal[free.name] < DETERMINED:
        return "fitted to the datasheet"
    if determination.conditional[free.name] < DETERMINED:
        return "fitted to the datasheet, which determines it only together with other numbers"
    return f"not determined by the datasheet; in its range about the estimate: {free.reason}"


def _search(
    figures: FigureErrors,
    free: tuple[FreeParameter, ...],
    start: int,
    keep: Keep,
    report_progress: Callable[[str], None],
) -> np.ndarray:
    """A bounded least-squares search from the estimates (start 0) or from a random place; every slope is kept."""
    width = np.array([f.width for f in free])
    low, high = (np.array([f.normalised(getattr(f, end)) for f in free]) for end in ("low", "high"))
    first = np.zeros(len(free))
    if start:
        first = (low + high) / 2 + np.random.default_rng(start).uniform(-0.5, 0.5, len(free)) * width
    done = 0

    def residual(x: np.ndarray) -> np.ndarray:
        return np.concatenate([figures.at(x) / _TIGHT, x / width])

    def slope(x: np.ndarray) -> np.ndarray:
        nonlocal done
        done += 1
        slopes = keep(f"start {start} step {done}", lambda: figures.slopes(x, _differences(free, x)))
        report_progress(f"start {start}, step {done}: largest error {100 * np.abs(figures.at(x)).max():.1f} %")
        return np.concatenate([slopes / _TIGHT, np.diag(1 / width)])

    search: Any = least_squares  # its stubs know no function for the slopes
    optimum = search(
        residual, first, slope, (low, high), x_scale=width, ftol=1e-2, xtol=1e-3, gtol=1e-3, max_nfev=_STEPS
    )
    return np.asarray(optimum.x)


def _differences(free: tuple[FreeParameter, ...], x: np.ndarray) -> np.ndarray:
    """Steps of the slopes, towards the middle of the ranges."""
    return np.array([_DIFFERENCE * f.width * (-1 if d > 0 else 1) for f, d in zip(free, x, strict=True)])


def _geometry(sheet: Datasheet) -> Rig:
    if sheet.geometry is None:
        raise ValueError(f"{sheet.name}: a fit needs the geometry of a three-stage valve")
    return sheet.geometry


def _rig(
    sheet: Datasheet, free: tuple[FreeParameter, ...], x: np.ndarray, determination: Determination | None = None
) -> Rig:
    """The rig at distances x; the main lands follow the rated flow.

    With what was found, every fitted number has its source and, as bounds, its 95 % interval inside its range.
    """
    printed = _geometry(sheet).numbers
    lender = _geometry(sheet).name
    numbers = {
        name: replace(printed[name], low=None, high=None, source=f"lent by {lender}: {printed[name].source}")
        for name in THREE_STAGE.numbers
    }
    numbers |= {name: _number(name, sheet.valve[name], "datasheet") for name in ("imax", "n")}
    for f, d in zip(free, x, strict=True):
        value = _number(f.name, f.value(d), f"estimate: {f.reason}")
        numbers[f.name] = replace(value, unit=printed[f.name].unit, low=f.low, high=f.high)
        if determination:
            low, high = (f.value(d + sign * determination.marginal[f.name]) for sign in (-1, 1))
            source, bounds = source_of(f, determination), {"low": max(f.low, low), "high": min(f.high, high)}
            numbers[f.name] = replace(numbers[f.name], source=source, **bounds)
    rubs, (part, why) = numbers["Fs3"], _rubbing(sheet, numbers["Kp"].value)
    most = max(rubs.value, part / 4 * printed["S3"].value * sheet.given["Ps"].value)
    numbers["Fs3"] = replace(rubs, low=0.0, high=most, source=f"{rubs.source}; {_on_spool(part)}{why}")
    lands = main_lands(sheet, numbers["z3max"].value, numbers["eps"].value)
    numbers["K3"] = _number("K3", lands, "datasheet: rated flow at full travel")
    return build_rig(sheet, numbers)


def _number(name: str, value: float, source: str) -> Number:
    unit = {**SUPPLY, **THREE_STAGE.numbers, **SECOND_ORDER.numbers}[name].unit
    return Number(name, float(value), usual_unit(value, unit), unit, source)
