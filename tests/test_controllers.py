"""What every controller promises, and what each is said to be. A new controller joins by one line of CONTROLLERS."""

import math
import re
from dataclasses import MISSING, fields
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from workbench.base.errors import InputError
from workbench.base.signals import SIGNALS
from workbench.base.table import ConfigTable
from workbench.base.units import to_si
from workbench.commands.common.step_experiment import StepConfig
from workbench.commands.run.options import load_config
from workbench.control.controller_spec import controller_spec

PERIOD = 1e-3  # s
EXPERIMENTS = Path(__file__).parents[1] / "experiments"
PRESSURE = {"use": "controllers.pressure:PressureFeedback", "gain": (2e-9, "1/Pa"), "corner": (1, "Hz")}
JACK = {
    "velocity_gain": (7.4, "m/s"), "jack_frequency": (31.6, "Hz"), "jack_damping": (0.357, "1"),
    "valve_frequency": (93.8, "Hz"), "valve_damping": (0.545, "1"), "delay": (0.824, "ms"),
}  # fmt: skip
CONTROLLERS = {
    "p": {"use": "controllers.p:P", "gain": (0.24, "1/m")},
    "pid-lead": {
        "use": "controllers.pid_lead:PidLead", "gain": (0.23, "1/m"), "integral_time": (0.5, "s"),
        "derivative_time": (10, "ms"), "derivative_filter": (5, "1"), "lead_time": (5, "ms"), "lead_ratio": (4, "1"),
    },
    "pid-lead, pi": {"use": "controllers.pid_lead:PidLead", "gain": (0.5, "1/m"), "integral_time": (50, "ms")},
    "fractional-pid": {
        "use": "controllers.fractional_pid:FractionalPid", "gain": (0.23, "1/m"), "integral_time": (0.5, "s"),
        "integral_order": (0.7, "1"), "derivative_time": (10, "ms"), "derivative_order": (0.8, "1"),
    },
    "fractional-pid, beyond one": {
        "use": "controllers.fractional_pid:FractionalPid", "gain": (0.5, "1/m"), "integral_time": (0.2, "s"),
        "integral_order": (1.3, "1"), "derivative_time": (10, "ms"), "derivative_order": (1.2, "1"),
    },
    "p-dp": {"use": "controllers.p:P", "gain": (4, "1/m"), "compensators": [PRESSURE]},
    "tvc": {
        "use": "controllers.tvc:Tvc", "bandwidth": (5, "Hz"), "mode_frequency": (28, "Hz"), "mode_damping": (0.4, "1"),
        "velocity_gain": (7.1, "m/s"), "jack_frequency": (27.4, "Hz"), "jack_damping": (0.02, "1"),
        "reference_corner": (30, "Hz"), "crossover": (5, "Hz"),
    },
    "crone1": {"use": "controllers.crone1:Crone1", **JACK, "compensators": [PRESSURE]},
    "crone1, with integral": {"use": "controllers.crone1:Crone1", **JACK, "integral": (0.5, "Hz")},
    "crone2": {"use": "controllers.crone2:Crone2", **JACK, "phase_margin": (65, "deg"), "compensators": [PRESSURE]},
    "crone2, with integral": {"use": "controllers.crone2:Crone2", **JACK, "integral": (0.3, "Hz")},
    "crone3": {"use": "controllers.crone3:Crone3", **JACK, "imaginary": (0.3, "1"), "compensators": [PRESSURE]},
    "lqg": {"use": "controllers.lqg:Lqg", **JACK, "inertia": (2.14e5, "Pa s^2/m"), "error": (80, "mm")},
    "pi on force, all around it": {
        "use": "controllers.pid_lead:PidLead", "gain": (4, "1/m"), "integral_time": (50, "ms"),
        "stiffness": (1e7, "N/m"), "compensators": [
            {"use": "controllers.acceleration:AccelerationFeedback", "gain": (1e-3, "s^2/m")},
            {"use": "controllers.feedforward:FeedForward", "velocity": (0.1, "s/m"), "acceleration": (1e-3, "s^2/m")},
            PRESSURE,
            {"use": "controllers.shaping:Shaping", "corner": (40, "Hz"), "lead": (10, "ms")},
        ],
    },
}  # fmt: skip
SIZE = {"m": 0.1, "m/s": 1.0, "m/s^2": 10.0, "Pa": 1e7, "N": 1e4, "A": 0.02, "1": 1.0}  # of a signal, by its SI unit


def table(name):
    """The controller's table as a config has it."""
    return spelled(CONTROLLERS[name])


def spelled(numbers):
    """Pairs as {value, unit}, also in the tables of compensators."""
    as_config = {tuple: lambda pair: {"value": pair[0], "unit": pair[1]}, list: lambda parts: [*map(spelled, parts)]}
    return {key: as_config.get(type(entry), str)(entry) for key, entry in numbers.items()}


def make(name):
    return controller_spec(name, ConfigTable(table(name), name)).build(PERIOD)


every = pytest.mark.parametrize("name", CONTROLLERS)
part = st.floats(-1, 1)
seed = st.integers(0, 10**6)


def size(signal):
    return SIZE[SIGNALS[signal].si]


def signals(random, measures):
    """A reference and a measurement of what a controller measures, anywhere."""
    measured = {signal: size(signal) * random.uniform(-1, 1) for signal in measures}
    return size(measures[0]) * random.uniform(-1, 1), measured


def at_rest(measures):
    return 0.0, dict.fromkeys(measures, 0.0)


@every
def test_it_says_what_it_is(name):
    controller, design = make(name), controller_spec(name, ConfigTable(table(name), name)).design
    assert type(controller).__doc__
    assert set(controller.measures) <= set(SIGNALS)
    for entry in fields(design):
        assert entry.metadata["low"] < entry.metadata["high"]
        assert entry.metadata["meaning"]
        to_si(1.0, entry.metadata["unit"], entry.metadata["unit"])
        if entry.default is not MISSING:
            assert entry.metadata["low"] <= entry.default <= entry.metadata["high"]


@every
def test_its_linear_view_is_sampled_and_named(name):
    controller = make(name)
    law = controller.linear()
    assert law.input_labels == ["reference", *controller.measures]
    assert law.output_labels == ["command"]
    assert law.dt == PERIOD


@every
@given(seed)
def test_its_linear_view_is_what_it_computes(name, seed):
    """With nothing limited, the recursion of compute and update is the state space, from rest."""
    controller, random = make(name), np.random.default_rng(seed)
    law = controller.linear()
    a, b, c, d = (np.asarray(part) for part in (law.A, law.B, law.C, law.D))
    x, demanded, wanted = np.zeros(len(a)), [], []
    controller.reset(*at_rest(controller.measures), 0.0)
    for _ in range(40):
        reference, measured = signals(random, controller.measures)
        u = np.array([reference, *(measured[signal] for signal in controller.measures)])
        demanded.append(controller.compute(reference, measured))
        controller.update(demanded[-1])
        wanted.append((c @ x + d @ u).item())
        x = a @ x + b @ u
    assert demanded == pytest.approx(wanted, rel=1e-10, abs=1e-10 * max(1.0, np.abs(wanted).max()))


@every
@given(seed, st.floats(-1, 1))
def test_it_starts_without_a_bump(name, seed, command):
    controller, random = make(name), np.random.default_rng(seed)
    for _ in range(2):  # and forgets what was before
        reference, measured = signals(random, controller.measures)
        controller.reset(reference, measured, command)
        assert controller.compute(reference, measured) == pytest.approx(command, abs=1e-9)
        controller.update(command)
        controller.compute(0.01, measured)
        controller.update(-1.0)


@every
@given(st.floats(-1, 1), part)
def test_at_rest_it_holds_its_command(name, command, where):
    """Reference and signals as at the reset: the command stays, for as long as one likes."""
    controller = make(name)
    measured = {signal: where * size(signal) for signal in controller.measures}
    reference = measured[controller.measures[0]]
    controller.reset(reference, measured, command)
    for _ in range(50):
        demanded = controller.compute(reference, measured)
        controller.update(demanded)
    assert demanded == pytest.approx(command, abs=1e-9)


@every
@given(seed)
def test_compute_changes_nothing(name, seed):
    asked, plain, random = make(name), make(name), np.random.default_rng(seed)
    for controller in (asked, plain):
        controller.reset(*at_rest(controller.measures), 0.1)
    for _ in range(5):
        reference, measured = signals(random, plain.measures)
        before = dict(measured)
        first = asked.compute(reference, measured)
        asked.compute(*signals(random, plain.measures))
        assert asked.compute(reference, measured) == first
        assert measured == before
        assert plain.compute(reference, measured) == first
        for controller in (asked, plain):
            controller.update(min(1.0, max(-1.0, first)))


@pytest.mark.parametrize("name", [name for name in CONTROLLERS if name != "tvc"])  # whose states ask no command
@pytest.mark.parametrize("sign", [1, -1])
def test_long_saturation_does_not_wind_it_up(name, sign):
    """Five seconds against a limit; then the error passes through zero, and the command is off the limit in 5 ms."""
    controller = make(name)
    reference, measured = at_rest(controller.measures)
    controller.reset(reference, measured, 0.0)
    reach = sign * size(controller.measures[0])
    while abs(controller.compute(reach, measured)) < 0.2:
        reach *= 1.1
        assert abs(reach) < 1e6
    reach *= 3
    held = [drive(controller, reach, measured, 0.1) for _ in range(5000)]
    assert held[-1] == 0.1 * sign
    after = [drive(controller, share * reach, measured, 0.1) for share in np.linspace(1, -1, 201)]
    assert max(sign * command for command in after[105:]) < 0.1


def drive(controller, reference, measured, limit):
    """One period with a drive that gives no more than a limit."""
    demanded = controller.compute(reference, measured)
    assert math.isfinite(demanded)
    realised = min(limit, max(-limit, demanded))
    controller.update(realised)
    return realised


@every
def test_two_of_a_kind_share_nothing(name):
    one, other = make(name), make(name)
    for controller in (one, other):
        controller.reset(*at_rest(controller.measures), 0.0)
    _, measured = at_rest(one.measures)
    before = other.compute(0.01, measured)
    for _ in range(20):
        one.update(one.compute(0.05, measured))
    assert other.compute(0.01, measured) == before


@given(where=st.floats(1e-3, 0.49), design=st.tuples(st.floats(0.01, 2), st.floats(0.01, 10), st.floats(0, 0.1)))
@pytest.mark.parametrize("lead", [(0.0, 1.0), (0.62e-3, 9.6), (0.05, 1.0), (0.02, 3.0)])
def test_pid_lead_is_its_docstring(where, design, lead):
    """K (1 + 1/(Ti s) + Td s/(Td/N s + 1)) (1 + T s)/(1 + T s/a), exactly, at the s that Tustin's rule puts for z."""
    (gain, ti, td), (t, a), n = design, lead, 5.5
    numbers = {"gain": (gain, "1/m"), "integral_time": (ti, "s"), "derivative_time": (td, "s")}
    numbers |= {"derivative_filter": (n, "1"), "lead_time": (t, "s"), "lead_ratio": (a, "1")}
    entries = {key: {"value": value, "unit": unit} for key, (value, unit) in numbers.items()}
    law = (
        controller_spec("x", ConfigTable({"use": "controllers.pid_lead:PidLead", **entries}, "x"))
        .build(PERIOD)
        .linear()
    )
    z = np.exp(2j * np.pi * where)
    s = 2 / PERIOD * (z - 1) / (z + 1)
    wanted = gain * (1 + 1 / (ti * s) + td * s / (td / n * s + 1)) * (1 + t * s) / (1 + t * s / a)
    assert np.asarray(law(z)).ravel() == pytest.approx([wanted, -wanted], rel=1e-9)


def test_no_controller_of_the_experiments_rings_from_sample_to_sample():
    config = load_config(EXPERIMENTS / "position_step.toml")
    assert isinstance(config, StepConfig)
    for chosen in config.controllers:
        poles = chosen.build(config.rig.period.value).linear().poles()
        assert np.all(poles.real > -0.2), chosen.name


def test_p_is_its_docstring():
    controller = make("p")
    controller.reset(0.0, {"position": 0.0}, 0.0)
    assert controller.compute(0.02, {"position": 0.005}) == pytest.approx(0.24 * 0.015)


@pytest.mark.parametrize("derivative_time", [1e-5, 1e-7])
def test_pid_lead_stays_finite_against_a_limit_for_every_allowed_design(derivative_time):
    numbers = {"gain": (1.0, "1/m"), "integral_time": (0.01, "s"), "derivative_time": (derivative_time, "s")}
    entries = {key: {"value": value, "unit": unit} for key, (value, unit) in numbers.items()}
    controller = controller_spec("x", ConfigTable({"use": "controllers.pid_lead:PidLead", **entries}, "x")).build(
        PERIOD
    )
    controller.reset(0.0, {"position": 0.0}, 0.0)
    for _ in range(2000):
        drive(controller, 1.0, {"position": 0.0}, 0.1)
    assert abs(controller.compute(1.0, {"position": 0.0})) < 10


GOOD = {"use": "controllers.p:P", "gain": {"value": 0.24, "unit": "1/m"}}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"gain": {"value": 1e4, "unit": "1/m"}}, "gain: 10000 1/m is outside 0.001 to 1000 1/m"),
        ({"gain": {"value": -0.2, "unit": "1/m"}}, "gain: -0.2 1/m is outside 0.001 to 1000 1/m"),
        ({"gain": {"value": 1.0, "unit": "1/um"}}, "gain: 1e+06 1/m is outside"),
        ({"gain": {"value": 0.24, "unit": "1/s"}}, 'gain.unit: unit "1/s" cannot be converted to "1/m"'),
        ({"gain": {"value": 0.24, "unit": "quux"}}, 'gain.unit: unknown unit "quux"'),
        ({"gain": {"value": float("nan"), "unit": "1/m"}}, "must be a finite number"),
        ({"gain": {"value": float("inf"), "unit": "1/m"}}, "must be a finite number"),
        ({"gain": {"value": "0.24", "unit": "1/m"}}, "must be a finite number"),
        ({"gain": {"value": True, "unit": "1/m"}}, "gain.value = True: must be a finite number"),
        ({"gain": {"value": 0.24}}, 'gain.unit: no unit; write unit = "1/m"'),
        ({"gain": 0.24}, 'gain = 0.24: must be a table; write {value = ..., unit = "1/m"}'),
        ({"gian": {"value": 0.24, "unit": "1/m"}}, 'gian: unknown key; did you mean "gain"?'),
        ({"use": "controllers.p"}, 'needs use = "module:Class"'),
        ({"use": 3}, 'needs use = "module:Class"'),
        ({"use": "controllers.q:Q"}, 'use = "controllers.q:Q": No module named'),
        ({"use": "controllers.pressure:PressureFeedback"}, "is a compensator; name it under compensators"),
        ({"compensators": PRESSURE}, "compensators: must be a list of tables; write [[compensators]]"),
        ({"compensators": [{"use": "controllers.p:P"}]}, "is a controller, and stands by itself"),
        ({"compensators": [{"use": "controllers.shaping:Shaping"}]}, "compensators.1.corner: missing"),
        ({"stiffness": {"value": 1, "unit": "N/m"}}, "stiffness: 1 N/m is outside 1000 to 1e+10 N/m"),
        ({"use": "controllers.p:Q"}, 'use = "controllers.p:Q": module controllers.p has no class Q'),
    ],
)
def test_a_mistake_in_a_config_is_named(change, message):
    with pytest.raises(InputError, match=r"^here: .*" + re.escape(message)) as caught:
        controller_spec("p", ConfigTable(GOOD | change, "here"))
    assert "\n" not in str(caught.value)


def test_a_missing_number_is_named():
    with pytest.raises(InputError, match=re.escape("here: gain: missing (command per position error, in 1/m)")):
        controller_spec("p", ConfigTable({"use": "controllers.p:P"}, "here"))


@pytest.mark.parametrize("use", ["math:pi", "controllers.p:Mapping", ":P", ".p:P"])
def test_what_is_no_controller_is_refused(use):
    with pytest.raises(InputError, match=r"^here: use = ") as caught:
        controller_spec("p", ConfigTable({"use": use}, "here"))
    assert "\n" not in str(caught.value)


def test_design_numbers_are_si():
    read = controller_spec("p", ConfigTable({"use": "controllers.p:P", "gain": "0.24e-3 1/mm"}, "here"))
    assert read.design.gain == pytest.approx(0.24)
    assert (read.name, read.use) == ("p", "controllers.p:P")
