"""The sheet of what a jack can do: its envelope with what binds, what a loop follows, and what a drive file takes."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...identify.acceptance.bench import TestBench
from ...identify.acceptance.row import AcceptanceLimit, Row, judged, unsaid
from ...identify.acceptance.sines import steady_sines
from ...loop.describing_function import sampled_frequencies
from ...loop.drive_simulation import drive
from ...loop.performance.bounds import Drive, PerformanceEnvelope, envelope
from ...loop.performance.carried import carried_by_jack
from ...loop.performance.drive import Choice, demands, pump_choices, valve_choices
from ...loop.performance.reached import PLAYED, Followed, Reached, followed, highest, reached
from ...loop.rig_variations import with_delay
from ...loop.rows import LoopSetup, linear_loops, loop_setup
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from .config import CapabilityAsked
from .figures import jack_figures, rows_with_bounds
from .found import Findings
from .page import capability_page
from .tuned import seeing, self_tuned

LOWEST, POINTS = 0.1, 60  # Hz; of a curve
PLAYED_FROM, PLAYED_POINTS = 1.0, 24  # Hz, from where a loop is played
FOLLOWED = {"amplitude": "its amplitude is within 5 %", "error": "its error is within 5 %"}
INSIDE, OUTSIDE, CHECKED = 0.95, 1.1, (1.0, 60.0)  # of the envelope; Hz between which the engine is asked


def run_capability(asked: CapabilityAsked, stage: Stage, progress: Progress) -> Outcome:
    """`rows` of the sheet, `envelope` with what binds from where to where, `reached`, `valves` and `pumps`."""
    measured = _measured(asked)
    progress("the valve at full command")
    response = TestBench(asked.rig, 0).response("main", 100)
    opened = Drive(response.f, response.response, asked.pump)
    progress("envelope")
    found = _found(asked, opened, measured, progress)
    progress("intervals by the rig's bounds")
    rows = rows_with_bounds(asked.rig, partial(jack_figures, asked=asked, drive=opened)) + _followed_rows(found)
    rows = judged(rows, _limits(asked))
    metrics = {"rows": [row.table() for row in rows], **_told(found)}
    subject = Subject(asked.rig, [found.loop] if found.loop else [])
    return Outcome(metrics, lambda: capability_page(asked, found, rows), _tables(found), subject=subject, dated=False)


def _limits(asked: CapabilityAsked) -> dict[str, AcceptanceLimit]:
    """The user's, and that the cooler takes the heat."""
    cooler = asked.drive.cooler if asked.drive else None
    own = {} if cooler is None else {"heat": AcceptanceLimit(f"cooler {cooler / 1e3:g} kW", None, cooler / 1e3)}
    return own | dict(asked.limits)


def _found(asked: CapabilityAsked, opened: Drive, measured: Mapping[str, np.ndarray], progress: Progress) -> Findings:
    rig = asked.rig
    highest_f = min(100.0, 0.1 / rig.period.value)
    f = sampled_frequencies(LOWEST, highest_f, POINTS, rig.period.value)
    whole = envelope(carried_by_jack(rig, f), opened)
    setup = loop_setup(with_delay(rig, rig.computing_delay.value))
    spec = asked.loop or self_tuned(setup)
    loop, why = (None, spec) if isinstance(spec, str) else (spec, "")
    lines = None
    if loop is not None:
        progress(f"what {loop.name} follows")
        at = sampled_frequencies(PLAYED_FROM, highest_f / 2, PLAYED_POINTS, rig.period.value)
        most = envelope(carried_by_jack(rig, at), opened).amplitude
        lines = followed(setup, loop, linear_loops(loop, setup), at, most)
    progress("a sine inside and one outside each bound")
    own, need = asked.drive, None
    if own is not None:
        need = demands(rig, own.position, own.band)
    catalogue = own.catalogue if own else None
    return Findings(
        whole, loop, why, lines, _reached(setup, whole), measured, need,
        valve_choices(need, catalogue.valves) if need and catalogue else (),
        pump_choices(need, catalogue.pumps, own.sag) if need and own and catalogue else (),
    )  # fmt: skip


def _reached(setup: LoopSetup, whole: PerformanceEnvelope) -> list[Reached]:
    rig = seeing(setup.rig)
    setup = setup if rig is setup.rig else loop_setup(rig)
    slow = drive(rig).loop
    return checked_points(whole, partial(reached, setup, slow))


def checked_points(whole: PerformanceEnvelope, ask: Callable[[float, float, str], Reached]) -> list[Reached]:
    """What the engine says of a sine of a frequency [Hz] and an amplitude, for a bound: in the middle of each span with
    a bound that it can be asked of, inside and outside the envelope."""
    points = []
    for bound, low, high in whole.spans():
        low, high = max(low, CHECKED[0]), min(high, CHECKED[1])
        if bound in PLAYED and low < high:
            f = float(np.sqrt(low * high))
            most = float(np.exp(np.interp(np.log(f), np.log(whole.f), np.log(whole.amplitude))))
            points += [ask(f, share * most, bound) for share in (INSIDE, OUTSIDE)]
    return points


def _measured(asked: CapabilityAsked) -> dict[str, np.ndarray]:
    """Sines of the position in records: f [Hz] and amplitude [m], [n, 2] by record. Raises InputError for none."""
    points, told = {}, ""
    sensor = asked.rig.sensors.get("position")
    for record in asked.records:
        if "position" not in record.signals:
            continue
        try:
            sines = steady_sines(record, "position", sensor.noise if sensor else 0.0)
        except InputError as error:
            told = told or f" ({error})"
            continue
        sizes = [float(np.abs(sine.amplitudes("position")).mean()) for sine in sines]
        points[record.name] = np.array([(sine.f, size) for sine, size in zip(sines, sizes, strict=True)])
    if asked.records and not points:
        raise InputError(f"--campaign: no record with sines of the position and rests between{told}; name another")
    return points


def _followed_rows(found: Findings) -> list[Row]:
    kinds = {**FOLLOWED, "control": "that is so under amplitude and phase control"}
    rows = []
    for kind, what in kinds.items():
        name = "a loop" if found.loop is None else found.loop.name
        meaning = f"{name} follows sines up to there with a part of the envelope: {what}"
        why = found.why or (found.followed.uncontrolled if found.followed and kind == "control" else "")
        rows.append(followed_row(f"followed_{kind}", meaning, found.followed, kind, PLAYED_FROM, why))
    return rows


def followed_row(id: str, meaning: str, found: Followed | None, kind: str, lowest: float, why: str = "") -> Row:
    """Up to where a loop that is played from the `lowest` frequency [Hz] on follows, in a kind of Followed's; `why` it
    does not."""
    edge = None if found is None else highest(found.f, getattr(found, kind))
    if edge is None:
        return unsaid(id, meaning, "Hz", why or f"not at {lowest:g} Hz, the lowest that was played")
    return Row(id, meaning, "Hz", *edge)


def _told(found: Findings) -> dict[str, Any]:
    return {
        "envelope": [{"bound": name, "from_hz": low, "to_hz": high} for name, low, high in found.envelope.spans()],
        "reached": [told(each) for each in found.reached],
        "measured": _shares(found),
        "valves": [_choice(each) for each in found.valves],
        "pumps": [_choice(each) for each in found.pumps],
    }


def told(point: Reached) -> dict[str, Any]:
    """A sine that the engine was asked for, as metrics.json has it."""
    return {**{key: getattr(point, key) for key in ("f", "amplitude", "bound", "off")}, "there": point.there}


def _shares(found: Findings) -> list[dict[str, Any]]:
    """Measured sines [SI] and the share of the envelope that they take."""
    own = found.envelope
    rows = []
    for record, sines in found.measured.items():
        for f, amplitude in sines.tolist():
            most = float(np.exp(np.interp(np.log(f), np.log(own.f), np.log(own.amplitude))))
            rows.append({"record": record, "f": f, "amplitude": amplitude, "share": amplitude / most})
    return rows


def _choice(choice: Choice) -> dict[str, Any]:
    return {
        "name": choice.entry.name,
        "fails": choice.fails or None,
        "used": choice.used,
        "accumulator_m3": choice.accumulator,
    }


def _tables(found: Findings) -> dict[str, dict[str, Any]]:
    whole = found.envelope
    tables = {"envelope": {"f_hz": whole.f, "amplitude": whole.amplitude, "binding": np.array(whole.binding)}}
    tables["envelope"] |= {name.replace(" ", "_"): each for name, each in whole.bounds.items()}
    if found.followed is not None:
        tables["followed"] = {"f_hz": found.followed.f} | {
            key: getattr(found.followed, key) for key in ("amplitude", "error", "control")
        }
    if found.demands is not None:
        need = found.demands
        tables["drive"] = {"t": need.t, "position": need.position, "power": need.power, "opening": need.lands.opening}
    return tables
