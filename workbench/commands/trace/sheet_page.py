"""The report of a trace of sheets: what the rig lacks, gain and phase before and after, numbers, what was tried."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...base.signals import SIGNALS
from ...base.units import from_si
from ...base.words import listed
from ...identify.found.fitted import effect_intervals, fitted
from ...identify.sheet.fit import SheetFit
from ...identify.sheet.model import FAILED, offsets
from ...identify.sheet.remainder import Band
from ...identify.sheet.tracer import SheetCandidate, SheetTrace
from ...identify.trace import rule
from ...records.sheet_points import SheetPoints
from ...report import Curve, Figure, Page, Panel, Section, Table
from ..common.error_page import AFTER, BEFORE, BETWEEN
from .effect_words import ALL_EFFECTS
from .next_record import EQUATION
from .words import RETUNE

_NUMBERS = 6  # candidates whose numbers are listed
_CURVE = 60  # frequencies of a drawn curve
_BANDS = 3  # bands of frequencies that the sentence names


def sheet_page(trace: SheetTrace, answer: Mapping[str, Any]) -> tuple[Page, Figure]:
    """The page, and the figure of the first sheet, from a trace and its trace.json."""
    problem = trace.problem
    figures = [_figure(trace, index) for index in range(len(problem.train))]
    sections = [
        Section("Before and after", [_errors_table(answer), *figures]),
        *([Section("What explains it", [_tried_table(trace), _numbers_table(trace)])] if trace.tried else []),
        *([Section("What it buys", [RETUNE])] if trace.effects else []),
        Section("The rig's own numbers", [_base_table(trace)]),
    ]
    title = f"{problem.source} on {problem.rig.name}: what the model lacks"
    return Page(title, sheet_sentence(trace, answer), sections), figures[0]


def sheet_sentence(trace: SheetTrace, answer: Mapping[str, Any]) -> str:
    """The answer in a few sentences."""
    errors = listed(
        [
            f"{_digits(row['before'])} to {_digits(row['after'])} {kind.partition('[')[2].rstrip(']')}"
            for kind, row in answer["rms"].items()
        ]
    )
    if trace.verdict == "none":
        return f"{trace.problem.rig.name} gives these curves within what they are known to: nothing is missing."
    if trace.verdict == "unknown":
        where = f", most likely in {EQUATION[trace.equation]}" if trace.equation else ""
        return f"The model misses something{where}; no effect of the library explains it. {_left(trace)}"
    names = listed([_with_alike(trace, each) for each in trace.effects])
    causes = listed([ALL_EFFECTS.get(each.effect.name, each.effect.name) for each in trace.effects])
    said = f"{causes[0].upper()}{causes[1:]} ({names})"
    if trace.tied:
        said += f", or as well {listed(list(trace.tied))}; these sheets cannot tell them apart"
    where = "where nothing was fitted" if trace.problem.heldout else "at the fitted points, all that there are,"
    said += f": the error {where} goes from {errors}."
    if trace.verdict == "incomplete":
        said += f" Something is still missing, or the rig has another formula of it. {_left(trace)}"
    return said


def _with_alike(trace: SheetTrace, named: SheetCandidate) -> str:
    """An effect that was named, and its formulas that these sheets do not tell from the one that was fitted."""
    alike = [effect.formula for effect in trace.alike(named)]
    return f"{named.effect.title}, or as well its {listed(alike)}" if alike else named.effect.title


def _left(trace: SheetTrace) -> str:
    """A sentence on where something is left, and what it looks like."""
    plain = sorted(trace.left, key=lambda band: band.low - band.high)[:_BANDS]
    where = [_band(band, several=len(trace.problem.sheets) > 2) for band in plain]
    said = f"What is left shows {listed(where) if where else 'at no frequency plainly'}. "
    element = trace.final.model.element
    if element is None:
        return said + "No delay, pole, zero or pair of poles takes it away."
    values = {free.name: free.value(x) for free, x in zip(trace.final.fit.free, trace.final.fit.x, strict=True)}
    _, plain, after = trace.judged
    took = rule.explained(float(plain.squares.sum()), float(after.squares.sum()), plain.samples)
    return said + f"A {element.shown(values)} behind the model takes away {100 * min(took, 1):.0f} % of it."


def _band(band: Band, several: bool) -> str:
    """ "from 30 to 90 Hz (up to 2.1 dB and 14 degrees)"."""
    size = [f"{value:.2g} {unit}" for value, unit in ((band.gain, "dB"), (band.phase, "degrees")) if value]
    where = f"at {band.low:.3g} Hz" if band.low == band.high else f"from {band.low:.3g} to {band.high:.3g} Hz"
    return f"{where}{f' of {band.sheet}' if several else ''} (up to {' and '.join(size)})"


def _digits(value: float | None) -> str:
    return "?" if value is None else f"{value:.2g}"


def _errors_table(answer: Mapping[str, Any]) -> Table:
    rows = [[kind, row["before"], row["after"], row["floor"]] for kind, row in answer["rms"].items()]
    note = (
        "On every third frequency, or the sheets held out, which no fit had; of sheets too short for that on all. A "
        "gain in dB counts up to a constant."
    )
    return Table("Error", ["of", "RMS before", "RMS after", "known to"], rows, note=note)


def _tried_table(trace: SheetTrace) -> Table:
    rows = [
        [e.effect.name, e.effect.formula, e.effect.equation, round(100 * min(e.judgement.explained, 1), 1),
         e.judgement.chi2, "named" if e in trace.effects else e.judgement.against or "no accident"]
        for e in trace.tried
    ]  # fmt: skip
    note = f"Explained: share of the misfit at frequencies that each fit did not see; named from {rule.NAMED:.0%} on."
    columns = ["effect", "formula", "equation", "explained [%]", "chi2, not fitted", "the rule says"]
    return Table("Effects that were fitted", columns, rows, note=note)


def _numbers_table(trace: SheetTrace) -> Table:
    rows = []
    for each in trace.tried[:_NUMBERS]:
        fit = trace.named.fit if each in trace.effects else each.fit.fit
        intervals = effect_intervals(each.effect, fit)
        for number, values in zip(each.effect.numbers, intervals.values(), strict=True):
            rows.append([each.effect.name, each.effect.formula, number.name, number.meaning, number.shown, *values])
    columns = ["effect", "formula", "number", "meaning", "unit", "value", "95 % low", "95 % high"]
    return Table("Their numbers", columns, rows)


def _base_table(trace: SheetTrace) -> Table:
    rows = []
    for entry in fitted(trace.problem.rig, trace.named.fit):
        number = entry.number
        values = [float(from_si(v, number.unit, number.si)) for v in (number.value, entry.value, entry.low, entry.high)]
        rows.append([number.name, number.unit, *values, "at an end" if entry.at_bounds else "not told" * entry.unseen])
    columns = ["number", "unit", "rig file", "fitted", "95 % low", "95 % high", ""]
    return Table("Numbers of the rig", columns, rows, note="Not told: the interval is as wide as the declared range.")


def _figure(trace: SheetTrace, index: int) -> Figure:
    """Gain and phase of a fitted sheet: stated, and of the model before and after, between its frequencies too."""
    sheet = trace.problem.train[index]
    gain = [Curve("sheet", sheet.f, sheet.gain, "markers")]
    phase = [Curve("sheet", sheet.f, sheet.phase, "markers")]
    shown = [("before", trace.base, BEFORE), ("after", trace.final, AFTER)]
    if trace.final is not trace.named is not trace.base:
        shown.insert(1, (f"with {listed([each.effect.name for each in trace.effects])}", trace.named, BETWEEN))
    for label, fit, colour in shown:
        f, gains, phases = model_curve(fit, sheet)
        gain.append(Curve(label, f, gains, color=colour))
        phase.append(Curve(label, f, phases, color=colour))
    panels = [Panel("gain [dB]", gain), Panel("phase [deg]", phase, y_step=45.0)]
    return Figure(_title(sheet), "frequency [Hz]", panels, log_x=True)


def model_curve(fit: SheetFit, sheet: SheetPoints) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frequencies [Hz] over the span of a sheet, and gain [dB] as the sheet refers it and phase [deg] of the model.

    NaN where a sine cannot be simulated.
    """
    f = np.union1d(np.geomspace(sheet.f[0], sheet.f[-1], _CURVE), sheet.f)
    nothing = np.zeros(f.size)
    at_points, along = fit.model.deviations([sheet, replace(sheet, f=f, gain=nothing, phase=nothing)], fit.fit.p[None])
    shift = float(offsets([sheet], [at_points])[0, 0])
    simulated = np.isfinite(along[0]).all(axis=1) & (along[0] != FAILED).any(axis=1)
    gain, phase = np.where(simulated[:, None], along[0], np.nan).T
    phase[simulated] = np.degrees(np.unwrap(np.radians(phase[simulated])))
    turns = np.round((sheet.phase - phase[np.searchsorted(f, sheet.f)]) / 360)
    return f, gain - shift, phase + 360 * (np.nanmedian(turns) if np.isfinite(turns).any() else 0.0)


def _title(sheet: SheetPoints) -> str:
    signal = SIGNALS[sheet.input]
    size = float(from_si(sheet.amplitude, signal.unit, signal.si))
    shown = f"{100 * size:g} %" if signal.unit == "1" else f"{size:g} {signal.unit}"
    return f"{sheet.name}: {sheet.output} over {sheet.input}, sines of {shown}"
