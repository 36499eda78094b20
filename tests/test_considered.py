"""A pinned number that is not exactly known: its error is in the intervals of what is fitted."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from made_campaigns import campaign

from workbench.base.process_pool import one_blas_thread
from workbench.identify.found.channels import longer_without
from workbench.identify.trace.considered import considered, with_considered
from workbench.identify.trace.problem import EstimationProblem, estimation_problem
from workbench.identify.trace.refit import FittedModel, fit_rig
from workbench.rigs.rig import Rig
from workbench.rigs.rig_file import load_rig

FITTED, PINNED, SHARE = ("K3", "beta", "b"), "f0", 0.1


def pinned(factor: float = 1.0, known: bool = True) -> Rig:
    """The small cylinder with three numbers to fit, and its valve's frequency pinned within 10 % at 95 %."""
    rig = load_rig("festo-tp511")
    numbers = {
        name: number if name in FITTED else replace(number, low=None, high=None, interval=None)
        for name, number in rig.numbers.items()
    }
    true = rig[PINNED]
    interval = (true * (1 - SHARE), true * (1 + SHARE)) if known else None
    numbers[PINNED] = replace(numbers[PINNED], value=true * factor, interval=interval)
    return replace(rig, numbers=numbers)


@cache
def fitted(factor: float, without: tuple[str, ...] = ()) -> tuple[EstimationProblem, FittedModel]:
    recorded = campaign(load_rig("festo-tp511"))
    fewer = {
        role: tuple(
            replace(record, signals={n: values for n, values in record.signals.items() if n not in without})
            for record in getattr(recorded, role)
        )
        for role in ("static", "train", "heldout")
    }
    with one_blas_thread():
        problem = estimation_problem(replace(recorded, **fewer), pinned(factor))
        return problem, fit_rig(problem)


def test_it_widens_every_interval_by_what_a_fit_beside_another_value_moves():
    problem, found = fitted(1.0)
    added = with_considered(problem, found).fit.covariance - found.fit.covariance
    deviation = SHARE / 1.96
    moved = (fitted(1 + deviation)[1].fit.x - fitted(1 - deviation)[1].fit.x) / 2
    assert np.sqrt(np.diag(added)) == pytest.approx(np.abs(moved), rel=0.1, abs=0.05 * np.abs(moved).max())
    assert np.abs(moved).max() > 3 * np.sqrt(found.fit.covariance.diagonal().min())


def test_intervals_hold_the_truth_where_the_pinned_number_is_off():
    true = load_rig("festo-tp511")
    problem, found = fitted(1 - 0.8 * SHARE)

    def outside(fit):
        ends = (fit.interval(index) for index in range(len(fit.free)))
        return [
            free.name for free, (low, high) in zip(fit.free, ends, strict=True) if not low <= true[free.name] <= high
        ]

    assert outside(found.fit)
    assert not outside(with_considered(problem, found).fit)


def test_a_number_without_an_interval_is_taken_as_it_is():
    assert not considered(pinned(known=False))
    assert [free.name for free in considered(pinned())] == [PINNED]
    problem, found = fitted(1.0)
    exact = replace(problem, rig=pinned(known=False))
    assert with_considered(exact, found) is found


def test_what_a_missing_signal_costs_is_of_the_interval_that_counts_the_pinned_number():
    (problem, found), pressures = fitted(1.0), ("pa", "pb")
    fits = [with_considered(*fitted(1.0, without)).fit for without in (pressures, ())]
    place = int(np.argmax((fits[1].covariance - found.fit.covariance).diagonal()))  # that which it moves most
    came = np.sqrt(fits[0].covariance[place, place] / fits[1].covariance[place, place])
    (longer,) = longer_without(problem, found, [pressures])
    (as_if_exact,) = longer_without(replace(problem, rig=pinned(known=False)), found, [pressures])
    assert longer[place] == pytest.approx(came, rel=0.3)
    assert as_if_exact[place] > 1.5 * came
