"""Policies: of zeros nothing is added, else they run compiled as in Python; their file is numbers, checked."""

import math
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from test_compiled_loop import agree, both, rig_for

from controllers.policy import Policy, PolicyDesign
from workbench.base.errors import InputError
from workbench.commands.run.options import load_config
from workbench.commands.train.start import silent_network
from workbench.control.controller_spec import ControllerSpec
from workbench.control.network import Memory, Network, read_network
from workbench.control.protocol import Controller, graph_law, linear_view

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
P_DP = next(s for s in load_config(EXPERIMENTS / "position_tuned.toml").controllers if s.name == "p-dp")
PERIOD = 1e-3
SILENT = silent_network("position", [0.01, 5e6], [3.0, 30.0], [6], 0.02, PERIOD)
WEIGHTS = np.where(SILENT.are_biases, 0.0, 1.0)


def odd_network(seed: int, size: float = 0.5) -> Network:
    return SILENT.with_numbers(np.random.default_rng(seed).normal(0, size, len(WEIGHTS)) * WEIGHTS)


def deep_network(seed: int, **changes) -> Network:
    """As another trainer might write it: three layers with biases, two past samples of the position and the command,
    pressures over their supply, cut, and clipped."""
    random = np.random.default_rng(seed)
    sizes = [(5, 6), (4, 5), (1, 4)]
    network = Network(
        signals=("position", "pa", "pb"),
        A=np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]),
        B=np.array([[0.0, 100.0, 0.0, 0.0, 0.0], [0.0] * 5, [0.0, 0.0, 0.0, 0.0, 1.0]]),
        C=np.vstack((np.zeros((3, 3)), np.eye(3))),
        D=np.vstack((np.diag([100.0, 100.0, 5e-8, 5e-8])[[0, 1, 2]], np.zeros((3, 4)))),
        shift=np.array([0.0, 0.0, -0.5, 0.0, 0.0, 0.0]),
        bound=2.0,
        layers=tuple((random.normal(0, 0.5, size), random.normal(0, 0.1, size[0])) for size in sizes),
        squash="clip",
        limit=0.02,
        decision=PERIOD,
    )
    return replace(network, **changes)


def remembering(seed: int, steeper: float = 1.0) -> Network:
    """An odd one whose units are made steeper by what it remembers."""
    network = odd_network(seed)
    gates = np.random.default_rng(seed).normal(0, steeper, network.layers[0][0].shape)
    return replace(network, memory=Memory(gates, 1e-3, 1e-4))


def on_p_dp(network: Network) -> ControllerSpec:
    return P_DP + ControllerSpec("policy", "controllers.policy:PolicyOn", PolicyDesign(network))


def signals(seed, k=200):
    random = np.random.default_rng(seed)
    scales = {"position": 5e-3, "pa": 5e5, "pb": 5e5}
    return random.normal(0, 5e-3, k), [{n: random.normal(0, s) for n, s in scales.items()} for _ in range(k)]


def commands(controller: Controller, seed: int, mirrored: bool = False):
    """Along random signals; those of a mirrored jack have the other sign, and its chambers change places."""
    reference, measured = signals(seed)
    controller.reset(0.0, dict.fromkeys(controller.measures, 0.0), 0.0)
    answers = []
    for r, y in zip(reference, measured, strict=True):
        seen = {"position": -y["position"], "pa": y["pb"], "pb": y["pa"]} if mirrored else y
        answers.append(controller.compute(-r if mirrored else r, seen))
        controller.update(answers[-1])
    return np.array(answers)


def test_of_zeros_it_is_the_law_that_it_stands_on():
    base = commands(P_DP.build(PERIOD), 1)
    np.testing.assert_allclose(commands(on_p_dp(SILENT).build(PERIOD), 1), base, atol=1e-12 * np.abs(base).max())


@given(st.integers(0, 1000))
@settings(max_examples=10, deadline=None)
def test_a_mirrored_jack_gets_a_mirrored_command(seed):
    policy = on_p_dp(odd_network(seed)).build(PERIOD)
    np.testing.assert_allclose(commands(policy, seed, True), -commands(policy, seed), atol=1e-12)


def test_with_biases_it_need_not():
    policy = Policy(PolicyDesign(deep_network(0)), PERIOD)
    assert np.abs(commands(policy, 0) + commands(policy, 0, True)).max() > 1e-4


def test_one_that_remembers_is_mirrored_too_and_by_its_formulas():
    """Energies of what it is shown, from 0: even in a motion."""
    network = remembering(3)
    policy = Policy(PolicyDesign(network), PERIOD)
    answers, (reference, measured) = commands(policy, 3), signals(3)
    np.testing.assert_allclose(commands(Policy(PolicyDesign(network), PERIOD), 3, True), -answers, atol=1e-12)
    (w1, _), (w2, _) = network.layers
    past, kept, expected = np.zeros(len(network.A)), np.zeros(w1.shape[1]), []
    for r, y in zip(reference, measured, strict=True):
        s = np.array([r, *y.values()])
        z = network.C @ past + network.D @ s
        steep = np.exp(network.memory.V @ kept / (kept.sum() + network.memory.floor))
        expected.append(network.limit * np.tanh(w2 @ np.tanh(w1 @ z * steep))[0])
        kept += network.memory.forgets * (z**2 - kept)
        past = network.A @ past + network.B @ np.append(s, expected[-1])
    np.testing.assert_allclose(answers, expected, atol=1e-12)


def test_its_linear_view_is_the_one_of_what_it_remembers():
    """At rest nothing is remembered, and the view is that of the units as they are; after a motion they are steeper."""
    network = remembering(2, steeper=2.0)
    law = Policy(PolicyDesign(network), PERIOD).graph_law()
    at = {"position": np.zeros(1), "pa": np.full(1, 7e6), "pb": np.full(1, 7e6), "command": np.zeros(1)}
    kept = np.zeros((1, network.remembers))
    blank = law.linearised_lanes(at)
    for part, same in zip(blank, law.linearised_lanes(at, kept), strict=True):
        np.testing.assert_array_equal(part, same)
    kept[0, 1] = 1.0
    (w1, _), (w2, _) = network.layers
    steep = np.exp(network.memory.V[:, 1] / (1 + network.memory.floor))
    expected = network.limit * (w2 * steep) @ w1 @ network.D
    np.testing.assert_allclose(law.linearised_lanes(at, kept)[3], expected, rtol=1e-9)
    unsteady = replace(network, decision=4 * PERIOD)
    with pytest.raises(InputError, match="decides at every sample"):
        Policy(PolicyDesign(unsteady), PERIOD)


@given(st.integers(0, 1000))
@settings(max_examples=10, deadline=None)
def test_it_adds_its_limit_at_most(seed):
    base, policy = P_DP.build(PERIOD), on_p_dp(odd_network(seed, 50.0)).build(PERIOD)
    reference, measured = signals(seed, 5)
    for r, y in zip(reference, measured, strict=True):
        for law in (base, policy):
            law.reset(0.0, dict.fromkeys(law.measures, 0.0), 0.0)
        assert abs(policy.compute(r, y) - base.compute(r, y)) <= 0.02 + 1e-12


@pytest.mark.parametrize("hold", [1, 4])
def test_by_itself_it_is_its_formulas(hold):
    """Against the formulas of the module, written out once more, with decisions held."""
    network = deep_network(5, decision=hold * PERIOD)
    answers, (reference, measured) = commands(Policy(PolicyDesign(network), PERIOD), 5), signals(5)
    past, decided = np.zeros(3), []
    (w1, b1), (w2, b2), (w3, b3) = network.layers

    def command(s):
        z = np.clip(network.C @ past + network.D @ s + network.shift, -2, 2)
        return 0.02 * np.clip(w3 @ np.tanh(w2 @ np.tanh(w1 @ z + b1) + b2) + b3, -1, 1)[0]

    offset = -command(np.zeros(4))
    for first in range(0, len(reference), hold):
        s = np.array([reference[first], *measured[first].values()])
        decided += [offset + command(s)] * hold
        past = network.A @ past + network.B @ np.append(s, decided[-1])
    np.testing.assert_allclose(answers, decided[: len(answers)], atol=1e-12)


@pytest.mark.parametrize(
    "network", [odd_network(3, 0.1), remembering(3), deep_network(3), deep_network(4, decision=4 * PERIOD)]
)
def test_compiled_it_does_what_it_does_in_python(network):
    spec = on_p_dp(network)
    agree(*both(rig_for(spec), spec, np.full(300, 0.01)), 0.01)


def test_its_linear_view_is_its_slope():
    policy = on_p_dp(odd_network(2)).build(PERIOD)
    law = graph_law(policy)
    assert law is not None
    at = {**dict.fromkeys(law.measures, 0.0), "command": 0.0}
    view, small = linear_view(policy, at), 1e-7
    for i, name in enumerate(("reference", *law.measures)):
        policy.reset(0.0, dict.fromkeys(law.measures, 0.0), 0.0)
        step = small * (1.0 if name in ("reference", "position") else 1e8)
        y = {key: step * (key == name) for key in law.measures}
        slope = policy.compute(step * (name == "reference"), y) / step
        assert slope == pytest.approx(view.D[0, i], rel=1e-3, abs=1e-12)


def test_the_linear_view_of_a_held_policy_answers_slow_sines_as_it_does():
    """First harmonic of the commands to a small sine of 4 Hz, decisions 5 ms apart, against the linear view."""
    policy = Policy(PolicyDesign(replace(odd_network(7, 1.0), decision=5 * PERIOD)), PERIOD)
    at = {**dict.fromkeys(policy.measures, 0.0), "command": 0.0}
    view, hz, k = linear_view(policy, at), 4.0, 1000
    turns = np.exp(2j * np.pi * hz * np.arange(k) * PERIOD)
    policy.reset(0.0, dict.fromkeys(policy.measures, 0.0), 0.0)
    answers = []
    for turn in turns:
        answers.append(policy.compute(0.0, {"position": 1e-6 * turn.real, "pa": 0.0, "pb": 0.0}))
        policy.update(answers[-1])
    harmonic = 2 * np.mean((np.array(answers) / turns)[k // 2 :]) / 1e-6
    z = np.exp(2j * np.pi * hz * PERIOD)
    gain = view.C @ np.linalg.solve(z * np.eye(len(view.A)) - view.A, view.B[:, 1]) + view.D[0, 1]
    assert harmonic == pytest.approx(complex(gain[0]), rel=0.01)


BODE = "[bode]\nlow_hz = 1\nhigh_hz = 5\npoints = 3\namplitudes_mm = [1]\n"


def written(folder: Path, **changes) -> ControllerSpec:
    """p-dp with a policy from a file that differs from a whole one; None takes an array away."""
    (folder / "whole.npz").write_bytes(SILENT.packed())
    with np.load(folder / "whole.npz") as file:
        arrays = {key: value for key, value in {**file, **changes}.items() if value is not None}
    np.savez(folder / "policy.npz", **arrays)
    text = (EXPERIMENTS / "train_p_dp.toml").read_text()
    base = "[controllers.p-dp]" + text.split("[controllers.p-dp]")[1].partition("\n#")[0]
    step = 'experiment = "step"\nrig = "jack-10t"\nscenarios = ["position-10mm"]\n'
    part = '[[controllers.p-dp.compensators]]\nuse = "controllers.policy:PolicyOn"\nnetwork = "policy.npz"\n'
    (folder / "mine.toml").write_text(step + base + "\n" + part + BODE)
    (spec,) = load_config(folder / "mine.toml").controllers
    return spec


@pytest.mark.parametrize("network", [odd_network(1), remembering(1), deep_network(1)])
def test_a_network_comes_back_from_its_file_and_goes_to_other_processes(tmp_path, network):
    (tmp_path / "mine.npz").write_bytes(network.packed())
    assert read_network(tmp_path / "mine.npz") == network
    spec = on_p_dp(network)
    assert pickle.loads(pickle.dumps(spec)) == spec
    assert "network" in repr(spec)


def test_an_experiment_names_the_file(tmp_path):
    spec = written(tmp_path)
    assert spec.compensators[-1].design.network == SILENT


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"W1": np.zeros((6, 4))}, r"W1 and b1 have the shapes \(6, 4\) and \(6,\); they need 5 columns"),
        ({"W2": np.zeros((2, 6)), "b2": np.zeros(2)}, "the last layer has 2 rows"),
        ({"b2": None}, "W2 and b2"),
        ({"W1": None}, "has no array W1"),
        ({"limit": None}, "has no array limit"),
        ({"A": np.zeros((4, 3))}, r"A has the shape \(4, 3\)"),
        ({"A": np.eye(4)}, "does not forget"),
        ({"W1": np.full((6, 5), math.nan)}, "W1 has numbers that are not finite"),
        ({"limit": 2.0}, "limit is 2; it must be above 0, and 1 at most"),
        ({"squash": "relu"}, "squash is .relu.; give tanh or clip"),
        ({"V": np.zeros((6, 5))}, "has no array forgets"),
        ({"V": np.zeros((6, 4)), "forgets": 0.1, "floor": 0.1}, r"V has the shape \(6, 4\); it needs that of W1"),
        ({"V": np.zeros((6, 5)), "forgets": 2.0, "floor": 0.1}, "forgets must be one number above 0, and 1 at most"),
        ({"signals": np.array([1.0, 2.0, 3.0])}, "holds float64; give text"),
        ({"W1": np.array([[{}] * 5] * 6)}, "is no .npz file of numbers"),
    ],
)
def test_a_file_that_is_no_network_is_refused_in_one_line(tmp_path, changes, says):
    with pytest.raises(InputError, match=says) as error:
        written(tmp_path, **changes)
    assert "\n" not in str(error.value)
    assert "policy.npz" in str(error.value)


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 no archive", SILENT.packed()[:400]])
def test_a_damaged_file_is_refused(tmp_path, content):
    (tmp_path / "mine.npz").write_bytes(content)
    with pytest.raises(InputError, match=r"mine\.npz: is no \.npz file of numbers"):
        read_network(tmp_path / "mine.npz")


def test_a_network_for_another_control_period_is_refused():
    with pytest.raises(InputError, match=r"decides every 1 ms, no multiple of the control period, 0\.4 ms"):
        on_p_dp(SILENT).build(4e-4)


def test_on_a_jack_whose_sides_are_alike_steps_to_either_side_are_mirrored():
    spec = on_p_dp(odd_network(3, 0.1))
    ups, downs = (both(rig_for(spec), spec, np.full(300, size))[1] for size in (0.01, -0.01))
    for up, down in zip(ups, downs, strict=True):
        np.testing.assert_allclose(up.record.signals["position"], -down.record.signals["position"], atol=1e-8)
        np.testing.assert_allclose(up.record.signals["command"], -down.record.signals["command"], atol=1e-8)


@given(st.integers(0, len(SILENT.packed()) - 1), st.integers(0, 255))
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_file_with_another_byte_is_a_network_or_refused_in_one_line(tmp_path, place, byte):
    content = bytearray(SILENT.packed())
    content[place] = byte
    (tmp_path / "mine.npz").write_bytes(content)
    message = ""
    try:
        read_network(tmp_path / "mine.npz")
    except InputError as error:
        message = str(error)
    assert "\n" not in message


def test_a_file_that_unpacks_to_too_much_is_refused(tmp_path):
    np.savez_compressed(tmp_path / "mine.npz", A=np.zeros(3 * 2**20))
    with pytest.raises(InputError, match="more than 16 MiB unpacked"):
        read_network(tmp_path / "mine.npz")
