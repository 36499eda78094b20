"""The page of a trace is drawn whatever was found: made results, not only those that a search happens to give.

FUZZ_PAGES=10000 in the environment draws as many (`make fuzz`).
"""

import os
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings, strategies as st
from test_learned_shapes import RIG, harder_out

from workbench.base.checkpoint import no_checkpoint
from workbench.commands.trace.metrics import compared, more_json, trace_json
from workbench.commands.trace.page import trace_page
from workbench.identify.fit.solver import Fit
from workbench.identify.found.missing_shape import missing_shape
from workbench.identify.trace.findings import CandidateFit, Trace
from workbench.identify.trace.problem import estimation_problem
from workbench.identify.trace.refit import FittedModel
from workbench.identify.trace.tracer import trace
from workbench.plant.effects import EQUATIONS, find
from workbench.report import render

LIBRARY = (find("jack.friction", "coulomb"),)
ODD = (0.0, 1e-300, 1e300, np.inf, np.nan)  # variances

PHASES = (Phase.explicit, Phase.reuse, Phase.generate, Phase.target)  # a page is slow to draw: nothing is shrunk


@cache
def found() -> Trace:
    """A small one in truth: friction named, its shape learned, a spring tried."""
    return trace(estimation_problem(harder_out(), RIG), LIBRARY, no_checkpoint, lambda _: None)


@cache
def drawn_from() -> tuple[Any, Any, Any]:
    return (
        trace_json(found()),
        compared(found()),
        missing_shape(replace(found(), verdict="unknown"), no_checkpoint, lambda _: None),
    )


def odd_fit(draw: st.DrawFn, fit: Fit) -> Fit:
    """Intervals that are no numbers, numbers at an end of their range or beyond all."""
    covariance = fit.covariance.copy()
    for place in range(len(fit.free)):
        if draw(st.booleans()):
            covariance[place, place] = draw(st.sampled_from(ODD))
    names = [free.name for free in fit.free]
    ends = tuple(draw(st.lists(st.sampled_from(names), unique=True))) if names else ()
    return replace(fit, covariance=covariance, at_bounds=ends)


def odd_model(draw: st.DrawFn, model_fit: FittedModel) -> FittedModel:
    return replace(model_fit, fit=odd_fit(draw, model_fit.fit))


def odd_candidate(draw: st.DrawFn, fit: CandidateFit) -> CandidateFit:
    if draw(st.integers(0, 4)) == 0:
        return replace(fit, model_fit=None, failed="<b>it</b> & more")
    assert fit.model_fit is not None
    explained = draw(st.sampled_from((0.0, 0.4, 1.0, 1.7)))
    judged = replace(fit.judgement, explained=explained, chi2=draw(st.sampled_from((0.9, 1.04, 7.0, np.inf))))
    return replace(fit, judgement=judged, model_fit=odd_model(draw, fit.model_fit))


def made_trace(draw: st.DrawFn) -> Trace:
    """A trace that fits together: what was added was tried, and what was learned is in the last fit."""
    real = found()
    passes = []
    for each in real.passes[: draw(st.integers(0, len(real.passes)))]:
        tried = tuple(odd_candidate(draw, fit) for fit in each.tried)
        accepted = tuple(fit for fit in tried if fit.model_fit is not None)[: draw(st.integers(0, 2))]
        passes.append(replace(each, tried=tried, accepted=accepted))
    added = tuple(fit for each in passes for fit in each.accepted)[: draw(st.integers(0, 2))]
    verdict = draw(st.sampled_from(("named", "tied", "incomplete") if added else ("unknown", "none")))
    learned = real.learned if draw(st.booleans()) else ()
    base = odd_model(draw, real.base)
    named = added[-1].refitted if added else base
    final = odd_model(draw, real.final) if learned else named
    gains = draw(st.lists(st.sampled_from((0.0, 3.0, 1e4, 1e9)), min_size=len(EQUATIONS), max_size=len(EQUATIONS)))
    evidence = tuple(zip(draw(st.permutations(EQUATIONS)), sorted(gains, reverse=True), strict=True))
    parity = draw(st.dictionaries(st.sampled_from(("drive", "force")), st.sampled_from((0.9, 1.3, 1e6, np.inf))))
    equation = None if verdict == "none" else draw(st.sampled_from(EQUATIONS))
    return replace(
        real,
        base=base,
        named=named,
        final=final,
        verdict=verdict,
        effects=added,
        equation=equation,
        evidence=evidence if draw(st.booleans()) else (),
        parity_residuals=parity,
        passes=tuple(passes),
        refuted=tuple(fit for each in passes for fit in each.accepted) if not added else (),
        learned=learned,
    )


def test_the_page_of_what_was_found_is_drawn():
    answer, both, shape = drawn_from()
    assert "jack.friction" in render(trace_page(found(), answer, both, LIBRARY, shape, None, {})[0])


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # numbers beyond all: what is drawn of them is asked here
@settings(
    print_blob=False,
    max_examples=int(os.environ.get("FUZZ_PAGES", "12")),
    phases=PHASES,
    suppress_health_check=list(HealthCheck),
)
@given(st.data())
def test_the_page_of_any_result_is_drawn(data):
    made = made_trace(data.draw)
    answer, both, shape = drawn_from()  # the test before has found it already
    answer = answer | {"verdict": made.verdict}
    odd = data.draw(st.sampled_from((None, 0.0, 1.0, 1e9)))  # None: a window could not be simulated
    answer["rms"] = {name: row | {"after": odd} for name, row in answer["rms"].items()}
    both = both if made.effects or made.learned else (both[0], both[0])
    page, _ = trace_page(made, answer, both, LIBRARY, shape if data.draw(st.booleans()) else None, None, {})
    assert "<b>it</b>" not in render(page)
    more_json(made)
