"""The report of a trace: what is wrong with the rig, how sure that is, what to record next."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...base.signals import SIGNALS
from ...base.units import from_si
from ...base.words import listed
from ...identify.data.noise_floor import NoiseFloor
from ...identify.fit.predict import Prediction
from ...identify.found.detectability import undetectable
from ...identify.found.fitted import fitted
from ...identify.found.missing_shape import UnexplainedDisturbance
from ...identify.found.session_fit import session_fits
from ...identify.trace.findings import Trace
from ...identify.trace.localise import likely_equations
from ...plant.effects import Effect
from ...report import Curve, Figure, Mark, Page, Panel, Section, Table
from ..common.error_page import AFTER, BEFORE, GIVEN, error_figure, error_table
from ..common.session_tables import session_fits_sentence, session_fits_table
from ..common.sessions import sessions, sessions_section, sessions_sentence
from ..fit.page import ranges_figure
from ..residual.study import noise_table
from .learned_page import LearnedLaw, learned_laws, learned_section, learned_sentence
from .metrics import Both, labels
from .next_record import EQUATION, Said, how, next_records
from .tables import (
    base_table,
    candidates_table,
    cosines_table,
    numbers_table,
    records_table,
    rule_table,
    seen_table,
    steps_table,
    unseen_signals,
    untested_table,
)
from .told import told_section, told_sentence
from .words import FREE_RUN, PLAN, RETUNE, has_clue, verdict

_ALIKE = 0.5  # correlation from which two disturbances are alike
_NO_CLUE = "The missing {} goes with no signal: none explains half of it, so that its shape over one would mislead."
Item = Figure | Table | str
SLICE = 1.0  # s, of the telling figure

Pair = tuple[Prediction, Prediction]


def trace_page(
    trace: Trace,
    answer: dict[str, Any],
    both: Both,
    library: Sequence[Effect],
    shape: UnexplainedDisturbance | None,
    shown: Sequence[dict[str, Any]] | None,
    advice: Said,
) -> tuple[Page, Figure]:
    """The page and its telling figure, from the answer and the predictions `both` before and after.

    `shape` is that of what is missing, `shown` what the records would have shown, `advice` what to record next.
    """
    changed, floor, names = bool(trace.effects or trace.learned), trace.problem.floor, labels(trace)
    pairs = list(zip(*both, strict=True))
    index, name, part = telling(pairs, floor, changed)
    first = signal_figure(pairs[index], name, floor, names, part)
    picture, differences = error_figure(answer["rms"], names), sessions(trace.problem, trace.final.fit)
    laws, in_sessions = learned_laws(trace), session_fits(trace.problem, trace.final.fit)
    sections = [
        Section("Held-out error", [picture, error_table(answer["rms"], names, trace.problem.free_run), first]),
        *_causes(trace, shape, laws),
        *_next(trace, advice),
        Section("What it buys", [RETUNE, *([FREE_RUN] if changed and not trace.problem.free_run else [])]),
        *_where(trace),
        _own_numbers(trace, names),
        *([Section("In sessions", [session_fits_table(trace.problem, in_sessions)])] if in_sessions else []),
        *sessions_section(trace.problem, differences),
        *told_section(trace),
        *_could_show(library, shown),
        Section("Noise floor", [noise_table(floor)]),
        _untested(trace, library),
        *_signals(trace, pairs, names),
    ]
    title = f"{trace.problem.campaign.path.resolve().name} on {trace.problem.rig.name}: what the model lacks"
    said = verdict(trace, shape, None if shown is None else undetectable(shown), advice)
    said += (
        told_sentence(trace)
        + learned_sentence(laws)
        + session_fits_sentence(in_sessions)
        + sessions_sentence(trace.problem, differences)
    )
    return Page(title, said, sections), picture


def _causes(trace: Trace, shape: UnexplainedDisturbance | None, laws: Sequence[LearnedLaw]) -> list[Section]:
    """What explains the misfit, what was learned of its shape, what is missing: this first where nothing was named."""
    causes = [_what(trace), learned_section(trace, laws), _shape(shape, _is_unclear(trace, shape))]
    return [section for sections in (causes if trace.effects else causes[::-1]) for section in sections]


def _what(trace: Trace) -> list[Section]:
    if not trace.passes:
        return []
    by_effect = steps_table(trace)
    items: list[Item] = [by_effect] if by_effect else []
    items += [candidates_table(trace), rule_table(trace), numbers_table(trace)]
    items += [table for n, each in enumerate(trace.passes, 1) if (table := cosines_table(each, n))]
    return [Section("What explains it" if trace.effects else "What was tried", items)]


def _shape(shape: UnexplainedDisturbance | None, unclear: bool) -> list[Section]:
    if shape is None:
        return []
    items: list[Item] = list(shape_tables(shape))
    if shape.sensors is None:
        items.insert(0, shape_figure(shape) if has_clue(shape) else _NO_CLUE.format(shape.name))
        if shape.partner is not None and abs(shape.partner[1]) > _ALIKE:
            name, rho = shape.partner
            way = "goes along with it" if rho > 0 else "goes the other way"
            items.append(f"The missing {name} {way} (correlation {rho:.2f}).")
    may_be = "may be" if unclear else "is"
    return [Section(f"What {may_be} missing in {EQUATION[shape.equation]}", items)]


def _is_unclear(trace: Trace, shape: UnexplainedDisturbance | None) -> bool:
    """Whether what is missing may sit in another equation than the one that is shown."""
    return shape is not None and bool(shape.rivals or (trace.verdict == "unknown" and len(trace.equations) > 1))


def _next(trace: Trace, advice: Said) -> list[Section]:
    said = [f"{about}: {text}." for about, text in next_records(trace, advice)]
    said += how(advice) if said else []
    if trace.tied or trace.verdict == "unknown":
        said.append(PLAN)
    return [Section("What to record next", said)] if said else []


def _where(trace: Trace) -> list[Section]:
    if not trace.evidence:
        return []
    clear = trace.clear
    said = f"{_evidence_words(trace, clear)}{_parity_words(trace, clear)}"
    if trace.effects and trace.equation != trace.evidence[0][0]:
        said += f" The effect that was named acts in {EQUATION[trace.equation or '']}: refits decide, not this."
    return [Section("In which equation", [said, evidence_figure(trace.evidence, clear)])]


def _evidence_words(trace: Trace, clear: float) -> str:
    """What the log-likelihoods say: an equation only where the next is clearly behind."""
    (best, gain), (second, next_gain), *_ = trace.evidence
    if gain < clear:
        return f"A disturbance in no equation explains the errors: the best gains {gain:.0f} ({clear:.0f} is clear)."
    near = [EQUATION[name] for name in likely_equations(trace.evidence, {}, clear)]
    if len(near) == 1:
        return (
            f"A disturbance in {EQUATION[best]} explains most; the next, in {EQUATION[second]}, is "
            f"{gain - next_gain:.0f} behind in log-likelihood ({clear:.0f} is clear)."
        )
    return f"By log-likelihood it may be {listed(near, 'or')}: these are too near to say which of them."


def _parity_words(trace: Trace, clear: float) -> str:
    """What measured signals say alone, and where both point, if at one equation."""
    if not trace.parity_residuals:
        return ""
    direct = ", ".join(f"{name} {value:.3g}" for name, value in trace.parity_residuals.items())
    said = f" Held against measured signals alone, without simulation, equations have chi2: {direct}."
    likely = likely_equations(trace.evidence, trace.parity_residuals, clear)
    by_evidence = likely_equations(trace.evidence, {}, clear)
    if trace.evidence[0][1] < clear or likely == by_evidence or not likely:
        return said
    return f"{said} With that, {listed([EQUATION[name] for name in likely], 'or')} is left."


def _own_numbers(trace: Trace, names: Sequence[str]) -> Section:
    model_fits = (trace.base, trace.final)[-len(names) :]
    fits = {name: fitted(trace.problem.rig, model_fit.fit) for name, model_fit in zip(names, model_fits, strict=True)}
    return Section("The rig's own numbers", [ranges_figure(fits), base_table(trace, len(names) > 1)])


def _could_show(library: Sequence[Effect], shown: Sequence[dict[str, Any]] | None) -> list[Section]:
    return [] if shown is None else [Section("What could not be seen", [seen_table(shown, library)])]


def _untested(trace: Trace, library: Sequence[Effect]) -> Section:
    tables = [untested_table(trace, library), unseen_signals(trace), records_table(trace.problem)]
    campaign = trace.problem.campaign
    notes = [f"{r.name}: {n}" for r in campaign.records for n in r.notes]
    return Section("What was used, and what was not", [*(table for table in tables if table), *notes])


def _signals(trace: Trace, pairs: Sequence[Pair], names: Sequence[str]) -> list[Section]:
    return [
        Section(
            f"Every signal of {pair[0].record.name}",
            [signal_figure(pair, signal, trace.problem.floor, names) for signal in pair[0].signals],
        )
        for pair in pairs
    ]


def shape_figure(of: UnexplainedDisturbance) -> Figure:
    """The disturbance against the signal that explains most of it."""
    assert of.points is not None
    assert of.curve is not None
    curves = [
        Curve("estimate", of.points[:, 0], of.points[:, 1], "markers", color="#8c959f"),
        Curve("mean", of.curve[:, 0], of.curve[:, 1], color="#d55e00"),
    ]
    line = f" It repeats at {of.line:.4g} Hz." if of.line else ""
    return Figure(
        f"The missing {of.name} over {of.signal.split(' [')[0]}",
        of.signal,
        [Panel(f"{of.name} [{of.unit}]", curves)],
        note="What has to be added to the model in the windows with the largest errors, by a Kalman smoother on the "
        f"linear model about the fit.{line}",
    )


def shape_tables(of: UnexplainedDisturbance) -> list[Table]:
    """How much of the disturbance each signal explains; or what is off at the sensors."""
    if of.sensors is not None:
        columns = ["sensor", "offset [bar]", "gain [%]", "lag [ms]"]
        note = "Means over the windows with the largest errors. A lag is positive where the sensor is late."
        return [Table("What the pressure sensors would have to be off by", columns, of.sensors, note=note)]
    rows = [[name, float(value)] for name, value in of.explained or []]
    note = "Cross-validated R2 of a curve through one signal: 1 explains all of it, 0 or less nothing."
    return [Table(f"What the missing {of.name} goes with", ["signal", "R2"], rows, note=note)]


def evidence_figure(evidence: Sequence[tuple[str, float]], clear: float) -> Figure:
    """How far each equation is behind the best in log-likelihood; from `clear` on it is told apart from it."""
    places = np.arange(1.0, len(evidence) + 1)
    least = clear / 10
    behind = np.maximum([evidence[0][1] - gain for _, gain in evidence], least)
    curve = Curve("disturbance in this equation", places, behind, "markers", AFTER)
    ends = (0.8 * least, 1.5 * max(float(behind.max()), 2 * clear))
    panel = Panel("behind the best [1]", [curve], True, ends, (Mark(clear, "clear from here on"),))
    return Figure(
        "Evidence of a disturbance, by equation",
        "equation",
        [panel],
        note="A random disturbance is added to one equation at a time; the one that makes the errors most likely, here "
        f"at the lower edge, is where the model lacks something. One that is less than {clear:.0f} behind it in "
        "log-likelihood is not told apart from it.",
        x_names=[name for name, _ in evidence],
    )


def signal_figure(pair: Pair, name: str, floor: NoiseFloor, labels: Sequence[str], part: slice = slice(None)) -> Figure:
    """One signal of one record: measured and modelled, and what is left of it, with twice the noise as a band."""
    signal, record = SIGNALS[name], pair[0].record
    t = record.t[part]

    def shown(values: np.ndarray) -> np.ndarray:
        return from_si(values[part], signal.unit, signal.si)

    noise = float(from_si(2 * floor.sigma[name], signal.unit, signal.si) - from_si(0.0, signal.unit, signal.si))
    lines = list(zip(labels, pair[-len(labels) :], (BEFORE, AFTER)[-len(labels) :], strict=True))
    band = (np.full(2, -noise), np.full(2, noise))
    above = [Curve("measured", t, shown(record.signals[name]))]
    above += [Curve(label, t, shown(prediction.signals[name]), color=colour) for label, prediction, colour in lines]
    below = [Curve("noise, 2 sigma", t[[0, -1]], np.zeros(2), "dot", GIVEN, band=band)]
    below += [Curve(label, t, shown(prediction.error(name)), color=colour) for label, prediction, colour in lines]
    panels = [Panel(signal.label, above), Panel(f"measured - model [{signal.unit}]", below)]
    return Figure(f"{record.name}: {name}", "time [s]", panels)


def telling(pairs: Sequence[Pair], floor: NoiseFloor, changed: bool) -> tuple[int, str, slice]:
    """Record, signal and second in which the difference is best seen."""
    best, place = -np.inf, (0, next(iter(pairs[0][0].signals)), slice(None))
    for index, (before, after) in enumerate(pairs):
        rows = max(2, round(SLICE / before.record.period))
        for name in before.signals:
            squares = _left(before, name, floor) - (_left(after, name, floor) if changed else 0.0)
            sums = np.convolve(squares, np.ones(min(rows, len(squares))), "valid")
            first = int(np.argmax(sums))
            if sums[first] > best:
                best, place = float(sums[first]), (index, name, slice(first, first + rows))
    return place


def _left(prediction: Prediction, name: str, floor: NoiseFloor) -> np.ndarray:
    """Squared errors over sigma, 0 where nothing is compared."""
    return np.nan_to_num((prediction.error(name) / floor.sigma[name]) ** 2)
