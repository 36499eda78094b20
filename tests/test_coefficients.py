"""Coefficients for a rig's own controller: scipy's sosfilt of what is printed is the controller, unlimited."""

import json
from pathlib import Path

import control
import numpy as np
import pytest
from scipy.signal import sosfilt
from test_controllers import CONTROLLERS, EXPERIMENTS, PERIOD, PRESSURE, make, spelled
from test_law import Network

from workbench.base.errors import InputError
from workbench.base.table import ConfigTable
from workbench.cli import main
from workbench.commands.run.options import load_config
from workbench.control.controller_spec import controller_spec
from workbench.control.export import Program, as_json, as_text, coefficients, replay
from workbench.control.law import law_of_view
from workbench.control.protocol import graph_law
from workbench.linear.state_space import as_state_space


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


def printed_of(controller):
    """What --json prints of a controller, through its text."""
    law = graph_law(controller)
    return json.loads(json.dumps(as_json(Program("law", law), coefficients(law))))


@pytest.mark.parametrize("name", CONTROLLERS)
def test_printed_sections_are_the_controller(name):
    """To 1e-9 of the largest command, through the text of JSON, run anew on the controller object."""
    printed = printed_of(make(name))
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
    return controller_spec(name, ConfigTable(numbers, name)).build(PERIOD)


@pytest.mark.parametrize("after", [(), (SHAPING,), (DITHER, SHAPING)], ids=["", "shaped", "dithered"])
@pytest.mark.parametrize("name", CONTROLLERS)
def test_schedules_and_maps_are_exported(name, after):
    """Laws that learn the realised command (anti-windup, observer) too: theirs is the demand less what was added."""
    printed = printed_of(around(name, PRESSURE, SCHEDULED, LAP, *after))
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
    printed = printed_of(around(name, SCHEDULED, LAP))
    command = np.array(printed["vector"]["command"])
    assert np.ptp(printed["vector"]["position"]) > 0.5
    flat = {**printed, "channels": [{k: v for k, v in c.items() if k != "scale"} for c in printed["channels"]]}
    bare = {key: value for key, value in printed.items() if key != "command_map"}
    for less in (flat, bare):
        assert np.abs(answer(less) - command).max() > 1e-6


def test_the_text_has_schedule_and_map():
    law = graph_law(around("p", SCHEDULED, LAP))
    exported = coefficients(law)
    text = as_text(Program("p", law), exported)
    assert "command = sum of the channels, mapped" in text
    for line in ("its output times a factor over the measured position", "the sum goes through a map"):
        assert line in text
    scale, command_map = exported.channels[-1].scale, exported.command_map
    for value in (*scale.at, *scale.values, *command_map.at, *command_map.to):
        assert f"{value:.17g}" in text.split()


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Network(0), "no sum of filters with schedules"),
        (lambda: around("p", LAP, PRESSURE), "compensators behind a map of the command have no coefficients"),
        (lambda: around("p", LAP, LAP), "compensators behind a map of the command have no coefficients"),
        (lambda: around("p", DITHER, PRESSURE), "compensators behind a dither have no coefficients"),
        (lambda: around("p", DITHER, DITHER), "compensators behind a dither have no coefficients"),
    ],
)
def test_a_law_of_another_form_has_no_sections(build, message):
    with pytest.raises(InputError, match=message):
        coefficients(graph_law(build()))


def test_a_law_without_sections_says_why_and_has_its_code(capsys):
    assert main(["coefficients", str(EXPERIMENTS / "position_mpc.toml"), "--json"]) == 0
    printed, notes = capsys.readouterr()
    laws = json.loads(printed)
    assert list(laws) == ["p-dp", "mpc", "mpc-preview", "mpc-bare"]
    assert notes == ""
    assert "knows its reference ahead" in laws["mpc-preview"]["without_sections"]
    ahead = np.array(laws["mpc-preview"]["code"]["reference"])
    assert ahead.shape[1] > 1
    assert ahead[0, 1] == ahead[1, 0]
    assert main(["coefficients", str(EXPERIMENTS / "position_mpc.toml"), "--controller", "mpc-preview"]) == 0
    assert "--out leaves it" in capsys.readouterr().out


OWN = """
from workbench.linear.state_space import state_space


class Clamped:
    measures = ("position",)

    class Design:
        pass

    def __init__(self, design, period):
        self._period = period

    def reset(self, reference, measurement, command):
        pass

    def compute(self, reference, measurement):
        return min(0.02, 3.0 * (reference - measurement["position"]))

    def update(self, realised):
        pass

    def linear(self):
        return state_space([], [], [], [[3.0, -3.0]], self._period, ["reference", "position"], ["command"])
"""


def test_a_controller_in_plain_python_is_exported_by_its_linear_view_only_where_that_is_asked(tmp_path, capsys):
    text = OWN.replace("    class Design:\n        pass", "    @dataclass\n    class Design:\n        pass")
    (tmp_path / "own.py").write_text("from dataclasses import dataclass\n" + text)
    own = '[controllers.own]\nuse = "own.py:Clamped"\n'
    experiment = tmp_path / "own.toml"
    experiment.write_text(
        'experiment = "step"\nrig = "jack-10t"\nscenarios = ["position-10mm"]\n'
        f"{own}[bode]\nlow_hz = 0.5\nhigh_hz = 30\npoints = 3\namplitudes_mm = [1]\n"
    )
    assert main(["coefficients", str(experiment)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "own: computes in Python" in line
    assert "--linear" in line
    assert main(["coefficients", str(experiment), "--linear", "--out", str(tmp_path / "laws")]) == 0
    for suffix in ("c", "h", "st"):
        assert "Without its limits, its anti-windup" in (tmp_path / "laws" / f"own.{suffix}").read_text()[:400]
    assert "its limits" in json.loads((tmp_path / "laws" / "own.json").read_text())["left_out"]


@pytest.mark.parametrize(("experiment", "name"), [("position_mpc", "mpc"), ("force_tuned", "mpc-force")])
def test_the_vector_of_a_predictive_law_has_work_for_its_plan(experiment, name):
    """In some samples of it the plan moves the command by the rate that it is allowed; its law has no such limit."""
    (spec,) = (spec for spec in load_config(EXPERIMENTS / f"{experiment}.toml").controllers if spec.name == name)
    exported = coefficients(graph_law(spec.build(PERIOD)))
    core = exported.planned.tables
    fastest = core.kernel.table("RATE")[0]
    inputs, jump = exported.vector, np.abs(np.diff(exported.vector["command"]))
    assert np.count_nonzero(jump > 0.9 * fastest) > 0
    core.kernel.table("BOUNDS")[:] = 0.0  # which never looks for a limit
    core.kernel.table("RATE")[:] = core.kernel.table("MOST")[:] = 1e9
    assert np.abs(replay(exported) - inputs["command"]).max() > 0.1 * np.abs(inputs["command"]).max()


def linear(a, b, c, d):
    """A law that is nothing but a discrete state space."""
    view = control.StateSpace(a, b, c, d, PERIOD, inputs=["reference", "position"], outputs=["command"])
    return law_of_view(as_state_space(view), ("position",))


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
    found = coefficients(linear(a, b, c, d))
    assert replay(found) == pytest.approx(found.vector["command"], abs=1e-9)
    assert [channel.signal for channel in found.channels] == ["reference", "position"]


def test_opposite_inputs_are_one_error():
    law = linear([[0.5]], [[1.0, -1.0]], [[2.0]], [[1.0, -1.0]])
    found = coefficients(law)
    assert [channel.signal for channel in found.channels] == ["error"]
    assert found.channels[0].sections[0] == pytest.approx([1, 1.5, 0, 1, -0.5, 0])


def test_a_law_that_does_nothing_has_sections_too():
    found = coefficients(linear(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((1, 0)), [[0.0, 0.0]]))
    assert np.all(replay(found) == 0)


def test_what_sections_can_not_give_is_said():
    """Twelve equal poles: no zeros and poles that floating point finds give them back."""
    n = 12
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((n, n)))[0]
    a = turn @ (0.9 * np.eye(n) + np.eye(n, k=1)) @ turn.T
    b = turn @ np.hstack((np.eye(n, 1, 1 - n), np.zeros((n, 1))))
    with pytest.raises(InputError, match="its poles are too close"):
        coefficients(linear(a, b, np.eye(1, n) @ turn.T, [[1.0, 0.0]]))


def test_the_text_has_every_digit():
    law = graph_law(make("crone2"))
    found = coefficients(law)
    words = as_text(Program("crone2", law), found).split()
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
