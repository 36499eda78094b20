"""The pages of traces of sheets and of pump drives are drawn whatever was found: results that nobody computed."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from made_pages import MARKUP, beyond_all, drawn, made_result, odd_fit, plain_fit
from test_pump_trace import cycle

from workbench.commands.common.run_folder import metrics_json
from workbench.commands.trace import metrics as trace_metrics, sheet_page as sheet_pages
from workbench.commands.trace.metrics import more_json, trace_json
from workbench.commands.trace.page import trace_page
from workbench.commands.trace.sheets import sheet_json
from workbench.identify.fit.free_parameters import Candidate, at_strength
from workbench.identify.fit.predict import Prediction
from workbench.identify.sheet.element import ELEMENTS
from workbench.identify.sheet.fit import SheetFit
from workbench.identify.sheet.problem import SheetProblem, sheet_problem
from workbench.identify.sheet.remainder import Band
from workbench.identify.sheet.tracer import JudgedFit, SheetCandidate, SheetTrace
from workbench.identify.trace.findings import CandidateFit, Pass, Trace
from workbench.identify.trace.problem import EstimationProblem, estimation_problem
from workbench.identify.trace.refit import FittedModel, HeldoutErrors
from workbench.identify.trace.rule import Judgement
from workbench.plant import build
from workbench.plant.effects import EQUATIONS, applies, known_effects, number_effects
from workbench.records import Campaign
from workbench.records.sheet_points import SheetPoints
from workbench.rigs.rig_file import load_rig


@cache
def sheets() -> tuple[SheetProblem, list[SheetFit]]:
    """Sheets at two amplitudes of a rig whose numbers stay where they are, alone, with effects, with an element."""
    f = np.geomspace(5.0, 80.0, 6)
    gain, phase = np.where(f > 60, np.nan, -0.1 * f), np.where(f < 10, np.nan, -2 * f)
    made = [SheetPoints(f"{MARKUP} {size:g}", "command", "flow", size, f, gain, phase, True) for size in (1.0, 0.25)]
    problem = sheet_problem(load_rig("jack-10t-rounded"), "made", made)
    effects = [effect for effect in known_effects() if problem.bench.has_room(effect)]
    return problem, [sheet_fit(problem, some) for some in ((), *((effect,) for effect in effects[::8]))]


def sheet_fit(problem: SheetProblem, effects: Any, element: Any = None) -> SheetFit:
    model = problem.model(effects)
    model = model if element is None else model.behind(element)
    free = [
        *problem.uncertain(problem.model()),
        *(free for each in effects for free in Candidate(each, at_strength(each, 1.0)).free()),
    ]
    p = model.plant.p.copy()
    if element is not None:
        free += [number.free for number in element.numbers]
        p = np.append(p, [number.tried[0] for number in element.numbers])
    return SheetFit(model, plain_fit(free, p, 1, 1), SimpleNamespace(squares=np.full(1, 50.0)))


@beyond_all
@made_result
@given(st.data())
def test_the_page_of_any_sheets_is_drawn(data):
    draw, (problem, fits) = data.draw, sheets()
    if draw(st.booleans()):
        problem = replace(problem, train=problem.train[:1], heldout=())
    odd = [
        replace(fit, fit=odd_fit(draw, fit.fit))
        for fit in (fits[0], *draw(st.lists(st.sampled_from(fits[1:]), max_size=3)))
    ]
    tried = tuple(
        SheetCandidate(effect, Judgement(effect.name, effect.formula, draw(st.sampled_from((0.0, 0.7, 1.7))), draw(
            st.sampled_from((0.9, np.inf))), 1, draw(st.sampled_from(("", MARKUP))), effect.kin), fit)
        for fit in odd[1:] for effect in fit.model.effects
    )  # fmt: skip
    effects = tried[: draw(st.integers(0, 1))]
    named = effects[-1].fit if effects else odd[0]
    element = draw(st.sampled_from((None, *ELEMENTS)))
    final = named if element is None else sheet_fit(problem, named.model.effects, element)
    judges = problem.heldout or problem.train
    size, stated = st.sampled_from((0.0, 3.0, 1e4)), np.array(draw(st.sampled_from(((1, 1), (1, np.nan), (np.nan, 1)))))
    judged = [
        JudgedFit(np.full(3, draw(size)), [stated * np.full((s.f.size, 2), draw(size)) for s in judges], 9)
        for _ in range(3)
    ]
    left = [Band(MARKUP, 5.0, draw(st.sampled_from((5.0, 80.0))), draw(st.sampled_from((0.0, 2.0))), 14.0)] * draw(
        st.integers(0, 4)
    )
    verdict = draw(st.sampled_from(("named", "tied", "incomplete") if effects else ("unknown", "none")))
    made = SheetTrace(
        problem, odd[0], named, final, tuple(judged), tuple(left), verdict, effects, (MARKUP,) * (verdict == "tied"),
        draw(st.sampled_from((None, *EQUATIONS))), tried, (),
    )  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sheet_pages, "_CURVE", 3)
        page, picture = sheet_pages.sheet_page(made, answer := sheet_json(made))
    drawn(page)
    assert picture._repr_html_()
    metrics_json(answer)


@cache
def pump() -> tuple[EstimationProblem, Any, list[Candidate]]:
    """A pump rig's campaign, of cycles that its own plant made, and what a trace tries there."""
    rig = load_rig("pump-rig").with_corrector("speed")
    records = [cycle(build(rig), f"cycle {k}", share, 0.0, k) for k, share in enumerate((0.4, 0.5, 0.3))]
    still = replace(records[0].slice(None, 1.2), name="still")
    made = Campaign(
        Path(MARKUP), "pump-rig", (still,), tuple(records[:2]), tuple(records[2:]), score="free-run", corrector="speed"
    )
    problem = estimation_problem(made, rig)
    known = [effect for effect in (*known_effects(), *number_effects(rig)) if applies(effect, rig)]
    return problem, known, [Candidate(effect, at_strength(effect, 1.0)) for effect in known]


def pump_fit(draw: st.DrawFn, known: tuple[Candidate, ...]) -> FittedModel:
    """The rig with effects and numbers that are others, at their strengths."""
    problem, *_ = pump()
    model = problem.model([each.effect for each in known])
    free = [*problem.free, *(free for each in known for free in each.free())]
    fit = odd_fit(draw, plain_fit(free, model.plant.p, problem.train.count, model.plant.n))
    return FittedModel(
        known, model, fit, SimpleNamespace(squares=np.array([draw(st.sampled_from((1.0, 50.0, np.inf)))]), samples=1)
    )


@beyond_all
@made_result
@given(st.data())
def test_the_page_of_any_trace_of_a_pump_is_drawn(data):
    draw, (problem, library, candidates) = data.draw, pump()
    some = draw(st.lists(st.sampled_from(candidates), max_size=3, unique_by=lambda each: each.effect.name))
    tried = []
    for k in range(len(some)):
        fitted_model, effect = pump_fit(draw, tuple(some[: k + 1])), some[k].effect
        share, against = draw(st.sampled_from((0.0, 0.7, 1.7))), draw(st.sampled_from(("", MARKUP)))
        judged = Judgement(effect.name, effect.formula, share, 1.1, 1, against, effect.kin)
        failed = draw(st.integers(0, 4)) == 0
        tied = tuple(draw(st.lists(st.sampled_from([each.effect.name for each in some]), max_size=1)))
        tried.append(
            CandidateFit(some[k], 0.5, judged, None if failed else fitted_model, MARKUP if failed else "", tied)
        )
    base = replace(pump_fit(draw, ()), selection=SimpleNamespace(squares=np.array([90.0]), samples=1))
    added = tuple(each for each in tried if each.model_fit is not None)[: draw(st.integers(0, 3))]
    named = added[-1].refitted if added else base
    windows = problem.heldout
    errors = [
        HeldoutErrors(
            np.zeros((windows.count, of.model.plant.n)), np.full(windows.count, draw(st.sampled_from((7.0, np.inf)))), 1
        )
        for of in (base, named, named)
    ]
    passes = (Pass(base, tuple((each, 0.4) for each in some), (), np.zeros((0, 0)), (), tuple(tried), added),)
    verdict = draw(st.sampled_from(("named", "tied", "incomplete") if added else ("unknown", "none")))
    made = Trace(
        problem, base, named, named, (errors[0], errors[1], errors[2]), verdict, added,
        draw(st.sampled_from((None, *EQUATIONS))), (), {}, passes if some else (),
    )  # fmt: skip
    both = (prediction := [at_rest(windows, draw)], prediction if not added else [at_rest(windows, draw)])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trace_metrics, "compared", lambda _: both)
        answer, more = trace_json(made), more_json(made)
    drawn(trace_page(made, answer, both, library, None, None, {})[0])
    metrics_json(answer | more)


def at_rest(windows: Any, draw: st.DrawFn) -> Prediction:
    """What a model predicts of a held-out record: nothing that moves, or nothing at all."""
    (record,) = windows.records
    value = draw(st.sampled_from((0.0, 1e5, np.nan)))
    return Prediction(record, {name: np.full(record.t.size, value) for name in windows.names}, ())
