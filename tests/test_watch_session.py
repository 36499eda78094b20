"""What one session says: a few rounds find what a whole fit does; a drive's gain is told as a sensor's scale is."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.identify.trace.problem import EstimationProblem, estimation_problem
from workbench.identify.trace.refit import fit_rig
from workbench.identify.watch.naming import explainer
from workbench.identify.watch.reader import _check_alike, _sizes
from workbench.identify.watch.session_evidence import near_fit, with_signal
from workbench.records import load_campaign
from workbench.rigs.rig_file import load_rig

SAMPLE = load_campaign(Path(__file__).parent.parent / "experiments" / "sample")
RIG = load_rig("jack-10t")
FEW = (2, 5, 7, 10)  # in window 9 friction, which the rig lacks, lets initial states end in more than one place


def problem(rig=RIG) -> EstimationProblem:
    whole = estimation_problem(replace(SAMPLE, rig=rig.name), rig)
    return replace(whole, train=whole.train.some(FEW))


@pytest.fixture(scope="module")
def whole():
    return fit_rig(problem()).fit


def test_a_few_rounds_from_near_are_where_the_whole_fit_is(whole):
    """A week later supply, oil and leakage are others: the same windows, begun from there."""
    values = {free.name: free.value(float(x)) for free, x in zip(whole.free, whole.x, strict=True)}
    week = {"Ps": 1.004, "beta": 1.02, "Cl": 1.05, "b": 0.93}
    moved = {name: replace(number, value=values[name] * week.get(name, 1.0)) if name in values else number
             for name, number in RIG.numbers.items()}  # fmt: skip
    near = near_fit(problem(replace(RIG, numbers=moved)))
    found = {free.name: free.value(float(x)) for free, x in zip(near.free, near.x, strict=True)}
    for k, free in enumerate(whole.free):
        low, high = whole.interval(k)
        assert abs(found[free.name] - values[free.name]) < 0.1 * (high - low), free.name
    assert near.chi2 == pytest.approx(whole.chi2, rel=5e-3)


def test_a_signal_that_is_scaled_and_scaled_back_is_as_it_was():
    windows = problem().train
    there = with_signal(windows, "pa", 0.03, 2e5)
    back = with_signal(with_signal(there, "pa", 0.0, -2e5 / 1.03), "pa", 1 / 1.03 - 1, 0.0)
    for a, b, c in zip(windows.groups, there.groups, back.groups, strict=True):
        np.testing.assert_allclose(c.measured, a.measured, rtol=1e-12)
        k = windows.names.index("pa")
        np.testing.assert_allclose(b.measured[..., k], (a.measured[..., k] - 2e5) / 1.03, rtol=1e-12)
        assert np.array_equal(np.delete(a.measured, k, axis=2), np.delete(b.measured, k, axis=2))


@pytest.mark.parametrize("name", ["pa.scale", "command.scale"])
def test_the_scale_of_a_sensor_and_the_gain_of_the_drive_are_found(whole, name):
    """Records whose transducer reads 4 % more, or whose drive asks for 4 % more than is logged."""
    values = {free.name: free.value(float(x)) for free, x in zip(whole.free, whole.x, strict=True)}
    held = {key: replace(number, value=values[key], low=0.995 * values[key], high=1.005 * values[key])
            if key in values else number for key, number in RIG.numbers.items()}  # fmt: skip

    def worn(rig):
        own = problem(rig)
        signal = name.removesuffix(".scale")
        less = 1 / 1.04 - 1  # of the log: the drive gets more than that; a sensor shows more than it should
        return replace(own, train=with_signal(own.train, signal, less, 0.0))

    said = explainer(worn, replace(RIG, numbers=held), ())((name,))[name]
    assert said.value == pytest.approx(0.04, abs=0.004)
    assert said.after < 0.2 * said.before


def test_a_supply_that_sags_is_no_other_unit_and_a_pressure_in_another_unit_is():
    sizes = [_sizes(SAMPLE)] * 3
    record = SAMPLE.train[0]
    supply = np.full(len(record.t), 210e5)
    supply[::2] -= 20e5
    before = [{**size, "supply": 210e5} for size in sizes]
    sags = replace(SAMPLE, train=(replace(record, signals={**record.signals, "supply": supply}),))
    _check_alike(sags, RIG, _sizes(sags), before)
    psi = replace(SAMPLE, train=(replace(record, signals={**record.signals, "pa": record.signals["pa"] / 14.5}),))
    with pytest.raises(InputError, match=r"^pa is 0\.0\d+ times as large as before; check its unit"):
        _check_alike(psi, RIG, _sizes(psi), before)
