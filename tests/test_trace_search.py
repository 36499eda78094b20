"""What a trace's search refits, from where, and what ends it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_campaigns import (
    alone,
    campaign,
    problem,
    rubbing,
    rubbing_campaign,
)

from workbench.base.process_pool import one_blas_thread
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.trace.metrics import more_json, trace_json
from workbench.commands.trace.tables import candidates_table
from workbench.identify.fit.free_parameters import Candidate, at_strength
from workbench.identify.fit.initial_states import predicted_states
from workbench.identify.fit.normal_equations import numbers_at
from workbench.identify.fit.rotation import Selection
from workbench.identify.fit.solver import Fit, fit_numbers
from workbench.identify.trace.context import trace_context
from workbench.identify.trace.findings import CandidateFit
from workbench.identify.trace.problem import estimation_problem
from workbench.identify.trace.refit import fit_rig, refit, with_selection
from workbench.identify.trace.refits import _Refits, judge, run_pass
from workbench.identify.trace.rule import NAMED, Judgement, explained
from workbench.identify.trace.tracer import trace
from workbench.plant.effects import find
from workbench.plant.effects.declared import effects_alike
from workbench.rigs.inner_loop import InnerLoop
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

ROOT = Path(__file__).parents[1]
SHARED = ROOT.parent / "shared" / "campaigns"
RIG = load_rig("festo-tp511")


@pytest.mark.parametrize("how", ["raises", "is infinite"])
def test_a_refit_that_fails_is_named_and_the_others_go_on(monkeypatch, how):
    def spoilt(problem, model_fit, candidate, *how):
        if candidate.effect.formula != "coulomb":
            if how == "raises":
                raise np.linalg.LinAlgError("singular matrix")
            return replace(model_fit, known=(candidate,), selection=Selection(np.full(2, np.inf), 2))
        return refit(problem, model_fit, candidate, *how)

    monkeypatch.setattr("workbench.identify.trace.refits.refit", spoilt)
    library = [find("jack.friction", formula) for formula in ("coulomb", "stribeck")]
    with one_blas_thread():
        left = trace(problem(), library, no_checkpoint, lambda _: None)
    answer, more = trace_json(left), more_json(left)
    assert [one["formula"] for one in answer["ranking"]] == ["coulomb"]
    assert answer["effects"] == ["jack.friction"]
    assert list(more["failed"]) == ["jack.friction stribeck"]
    assert candidates_table(left).rows[-1][1] == "stribeck"
    assert "no fit: " in str(candidates_table(left).rows[-1])


def test_a_formula_with_memory_that_starts_far_off_is_fitted_from_short_windows():
    with one_blas_thread():
        lugre = find("jack.friction", "lugre")
        far = Candidate(lugre, {number.name: number.high for number in lugre.numbers})
        refitted = refit(problem(), alone(), far)
    assert explained(alone().squares, refitted.squares, alone().samples) > 0.9


def test_a_formula_with_memory_is_given_up_where_short_windows_lead_to_no_place_near_the_records(monkeypatch):
    fits: list[Fit] = []

    def counted(*args, **how):
        fits.append(fit_numbers(*args, **how))
        return fits[-1]

    def far(model, windows, p):
        x0, squares = predicted_states(model, windows, p)
        return x0, 100 * squares

    monkeypatch.setattr("workbench.identify.trace.short_windows.fit_numbers", counted)
    monkeypatch.setattr("workbench.identify.trace.short_windows.predicted_states", far)
    with one_blas_thread():
        lugre = find("jack.friction", "lugre")
        refitted = refit(problem(), alone(), Candidate(lugre, {number.name: number.high for number in lugre.numbers}))
    assert len(fits) == 1
    assert np.array_equal(refitted.fit.x, fits[0].x)
    assert explained(alone().squares, refitted.squares, alone().samples) == 0.0


@pytest.mark.parametrize(("least", "fits"), [(0.0, 2), (1.01, 1)])
def test_a_refit_that_harms_is_made_again_from_where_no_number_follows(monkeypatch, least, fits):
    """But one that explains less of what it saw than is asked is of no use."""
    starts: list[np.ndarray] = []

    def caught(model, windows, free, start, *others, **how):
        fit = fit_numbers(model, windows, free, start, *others, **how)
        starts.append(start)
        return replace(fit, unseen=1e4 * fit.unseen) if len(starts) == 1 else fit

    with one_blas_thread():
        base, coulomb = alone(), find("jack.friction", "coulomb")
        monkeypatch.setattr("workbench.identify.trace.refit.fit_numbers", caught)
        refitted = refit(problem(), base, Candidate(coulomb, {"Fc": 50.0}), least=least)
    assert len(starts) == fits
    if fits == 1:
        return
    followed, stayed = (start[: len(base.fit.x)] for start in starts)
    assert not np.allclose(followed, base.fit.x)
    assert np.allclose(stayed, base.fit.x)
    assert explained(base.squares, refitted.squares, base.samples) > 0.9


def test_where_a_formula_with_memory_explains_nothing_the_name_s_others_are_fitted(monkeypatch):
    monkeypatch.setattr("workbench.identify.trace.refits.refit", lambda problem, alone, candidate, *how: alone)
    lugre = find("jack.friction", "lugre")
    library = [lugre, replace(lugre, formula="another")]
    with one_blas_thread(), trace_context(problem(), library, no_checkpoint, lambda _: None, several=False) as context:
        tried = run_pass(context, 1, alone(), alone()).tried
    assert {fit.candidate.effect.formula for fit in tried} == {"lugre", "another"}


def test_where_no_score_explains_anything_more_names_are_fitted_those_with_memory_last_and_only_in_need():
    """About a rig that is far off, as by a delay, a score ranks nothing, and memory takes long."""
    spring, lugre = find("load.spring", "linear"), find("jack.friction", "lugre")
    plain = [Candidate(replace(spring, name=f"plain.{k}"), {}) for k in range(5)]
    ranked = [(candidate, 0.03 - 0.001 * k) for k, candidate in enumerate([Candidate(lugre, {}), *plain])]
    sure = [(candidate, 10 * share) for candidate, share in ranked]
    with (
        one_blas_thread(),
        trace_context(problem(), [spring, lugre], no_checkpoint, lambda _: None, several=False) as context,
    ):
        refits = _Refits(context, 1, alone(), alone(), NAMED)
        lost, told = ([pair[0].effect.name for pair in refits._planned(each, {})] for each in (ranked, sure))
        explains = Judgement("plain.2", "linear", 1.0, 1.0, 1, "", "")
        tried = {plain[2].effect.title: CandidateFit(plain[2], 0.028, explains, alone())}
        then = [pair[0].effect.name for pair in refits._planned(ranked, tried)]
    assert lost == [*(f"plain.{k}" for k in range(5)), "jack.friction"]
    assert told == ["jack.friction", "plain.0", "plain.1", "plain.2"]
    assert then == [f"plain.{k}" for k in range(5)]


def test_where_the_shortlist_explains_nothing_every_effect_in_the_equations_in_question_is_fitted():
    spring, lugre = find("load.spring", "linear"), find("jack.friction", "lugre")
    plain = [Candidate(replace(spring, name=f"plain.{k}"), {}) for k in range(8)]
    ranked = [(candidate, 0.3 - 0.01 * k) for k, candidate in enumerate(plain)]
    with (
        one_blas_thread(),
        trace_context(problem(), [spring, lugre], no_checkpoint, lambda _: None, several=False) as context,
    ):

        def names(equations, explained):
            refits = _Refits(context, 1, alone(), alone(), NAMED, equations)
            tried = {
                pair[0].effect.title: CandidateFit(
                    *pair, Judgement(pair[0].effect.name, "linear", explained, 1.5, 1, "", ""), alone()
                )
                for pair in ranked[:4]
            }
            return [pair[0].effect.name for pair in refits._planned(ranked, tried)]

        assert names((), 0.1) == names(("flow",), 0.1) == names(("force",), 0.9)
        assert names(("force",), 0.1) == [f"plain.{k}" for k in range(8)]


@pytest.mark.parametrize(("inner", "fits"), [(None, 4), (InnerLoop("position", 0.05), 8)])
def test_in_a_loop_of_somebody_else_a_name_that_leaves_a_misfit_ends_no_search(inner, fits):
    """Its few signals let unequal lands explain 98 % of what a leak does; elsewhere 90 % is enough."""
    spring = find("load.spring", "linear")
    plain = [Candidate(replace(spring, name=f"plain.{k}"), {}) for k in range(8)]
    ranked = [(candidate, 0.3 - 0.01 * k) for k, candidate in enumerate(plain)]
    with one_blas_thread():
        told = replace(problem(), rig=replace(RIG, inner=inner))
        with trace_context(told, [spring], no_checkpoint, lambda _: None, several=False) as context:
            tried = {
                each.effect.title: CandidateFit(
                    each, 0.3, Judgement(each.effect.name, "", 0.9, 1.5, 1, "", ""), alone()
                )
                for each in plain[:4]
            }
            planned = _Refits(context, 1, alone(), alone(), NAMED, ("force",))._planned(ranked, tried)
    assert len(planned) == fits


def test_an_effect_that_would_be_stronger_than_it_may_be_ends_no_search():
    """Friction of 60 N is what is missing: within 45 N it explains nearly all, and leaves a misfit."""
    friction, spring = find("jack.friction", "coulomb"), find("load.spring", "linear")
    with one_blas_thread(), trace_context(problem(), [spring], no_checkpoint, lambda _: None, several=False) as context:

        def then(high):
            effect = replace(friction, numbers=(replace(friction.numbers[0], high=high), *friction.numbers[1:]))
            candidate = Candidate(effect, at_strength(effect, 0.5))
            found = refit(problem(), alone(), candidate)
            judgement = judge(context, effect, alone(), alone(), found)
            assert judgement.explained > NAMED
            tried = {effect.title: CandidateFit(candidate, 0.9, judgement, found)}
            ranked = [(candidate, 0.9), (Candidate(spring, {}), 0.01)]
            refits = _Refits(context, 1, alone(), alone(), NAMED, ("force",))
            return [pair[0].effect.name for pair in refits._planned(ranked, tried)]

        assert then(45.0) == ["jack.friction", "load.spring"]
        assert then(400.0) == ["jack.friction"]


def left_off(by: float):
    """Refits that are left where the rig's numbers are off, by so much of their ranges, and explain a part."""

    def stuck(problem, alone, candidate, *how):
        good = refit(problem, alone, candidate, *how)
        x = good.fit.x.copy()
        x[: len(problem.free)] += by
        p = numbers_at(good.model, good.fit.free, x, good.fit.p)
        x0, squares = predicted_states(good.model, problem.train, p)
        left = replace(good.fit, x=x, p=p, x0=x0, squares=squares, unseen=squares)
        return with_selection(problem, good.model, left, good.known)

    return stuck


def test_numbers_that_have_taken_an_effect_are_let_go_before_nothing_is_named(monkeypatch):
    monkeypatch.setattr("workbench.identify.trace.refits.refit", left_off(0.02))
    library = [find("jack.friction", "coulomb")]
    with one_blas_thread(), trace_context(problem(), library, no_checkpoint, lambda _: None, several=False) as context:
        short, whole = (run_pass(context, 1, alone(), alone(), equations=each) for each in ((), ("force",)))
    assert 0.3 < short.tried[0].judgement.explained < NAMED
    assert not short.accepted
    assert [fit.candidate.effect.name for fit in whole.accepted] == ["jack.friction"]


def test_numbers_that_have_taken_a_part_of_the_first_effect_are_let_go_before_a_second_is_sought(monkeypatch):
    monkeypatch.setattr("workbench.identify.trace.refits.refit", left_off(0.007))
    library = [find("jack.friction", "coulomb"), find("load.spring", "linear"), find("sensor.lag", "first order")]
    with one_blas_thread():
        found = trace(problem(), library, no_checkpoint, lambda _: None)
    (first,) = found.passes[0].accepted
    assert first.judgement.explained > NAMED
    assert first.refitted.chi2 > 1.2
    assert [fit.candidate.effect.name for fit in found.effects] == ["jack.friction"]
    assert found.effects[0].refitted.chi2 < 1.05
    assert len(found.passes) == 1


@pytest.mark.parametrize("without", [(), ("sensor.filter",)])
def test_where_a_late_command_leaves_a_misfit_a_low_pass_of_the_logger_is_tried(without, monkeypatch):
    """Its name ties with that of the delay, of which a part may be there; what is taken out is not tried."""
    few = [each for each in effects_alike(RIG, "drive timing") if each.formula == "bessel 2"]
    monkeypatch.setattr(
        "workbench.identify.trace.search.effects_alike",
        lambda rig, kin, without: [each for each in few if each.kin == kin and each.name not in without],
    )
    tau = Number("tau", 4e-3, "s", "s", "made up")
    logged = campaign(replace(RIG, effects=(EffectUse("sensor.filter", "bessel 2", {"tau": tau}),)))
    with one_blas_thread():
        own = estimation_problem(logged, RIG), [find("drive.delay", "interpolated")], no_checkpoint, lambda _: None
        found = trace(*own, learns=False, without=without)
    names = [fit.candidate.effect.name for fit in found.effects]
    if without:
        assert "sensor.filter" not in [*names, *found.tied]
    else:
        assert (found.verdict, names, found.tied) == ("tied", ["sensor.filter"], ("drive.delay",))


def test_a_fit_that_stopped_half_way_is_no_reason_to_name_an_effect(monkeypatch):
    """Friction is declared, so nothing is missing; the rig's fit is left off its optimum, a spring's fit finds it."""

    def stuck(problem, follows=True):
        good = fit_rig(problem)
        x = good.fit.x + 0.4
        p = numbers_at(good.model, good.fit.free, x, good.fit.p)
        x0, squares = predicted_states(good.model, problem.train, p)
        left = replace(good.fit, x=x, p=p, x0=x0, squares=squares, unseen=squares)
        return with_selection(problem, good.model, left, ())

    monkeypatch.setattr("workbench.identify.trace.search.fit_rig", stuck)
    with one_blas_thread():
        problem = estimation_problem(rubbing_campaign(), rubbing())
        assert stuck(problem).chi2 > 1.5
        left = trace(problem, [find("load.spring", "linear")], no_checkpoint, lambda _: None)
    assert (left.verdict, left.effects) == ("none", ())
    assert left.chi2[0] < 1.05
