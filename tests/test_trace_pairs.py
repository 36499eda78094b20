"""Two effects at once: the joint score against least squares, the rule, and a small cylinder that lacks two."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from made_campaigns import campaign
from scipy.optimize import nnls

from workbench.base.process_pool import one_blas_thread
from workbench.commands.common.outcome import no_checkpoint
from workbench.identify.fit.free_parameters import Candidate, at_strength
from workbench.identify.trace.context import TraceContext, trace_context
from workbench.identify.trace.findings import CandidateFit, Pass
from workbench.identify.trace.joint import refit_pairs, without_false_first
from workbench.identify.trace.pairs import joint_amplitudes, joint_gains
from workbench.identify.trace.problem import EstimationProblem, estimation_problem
from workbench.identify.trace.refit import FittedModel, fit_rig, refit
from workbench.identify.trace.refits import judge, run_pass
from workbench.identify.trace.rule import best_pair, worth_adding
from workbench.identify.trace.search import SearchResult, search_effects
from workbench.identify.trace.verdict import _nearest, judge_search
from workbench.plant.effects import Effect, find
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

pytestmark = pytest.mark.usefixtures("right_columns")


def directions(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors [count, 30] with something in common, and an error [30]."""
    random = np.random.default_rng(count)
    shapes = random.standard_normal((count, 30)) + 0.7 * random.standard_normal(30)
    return shapes / np.linalg.norm(shapes, axis=1)[:, None], random.standard_normal(30)


def test_the_joint_gain_is_that_of_least_squares():
    shapes, error = directions(5)
    cosines, alone = shapes @ shapes.T, shapes @ error
    gains = joint_gains(alone, cosines, np.zeros(5, bool))
    beside = joint_amplitudes(alone, cosines)
    for i in range(5):
        for j in set(range(5)) - {i}:
            amplitudes, left, *_ = np.linalg.lstsq(shapes[[i, j]].T, error)
            assert gains[i, j] == pytest.approx(error @ error - left[0])
            assert (beside[i, j], beside[j, i]) == pytest.approx(amplitudes)


def test_an_effect_of_one_sign_has_no_negative_amplitude():
    shapes, error = directions(40)
    cosines, alone = shapes @ shapes.T, shapes @ error
    gains = joint_gains(alone, cosines, np.ones(40, bool))
    possible = 0
    for i in range(40):
        for j in range(i):
            amplitudes, left = nnls(shapes[[i, j]].T, error)
            if (amplitudes > 0).all():
                assert gains[i, j] == pytest.approx(error @ error - left**2)
                possible += 1
            else:  # one of the two would be used alone: that is no pair
                assert gains[i, j] == 0
    assert 0 < possible < 780


def test_two_that_hide_each_other_gain_together():
    cosines = np.array([[1.0, 0.9], [0.9, 1.0]])
    gains = joint_gains(np.array([1.0, 0.0]), cosines, np.zeros(2, bool))
    assert gains[0, 1] == pytest.approx(1 / (1 - 0.81))


def test_two_that_look_alike_are_no_pair():
    cosines = np.array([[1.0, 0.97], [0.97, 1.0]])
    assert not joint_gains(np.array([3.0, 1.0]), cosines, np.zeros(2, bool)).any()


@pytest.mark.parametrize(
    ("explained", "chi2", "best"),
    [
        ([], [], None),
        ([0.9, 0.5], [1.4, 3.0], None),
        ([0.6, 0.97], [1.4, 1.2], 1),
        ([0.9, 0.5], [1.02, 3.0], 0),
        ([0.97, 0.975], [1.2, 1.2], None),
    ],
)
def test_a_pair_explains_enough_and_is_the_only_one(explained: list[float], chi2: list[float], best: int | None):
    assert best_pair(explained, chi2) == best


EFFECTS = (find("jack.friction", "coulomb"), find("load.spring", "linear"), find("sensor.lag", ""))


def used(name: str, formula: str, **numbers: float) -> EffectUse:
    """An effect as a rig declares it, SI."""
    si = {number.name: number.si for number in find(name, formula).numbers}
    return EffectUse(name, formula, {key: Number(key, v, si[key], si[key], "made up") for key, v in numbers.items()})


@cache
def lacking(*uses: tuple[str, float]) -> EstimationProblem:
    """Records of a cylinder with effects that its file lacks: a number of each by its name."""
    effects = {
        "Fc": partial(used, "jack.friction", "coulomb"),
        "k": partial(used, "load.spring", "linear", x0=0.0),
        "tau": partial(used, "sensor.lag", "first order"),
    }
    rig = load_rig("festo-tp511")
    truth = replace(rig, effects=tuple(effects[name](**{name: value}) for name, value in uses))
    return estimation_problem(campaign(truth, fitted=1.2), rig)


def searching(problem: EstimationProblem, library: Sequence[Effect] = EFFECTS) -> AbstractContextManager[TraceContext]:
    return trace_context(problem, library, no_checkpoint, lambda _: None, False)


def together(problem: EstimationProblem) -> tuple[Pass, ...]:
    with one_blas_thread(), searching(problem) as context:
        base = fit_rig(context.problem)
        return refit_pairs(context, run_pass(context, 1, base, base))


def test_two_effects_are_refitted_together():
    spring, friction = together(lacking(("Fc", 40.0), ("k", 1000.0)))
    first, second = spring.accepted[0], friction.accepted[0]
    assert (first.judgement.name, second.judgement.name) == ("load.spring", "jack.friction")
    assert second.candidate.start["Fc"] == pytest.approx(40, rel=0.3)
    assert first.judgement.explained < 0.9 < 0.99 < second.judgement.explained
    assert friction.before is first.model_fit
    assert second.refitted.effects == (first.candidate.effect, second.candidate.effect)


def test_an_effect_that_the_other_does_without_is_none_of_a_pair():
    assert together(lacking(("Fc", 60.0), ("tau", 0.002))) == ()


def test_an_effect_with_memory_whose_partners_were_tried_is_in_no_further_pair():
    spring, lugre = Candidate(EFFECTS[1], {"k": 1000.0, "x0": 0.0}), find("jack.friction", "lugre")
    with one_blas_thread(), searching(lacking(("Fc", 60.0))) as context:
        base = fit_rig(context.problem)
        first = replace(added(context, base, base, spring), candidate=Candidate(lugre, at_strength(lugre, 1.0)))
        search = Pass(base, (), (), np.zeros((0, 0)), (((spring, first.candidate), 0.9),), (), ())
        context = replace(context, stage=lambda name, _: pytest.fail(f"{name} is fitted"))
        assert refit_pairs(context, search, first) == ()
        judged = replace(first, judgement=replace(first.judgement, against="", explained=0.5))
        found = SearchResult(base, (), None, (replace(search, tried=(judged,)),))
        assert [start.known for start, _ in _nearest(found)] == [()]  # nor is a shape sought beside it


@pytest.mark.parametrize(
    ("missing", "names"),
    [((("Fc", 60.0),), ["jack.friction"]), ((("Fc", 40.0), ("k", 1000.0)), ["spring", "friction"])],
)
def test_a_first_effect_that_the_second_does_without_is_dropped(missing: tuple, names: list[str]):
    with one_blas_thread(), searching(lacking(*missing)) as context:
        base = fit_rig(context.problem)
        spring = added(context, base, base, Candidate(EFFECTS[1], {"k": 1000.0, "x0": 0.0}))
        friction = added(context, base, spring.refitted, Candidate(EFFECTS[0], {"Fc": 50.0}))
        left = without_false_first(context, base, spring, friction)
    assert [fit.judgement.name.split(".")[-1] for fit in left] == [name.split(".")[-1] for name in names]
    assert left[-1].judgement.explained > 0.95


def added(context: TraceContext, base: FittedModel, before: FittedModel, candidate: Candidate) -> CandidateFit:
    """An effect refitted beside those of a fit."""
    after = refit(context.problem, before, candidate)
    return CandidateFit(candidate, 0.5, judge(context, candidate.effect, before, base, after), after)


def test_a_faint_second_effect_is_named_where_held_out_records_ask_for_it():
    with one_blas_thread(), searching(lacking(("Fc", 60.0), ("tau", 0.002))) as context:
        answer = judge_search(context, search_effects(context))
    names = [fit.judgement.name for fit in answer.effects]
    assert (answer.verdict, names) == ("named", ["jack.friction", "sensor.lag"])
    before, both = answer.passes[1].before.squares, answer.effects[1].refitted.squares
    assert not worth_adding(before - both, answer.base.squares, answer.base.samples)


@pytest.mark.parametrize(
    ("families", "names"),
    [(("lags", "lags"), ["jack.friction", "sensor.lag"]), (("lags", "lines"), ["jack.friction"])],
)
def test_a_second_effect_may_tie_within_its_family_alone(families: tuple[str, str], names: list[str]):
    """An effect beside its own copies under other names: nothing tells them apart, though but two of them are tried
    for their scores."""
    friction, _, lag = EFFECTS
    late, later = (replace(lag, name=name, family=families[1]) for name in ("sensor.late", "sensor.later"))
    library = (friction, replace(lag, family=families[0]), late, later)
    with one_blas_thread(), searching(lacking(("Fc", 60.0), ("tau", 0.004)), library) as context:
        search = search_effects(context)
        verdict = judge_search(context, search, learns=False).verdict
    assert [fit.judgement.name for fit in search.effects] == names
    assert [set(fit.tied) for fit in search.effects] == [set(), {"sensor.late", "sensor.later"}][: len(names)]
    assert (verdict == "tied") == (len(names) == 2)
