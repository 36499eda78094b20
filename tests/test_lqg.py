"""LQG: an optimum, by the separation of its poles, without offset, and a stable loop on the jack."""

import control
import numpy as np
import pytest
from made_loops import run_loop

from controllers.lqg import Lqg
from workbench.control.jack_model import fit_jack_model
from workbench.linear import discretise
from workbench.loop.margins import linear_loop
from workbench.loop.step_metrics import overshoot, settling_time

PERIOD = 1e-3
INERTIA = 1000 / 4.67e-3  # Pa s^2/m: the rig's mass over its area


@pytest.fixture(scope="module")
def design(plant, moving):
    model = fit_jack_model(discretise(plant, moving, PERIOD))
    return Lqg.Design(**vars(model), inertia=INERTIA, error=0.08)


@pytest.fixture(scope="module")
def own(design):
    """The plant that the design is for: command -> position, pa, pb."""
    jack = design.discretise(PERIOD)
    rows = np.array([[1, 0], [0, INERTIA / 2], [0, -INERTIA / 2]])
    return control.StateSpace(jack.A, jack.B, rows @ np.asarray(jack.C), 0, PERIOD)


def closed(plant, law, command=0.0, pressure=0.0, reference=1.0, seconds=8.0):
    """The position in the linear loop under a constant reference, command offset and pressure offset, every second."""
    (a, b, c, _), (ac, bc, cc, dc) = (tuple(np.asarray(getattr(s, part)) for part in "ABCD") for s in (plant, law))
    x, xc, found = np.zeros(len(a)), np.zeros(len(ac)), []
    for k in range(round(seconds / PERIOD) + 1):
        y = c @ x + [0, pressure / 2, -pressure / 2]
        seen = np.append(reference, y)
        if k % round(1 / PERIOD) == 0:
            found.append(y[0])
        u = cc @ xc + dc @ seen + command
        x, xc = a @ x + b @ u, ac @ xc + bc @ seen
    return np.array(found)


def test_its_loop_has_the_poles_of_feedback_and_filter(design, own):
    """Separation: on its own model each pole is one of the optimal feedback's or one of the filter's."""
    controller = Lqg(design, PERIOD)
    jack = design.discretise(PERIOD)
    a, b, c = (np.asarray(part) for part in (jack.A, jack.B, jack.C))
    feedback = control.dlqr(a, b, np.outer(c[0], c[0]) / design.error**2, np.eye(1))[2]
    law = controller.linear()
    ac, bc, cc, dc = (np.asarray(part) for part in (law.A, law.B, law.C, law.D))
    rows = np.asarray(own.C)
    whole = np.block([[a + b @ dc[:, 1:] @ rows, b @ cc], [bc[:, 1:] @ rows, ac]])
    poles = np.linalg.eigvals(whole)
    assert np.abs(poles).max() < 1
    for pole in feedback[np.abs(feedback) > 0.1]:
        assert np.abs(poles - pole).min() < 1e-6


def test_a_dearer_error_is_followed_faster(design, own):
    def slowest(error):
        law = Lqg(Lqg.Design(**{**vars(design), "error": error}), PERIOD).linear()
        return abs(closed(own, law, seconds=1.0)[1] - 1)

    assert slowest(0.08) < slowest(2.0) < slowest(10.0)


def test_neither_a_command_nor_a_load_leaves_an_offset(design, own):
    law = Lqg(design, PERIOD).linear()
    assert closed(own, law)[-1] == pytest.approx(1, abs=1e-6)
    assert closed(own, law, command=0.01)[-1] == pytest.approx(1, abs=1e-4)
    assert closed(own, law, pressure=1e6, reference=0.01)[-1] == pytest.approx(0.01, abs=1e-5)


def test_it_is_stable_at_null_and_moving(plant, rest, moving, design):
    """At null the gain is twice that of the model, which is of the moving jack."""
    for about in (rest, moving):
        assert linear_loop(plant, about, Lqg(design, PERIOD), PERIOD).ms < 1.6


def test_it_settles_10_mm_in_80_ms(engine, rig, rest, design):
    run = run_loop(engine, rig, Lqg(design, PERIOD), rest, np.full(1001, 0.01))
    t, y = run.record.t, run.record.signals["position"]
    assert settling_time(t, y, 0.01, 2e-4) < 0.08
    assert overshoot(y, 0.0, 0.01) < 5
