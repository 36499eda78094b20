"""A closed loop as a servo of few numbers, against loops that scipy simulates."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lsim

from workbench.commands.fit.ladder import ladder_sentence
from workbench.commands.new.closed_loop import closed_loop_files
from workbench.identify.fit.servo import fit_servos
from workbench.identify.trace.problem import estimation_problem
from workbench.records import Campaign, Record
from workbench.rigs.driven import driven
from workbench.rigs.rig_file import load_rig

PERIOD, FINE, NOISE = 2e-3, 8, 2e-5
GAIN, DELAY, ZERO, COMPLIANCE = 40.0, 5e-3, 3e-4, 5e-8  # 1/s, s, m, m/N


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    folder = tmp_path_factory.mktemp("servo")
    for name, text in closed_loop_files({"force": 1e5, "stroke": 0.15, "speed": 0.5, "M": 100.0}, "servo").items():
        (folder / name).write_text(text)
    return load_rig(folder / "rig.toml")


def simulated(name, system, seed, force=True):
    """A loop in continuous time, whose reference is held for a period, and late."""
    random = np.random.default_rng(seed)
    t = np.arange(0, 12, PERIOD)
    reference = 2e-3 * np.convolve(random.standard_normal(t.size), np.ones(20) / 6, mode="same")
    pushed = 2e4 * np.convolve(random.standard_normal(t.size), np.ones(50) / 10, mode="same") * force
    fine = np.arange(t.size * FINE) * (PERIOD / FINE)
    late = np.clip(np.floor((fine - DELAY + 1e-12) / PERIOD), 0, None).astype(int)
    asked = reference[late] + ZERO - COMPLIANCE * np.repeat(pushed, FINE)
    x = lsim(system, asked, fine, interp=False)[1][::FINE]
    signals = {"reference": reference, "position": x + NOISE * random.standard_normal(t.size)}
    return Record(name, t, {**signals, **({"force": pushed} if force else {})})


def servos(rig, system, force=True):
    records = [simulated(name, system, seed, force) for seed, name in enumerate(("train", "heldout"))]
    campaign = driven(Campaign(Path("made"), rig.name, (), (records[0],), (records[1],)), rig)
    problem = estimation_problem(campaign, replace(rig, load="measured") if force else rig)
    return fit_servos(rig.inner, "m", problem.train, problem.heldout)


def holds(number, truth):
    value, low, high = number
    assert low <= truth <= high
    assert value == pytest.approx((low + high) / 2, rel=0.02)
    return (high - low) / 2


def test_the_numbers_of_a_servo_lie_within_short_intervals(rig):
    free, yielding, second = servos(rig, ([GAIN], [1, GAIN]))
    assert holds(yielding.numbers["speed gain [1/s]"], GAIN) < 0.01 * GAIN
    assert holds(yielding.numbers["delay [s]"], DELAY) < 0.2e-3
    assert holds(yielding.numbers["zero [m]"], ZERO) < 0.1 * ZERO
    assert holds(yielding.numbers["compliance [m/N]"], COMPLIANCE) < 0.1 * COMPLIANCE
    assert yielding.heldout == pytest.approx(NOISE, rel=0.02)
    assert free.heldout > 2 * NOISE  # what the force does is no servo's without it
    assert second.heldout == pytest.approx(NOISE, rel=0.02)


def test_a_second_pole_is_seen_where_there_is_one(rig):
    frequency, damping = 60.0, 0.6
    free, second = servos(rig, ([frequency**2], [1, 2 * damping * frequency, frequency**2]), force=False)
    assert holds(second.numbers["frequency [rad/s]"], frequency) < 0.02 * frequency
    assert holds(second.numbers["damping [1]"], damping) < 0.02
    holds(second.numbers["delay [s]"], DELAY)
    assert second.heldout == pytest.approx(NOISE, rel=0.02)
    assert free.heldout > 3 * NOISE


def test_where_nothing_follows_no_structure_is_claimed():
    rungs = [{"rung": "first order", "left": 1.08, "numbers": {}}, {"rung": "this plant", "left": 1.04, "numbers": {}}]
    said = ladder_sentence({"bears": None, "unit": "mm", "rungs": rungs})
    assert "check which column is the reference" in said
    assert "bear" not in said
