"""Frequency response: exact Fourier pieces, and a stepped sine that is the Bode plot where the plant is linear."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from controllers.p import P
from workbench.base.errors import InputError
from workbench.base.gain_phase import gain_db, phase_deg
from workbench.engine import Engine
from workbench.linear import equilibrium, linearise
from workbench.linear.crossings import corner_frequency
from workbench.linear.frequency_response import (
    FLAGS,
    first_harmonic,
    held_harmonic,
    linear_response,
    scan,
    stepped_sine,
    stepped_sines,
)
from workbench.loop.describing_function import (
    SinePoint,
    closed_loop_sine,
    closed_loop_sweep,
    sampled_frequencies,
    sweep_frequencies,
)
from workbench.loop.margins import closed_poles, linear_loop
from workbench.loop.sampled_lanes import sampled_lane
from workbench.loop.sampled_loop import SampledLoop
from workbench.plant import build
from workbench.plant.assembly import Assembly
from workbench.rigs.oil import CAVITATES
from workbench.rigs.rig_file import load_rig


def a_plant(name, states, rates, output):
    """A small plant: `rates` and `output` are functions of its states (a dict) and its input."""
    b = Assembly(name, {})
    u = b.input("command", "1", 1.0)
    x = {state: b.state(state, "1", 1.0) for state in states}
    for state, rate in rates(x, u).items():
        b.rate(state, rate)
    b.output(y=output(x), lowest_pressure=CAVITATES + 1 + output(x))
    return b.finish()


@pytest.fixture(scope="module")
def lag():
    """1/(s/100 + 1)^2."""
    return a_plant("lag", "ab", lambda x, u: {"a": 100 * (u - x["a"]), "b": 100 * (x["a"] - x["b"])}, lambda x: x["b"])


def nothing(plant):
    return np.zeros(plant.n), np.zeros(len(plant.inputs))


@given(
    points=st.integers(3, 200),
    amplitude=st.floats(0.1, 10),
    phase=st.floats(-3, 3),
    level=st.floats(-5, 5),
    drift=st.floats(-5, 5),
    over=st.floats(-1, 1),
)
def test_first_harmonic_is_exact_and_removes_level_drift_and_higher_harmonics(
    points, amplitude, phase, level, drift, over
):
    turn = 2 * np.pi * np.arange(points + 1) / points
    third = over * np.cos(3 * turn) if points > 4 else 0  # from five points on the third is another one
    samples = level + drift * turn + amplitude * np.cos(turn + phase) + third
    assert first_harmonic(samples) == pytest.approx(amplitude * np.exp(1j * phase), abs=1e-9 * (1 + points))
    both = first_harmonic(np.column_stack([samples, 2 * samples]))
    assert both == pytest.approx([first_harmonic(samples), 2 * first_harmonic(samples)])


@given(points=st.integers(3, 500), amplitude=st.floats(0.1, 10))
def test_held_harmonic_is_the_integral_over_the_staircase(points, amplitude):
    edges = 2 * np.pi * np.arange(points + 1) / points
    pieces = (np.exp(-1j * edges[:-1]) - np.exp(-1j * edges[1:])) / 1j  # integral of exp(-j turn) over each hold
    coefficient = np.sum(amplitude * np.sin(edges[:-1]) * pieces) / np.pi
    assert held_harmonic(amplitude, points) == pytest.approx(coefficient, rel=1e-9)


@given(where=st.floats(1.01, 9e3), slope=st.floats(1, 60))
def test_a_crossing_is_interpolated_over_log_f(where, slope):
    f = np.geomspace(1, 1e4, 17)
    assert corner_frequency(f, -slope * np.log10(f), -slope * np.log10(where)) == pytest.approx(where, rel=1e-9)


def test_a_crossing_is_the_first_fall():
    f = np.array([1.0, 2.0, 4.0, 8.0, 16.0])
    assert corner_frequency(f, np.array([-5.0, 0.0, -6.0, 0.0, -6.0]), -3.0) == pytest.approx(np.sqrt(8))
    assert corner_frequency(f, np.array([-5.0, -4.0, 0.0, 0.0, 0.0]), -3.0) is None
    assert corner_frequency(f, np.array([0.0, -3.0, -6.0, -7.0, -8.0]), -3.0) == pytest.approx(2.0)


def test_phase_has_no_jumps_and_gain_is_in_decibels():
    f = np.geomspace(0.1, 100, 200)
    response = 1 / (1j * f * (1 + 1j * f) ** 3)
    assert phase_deg(response)[[0, -1]] == pytest.approx([-90 - 3 * np.degrees(np.arctan(0.1)), -358.3], abs=0.1)
    assert np.abs(np.diff(phase_deg(response))).max() < 10
    assert gain_db(np.array([10.0, -0.1j])) == pytest.approx([20, -20])


def test_linear_response_is_in_hertz(lag):
    f = np.array([1.0, 15.9, 100.0])
    model = linearise(lag, equilibrium(lag, command=0.0), outputs=("y",))
    assert linear_response(model, f) == pytest.approx(1 / (2j * np.pi * f / 100 + 1) ** 2, rel=1e-9)


def test_stepped_sine_is_exact_on_a_linear_plant(lag):
    f = np.array([0.7, 5.0, 16.0, 33.0])
    sine = stepped_sine(Engine(lag, 1e-7), *nothing(lag), f, 0.5, ["y"])
    wanted = 1 / (2j * np.pi * f / 100 + 1) ** 2
    assert np.all(sine.settled)
    assert not sine.saturated.any()
    assert not sine.cavitated.any()
    assert np.abs(gain_db(sine.response["y"] / wanted)).max() < 0.02
    assert np.abs(np.angle(sine.response["y"] / wanted, deg=True)).max() < 0.1


def test_stepped_sine_ignores_the_drift_of_an_integrator():
    """1/(s (s/300 + 1)) started where it drifts: the drift is neither gain nor phase."""
    plant = a_plant("integrator", "ab", lambda x, u: {"a": 300 * (u - x["a"]), "b": x["a"]}, lambda x: x["b"])
    f = np.array([1.0, 8.0, 40.0])
    sine = stepped_sine(Engine(plant, 1e-7), np.array([0.3, 0.0]), np.array([0.3]), f, 0.2, ["y"])
    s = 2j * np.pi * f
    ratio = sine.response["y"] * s * (s / 300 + 1)
    assert np.abs(gain_db(ratio)).max() < 0.02
    assert np.abs(np.angle(ratio, deg=True)).max() < 0.1


def test_stepped_sine_of_a_cubic_is_its_describing_function():
    """y' = 1000 (u^3 - y): gain 3 A^2/4 at low frequency."""
    plant = a_plant("cubic", "a", lambda x, u: {"a": 1000 * (u**3 - x["a"])}, lambda x: x["a"])
    for amplitude in (0.1, 2.0):
        sine = stepped_sine(Engine(plant, 1e-7), *nothing(plant), [1.0], amplitude, ["y"])
        assert abs(sine.response["y"][0]) == pytest.approx(0.75 * amplitude**2, rel=2e-3)
        assert sine.amplitude == amplitude


def test_flags_say_what_happened(lag):
    sine = stepped_sine(Engine(lag), *nothing(lag), [1.0, 100.0], 1.2, ["y"], {"y": 1.0})
    assert list(sine.saturated) == [True, False]
    assert list(sine.cavitated) == [True, False]  # here the lowest pressure is 1 + y above that


def test_a_point_that_never_settles_is_flagged():
    """A hardly damped oscillation beside the sine: two cycles never agree within 60."""
    w = 2 * np.pi * 9.7
    plant = a_plant(
        "bell", "ab", lambda x, u: {"a": x["b"], "b": w * w * (u - x["a"]) - 2e-4 * w * x["b"]}, lambda x: x["a"]
    )
    sine = stepped_sine(Engine(plant), np.array([1.0, 0.0]), np.zeros(1), [7.0], 0.01, ["y"])
    assert list(sine.settled) == [False]
    assert list(sine.cycles) == [60]


def test_a_failed_simulation_is_said(lag):
    engine = Engine(lag)
    with pytest.raises(InputError, match=r"lag: the simulation failed at 3 Hz, amplitude 0\.5; try a smaller one"):
        stepped_sine(engine, np.full(2, np.nan), np.zeros(1), [3.0], 0.5, ["y"])


def test_a_scan_refines_the_corners(lag):
    f = np.geomspace(1, 100, 7)
    sine = scan(Engine(lag, 1e-6), *nothing(lag), f, 0.5, "y")
    assert np.all(np.diff(sine.f) > 0)
    assert set(f) <= set(sine.f)
    assert len(sine.f) == len(sine.response["y"]) == len(sine.settled) == len(sine.cycles)
    gain = np.abs(1 / (2j * np.pi / 100 + 1) ** 2)
    corner = 100 / (2 * np.pi) * np.sqrt(10**0.15 / gain - 1)
    response = sine.response["y"]
    assert corner_frequency(sine.f, gain_db(response / np.abs(response[0])), -3.0) == pytest.approx(corner, rel=1e-3)
    assert corner_frequency(sine.f, phase_deg(response), -90.0) == pytest.approx(100 / (2 * np.pi), rel=1e-3)


@pytest.fixture(scope="module")
def valve(valve_bench):
    return Engine(valve_bench), equilibrium(valve_bench, command=0.0)


def test_at_a_tiny_amplitude_the_valve_is_its_linear_model(valve, valve_bench):
    engine, rest = valve
    f = np.array([5.0, 30.0, 80.0, 120.0, 200.0])
    sine = stepped_sine(engine, rest.x, rest.u, f, 1e-5, ["flow", "spool"], {"flapper": 1e-6})
    for name in ("flow", "spool"):
        ratio = sine.response[name] / linear_response(linearise(valve_bench, rest, outputs=(name,)), f)
        assert np.abs(gain_db(ratio)).max() < 0.05
        assert np.abs(np.angle(ratio, deg=True)).max() < 0.5
    assert np.all(sine.settled)
    assert not sine.saturated.any()


def test_sines_of_many_plants_are_those_one_by_one_and_a_failure_is_its_own(valve, valve_bench):
    engine, rest = valve
    p = np.tile(valve_bench.p, (4, 1))
    p[:, valve_bench.parameters.index("Kp")] *= (0.5, 1.0, 2.0, 1.0)
    start = np.array([rest.x, rest.x, rest.x, np.full_like(rest.x, np.nan)])
    f, lanes = np.tile([20.0, 90.0], 4), np.repeat(np.arange(4), 2)
    sines = stepped_sines(engine, start[lanes], rest.u, f, 1.0, ["flow"], None, p[lanes])
    for lane in range(3):
        alone = stepped_sine(engine, rest.x, rest.u, [20.0, 90.0], 1.0, ["flow"], p=p[lane])
        ratio = sines.response["flow"][lanes == lane] / alone.response["flow"]
        assert np.abs(ratio - 1).max() < 1e-9
        assert np.array_equal(sines.cycles[lanes == lane], alone.cycles)
    assert np.isnan(sines.response["flow"][lanes == 3]).all()
    assert not sines.settled[lanes == 3].any()


def test_at_full_amplitude_the_flapper_meets_its_nozzle(rig, valve):
    engine, rest = valve
    limits = {"flapper": rig["xo"], "current": rig["imax"]}
    full, quarter = (stepped_sine(engine, rest.x, rest.u, [30.0, 200.0], a, ["flow"], limits) for a in (1.0, 0.25))
    assert list(full.saturated) == [False, True]
    assert not quarter.saturated.any()


@given(st.floats(0.1, 2), st.floats(5, 200), st.integers(3, 30))
def test_sampled_frequencies_are_whole_numbers_of_samples(low, high, count):
    f = sampled_frequencies(low, high, count, 1e-3)
    samples = 1 / (f * 1e-3)
    assert samples == pytest.approx(np.round(samples))
    assert np.all(np.diff(f) > 0)
    assert len(f) <= count
    assert f[[0, -1]] == pytest.approx([low, high], rel=0.1)


def test_at_a_tiny_amplitude_the_closed_loop_is_its_linear_model(rig, plant, engine, rest):
    """Position loop, reference to position, against the sampled linear loop at the same frequencies."""
    period = rig.period.value

    def make():
        return P(P.Design(gain=0.24), period)

    f = sampled_frequencies(0.5, 20, 4, period)
    sine = closed_loop_sine(engine, rig, make, rest, f, 1e-5)
    linear = linear_loop(plant, rest, make(), period)
    assert linear.closed is not None
    there = np.exp(np.interp(np.log(f), np.log(linear.f), np.log(linear.closed)))
    ratio = sine.response["position"] / there
    assert np.abs(gain_db(ratio)).max() < 0.05
    assert np.abs(np.angle(ratio, deg=True)).max() < 0.5
    assert np.all(sine.settled)
    assert not sine.saturated.any()


def test_a_closed_loop_point_that_trips_is_not_a_number(rig, engine, rest):
    """A reference of half a metre leaves the allowed stroke."""
    fits, trips = (
        closed_loop_sine(engine, rig, lambda: P(P.Design(gain=0.24), 1e-3), rest, [0.5], size) for size in (0.1, 0.5)
    )
    assert np.isfinite(fits.response["position"]).all()
    assert np.isnan(trips.response["position"]).all()
    assert not trips.settled.any()


def test_a_closed_loop_point_is_flagged_where_the_drive_has_no_more_current(rig):
    """The guard lets every command pass; a drive with a tenth of its rated current cannot follow the large one."""
    weak = rig.with_values(isat=0.1)
    plant = build(weak)
    at, drive = equilibrium(plant), Engine(plant)
    small, large = (
        closed_loop_sine(drive, weak, lambda g=gain: P(P.Design(gain=g), 1e-3), at, [50.0], 0.1) for gain in (0.24, 5)
    )
    assert not small.saturated.any()
    assert large.saturated.all()


@pytest.mark.parametrize("amplitude", [0.01, 0.235])  # some points of the large one meet a limit, others trip
def test_points_in_lanes_are_those_of_the_loop_in_python(rig, engine, rest, amplitude):
    design, f = P.Design(gain=5.0), np.array([0.8, 2.0, 5.0, 20.0, 50.0])
    sine = closed_loop_sine(engine, rig, lambda: P(design, 1e-3), rest, f, amplitude)
    for i, frequency in enumerate(f):
        point = SinePoint(rig, "position", frequency, rig["xmid"], amplitude)
        loop = SampledLoop(engine, rig, P(design, 1e-3), rest, compiled=False)
        while not point.done:
            run = loop.run(point.reference)
            if run.tripped:
                point.trip()
            else:
                point.end_block(run.record.signals, run.record.signals["command"], run.demanded)
        assert sine.response["position"][i] == pytest.approx(point.response, abs=1e-6, nan_ok=True)
        flags = [getattr(sine, name)[i] for name in FLAGS]
        assert flags == [getattr(point, name) for name in FLAGS]
    assert np.isnan(sine.response["position"]).any() == (amplitude > 0.1)
    assert sine.saturated.any() == (amplitude > 0.1)


def test_a_sweep_looks_at_the_mode_that_an_even_one_passes_by():
    """P at 0.24 1/m: a peak at 27 Hz between two points of an even sweep, whose gains are far lower."""
    rig = load_rig("jack-10t")
    plant = build(rig)
    engine, rest, law = Engine(plant), equilibrium(plant), P(P.Design(gain=0.24), 1e-3)
    poles = closed_poles(sampled_lane(plant, rest, 1e-3), law)
    f = sweep_frequencies(0.1, 50.0, 20, 1e-3, poles)
    assert np.allclose(np.round(1 / (f * 1e-3)) * 1e-3, 1 / f)  # whole samples
    sweep = closed_loop_sweep(engine, rig, lambda: P(P.Design(gain=0.24), 1e-3), rest, f, 2.4e-3)
    gain, even = gain_db(sweep.response["position"]), sampled_frequencies(0.1, 50.0, 20, 1e-3)
    band = (sweep.f > 20) & (sweep.f < 40)
    assert sweep.f[band][np.argmax(gain[band])] == pytest.approx(27.3, rel=0.03)
    coarse = np.isin(np.round(1 / sweep.f, 6), np.round(1 / even, 6))
    assert gain[band].max() > gain[band & coarse].max() + 5
    steps = np.abs(np.diff(gain[sweep.f < 20]))
    assert steps.max() < 3
