"""Coefficients for a rig's own controller: scipy's sosfilt of what is printed is what the controller object does."""

import json
from pathlib import Path

import control
import numpy as np
import pytest
from scipy.signal import sosfilt
from test_controllers import CONTROLLERS, EXPERIMENTS, PERIOD, PRESSURE, make, spelled
from test_graph_law import Network

from workbench.base.errors import InputError
from workbench.base.table import Table
from workbench.cli import main
from workbench.commands.run.config import load_config
from workbench.control.controller_spec import controller_spec
from workbench.control.export import as_json, as_text, coefficients, replay


def answer(printed):
    """The command that the printed sections make of the printed inputs."""
    vector = {name: np.array(values) for name, values in printed["vector"].items()}
    vector["error"] = vector["reference"] - vector[list(vector)[1]]
    command = np.zeros(len(vector["reference"]))
    for channel in printed["channels"]:
        part = sosfilt(channel["sections"], vector[channel["signal"]])
        if "scale" in channel:
            scale = channel["scale"]
            part = part * np.interp(vector[scale["signal"]], scale["at"], scale["factor"])
        command += part
    if "command_map" in printed:
        at, to = (np.array(printed["command_map"][key]) for key in ("at", "to"))
        inside = (at[0] <= command) & (command <= at[-1])
        command = np.where(inside, np.interp(command, at, to), command)
    sine = printed.get("dither", {"amplitude": 0.0, "frequency_hz": 0.0})
    turns = sine["frequency_hz"] * printed["period_s"] * np.arange(len(command))
    return command + sine["amplitude"] * np.sin(2 * np.pi * turns)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_printed_sections_are_the_controller(name):
    """To 1e-9 of the largest command, through the text of JSON, run anew on the controller object."""
    printed = json.loads(json.dumps(as_json(coefficients(make(name), PERIOD))))
    controller, inputs = make(name), printed["vector"]
    controller.reset(0.0, dict.fromkeys(controller.measures, 0.0), 0.0)
    wanted = []
    for k in range(len(inputs["reference"])):
        wanted.append(controller.compute(inputs["reference"][k], {s: inputs[s][k] for s in controller.measures}))
        controller.update(wanted[-1])
    assert inputs["command"] == pytest.approx(wanted, rel=1e-12)
    assert answer(printed) == pytest.approx(np.array(wanted), abs=1e-9 * np.abs(wanted).max())
    assert printed["period_s"] == PERIOD


SCHEDULED = {
    "use": "controllers.pressure:PressureFeedback",
    "gain": (2e-9, "1/Pa"),
    "corner": (1, "Hz"),
    "column": (0.3, "m"),
    "middle": (0.02, "m"),
}
LAP = {"use": "controllers.lap_inverse:LapInverse", "excess": (0.004, "1"), "width": (0.004, "1")}
DITHER = {"use": "controllers.dither:Dither", "amplitude": (0.03, "1"), "frequency": (170, "Hz")}
SHAPING = {"use": "controllers.shaping:Shaping", "corner": (20, "Hz")}


def around(name, *compensators):
    """A controller with these compensators instead of its own."""
    numbers = spelled({**CONTROLLERS[name], "compensators": list(compensators)})
    return controller_spec(name, Table(numbers, name)).build(PERIOD)


@pytest.mark.parametrize("after", [(), (SHAPING,), (DITHER, SHAPING)], ids=["", "shaped", "dithered"])
@pytest.mark.parametrize("name", CONTROLLERS)
def test_schedules_and_maps_are_exported(name, after):
    """Laws that learn the realised command (anti-windup, observer) too: theirs is the demand less what was added."""
    printed = json.loads(json.dumps(as_json(coefficients(around(name, PRESSURE, SCHEDULED, LAP, *after), PERIOD))))
    scheduled = [channel["signal"] for channel in printed["channels"] if "scale" in channel]
    assert scheduled == ["pa", "pb"]
    controller, inputs, expected = around(name, PRESSURE, SCHEDULED, LAP, *after), printed["vector"], []
    controller.reset(0.0, dict.fromkeys(controller.measures, 0.0), 0.0)
    for k in range(len(inputs["reference"])):
        expected.append(controller.compute(inputs["reference"][k], {s: inputs[s][k] for s in controller.measures}))
        controller.update(expected[-1])
    assert inputs["command"] == pytest.approx(expected, rel=1e-12)
    assert answer(printed) == pytest.approx(np.array(expected), abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("name", ["pid-lead", "tvc", "lqg"])
def test_the_vector_covers_schedule_and_map(name):
    """An export without either, or with a factor for the whole schedule, does not give the vector."""
    printed = as_json(coefficients(around(name, SCHEDULED, LAP), PERIOD))
    command = np.array(printed["vector"]["command"])
    assert np.ptp(printed["vector"]["position"]) > 0.5
    flat = {**printed, "channels": [{k: v for k, v in c.items() if k != "scale"} for c in printed["channels"]]}
    bare = {key: value for key, value in printed.items() if key != "command_map"}
    for less in (flat, bare):
        assert np.abs(answer(less) - command).max() > 1e-6


def test_the_text_has_schedule_and_map():
    exported = coefficients(around("p", SCHEDULED, LAP), PERIOD)
    text = as_text("p", exported)
    assert "command = sum of the channels, mapped" in text
    for line in ("its output times a factor over the measured position", "the sum goes through a map"):
        assert line in text
    scale, command_map = exported.channels[-1].scale, exported.command_map
    for value in (*scale.at, *scale.values, *command_map.at, *command_map.to):
        assert f"{value:.17g}" in text.split()


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Network(0), "Network is no linear law with scheduled compensators; it cannot be exported"),
        (lambda: around("p", LAP, PRESSURE), "compensators behind a map of the command cannot be exported"),
        (lambda: around("p", LAP, LAP), "compensators behind a map of the command cannot be exported"),
        (lambda: around("p", DITHER, PRESSURE), "compensators behind a dither cannot be exported"),
        (lambda: around("p", DITHER, DITHER), "compensators behind a dither cannot be exported"),
    ],
)
def test_a_law_of_another_form_is_refused(build, message):
    with pytest.raises(InputError, match=message):
        coefficients(build(), PERIOD)


def test_a_law_that_cannot_be_exported_leaves_the_others_theirs(capsys):
    assert main(["coefficients", str(EXPERIMENTS / "position_mpc.toml"), "--json"]) == 0
    printed, notes = capsys.readouterr()
    assert list(json.loads(printed)) == ["p-dp", "mpc", "mpc-bare"]
    (line,) = notes.splitlines()
    assert "mpc-preview: a law that knows its reference ahead cannot be exported" in line
    assert main(["coefficients", str(EXPERIMENTS / "position_mpc.toml"), "--controller", "mpc-preview"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_a_law_that_measures_its_specimen_is_exported_as_on_that_of_its_design(capsys):
    assert main(["coefficients", str(EXPERIMENTS / "force_tuned.toml"), "--json"]) == 0
    printed, notes = capsys.readouterr()
    assert list(json.loads(printed)) == ["p-dp-force", "mpc-force"]
    (line,) = notes.splitlines()
    assert "p-dp-force: as on the specimen of its design" in line


@pytest.mark.parametrize(("experiment", "name"), [("position_mpc", "mpc"), ("force_tuned", "mpc-force")])
def test_the_vector_of_a_predictive_law_has_work_for_its_plan(experiment, name):
    """In some samples of it the plan moves the command by the rate that it is allowed; its law has no such limit."""
    (spec,) = (spec for spec in load_config(EXPERIMENTS / f"{experiment}.toml").controllers if spec.name == name)
    exported = coefficients(spec.build(PERIOD), PERIOD)
    core = exported.planned.core
    fastest = core.kernel.table("RATE")[0]
    inputs, jump = exported.vector, np.abs(np.diff(exported.vector["command"]))
    assert np.count_nonzero(jump > 0.9 * fastest) > 0
    core.kernel.table("BOUNDS")[:] = 0.0  # which never looks for a limit
    core.kernel.table("RATE")[:] = core.kernel.table("MOST")[:] = 1e9
    assert np.abs(replay(exported) - inputs["command"]).max() > 0.1 * np.abs(inputs["command"]).max()


class Linear:
    """A controller that is nothing but a discrete state space."""

    measures = ("position",)

    def __init__(self, a, b, c, d):
        self._law = control.StateSpace(a, b, c, d, PERIOD, inputs=["reference", "position"], outputs=["command"])
        self._x = np.zeros(len(self._law.A))

    def linear(self):
        return self._law

    def reset(self, reference, measurement, command):
        self._x = 0 * self._x

    def compute(self, reference, measurement):
        self._u = np.array([reference, measurement["position"]])
        return (np.asarray(self._law.C) @ self._x + np.asarray(self._law.D) @ self._u).item()

    def update(self, realised):
        self._x = np.asarray(self._law.A) @ self._x + np.asarray(self._law.B) @ self._u


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("direct", [0.0, 1.0])
@pytest.mark.parametrize("late", [0, 2])
def test_any_stable_law_has_sections(seed, direct, late):
    """Of any order, with zeros where they come, answering at once, a sample late or three."""
    random = np.random.default_rng(seed)
    n = int(random.integers(0, 9))
    a = random.standard_normal((n, n))
    a *= 0.9 / max(1e-9, np.abs(np.linalg.eigvals(a)).max(initial=0.0))
    b, c, d = random.standard_normal((n, 2)), random.standard_normal((1, n)), direct * random.standard_normal((1, 2))
    way = np.eye(late, k=-1)
    last = np.eye(1, late, late - 1)
    if late:
        whole = np.block([[a, np.zeros((n, late))], [np.eye(late, 1) @ c, way]])
        a, b, c, d = whole, np.vstack((b, np.eye(late, 1) @ d)), np.hstack((np.zeros((1, n)), last)), 0 * d
    found = coefficients(Linear(a, b, c, d), PERIOD)
    assert replay(found) == pytest.approx(found.vector["command"], abs=1e-9)
    assert [channel.signal for channel in found.channels] == ["reference", "position"]


def test_opposite_inputs_are_one_error():
    law = Linear([[0.5]], [[1.0, -1.0]], [[2.0]], [[1.0, -1.0]])
    found = coefficients(law, PERIOD)
    assert [channel.signal for channel in found.channels] == ["error"]
    assert found.channels[0].sections[0] == pytest.approx([1, 1.5, 0, 1, -0.5, 0])


def test_a_law_that_does_nothing_has_sections_too():
    found = coefficients(Linear(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((1, 0)), [[0.0, 0.0]]), PERIOD)
    assert np.all(replay(found) == 0)


def test_what_sections_can_not_give_is_said():
    """Twelve equal poles: no zeros and poles that floating point finds give them back."""
    n = 12
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((n, n)))[0]
    a = turn @ (0.9 * np.eye(n) + np.eye(n, k=1)) @ turn.T
    b = turn @ np.hstack((np.eye(n, 1, 1 - n), np.zeros((n, 1))))
    with pytest.raises(InputError, match="its poles are too close"):
        coefficients(Linear(a, b, np.eye(1, n) @ turn.T, [[1.0, 0.0]]), PERIOD)


def test_the_text_has_every_digit():
    found = coefficients(make("crone2"), PERIOD)
    words = as_text("crone2", found).split()
    for channel in found.channels:
        for value in channel.sections[:, [0, 1, 2, 4, 5]].ravel():
            assert f"{value:.17g}" in words


EXPERIMENT = str(Path(__file__).parents[1] / "experiments" / "position_crone.toml")


def test_the_command_prints_json(capsys):
    assert main(["coefficients", EXPERIMENT, "--controller", "crone2", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)["crone2"]
    assert answer(printed) == pytest.approx(np.array(printed["vector"]["command"]), abs=1e-9)


@pytest.mark.parametrize("command", ["coefficients", "jack-model"])
def test_a_controller_that_is_not_there_is_named(capsys, command):
    assert main([command, EXPERIMENT, "--controller", "crone9"]) == 2
    assert "no controller crone9; it has p-dp, pid-lead, crone1, crone2, lqg" in capsys.readouterr().err


def test_the_jack_model_is_the_one_in_the_experiment(capsys):
    """What the experiment gives its designs is what the command prints, moving."""
    assert main(["jack-model", EXPERIMENT, "--controller", "crone2"]) == 0
    printed = capsys.readouterr().out.split("moving\n")[1].splitlines()
    text = Path(EXPERIMENT).read_text("utf-8")
    for line in printed:
        assert line in text
