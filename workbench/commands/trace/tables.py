"""The tables of a trace: errors, candidates, numbers, what looks alike, what was not tested."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...base.units import from_si
from ...identify.fit.free_parameters import at_strength, strengths
from ...identify.fit.solver import Fit
from ...identify.fit.windows import predicted
from ...identify.found.effect_by_effect import steps
from ...identify.found.fitted import effect_intervals, fitted, fitted_cells, interval_cells, number_remarks
from ...identify.trace import rule as decide
from ...identify.trace.findings import CandidateFit, Pass, Trace
from ...identify.trace.localise import likely_equations
from ...identify.trace.problem import EstimationProblem
from ...plant.effects import Effect, acts, applies, known_effects, missing
from ...records.campaign import ROLES
from ...report import Table
from ...report.table import Cell
from .metrics import failures, ranking
from .reasons import accident, reason
from .words import SIGNAL

_NUMBERS = 6  # candidates whose numbers are listed
_COMPARED = 6  # effects whose likeness is listed
_ONE_OF_SEVERAL = "as one of several"


def candidates_table(trace: Trace) -> Table:
    """Every refitted effect, with what the rule says of it."""
    each_of = {id(fit): search for search in trace.passes for fit in search.tried}
    rows = []
    for fit, share in ranking(trace):
        effect = fit.candidate.effect
        says = reason(trace, each_of[id(fit)], fit)
        rows.append(
            [effect.name, effect.formula, effect.equation, round(100 * min(share, 1.0), 1), fit.judgement.chi2, says]
        )
    for search in trace.passes:
        for fit, why in failures(search.tried):
            effect = fit.candidate.effect
            rows.append([effect.name, effect.formula, effect.equation, None, None, f"no fit: {why}"])
    return Table(
        "Effects that were fitted",
        ["effect", "formula", "equation", "explained [%]", "chi2, not fitted", "the rule says"],
        rows,
        note="Explained: the share of the misfit of the fitted rig that goes away where nothing was fitted, on the "
        "select records or on blocks of the train records in turn, beside effects added before. An effect counts if "
        "its gain is no accident, and is named if it explains "
        + (
            f"{100 * decide.ONE_OF_SEVERAL:.0f} % of what those before left (the rig is known to lack several)"
            if trace.several
            else "80 % or reaches the noise"
        )
        + ", and the held-out records bear it out; below that, nothing is named.",
    )


def rule_table(trace: Trace) -> Table:
    """What the rule asked before it said anything, and what it got."""
    problem, base, heldout = trace.problem, trace.base, trace.problem.heldout.samples
    gate, last = (decide.gate(problem.deviation(samples)) for samples in (base.samples, heldout))
    rows: list[list[Cell]] = [
        ["the fitted rig misses something", "chi2, not fitted", base.chi2, f"above {gate:.3g}", base.chi2 > gate]
    ]
    if trace.evidence:
        least, gain = decide.SIGNIFICANT * problem.kappa, trace.evidence[0][1]
        rows.append(["it sits in an equation", "gain in log-likelihood", gain, f"above {least:.3g}", gain >= least])
        lead, one = trace.clear, len(likely_equations(trace.evidence, trace.parity_residuals, trace.clear)) == 1
        words = ["which is one alone", "lead on the next, log-likelihood"]
        rows.append([*words, gain - trace.evidence[1][1], f"{lead:.3g} or more, or told by measured signals", one])
    asked = trace.effects or trace.refuted or tuple(fit for fit, _ in ranking(trace)[:1])
    rows += [
        row for search in trace.passes for fit in search.tried if fit in asked for row in _asked(trace, search, fit)
    ]
    if trace.effects:
        before, named, _ = (errors.chi2 for errors in trace.heldout)
        share, least = trace.heldout[0].explained(trace.heldout[1]), decide.asked(named, trace.several)
        enough = f"{100 * least:.0f} or more, or the noise floor"
        held = share >= least or named <= last
        rows.append(["held-out records bear it out", "explained, held-out [%]", 100 * min(share, 1.0), enough, held])
        most = problem.complete(before, heldout, trace.several)
        rows.append(["nothing else is missing", "held-out chi2", named, f"at most {most:.3g}", named <= most])
    return Table("What the rule asked", ["that", "test", "value", "asked", "answer"], rows)


def _asked(trace: Trace, search: Pass, fit: CandidateFit) -> list[list[Cell]]:
    """The rule's questions about one effect."""
    judged, name = fit.judgement, fit.candidate.effect.name
    fall, chance = accident(trace, search, fit)
    enough = f"{100 * decide.NAMED:.0f} or more, or the noise floor"
    if trace.effects and judged.explained < decide.NAMED and judged.chi2 >= decide.CLOSED:
        enough = _ONE_OF_SEVERAL
    least, share = decide.BIC * trace.problem.kappa, min(judged.explained, 1.0)
    explains = judged.explained >= decide.NAMED or judged.chi2 < decide.CLOSED or enough == _ONE_OF_SEVERAL
    return [
        [f"{name} is no accident", "fall of BIC, train", fall, f"above {least:.3g}", fall > least],
        [f"{name} is no accident", "chance, not fitted", chance, f"below {decide.CHANCE:g}", chance < decide.CHANCE],
        [f"{name} explains it", "explained, not fitted [%]", 100 * share, enough, explains],
    ]


def numbers_table(trace: Trace) -> Table:
    """The numbers of the added and of the next best effects with intervals."""
    fits = [(fit, trace.named if fit in trace.effects else fit.refitted) for fit, _ in ranking(trace)[:_NUMBERS]]
    return effects_numbers("Their numbers", [(fit.candidate.effect, model_fit.fit) for fit, model_fit in fits])


def effects_numbers(name: str, effects: Sequence[tuple[Effect, Fit]]) -> Table:
    """The fitted numbers of effects with intervals, and what is to be thought of each."""
    rows = []
    for effect, fit in effects:
        intervals, remarks = list(effect_intervals(effect, fit).values()), number_remarks(effect, fit)
        for number, values in zip(effect.numbers, intervals, strict=True):
            if number.given:
                continue
            range_ = [float(from_si(v, number.shown, number.si)) for v in (number.low, number.high)]
            cells = [effect.name, effect.formula, number.name, number.meaning, number.shown]
            rows.append([*cells, *interval_cells(values), *range_, ", ".join(remarks[number.name])])
    return Table(
        name,
        ["effect", "formula", "number", "meaning", "unit", "value", "95 % low", "95 % high", "range low", "range high",
         ""],
        rows,
        note="Not told: the interval is not shorter than 80 % of the range, so that these records do not tell it. "
        "May be none: the interval holds the value at which the effect is gone.",
    )  # fmt: skip


def base_table(trace: Trace, changed: bool) -> Table:
    """The rig's own numbers: in its file, fitted alone, and beside what was added."""
    rig = trace.problem.rig
    rows = []
    for alone, last in zip(fitted(rig, trace.base.fit), fitted(rig, trace.final.fit), strict=True):
        number = last.number
        ends = [float(from_si(v, number.unit, number.si)) for v in (number.low, number.high) if v is not None]
        shown = [number.shown, *(fitted_cells(alone)[:1] if changed else []), *fitted_cells(last), *ends]
        state = ["at an end"] * last.at_bounds + ["at an end when alone"] * (alone.at_bounds and not last.at_bounds)
        state += ["not seen"] * last.unseen
        rows.append([number.name, number.unit, *shown, ", ".join(state)])
    alone = ["alone", "with effects"] if changed else ["fitted"]
    columns = ["number", "unit", "rig file", *alone, "95 % low", "95 % high", "range low", "range high", ""]
    note = (
        "At an end of its declared range: something that the model lacks may push it there. Not seen: the interval is "
        "not shorter than 80 % of the range."
    )
    return Table("Numbers of the rig", columns, rows, note=note)


def cosines_table(search: Pass, number: int) -> Table | None:
    """What this campaign can tell apart, of the effects that were refitted and those with the best scores."""
    tried = list(dict.fromkeys(fit.candidate.effect.name for fit in search.tried))
    names = [name for name in dict.fromkeys((*tried, *search.compared)) if name in search.compared][:_COMPARED]
    if len(names) < 2:
        return None
    places = [search.compared.index(name) for name in names]
    part = np.asarray(search.cosines)[np.ix_(places, places)]
    rows = [[name, *row] for name, row in zip(names, np.round(part, 2).tolist(), strict=True)]
    note = (
        "Cosine between what two effects do to the errors, beyond what the rig's numbers can do: near 1 this campaign "
        "cannot tell them apart."
    )
    return Table(f"Likeness of effects{f', search {number}' if number > 1 else ''}", ["", *names], rows, note=note)


def untested_table(trace: Trace, library: Sequence[Effect]) -> Table | None:
    """Effects that were not tried, and why."""
    rig, named = trace.problem.rig, {effect.name for effect in library}
    declared = {use.name for use in rig.effects}
    known = (*known_effects(rig.effect_files), *library)
    fit, able = ({effect.name for effect in known if of(effect, rig)} for of in (applies, acts))
    kinds = {effect.name: effect for effect in reversed(known)}
    rows = []
    for name in dict.fromkeys(effect.name for effect in known):
        if name in declared:
            rows.append([name, "the rig file declares it"])
        elif name not in fit:
            rows.append([name, f"a {rig.valve} valve has {missing(kinds[name], rig.valve)}"])
        elif name not in able:
            rows.append([name, "the rig has nothing that it acts on, or describes it by a number of its own"])
        elif kinds[name].alike:
            rows.append([name, "it looks much like a late command, and is tried where that leaves a misfit"])
        elif name not in named:
            rows.append([name, "taken out by --without"])
    return Table("Effects that were not tried", ["effect", "why"], rows) if rows else None


def unseen_signals(trace: Trace) -> Table | None:
    """Signals that the model predicts and no held-out record has."""
    names = {name for record in trace.problem.heldout.records for name in record.signals}
    lacking = [name for name in predicted(trace.base.model.plant) if name not in names]
    rows = [[name, SIGNAL[name]] for name in lacking if name not in ("velocity", "load_pressure")]
    return Table("Signals that no held-out record has", ["signal", "what it would do"], rows) if rows else None


def records_table(problem: EstimationProblem) -> Table:
    """Which record was used for what."""
    rows = [
        [record.name, role, float(record.t[-1] - record.t[0]) + record.period, record.t.size, ", ".join(record.names)]
        for role in ROLES
        for record in getattr(problem.campaign, role)
    ]
    used = (
        "static: the noise floor; train: fits, scores and equations, and, by blocks in turn, what is chosen where no "
    )
    used += "record is under select; heldout: looked at once, at the end; every error that is quoted is from there."
    return Table("Records", ["record", "role", "seconds", "samples", "signals"], rows, note=used)


def seen_table(rows: Sequence[dict[str, Any]], library: Sequence[Effect]) -> Table:
    """From which value on each effect would have been seen."""
    cells = []
    for row in rows:
        effect = next(effect for effect in library if effect.name == row["effect"])
        number = next(n for n in effect.numbers if n.name == strengths(effect)[0])
        least = None if row["strength"] is None else at_strength(effect, row["strength"])[number.name]
        shown = [None if v is None else float(from_si(v, number.shown, number.si)) for v in (least, number.typical)]
        visible = row["strength"] is not None and row["strength"] <= 1
        cells.append([effect.name, effect.formula, number.name, number.shown, *shown, visible])
    return Table(
        "What these records would have shown",
        ["effect", "formula", "number", "unit", "shows from", "typical", "typical shows"],
        cells,
        note="Shows from: the value, about, that leaves a misfit which no number of the rig can hide. A dash: no value "
        "within its range does.",
    )


def steps_table(trace: Trace) -> Table | None:
    """The steps as a table, if any."""
    every = steps(trace)
    if not every:
        return None
    rows = [[step.added, *step.rms.values()] for step in every]
    note = "RMS error of one free run through each held-out record, with all that stands above too, fitted anew."
    return Table("Effect by effect", ["with", *every[0].rms], rows, note=note)
