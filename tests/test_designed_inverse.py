"""The inverse before a loop and what it promises; a loop that closes through its reference, linear and simulated."""

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigvals

from workbench.base.errors import InputError
from workbench.commands.run.options import load_config
from workbench.control.compensators import compensated
from workbench.control.controller_type import controller
from workbench.linear.interconnect import select
from workbench.linear.state_space import StateSpace, state_space, transfer_function, tustin
from workbench.loop.designed_inverse import designed_inverse, outer_loop
from workbench.loop.rig_variations import variation, with_delay
from workbench.loop.rows import linear_loops, loop_setup
from workbench.loop.sampled_loop import SampledLoop

PERIOD = 1e-3
TUNED = Path(__file__).parents[1] / "experiments/position_tuned.toml"
LOOP = controller("controllers.p:P", gain=3.5) + controller(
    "controllers.pressure:PressureFeedback", gain=1.6e-9, corner=0.25
)


@pytest.fixture(scope="module")
def setups(rig):
    return {name: loop_setup(with_delay(variation(rig, name), 3e-4)) for name in ("nominal", "beta-50", "mass+50")}


@pytest.fixture(scope="module")
def loops(setups):
    return {name: linear_loops(LOOP, setup) for name, setup in setups.items()}


def moving(reference):
    """A reference of 2 s in 1 to 4 Hz, at rest at both ends."""
    t = np.arange(3000) * PERIOD
    share = np.clip(np.minimum(t - 0.5, 2.5 - t) / 0.5, 0, 1)
    return reference * share * (np.sin(2 * np.pi * 1.3 * t) + 0.5 * np.sin(2 * np.pi * 3.7 * t))


def test_the_gain_at_rest_is_one_and_the_response_that_of_the_taps(loops):
    inverse = designed_inverse([loops["nominal"].null], PERIOD, 40, 200)
    assert inverse.taps.sum() == pytest.approx(1.0, abs=1e-12)
    assert inverse.response(np.array([0.0])) == pytest.approx(1.0, abs=1e-12)
    f = np.array([0.5, 3.0, 20.0, 300.0])
    law = inverse.law(np.exp(2j * np.pi * f * PERIOD))
    assert law * np.exp(2j * np.pi * f * PERIOD * 40) == pytest.approx(inverse.response(f), rel=1e-9)


def test_it_is_the_least_squares_of_its_own_sum(loops):
    """Any other taps with the same sum are worse."""
    from workbench.loop.designed_inverse import BAND, FAINT

    null = loops["nominal"].null
    inverse = designed_inverse([null], PERIOD, 30, 80)
    f = np.linspace(0, 500, 4001)
    closed = np.interp(f, null.f, null.closed)
    z = np.exp(2j * np.pi * f * PERIOD)
    shifted = z[:, None] ** (30 - np.arange(80))

    def cost(taps):
        h = shifted @ taps
        return np.mean(np.abs(1 - h * closed) ** 2 / (1 + (f / BAND) ** 4) + FAINT**2 * np.abs(h) ** 2)

    random = np.random.default_rng(0)
    for _ in range(20):
        other = random.standard_normal(80)
        assert cost(inverse.taps + 1e-2 * (other - other.mean())) > cost(inverse.taps)


def test_its_gain_is_bounded_where_that_of_zero_phase_error_tracking_is_not(rig):
    """Which cancels all poles and zeros but those outside the unit circle, whose phase it undoes (Tomizuka, 1987)."""
    (spec,) = (each for each in load_config(TUNED).controllers if each.name == "p-dp")
    setup = loop_setup(with_delay(rig, 3e-4))
    null = linear_loops(spec, setup).null
    outside = [z for z in zeros(select(setup.null_plant.model, ["command"], ["position"])) if abs(z) > 1]  # the loop's
    assert np.sort(outside) == pytest.approx([-479.5, -10.345, -1.869], rel=1e-3)
    f = np.array([5.0, 15.0, 60.0])
    z = np.exp(2j * np.pi * f * PERIOD)[:, None]
    zero_phase = np.prod(np.abs(z - outside) ** 2 / np.abs(1 - np.array(outside)) ** 2, axis=1)
    assert np.abs(1 - zero_phase[:2]) == pytest.approx([0.0003, 0.0027], rel=0.05)
    inverse = designed_inverse([null], PERIOD, 80, 300)
    assert np.interp(f[:2], null.f, np.abs(inverse.left(null))) == pytest.approx([0.002, 0.194], rel=0.1)
    gains = np.abs([zero_phase / np.interp(f, null.f, null.closed), inverse.response(f)])
    assert gains[:, 0] == pytest.approx(1.47, rel=0.01)
    assert gains[:, 2] == pytest.approx([320, 0.061], rel=0.02)


def zeros(system):
    """Finite zeros of a state space."""
    n = len(system.A)
    left = np.block([[system.A, system.B], [system.C, system.D]])
    roots = eigvals(left, np.diag([1.0] * n + [0.0]))
    return roots[np.isfinite(roots)]


def test_it_undoes_the_lag_on_plants_that_it_was_designed_on_and_on_others(loops):
    inverse = designed_inverse([loops[name].null for name in ("nominal", "beta-50")], PERIOD, 80, 300)
    for name in ("nominal", "beta-50", "mass+50"):
        null = loops[name].null
        band = (null.f > 0.5) & (null.f < 5.0)
        assert np.abs(inverse.left(null)[band]).max() < 0.15
        assert np.abs(1 - null.closed[band]).max() > 0.5


def test_the_jack_follows_a_moving_reference_better_by_a_factor_of_three(setups, loops):
    inverse = designed_inverse([loops["nominal"].null, loops["nominal"].moving], PERIOD, 80, 300)
    reference = moving(0.02)
    for name, setup in setups.items():
        errors = []
        for drive in (reference, inverse.filtered(reference)):
            run = SampledLoop(setup.engine, setup.rig, LOOP.build(PERIOD), setup.null, seed=1).run(drive)
            assert run.tripped is None
            errors.append(np.sqrt(np.mean((run.record.signals["position"] - reference) ** 2)))
        assert errors[1] < errors[0] / 3, name


def test_as_a_compensator_it_is_late_by_its_preview(setups, loops):
    inverse = designed_inverse([loops["nominal"].null], PERIOD, 40, 120)
    setup, reference = setups["nominal"], moving(0.02)
    law = compensated(LOOP.build(PERIOD), inverse)
    late = SampledLoop(setup.engine, setup.rig, law, setup.null).run(reference).record.signals["position"]
    drive = inverse.filtered(reference)
    known = SampledLoop(setup.engine, setup.rig, LOOP.build(PERIOD), setup.null).run(drive).record.signals["position"]
    assert late[40:] == pytest.approx(known[:-40], abs=1e-6)


def test_a_preview_beyond_the_taps_and_an_unstable_loop_are_refused(rig, loops, setups):
    with pytest.raises(InputError, match="preview of 80 samples"):
        designed_inverse([loops["nominal"].null], PERIOD, 80, 80)
    wild = linear_loops(controller("controllers.p:P", gain=90.0), setups["nominal"])
    with pytest.raises(InputError, match="unstable"):
        designed_inverse([loops["nominal"].null, wild.null], PERIOD, 10, 80)


def substructure(mass, damping, stiffness):
    """What a numerical mass on spring and damper does of the measured force, sampled: force -> reference."""
    a, b, c, d = tustin(transfer_function([-1.0], [mass, damping, stiffness]), PERIOD)
    return state_space(a, b, c, d, PERIOD, ["force"], ["reference"])


@pytest.fixture(scope="module")
def hybrid(rig):
    return loop_setup(with_delay(rig.with_values(ks=1e6, cs=1e3), 3e-4))


def simulated(setup, outer: StateSpace, seconds, inverse=None):
    """Position after a push at the start, the reference made of the measured force sample by sample."""
    through = inverse.law if inverse else None
    loop = SampledLoop(setup.engine, setup.rig, LOOP.build(PERIOD), setup.null, compiled=False)
    x, taps, position, force = np.zeros(len(outer.A)), np.zeros(0), [], 0.0
    taps = np.zeros(0 if through is None else len(through.A))
    for k in range(round(seconds / PERIOD)):
        heard = force + (1e3 if k < 50 else 0.0)
        reference = float((outer.C @ x + outer.D[:, 0] * heard)[0])
        x = outer.A @ x + outer.B[:, 0] * heard
        if through is not None:
            reference, taps = (
                float((through.C @ taps + through.D[:, 0] * reference)[0]),
                through.A @ taps + through.B[:, 0] * reference,
            )
        run = loop.run(np.array([reference]))
        position.append(float(run.record.signals["position"][0]))
        force = float(setup.engine.observe(loop._x, loop._held)[setup.engine.plant.output("force")])
    return np.array(position)


def test_an_outer_loop_is_unstable_although_every_inner_margin_is_fine(hybrid):
    inner = linear_loops(LOOP, hybrid)
    assert inner.stable
    assert inner.worst(max, "ms") < 2.2
    assert inner.worst(min, "gain_margin_db") > 6
    slow, damped = substructure(6e3, 2e3, 1e5), substructure(6e3, 2e5, 1e5)
    law = LOOP.build(PERIOD)
    unstable, stable = (outer_loop(hybrid.null_plant, law, outer) for outer in (slow, damped))
    assert unstable.stable is False
    assert unstable.ms is None
    assert stable.stable
    assert stable.ms is not None
    late = simulated(hybrid, slow, 2.5)
    assert np.ptp(late[-700:]) > 1.5 * np.ptp(late[500:1200])
    calm = simulated(hybrid, damped, 2.5)
    assert np.ptp(calm[-700:]) < 0.2 * np.ptp(calm[:700])


def test_the_margins_of_an_outer_loop_are_those_of_its_product(hybrid):
    """-G T of the closed loop's own response; without a specimen's force it would be nothing."""
    outer, law = substructure(6e3, 2e5, 1e5), LOOP.build(PERIOD)
    opened = outer_loop(hybrid.null_plant, law, outer)
    z = np.exp(2j * np.pi * opened.f * PERIOD)
    inner = linear_loops(LOOP, hybrid).null
    rows = hybrid.null_plant.rows(["force", "position"])
    force, position = hybrid.null_plant.response.of_outputs(rows).at(z[None])[0]
    closed = np.interp(opened.f, inner.f, inner.closed) * force / position
    product = -outer(z) * closed
    band = opened.f < 50
    assert opened.open[band] == pytest.approx(product[band], rel=2e-3)
    assert opened.ms == pytest.approx(np.abs(1 / (1 + opened.open)).max(), rel=1e-6)


@pytest.mark.parametrize(
    ("numbers", "without", "with_it"),
    [((6e3, 1e4, 1e5), False, True), ((10.0, 1e3, 2e6), True, False)],
    ids=["it takes lag away", "it has gain above its band"],
)
def test_an_inverse_mends_or_ruins_an_outer_loop(hybrid, numbers, without, with_it):
    """A heavy substructure lacks damping for the loop's lag; a quick spring answers to what the inverse amplifies."""
    inner = linear_loops(LOOP, hybrid)
    inverse = designed_inverse([inner.null, inner.moving], PERIOD, 0, 100)
    outer, law = substructure(*numbers), LOOP.build(PERIOD)
    assert outer_loop(hybrid.null_plant, law, outer).stable is without
    assert outer_loop(hybrid.null_plant, law, outer, inverse).stable is with_it
    swings = simulated(hybrid, outer, 2.0, inverse)
    assert bool(np.ptp(swings[-500:]) < 0.5 * np.ptp(swings[:500])) is with_it
