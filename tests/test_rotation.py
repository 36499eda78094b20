"""Cross-validation in closed form, windows by what they tell, and intervals under a wrong model."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from made_campaigns import commands, made, rubbing, rubbing_campaign

from workbench.identify.data import noise_floor
from workbench.identify.fit import cut_windows
from workbench.identify.fit.determined import FreeParameter
from workbench.identify.fit.informative import kinds
from workbench.identify.fit.initial_states import fit_states, predicted_states
from workbench.identify.fit.intervals import clustered, widest
from workbench.identify.fit.normal_equations import STATE_PULL, ranges, tangents_at
from workbench.identify.fit.prior import prior_of
from workbench.identify.fit.rotation import Parts, blocks, parts_of
from workbench.identify.fit.solver import Fit, fit_numbers
from workbench.identify.fit.windows import BLOCKS, row_blocks
from workbench.identify.trace.problem import MOST, estimation_problem
from workbench.identify.trace.refit import fit_rig
from workbench.plant import build
from workbench.records import load_campaign
from workbench.rigs.rig_file import load_rig

REAL = Path(__file__).parents[2] / "shared" / "data" / "festo_tp511"


def linear_fit(seed: int, windows: int = 12, rows: int = 30, numbers: int = 3) -> tuple[Fit, np.ndarray, np.ndarray]:
    """A fit whose errors e + J d are linear in its numbers, at its optimum; J [w, rows, k], e [w, rows]."""
    random = np.random.default_rng(seed)
    slopes, errors = random.standard_normal((windows, rows, numbers)), random.standard_normal((windows, rows))
    free = tuple(FreeParameter(f"n{k}", 0.0, -20.0, 20.0, 1.0, "") for k in range(numbers))
    prior = np.diag(ranges(free)[2] ** -2)
    x = optimum(slopes, errors, prior)
    left = errors + slopes @ x
    matrices, gradients = np.swapaxes(slopes, 1, 2) @ slopes, np.einsum("wrk,wr->wk", slopes, left)
    squares = np.sum(left**2, 1)
    fit = Fit(free, x, x, np.zeros((windows, 0)), squares, errors.size, prior, matrices, gradients, squares, ())
    return fit, slopes, errors


def optimum(slopes: np.ndarray, errors: np.ndarray, prior: np.ndarray) -> np.ndarray:
    flat = slopes.reshape(-1, slopes.shape[-1])
    return np.linalg.solve(flat.T @ flat + prior, -flat.T @ errors.ravel())


def _rotated(fit: Fit, block: np.ndarray) -> np.ndarray:
    return Parts(fit.squares, fit.matrices, fit.gradients, block).unseen(prior_of(fit.free), fit.x)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_rotation_is_leaving_out_and_fitting_again(seed):
    """For errors that are linear in the numbers: to rounding."""
    fit, slopes, errors = linear_fit(seed)
    block = np.arange(12) % 3
    prior = np.diag(ranges(fit.free)[2] ** -2)
    left_out = np.empty(12)
    for number in range(3):
        own = block == number
        x = optimum(slopes[~own], errors[~own], prior)
        left_out[own] = np.sum((errors[own] + slopes[own] @ x) ** 2, axis=1)
    np.testing.assert_allclose(_rotated(fit, block), left_out, rtol=1e-9)


def test_numbers_stay_in_their_ranges_when_a_block_is_left_out():
    fit, *_ = linear_fit(1)
    tight = replace(
        fit, free=tuple(replace(f, low=float(x), high=float(x) + 1e-9) for f, x in zip(fit.free, fit.x, strict=True))
    )
    np.testing.assert_allclose(_rotated(tight, np.arange(12) % 3), fit.squares, rtol=1e-6)


def test_every_block_has_a_part_of_every_record():
    problem = estimation_problem(rubbing_campaign(), load_rig("festo-tp511"))
    block = blocks(problem.train)
    record = np.array([index for index, *_ in problem.train.spans])
    for index in np.unique(record):
        own = block[record == index]
        assert np.all(np.diff(own) >= 0)
        assert set(own.tolist()) <= set(range(BLOCKS))
        assert len(set(own.tolist())) == min(BLOCKS, own.size)


def test_windows_in_which_something_moves_are_taken():
    """A rig that stands most of the time: the few windows in which it moves tell its numbers, and all are taken."""
    rig = load_rig("festo-tp511")
    steps, triangle, _ = commands(2.0)
    still = [made(rig, f"still {k}", np.zeros(4000), k) for k in range(6)]
    moving = [made(rig, "steps", steps, 11), made(rig, "triangle", triangle, 12)]
    of = replace(rubbing_campaign(), train=(*still, *moving))
    problem = estimation_problem(of, rig)
    assert problem.large
    train = problem.only(problem.chosen()).train
    assert train.count == MOST
    moved = {span for span in problem.train.spans if span[0] >= len(still)}
    assert moved <= set(train.spans)


def test_windows_that_a_search_leaves_out_select():
    """Where enough are left; none is fitted and compared by at once."""
    rig = load_rig("festo-tp511")
    steps, triangle, _ = commands(2.0)
    records = [made(rig, f"record {k}", (steps, triangle)[k % 2], k) for k in range(MOST)]
    problem = estimation_problem(replace(rubbing_campaign(), train=tuple(records)), rig)
    assert problem.select is None
    search = problem.only(problem.chosen())
    assert search.select is not None
    assert search.train.count == search.select.count == MOST
    assert not set(search.train.spans) & set(search.select.spans)
    few = replace(problem, train=problem.train.some(range(2 * MOST - 1)))
    assert few.only(few.chosen()).select is None


@pytest.mark.skipif(not REAL.is_dir(), reason="the real recordings are not beside the project")
def test_a_search_on_the_real_rig_sees_every_voltage_in_both_directions():
    """64 windows at an even stride held no extending one at 3 and 5 V."""
    rig, whole = load_rig("festo-tp511"), load_campaign(REAL)
    every = replace(whole, train=(*whole.train, *whole.heldout))
    problem = estimation_problem(every, rig)
    train = problem.only(problem.chosen()).train
    kind, every_kind = kinds(train), np.unique(kinds(problem.train))
    assert len(every_kind) == 9  # three voltages, out, back and standing
    assert min(int(np.sum(kind == k)) for k in every_kind) >= 3


@pytest.mark.parametrize("by_record", [False, True])
def test_intervals_hold_where_errors_go_together(by_record):
    """95 of 100 of a slope whose errors are constant within a cluster; the plain ones hold in half of the cases."""
    random, rows, inside, plainly = np.random.default_rng(3), 40, 0, 0
    records = (made(rubbing(), "a", np.zeros(60), 1),) * 12
    windows = cut_windows(build(load_rig("festo-tp511")), records, noise_floor(rubbing_campaign()), late=0.0)
    for _ in range(400):
        slope = random.standard_normal((12, 1)) * np.ones((12, rows))
        error = random.standard_normal((12, 1)) + 0.3 * random.standard_normal((12, rows))
        information = np.sum(slope**2)
        estimate = np.sum(slope * error) / information
        left = error - slope * estimate
        gradients = np.sum(slope * left, axis=1)[:, None]
        noise = np.array([[information * np.mean(left**2)]])
        inverse = np.array([[1 / information]])
        both = widest(inverse, [noise, clustered(gradients, windows, by_record)], np.zeros((1, 1)))
        inside += abs(estimate) < 1.96 * np.sqrt(both[0, 0])
        plainly += abs(estimate) < 1.96 * np.sqrt(inverse[0, 0] ** 2 * noise[0, 0])
    assert inside / 400 > 0.9
    assert plainly / 400 < 0.6


def test_joined_windows_go_on_from_where_the_ones_before_end():
    """What is measured moves nothing; the first one of a record is run up to, and so moves as the record does."""
    problem = estimation_problem(rubbing_campaign(), rubbing())
    model, windows = problem.model(), problem.train
    x0, _ = predicted_states(model, windows, model.p)
    joined = model.joined(windows, model.p, x0)
    before = [w for w, (span, after) in enumerate(pairwise(windows.spans)) if (span[0], span[2]) == after[:2]]
    assert before
    record, first, end = (windows.records[windows.spans[before[0]][0]], *windows.spans[before[0]][1:])
    u = np.zeros((end - first, len(model.plant.inputs)))
    u[:, 0] = record.signals["command"][first:end]
    last = model.engine.run(x0[before[0]], record.t[first : end + 1], u, model.p).x[-1]
    assert joined[before[0] + 1] == pytest.approx(last)
    begins = [w for w in range(windows.count) if w - 1 not in before]
    speed = model.plant.state("v")
    still, moving = (np.abs(x[begins, speed] - x0[begins, speed]).max() for x in (0 * x0, joined))
    assert moving < still


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_leaving_out_a_part_of_a_free_run_is_fitting_its_other_rows_again(seed):
    """The one initial state of each run following the numbers as it does in the fit of all rows: to rounding."""
    random, runs, rows, states, numbers = np.random.default_rng(seed), 3, 41, 2, 3
    model = SimpleNamespace(plant=SimpleNamespace(n=states, scale=np.ones(states)))
    free = tuple(FreeParameter(f"n{k}", 0.0, -20.0, 20.0, 1.0, "") for k in range(numbers))
    prior = prior_of(free)
    slopes = random.standard_normal((runs, rows, states + numbers))
    errors = random.standard_normal((runs, rows, 1))
    group = SimpleNamespace(which=np.arange(runs))
    windows = SimpleNamespace(count=runs, groups=(group,), free_run=True, misfit=1.0)

    nothing = np.zeros((runs, states)), np.zeros((runs, states))
    tangents = tangents_at(model, windows, [slopes], [errors], *nothing)
    parts = parts_of(windows, np.sum(errors**2, axis=(1, 2)), tangents)
    unseen = parts.unseen(prior, np.zeros(numbers)).reshape(runs, BLOCKS)
    to_state, to_number = slopes[..., :states], slopes[..., states:]
    pull = np.eye(states) / STATE_PULL**2
    follows = np.linalg.inv(np.swapaxes(to_state, 1, 2) @ to_state + pull) @ np.swapaxes(to_state, 1, 2) @ to_number
    left = to_number - to_state @ follows
    for block in range(BLOCKS):
        own = row_blocks(rows) == block
        x = optimum(left[:, ~own], errors[:, ~own, 0], prior.matrix)
        squares = np.sum((errors[:, own, 0] + left[:, own] @ x) ** 2, axis=1)
        np.testing.assert_allclose(unseen[:, block], squares, rtol=1e-8)


def test_steep_windows_are_left_out_as_a_fit_without_them_would_be():
    """Of a rig with friction fitted by one without: to 10 % in all, each window nearer than the fit that saw it."""
    problem = estimation_problem(rubbing_campaign(), load_rig("festo-tp511"))
    base = fit_rig(problem)
    fit, block = base.fit, blocks(problem.train)
    refitted = np.empty(problem.train.count)
    for number in np.unique(block):
        rest, own = np.flatnonzero(block != number), np.flatnonzero(block == number)
        others = problem.train.some(rest.tolist())
        without = fit_numbers(base.model, others, fit.free, fit.x, fit.p, fit.x0[rest], problem.kappas)
        refitted[own] = fit_states(base.model, problem.train.some(own.tolist()), fit.x0[own], without.p)[1]
    assert fit.unseen.sum() == pytest.approx(refitted.sum(), rel=0.1)
    moved = np.abs(refitted - fit.squares) > 0.2 * fit.squares
    assert moved.any()
    assert np.all(np.abs(fit.unseen - refitted)[moved] < np.abs(fit.squares - refitted)[moved])
