"""Groups of records that differ in a number of the rig are told, and only they."""

from dataclasses import replace

import pytest
from made_campaigns import campaign, commands, made

from workbench.base.process_pool import one_blas_thread
from workbench.identify.fit.sessions import groups, session_differences
from workbench.identify.trace.problem import estimation_problem
from workbench.identify.trace.refit import fit_rig
from workbench.rigs.rig import Rig
from workbench.rigs.rig_file import load_rig

RIG = load_rig("festo-tp511")


def faster(factor: float) -> Rig:
    """The rig whose valve passes more by a factor."""
    return replace(
        RIG, numbers=RIG.numbers | {"K3": replace(RIG.numbers["K3"], value=factor * RIG.numbers["K3"].value)}
    )


def differences(factor: float):
    """Two records of the rig, two of it with a faster valve; what the groups differ by."""
    steps, triangle, _ = commands(2.0)
    second = faster(factor)
    train = (
        made(RIG, "steps 1", steps, 21), made(RIG, "triangle 1", triangle, 22),
        made(second, "steps 2", steps, 23), made(second, "triangle 2", triangle, 24),
    )  # fmt: skip
    with one_blas_thread():
        problem = estimation_problem(replace(campaign(RIG), train=train), RIG)
        fit = fit_rig(problem).fit
        return session_differences(fit, problem.train, {"second day": (2, 3)}, problem.kappa)


@pytest.mark.parametrize("percent", [2.0, -3.0])
def test_a_session_in_which_the_valve_passes_more_is_told(percent):
    (found,) = differences(1 + percent / 100)
    assert (found.number, found.group, found.records) == ("K3", "second day", ("steps 2", "triangle 2"))
    assert found.percent == pytest.approx(percent, abs=max(3 * found.error, 0.1))


def test_records_of_one_rig_do_not_differ():
    assert differences(1.0) == []


def test_groups_are_those_with_other_signals_and_later_repeats():
    steps, triangle, _ = commands(1.0)
    records = [
        made(RIG, name, command, 1, dict.fromkeys(signals, 0.0001))
        for name, command, signals in (
            ("a", steps, ("pa", "position")), ("b", steps, ("pa", "position")),
            ("c", steps, ("pb", "position")), ("d", triangle, ("pb", "position")),
        )
    ]  # fmt: skip
    assert groups(records) == {"with pa": (0, 1), "with pb": (2, 3), "later repeats": (1,)}
    assert groups(records[:1]) == {}
