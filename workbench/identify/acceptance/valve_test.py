"""A valve's sheet: every line of it from records, or with the reason why these records cannot say it.

Records named `valve-...` are tests of a kind: valve-flow, valve-pressure (blocked ports), valve-step-10, -50, -100 and
valve-sine-5, -25, -100 (sines with rests between). Any other record that moves serves the flow curve, hysteresis, and
the response to small signals.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...base.units import from_si
from ...records import Record
from ...rigs.rig import Rig
from .curve_figures import curve_rows
from .dynamics import SINES, STEPS, ResponseEstimate, corner_rows, multisine_response, sine_response, step_rows
from .flow_curve import FlowCurve, metered_curve, piston_curve
from .hysteresis import hysteresis_row, threshold_row
from .opening import Opening, command_opening, spool_opening
from .pressure import pressure_rows
from .row import Row, unsaid

STEADY = 0.05  # of the supply: how far it may vary in a test at constant pressure
_TOO_MUCH, _TOO_LITTLE = 3.0, 0.02  # of what the valve may give: a flow beyond is in another unit
_OTHER_UNITS = ("l/min", "m^3/s", "l/s", "cm^3/s", "m^3/h")


@dataclass(frozen=True)
class Shift:
    """A line of the sheet: its shift is told for a change `per` (SI) of the level; `none`: why it is not told."""

    id: str
    meaning: str
    per: float
    none: str


SUPPLY = Shift(
    "null_shift_supply",
    "null shift with supply pressure, over full command per 10 bar",
    10e5,
    "no records at two supply pressures",
)
TEMPERATURE = Shift(
    "null_shift_temperature",
    "null shift with oil temperature, over full command per 10 K",
    10.0,
    "no two sessions with an oil temperature",
)


@dataclass(frozen=True, eq=False)
class ValveSheet:
    """The lines of a sheet, and the curve and responses behind them."""

    rows: list[Row]
    curve: FlowCurve | None
    responses: Mapping[str, ResponseEstimate]


def valve_sheet(records: Sequence[Record], rig: Rig) -> ValveSheet:
    """Raises InputError for a test at varying supply, a flow in another unit, a dwell that is too short and a sine that
    is none."""
    check_valve_records(records, rig)
    tests = {record.name: record for record in records if record.name.startswith("valve-")}
    slow = [r for r in records if np.ptp(r.signals["command"]) > 0 and not _is(r, "pressure", "step", "sine")]
    opening = spool_opening(slow, rig)
    curve, why = flow_curve(slow, rig, opening)
    rows = curve_rows(curve) if curve is not None else _no_curve(why)
    lagging = command_opening(rig)  # a lag that is fitted to the records has taken up what both ways lie apart
    rows += [row(slow, opening, curve, lagging) for row in (hysteresis_row, threshold_row)]
    rows += _shifts(why)
    rows += pressure_rows([record for record in records if _is(record, "pressure")])
    output = next((name for name in ("spool", "flow") if any(name in r.signals for r in records)), None)
    rows += _steps(tests, output, rig)
    responses = {f"main_{size}": r for size in SINES if (r := _sines(tests, size, output)) is not None}
    for size in SINES:
        what = f"main stage, {size} %"
        rows += corner_rows(
            responses.get(f"main_{size}"),
            f"main_{size}",
            what,
            f"no record valve-sine-{size} with a spool or a flow meter",
        )
    small = _small(slow, output)
    if small is not None:
        responses["main_small"] = small
    rows += corner_rows(
        small, "main_small", "main stage, signals as small as a multisine's", "no record excites the command broadly"
    )
    return ValveSheet(rows, curve, responses)


def flow_curve(records: Sequence[Record], rig: Rig, opening: Opening | None) -> tuple[FlowCurve | None, str]:
    """By a flow meter where a record has one, else by the piston; None and why where neither is there."""
    metered = [record for record in records if "flow" in record.signals]
    if metered:
        return metered_curve(metered, rig, opening), ""
    swept = [record for record in records if "position" in record.signals and {"pa", "pb"} & set(record.names)]
    if not swept:
        return None, "no record has a flow meter, or a position with a chamber pressure"
    if rig.valve not in ("three-stage", "second-order"):
        return None, f"a {rig.valve} has no lands whose flow follows a pressure drop"
    return piston_curve(swept, rig, opening or command_opening(rig)), ""


def check_valve_records(records: Sequence[Record], rig: Rig) -> None:
    """Raises InputError for a test at varying supply, and for a flow in another unit."""
    for record in records:
        supply, flow = record.signals.get("supply"), record.signals.get("flow")
        constant = record.name.startswith("valve-") or (flow is not None and "pa" not in record.signals)
        if supply is not None and constant:
            low, high = np.quantile(supply, [0.02, 0.98])
            if high - low > STEADY * float(np.median(supply)):
                raise InputError(
                    f"record {record.name}: the supply varies from {low / 1e5:.4g} to {high / 1e5:.4g} bar; a "
                    f"valve's test is at constant pressure, within {100 * STEADY:g} %: hold it, or "
                    "record pa and pb beside the flow"
                )
        if flow is not None and not _is(record, "pressure"):
            _check_unit(record, flow, rig)


def _check_unit(record: Record, flow: np.ndarray, rig: Rig) -> None:
    opened = float(np.abs(record.signals["command"]).max())
    most = rig["K3"] * rig["z3max"] * np.sqrt(rig["Ps"]) if "K3" in rig else np.inf
    seen = float(np.abs(flow).max())
    if seen <= _TOO_MUCH * most and seen >= _TOO_LITTLE * most * opened:
        return
    shown = from_si(seen, "l/min", "m^3/s")
    fits = [
        unit
        for unit in _OTHER_UNITS
        for other in _OTHER_UNITS
        if unit != other
        and _TOO_LITTLE * most * opened < from_si(seen, other, "m^3/s") * from_si(1.0, "m^3/s", unit) < _TOO_MUCH * most
    ]
    hint = f"; were it in {fits[0]} it would fit" if fits else ""
    given = from_si(most * opened, "l/min", "m^3/s")
    raise InputError(
        f"record {record.name}: flow reaches {shown:.4g} l/min, where the valve gives {given:.4g} "
        f"at most at that command{hint}: name its unit in campaign.toml"
    )


def _is(record: Record, *kinds: str) -> bool:
    return record.name.startswith(tuple(f"valve-{kind}" for kind in kinds))


def _no_curve(why: str) -> list[Row]:
    lines = {
        "main_flow": "l/min",
        "flow_gain_extending": "l/min",
        "flow_gain_retracting": "l/min",
        "flow_gain_null": "l/min",
    }
    lines |= dict.fromkeys(("symmetry", "linearity", "lap", "null_bias"), "%")
    return [unsaid(id, id.replace("_", " "), unit, why) for id, unit in lines.items()]


def _shifts(why: str) -> list[Row]:
    """The rows of the null's shifts, which `null_shift` tells where records are of two states."""
    none = {SUPPLY: why or SUPPLY.none, TEMPERATURE: TEMPERATURE.none}
    return [unsaid(line.id, line.meaning, "%", reason) for line, reason in none.items()]


def _steps(tests: Mapping[str, Record], output: str | None, rig: Rig) -> list[Row]:
    found = {size: record for size in STEPS for name, record in tests.items() if name == f"valve-step-{size}"}
    if output is None:
        return step_rows({}, "", 0.0, "no record has a spool or a flow meter")
    sensor = rig.sensors.get(output)
    return step_rows(found, output, sensor.noise if sensor else 0.0, "no record valve-step of this size")


def _sines(tests: Mapping[str, Record], size: int, output: str | None) -> ResponseEstimate | None:
    record = tests.get(f"valve-sine-{size}")
    return None if record is None or output is None else sine_response(record, output)


def _small(records: Sequence[Record], output: str | None) -> ResponseEstimate | None:
    """The response that reaches furthest, of all records."""
    if output is None:
        return None
    found = [
        r for record in records if output in record.signals and (r := multisine_response(record, output)) is not None
    ]
    return max(found, key=lambda response: response.f[-1], default=None)
