"""The door for Python: an inverse before a loop, and a loop that closes through its reference."""

import control
import numpy as np
import pytest

import workbench as wb
from controllers import P, PressureFeedback
from workbench.base.errors import InputError

LAW = P(gain=3.5) + PressureFeedback(gain="1.6e-4 1/bar", corner="0.25 Hz")


@pytest.fixture(scope="module")
def loop():
    return wb.ClosedLoop(wb.load_rig("jack-10t"), LAW)


def test_a_loop_follows_a_filtered_reference_better(loop):
    inverse = loop.inverse(wb.ClosedLoop(wb.variation(loop.rig, "beta-50"), LAW))
    assert "80 ms ahead" in repr(inverse)
    assert inverse.response(np.array([0.0])) == pytest.approx(1.0)
    assert "gain" in repr(inverse.plot())
    t = np.arange(2000) * 1e-3
    reference = 0.02 * np.sin(np.pi * np.clip((t - 0.4) / 1.2, 0, 1)) ** 4
    errors = [np.ptp(loop.follow(drive)["position"] - reference) for drive in (reference, inverse(reference))]
    assert errors[1] < errors[0] / 3


def test_margins_through_the_reference_take_a_python_control_system(loop):
    hybrid = wb.ClosedLoop(loop.rig.with_values(ks=1e6, cs=1e3), LAW)
    mass = control.ss(control.tf([-1.0], [6e3, 1e4, 1e5]))
    outer = control.sample_system(mass, 1e-3, "tustin")
    outer.input_labels, outer.output_labels = ["force"], ["reference"]
    assert hybrid.margins().ms < 2.2
    assert not hybrid.margins_through(outer).stable
    assert hybrid.margins_through(outer, hybrid.inverse(preview=0, length="100 ms")).null.stable


@pytest.mark.parametrize(
    ("period", "labels", "said"),
    [(1e-3, ("forse", "reference"), "force"), (1e-3, ("force", "position"), "reference"), (2e-3, None, "period")],
)
def test_an_outer_loop_of_other_signals_is_refused(loop, period, labels, said):
    outer = control.ss([0.5], [1.0], [1e-9], [0.0], period)
    outer.input_labels, outer.output_labels = ([name] for name in labels or ("force", "reference"))
    with pytest.raises(InputError, match=said):
        loop.margins_through(outer)


def test_an_unstable_loop_has_no_inverse(loop):
    with pytest.raises(InputError, match="unstable"):
        wb.ClosedLoop(loop.rig, P(gain=90.0)).inverse()


def test_an_inverse_is_judged_on_drawn_plants(loop):
    asked = {"record": "position-sine-5hz", "within": {"M": (0.9, 1.1)}}
    played = wb.inverse(loop, plants=2, **asked)
    assert {row["plants"] for row in played.metrics["plants"]} == {2}
    with pytest.raises(InputError, match=r"inverse: stroke: the record of .* leaves it even from mid stroke"):
        wb.inverse(loop, plants=2, stroke=0.001, **asked)
