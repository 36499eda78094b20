"""A rig from a valve's sheet: a second-order valve with the figures that the sheet states, on the rest of another rig.

The sheet is metrics.json of `jackbench valve-test`. Its intervals become the bounds of the rig's numbers; then the rig
plays the sheet again.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from ...base.errors import InputError
from ...identify.acceptance.bench import TestBench
from ...report import Curve, Figure, Page, Panel, Section, Table
from ...rigs.number import Number
from ...rigs.rig import Rig, number_specs
from ...rigs.schema import GAS
from ...rigs.tolerances import with_tolerance
from ...rigs.valve.second_order import SECOND_ORDER
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from ..common.sheet_options import Rows
from ..valve_test.study import played_sheet

REFERENCE = 5.0  # Hz, that a sheet's gains are referred to
_RESPONSES = {"main_25": 0.25, "main_100": 1.0, "main_small": np.inf, "main_5": 0.05}  # amplitudes, the best first
_LOST = ("current", "pilot_spool", "flapper")  # signals of a valve with a pilot
_CORRECTOR = "p"  # as rigs from datasheets have it; the kind has none of its own
_ROOT = float(np.sqrt(35e5))
_PER_MINUTE = 60000.0


def rig_of_sheet(rows: Rows, like: Rig, name: str) -> Rig:
    """`like` with the sheet's valve. Raises InputError for a sheet without gains, lap, null or both corners of a
    response, and for a valve that is not of the second order, or overlapped."""
    gains = [_line(rows, f"flow_gain_{way}") for way in ("extending", "retracting")]
    lap, null = _line(rows, "lap"), _line(rows, "null_bias")
    if lap[0] >= 0:
        raise InputError(f"{name}: its valve is overlapped by {lap[0]:g} %; such a rig needs the effect main.deadband")
    stem = _response(rows, name)
    f3db, f90 = _line(rows, f"{stem}_f3db"), _line(rows, f"{stem}_f90")
    travel = like["z3max"]
    scale = 1 / (_PER_MINUTE * travel * _ROOT)
    gain = tuple(scale * float(np.mean([each[k] for each in gains])) for k in range(3))
    eps = tuple(-each * travel / 200 for each in (lap[0], lap[2], lap[1]))
    zeta = _damping(f3db[0], f90[0], -lap[0] / 200 / _RESPONSES[stem], name)
    numbers = {
        "f0": _number("f0", f90, "-90 deg"),
        "zeta": with_tolerance(_number("zeta", 3 * (zeta,), "-3 dB over -90 deg"), SECOND_ORDER.numbers["zeta"]),
        "z0": _number("z0", tuple(-each / 100 for each in (null[0], null[2], null[1])), "null bias"),
        "K3": _number("K3", gain, "flow gains"),
        "z3max": Number("z3max", travel, "m", "m", f"as {like.name}; only flow over travel matters"),
        "eps": _number("eps", eps, "lap"),
        "n": like.numbers["n"],
    }
    specs = number_specs(SECOND_ORDER.name, _CORRECTOR, like.jack, like.load)
    every = {key: numbers.get(key) or like.numbers[key] for key in (*specs, *(set(GAS) & set(like.numbers)))}
    kept = tuple(use for use in like.effects if use.name.startswith(("jack.", "load.", "sensor.")))
    sensors = {key: sensor for key, sensor in like.sensors.items() if key not in _LOST}
    own = {"valve": SECOND_ORDER.name, "corrector": _CORRECTOR, "numbers": every, "effects": kept}
    return replace(like, name=name, title=f"{like.title}, with the valve of a sheet", sensors=sensors, **own)


def run_sheet_rig(rows: Rows, rig: Rig, stage: Stage, progress: Progress) -> Outcome:
    """`rows`: each line of the sheet beside what the rig plays, and whether that lies within the sheet's interval."""
    progress("the rig's valve on its test bench")
    played = {row.id: row.value for row in played_sheet(TestBench(rig, 0), progress).rows}
    lines = [
        {**{key: row[key] for key in ("id", "value", "low", "high", "unit")}, "rig": value,
         "within": bool(row["low"] <= value <= row["high"])}
        for id, row in rows.items() if (value := played.get(id)) is not None
    ]  # fmt: skip
    return Outcome({"rows": lines}, lambda: _page(rig, lines), subject=Subject(rig))


def _page(rig: Rig, lines: list[dict[str, Any]]) -> tuple[Page, Figure]:
    inside = sum(line["within"] for line in lines)
    head = ["line", "sheet", "low", "high", "this rig", "unit", "within"]
    cells = [
        [*(line[key] for key in ("id", "value", "low", "high", "rig", "unit")), "yes" if line["within"] else "no"]
        for line in lines
    ]
    off = np.array([2 * (each["rig"] - each["value"]) / max(each["high"] - each["low"], 1e-12) for each in lines])
    curve = Curve("lines", np.arange(1, len(lines) + 1.0), off, "markers")
    figure = Figure(
        "What the rig plays less the sheet, over half of its interval", "", [Panel("off [1]", [curve])],
        x_names=[line["id"] for line in lines],
    )  # fmt: skip
    note = (
        "One second-order valve has one response: at other amplitudes than the one that it was made of it may differ."
    )
    page = Page(
        f"{rig.name}: a rig from a valve's sheet",
        f"{inside} of {len(lines)} lines that the rig plays lie within the sheet's intervals.",
        [Section("The sheet, played again", [figure, Table("", head, cells, note)])],
    )
    return page, figure


def _line(rows: Rows, id: str) -> tuple[float, float, float]:
    if id not in rows:
        raise InputError(f"the sheet has no {id}, which a rig needs; play or record more of the valve")
    row = rows[id]
    return float(row["value"]), float(row["low"]), float(row["high"])


def _response(rows: Rows, name: str) -> str:
    """The first of _RESPONSES that the sheet has both corners of."""
    stem = next((each for each in _RESPONSES if {f"{each}_f3db", f"{each}_f90"} <= rows.keys()), None)
    if stem is None:
        raise InputError(f"{name}: the sheet has no response with both corners, -3 dB and -90 deg; record sines")
    return stem


def _damping(f3db: float, f90: float, lap: float, name: str) -> float:
    """Damping ratio of a lag of natural frequency f90 [Hz] by which the flow at f3db is 3 dB below that at 5 Hz.

    `lap`: the underlap of a land over the amplitude of the sine; it adds 4/pi of itself to the flow's first harmonic
    (a relay's describing function, as an opening that is there at once), the more the less a spool still moves.
    """

    def level(zeta: float) -> float:
        ratio = np.array([f3db, REFERENCE]) / f90
        size = 1 / np.hypot(1 - ratio**2, 2 * zeta * ratio) + 4 / np.pi * lap
        return float(20 * np.log10(size[0] / size[1])) + 3

    low, high = SECOND_ORDER.numbers["zeta"].low, SECOND_ORDER.numbers["zeta"].high
    if level(low) * level(high) > 0:
        raise InputError(f"{name}: no second-order valve has -3 dB at {f3db:g} Hz and -90 deg at {f90:g} Hz")
    return float(brentq(level, low, high))  # pyright: ignore[reportArgumentType]


def _number(name: str, ends: tuple[float, ...], what: str) -> Number:
    value, low, high = ends
    unit = SECOND_ORDER.numbers[name].unit
    bounds = (low, high) if low < value < high else (None, None)
    return Number(name, value, unit, unit, f"valve sheet: {what}", *bounds)
