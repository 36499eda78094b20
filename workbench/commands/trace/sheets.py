"""`jackbench trace SHEET.csv ... --output SIGNAL --rig RIG`: frequency-response sheets as records of a trace."""

import argparse
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import partial
from hashlib import sha256
from typing import Any

import numpy as np

from ...base.numbers import finite
from ...base.process_pool import one_blas_thread
from ...identify.fit.solver import Fit
from ...identify.found.fitted import base_intervals, effect_intervals, rig_as_fitted
from ...identify.sheet.element import Element
from ...identify.sheet.problem import SIGMA, SheetProblem, sheet_problem
from ...identify.sheet.tracer import SheetCandidate, SheetTrace, trace_sheets
from ...plant.effects import Effect
from ...plant.effects.declared import effects_for
from ...records.sheet_points import SheetPoints
from ...rigs.rig import Rig
from ...rigs.rig_file import rig_text
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from ..common.rig_out import finish_with_rig
from ..common.run_folder import metrics_json
from .sheet_page import sheet_page
from .study import digest

KINDS = ("gain [dB]", "phase [deg]")


def trace_command(options: argparse.Namespace, words: list[str], rig: Rig, sheets: tuple[SheetPoints, ...]) -> None:
    """Trace the sheets that the command line names, as read."""
    sigma = SIGMA if options.sigma is None else tuple(options.sigma)
    files = [str(file.resolve()) for file in options.effects]
    rig = replace(rig, effect_files=tuple(dict.fromkeys((*rig.effect_files, *files))))
    library = effects_for(rig, (), options.without)
    source = "-".join(dict.fromkeys(sheet.name for sheet in sheets))
    identity = {
        "command": "trace",
        "rig": rig.table(),
        "sheets": {sheet.name: _digest(sheet) for sheet in sheets},
        "pair": [options.input, options.output],
        "amplitudes": [sheet.amplitude for sheet in sheets],
        "sigma": list(sigma),
        "heldout": sorted(options.heldout),
        "effects": digest(rig.effect_files),
        "without": sorted(options.without),
    }
    problem = sheet_problem(rig, source, sheets, sigma, options.heldout)
    finish_with_rig(options, words, source, identity, partial(run_sheet_trace, problem, library))


def run_sheet_trace(problem: SheetProblem, library: Sequence[Effect], stage: Stage, progress: Progress) -> Outcome:
    """Trace sheets to effects of `library`; trace.json and the rig as found, as of a campaign."""
    with one_blas_thread():
        trace = trace_sheets(problem, library, progress)
    answer = sheet_json(trace)
    fit = trace.named.fit
    rig = rig_as_fitted(problem.rig, problem.source, fit, [each.effect for each in trace.effects])
    texts = {"trace.json": metrics_json(answer), "rig.toml": rig_text(rig)}
    more = {"parameters": base_intervals(problem.rig, fit), "sheets": _by_sheet(trace)}
    return Outcome(answer | more, lambda: sheet_page(trace, answer), {}, texts, Subject(problem.rig))


def sheet_json(trace: SheetTrace) -> dict[str, Any]:
    """The answer by the keys of trace.json."""
    names = [candidate.effect.name for candidate in trace.effects]
    return {
        "verdict": trace.verdict,
        "effects": [*names, *trace.tied] if trace.verdict == "tied" else names,
        "equation": trace.equation,
        "alike": [effect.title for named in trace.effects for effect in trace.alike(named)],
        "ranking": [_ranked(trace, candidate) for candidate in trace.tried],
        "chi2": {"before": finite(trace.judged[0].chi2), "after": finite(trace.judged[-1].chi2)},
        "rms": _rms(trace, range(len(trace.judged[0].deviations))),
        "learned": [_learned(trace, element)] if (element := trace.final.model.element) else [],
        "left": [asdict(band) for band in trace.left],
    }


def _learned(trace: SheetTrace, element: Element) -> dict[str, Any]:
    """The element behind the model: what it is, and its numbers with their intervals, SI."""
    fit = trace.final.fit
    names = [free.name for free in fit.free]
    numbers = {}
    for number in element.numbers:
        at = names.index(number.free.name)
        unit = f" [{number.unit}]" if number.unit else ""
        numbers[f"{number.name}{unit}"] = [fit.free[at].value(fit.x[at]), *fit.interval(at)]
    return {"element": element.name, "parameters": numbers, "chi2": finite(trace.judged[-1].chi2)}


def _ranked(trace: SheetTrace, candidate: SheetCandidate) -> dict[str, Any]:
    fit: Fit = trace.named.fit if candidate in trace.effects else candidate.fit.fit
    return {
        "effect": candidate.effect.name,
        "formula": candidate.effect.formula,
        "explained": candidate.judgement.explained,
        "parameters": effect_intervals(candidate.effect, fit),
    }


def _rms(trace: SheetTrace, which: Sequence[int]) -> dict[str, dict[str, float | None]]:
    """Errors in dB and degrees on what judges, with what the sheets are known to."""
    rows = {}
    for column, (kind, sigma) in enumerate(zip(KINDS, trace.problem.sigma, strict=True)):
        before, after = (
            np.concatenate([trace.judged[place].deviations[index][:, column] for index in which]) for place in (0, -1)
        )
        if np.isfinite(before).any():
            rows[kind] = {"before": _mean(before), "after": _mean(after), "floor": sigma}
    return rows


def _mean(deviations: np.ndarray) -> float | None:
    return finite(float(np.sqrt(np.nanmean(deviations**2))))


def _by_sheet(trace: SheetTrace) -> dict[str, Any]:
    judges = trace.problem.heldout or trace.problem.train
    return {sheet.name: _rms(trace, [index]) for index, sheet in enumerate(judges)}


def _digest(sheet: SheetPoints) -> str:
    arrays = (sheet.f, sheet.gain, sheet.phase)
    return sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)).hexdigest()[:16]
