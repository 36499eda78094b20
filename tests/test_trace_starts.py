"""Where a trace's refits start: effects at finite strengths, numbers following, secants, and a delay as a shift."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from made_campaigns import PERIOD, SIGMA, campaign, commands, made, rubbing, rubbing_campaign

from workbench.base.process_pool import one_blas_thread
from workbench.commands.common.outcome import no_checkpoint
from workbench.identify.fit.free_parameters import Candidate, at_strength, extend_parameters
from workbench.identify.trace import refit as refitting
from workbench.identify.trace.context import TraceContext, trace_context
from workbench.identify.trace.findings import CandidateFit
from workbench.identify.trace.follow import Follower
from workbench.identify.trace.problem import EstimationProblem, estimation_problem
from workbench.identify.trace.refit import FittedModel, fit_rig, refit
from workbench.identify.trace.refits import _Refits
from workbench.identify.trace.rule import NAMED, Judgement
from workbench.identify.trace.score import STRENGTHS, NuisanceProjection, score, worst_windows
from workbench.identify.trace.tracer import trace
from workbench.plant.effects import LIBRARY, find, with_apart
from workbench.records import Campaign, Record
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

RIG = load_rig("festo-tp511")
FRICTION = find("jack.friction", "coulomb")


pytestmark = pytest.mark.usefixtures("right_columns")


@cache
def fitted() -> tuple[EstimationProblem, FittedModel]:
    """A cylinder that rubs with 60 N, and the fit of one that does not."""
    with one_blas_thread():
        problem = estimation_problem(rubbing_campaign(), RIG)
        return problem, fit_rig(problem)


def follower(candidate: Candidate) -> Follower:
    """Starts with one effect more."""
    problem, alone = fitted()
    return Follower(alone.model, problem.train, alone.fit, problem.model((candidate.effect,)), (candidate,))


def late(name: str, command: np.ndarray, seed: int, rows: int) -> Record:
    """What a rig records that meets its command so many rows late."""
    met = np.concatenate((np.zeros(rows), command[: len(command) - rows]))
    record = made(RIG, name, met, seed)
    return replace(record, signals=dict(record.signals) | {"command": command})


def test_a_delay_is_found_as_a_shift():
    rows = 2
    names = ("steps", "triangle", "sines")
    steps, triangle, sines = (
        late(name, command, seed, rows) for seed, (name, command) in enumerate(zip(names, commands(2.0), strict=True))
    )
    still = made(RIG, "still", np.zeros(500), 4)
    recorded = Campaign(Path("late"), "festo-tp511", (still,), (steps, triangle), (sines,))
    library = [find("drive.delay", "shift"), find("drive.lag", "command filter")]
    with one_blas_thread():
        answer = trace(estimation_problem(recorded, RIG), library, no_checkpoint, lambda _: None)
    assert answer.verdict == "named"
    assert answer.effects[0].candidate.effect.name == "drive.delay"
    values = dict(zip(answer.named.model.parameters, answer.named.fit.p, strict=True))
    assert values["drive.delay.delay"] == pytest.approx(rows * PERIOD, rel=0.05)


def test_numbers_that_follow_an_effect_leave_less_than_it_put_in_beside_them():
    candidate = Candidate(FRICTION, {"Fc": 60.0})
    start = follower(candidate).start()
    problem, alone = fitted()
    model = problem.model((FRICTION,))
    values = model.plant.parameter_values(None, **dict(zip(alone.model.parameters, alone.fit.p, strict=True)))
    plain = model.errors(
        problem.train, alone.fit.x0, model.plant.parameter_values(values, **{"jack.friction.Fc": 60.0})
    )
    put_in = sum(float(np.sum(part**2)) for part in plain)
    assert start.squares < 0.5 * min(put_in, float(alone.fit.squares.sum()))


def test_less_of_an_effect_is_tried_where_much_harms():
    far = follower(Candidate(FRICTION, {"Fc": 240.0}))
    start, harmless = far.best((1.0, 0.5, 0.25, 0.1))
    assert harmless
    assert start.p[-1] == pytest.approx(60.0)


def test_an_effect_is_fitted_by_secants():
    lugre = find("jack.friction", "lugre")
    candidate = Candidate(lugre, at_strength(lugre, 0.1))
    problem, alone = fitted()
    starts = follower(candidate)
    fit = starts.fit(starts.start(), problem.kappas, 12)
    assert fit.chi2 < 1.1 < alone.fit.chi2
    assert fit.free == starts.free
    force = next(k for k, free in enumerate(fit.free) if free.name == "jack.friction.Fc")
    assert fit.free[force].value(fit.x[force]) == pytest.approx(60.0, rel=0.1)
    assert np.isfinite(fit.covariance).all()


@pytest.mark.parametrize(("force", "weaker"), [(1.0, True), (200.0, False)])
def test_an_effect_that_is_too_strong_at_every_strength_is_scored_at_less(force, weaker):
    """The least strength is 24 N here."""
    quiet = {name: sigma / (20 if weaker else 1) for name, sigma in SIGMA.items()}
    with one_blas_thread():
        problem = estimation_problem(campaign(rubbing(force), sigma=quiet), RIG)
        alone = fit_rig(problem)
        windows, fit = worst_windows(problem.train, alone.fit)
        rest = NuisanceProjection(alone.model, windows, fit)
        scored = score(RIG, (), FRICTION, alone.model, windows, fit, rest)
    assert (min(trial.tried.strength for trial in scored.trials) < STRENGTHS[0]) is weaker
    assert scored.candidate.start["Fc"] == pytest.approx(force, rel=0.5)


def test_an_effect_that_acts_beyond_a_threshold_starts_where_it_acts():
    """A largest speed of the spool that the records just reach: half of that time of travel is no limit at all."""
    number = Number("T", 0.025, "s", "s", "made up")
    slow = replace(RIG, effects=(EffectUse("main.rate", "symmetric", {"T": number}),))
    effect = find("main.rate", "symmetric")
    with one_blas_thread():
        problem = estimation_problem(campaign(slow), RIG)
        alone = fit_rig(problem)
        windows, fit = worst_windows(problem.train, alone.fit)
        scored = score(RIG, (), effect, alone.model, windows, fit, NuisanceProjection(alone.model, windows, fit))
        found = refit(problem, alone, scored.candidate)
    assert scored.candidate.start["T"] > 0.02
    assert found.chi2 - 1 < 0.05 * (alone.chi2 - 1)
    assert dict(zip(found.model.parameters, found.fit.p, strict=True))["main.rate.T"] == pytest.approx(0.025, rel=0.05)


def test_lines_of_two_transducers_need_not_be_alike():
    apart = {effect.title for effect in with_apart(LIBRARY)} - {effect.title for effect in LIBRARY}
    assert apart == {"sensor.lag first order; apart", "sensor.lag line; apart"}


@pytest.mark.parametrize(("shown", "verdict"), [(True, "named"), (False, "none")])
def test_a_misfit_that_no_equation_explains_is_named_where_held_out_records_show_it(monkeypatch, shown, verdict):
    real = TraceContext.is_misfit
    monkeypatch.setattr(TraceContext, "is_significant", lambda self, place: False)
    monkeypatch.setattr(
        TraceContext,
        "is_misfit",
        lambda self, errors: real(self, errors) and (shown or isinstance(errors, FittedModel)),
    )
    with one_blas_thread():
        answer = trace(fitted()[0], (FRICTION,), no_checkpoint, lambda _: None)
    assert answer.verdict == verdict
    assert [effect.candidate.effect.name for effect in answer.effects] == ["jack.friction"] * shown


def test_a_refit_that_overshot_and_took_the_effect_away_begins_anew_where_it_is_faint(monkeypatch):
    """From there nothing leads back; the better of the two fits counts, and says where it began."""
    problem, alone = fitted()
    model, begun = problem.model((FRICTION,)), []
    plain = refitting._fitted

    def overshoots(problem, before, model, candidates, *how):
        begun.append(candidates[0].start["Fc"])
        fit = plain(problem, before, model, candidates, *how)
        if len(begun) > 1:
            return fit
        off = model.plant.parameter_values(fit.p, **{"jack.friction.Fc": 0.0})
        return replace(fit, p=off, squares=10 * fit.squares)

    monkeypatch.setattr(refitting, "_fitted", overshoots)
    with one_blas_thread():
        found = refit(problem, alone, Candidate(FRICTION, {"Fc": 200.0}))
    assert begun == [200.0, at_strength(FRICTION, 0.1)["Fc"]]
    assert found.known[-1].start["Fc"] == begun[1]
    assert found.fit.p[model.parameters.index("jack.friction.Fc")] == pytest.approx(60.0, rel=0.1)


def test_an_effect_that_only_harms_where_it_is_faint_is_not_fitted_there(monkeypatch):
    problem, alone = fitted()
    model, begun, off = problem.model((FRICTION,)), [], {"jack.friction.Fc": 0.0}

    def to_nothing(problem, before, model, candidates, *how):
        begun.append(candidates[0].start["Fc"])
        p = model.plant.parameter_values(extend_parameters(before.model.plant, before.fit.p, model.plant), **off)
        return replace(before.fit, free=(*before.fit.free, *candidates[0].free()), x=np.append(before.fit.x, 0.0), p=p)

    monkeypatch.setattr(refitting, "_fitted", to_nothing)
    monkeypatch.setattr(Follower, "best", lambda self, shares: (self.start(shares[-1], steps=0), False))
    with one_blas_thread():
        found = refit(problem, alone, Candidate(FRICTION, {"Fc": 200.0}))
    assert begun == [200.0]
    assert found.fit.p[model.parameters.index("jack.friction.Fc")] == 0.0


@pytest.mark.parametrize(("share", "planned"), [(0.9, ["plain.0", "plain.1"]), (0.97, ["plain.0"])])
def test_a_rival_with_a_faint_score_is_refitted_unless_nearly_all_is_explained(share, planned):
    """Numbers that have taken what they can leave little for a score to see."""
    problem, alone = fitted()
    spring = find("load.spring", "linear")
    first, faint = (Candidate(replace(spring, name=f"plain.{k}"), {}) for k in range(2))
    judgement = Judgement("plain.0", "linear", share, 1.0, 1, "", "")
    tried = {first.effect.title: CandidateFit(first, 0.4, judgement, alone)}
    with one_blas_thread(), trace_context(problem, [spring], no_checkpoint, lambda _: None, several=False) as context:
        refits = _Refits(context, 1, alone, alone, NAMED)
        assert [pair[0].effect.name for pair in refits._planned([(first, 0.4), (faint, 0.05)], tried)] == planned
