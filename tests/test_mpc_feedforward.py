"""Feed-forward of predictive control: a shaping in front of the governor, which so keeps the stroke with it."""

from dataclasses import replace

import numpy as np
import pytest
from made_loops import run_loop
from made_mpc import FREE, PERIOD, made, planned, shipped_spec

from controllers.feedforward import FeedForward
from controllers.shaping import Shaping
from workbench.commands.common.shipped import experiment
from workbench.commands.tune.options import load_tune
from workbench.control.controller_type import controller
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.loop.rig_variations import with_delay
from workbench.plant import build

RIGS = load_tune(experiment("tune_mpc")).rigs
VELOCITY, CORNER = 0.042, 7.9  # s/m, Hz
FOLLOW = planned(made(**FREE)).law.follow
NUMBERS = {"corner": CORNER, "notch": CORNER, "lead": 1 / (np.pi * CORNER) + VELOCITY / FOLLOW}
FORWARD = controller("controllers.feedforward:FeedForward", velocity=VELOCITY, corner=CORNER)
SHAPING = controller("controllers.shaping:Shaping", **NUMBERS)


def test_feed_forward_that_the_filter_knows_of_is_a_shaping():
    """K r + Kv s/(s/w + 1)^2 r is K times a Shaping with its notch at w and the lead 2/w + Kv/K."""
    z = np.exp(2j * np.pi * PERIOD * np.geomspace(0.01, 400, 50))
    shaping = Shaping(Shaping.Design(**NUMBERS), PERIOD).law
    forward = FeedForward(FeedForward.Design(velocity=VELOCITY, corner=CORNER), PERIOD).law
    assert FOLLOW * shaping(z) == pytest.approx(FOLLOW + forward(z), rel=1e-12)


def run(varied, spec, reference):
    """A step late and with noise."""
    late = with_delay(RIGS[varied], 3e-4)
    plant = build(late)
    return run_loop(Engine(plant), late, spec.build(PERIOD), equilibrium(plant), np.full(600, reference), seed=1)


@pytest.mark.parametrize("reference", [0.3, 0.239])
@pytest.mark.parametrize("varied", RIGS)
def test_the_stroke_limit_is_kept_with_it_on_every_rig_late_and_with_noise(varied, reference):
    """A reference beyond the limit is followed up to it, one just inside arrives where it does without."""
    bare, ends = shipped_spec("mpc"), []
    bare = replace(bare, compensators=bare.compensators[:2])
    for spec in (bare, bare + SHAPING, shipped_spec("mpc")):
        done = run(varied, spec, reference)
        position = done.record.signals["position"]
        assert done.tripped is None
        assert position.max() < 0.24
        assert max(done.record.signals[name].max() for name in ("pa", "pb")) < 225e5
        ends.append(position[-100:].mean())
    assert ends == pytest.approx([ends[0]] * 3, abs=3e-5)


def test_around_the_governor_it_takes_more_pressure_than_there_may_be():
    """Why it is no FeedForward: neither filter nor governor knows of that."""
    feedback, *rest = shipped_spec("mpc").compensators[:3]
    around = replace(shipped_spec("mpc"), compensators=(feedback, FORWARD, *rest))
    signals = run("mass+50", around, 0.3).record.signals
    assert max(signals[name].max() for name in ("pa", "pb")) > 250e5
