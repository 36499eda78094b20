"""A rig in the loop of its maker: its graph, what it follows, and what can be asked of it."""

import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from made_inner_loops import LABEL, played, press

from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.new.closed_loop import closed_loop_files
from workbench.engine import Engine
from workbench.linear import equilibrium, linearise
from workbench.linear.equilibria import equilibria, moved
from workbench.link.client import LinkClient
from workbench.link.wire_loop import stands
from workbench.loop.drive_simulation import drive, play
from workbench.plant import build
from workbench.plant.effects.declared import effects_for
from workbench.records import Campaign, Record
from workbench.records.excitation import Excitation
from workbench.rigs.driven import driven
from workbench.rigs.inner_loop import inner_specs
from workbench.rigs.rig import EffectUse, Rig
from workbench.rigs.rig_file import load_rig, save_rig


@pytest.fixture(scope="module")
def rig(tmp_path_factory) -> Rig:
    return press(tmp_path_factory.mktemp("closed"))


@pytest.mark.parametrize("position", [-0.068, 0.02, 0.068])
def test_the_loop_holds_any_place_by_what_it_is_asked(rig, position):
    """The valve's command saturates a few millimetres away from it, from where no slope leads back."""
    plant = build(rig)
    rest = equilibrium(plant, position=position)
    lanes = equilibria(plant, plant.p[None], np.array([position]))
    assert rig.inner is not None
    for u in (rest.u, lanes.u[0]):
        assert u[0] * rig.inner.full_command == pytest.approx(position, abs=1e-4)
    asked = equilibria(plant, plant.p[None], np.array([position]), command=position / rig.inner.full_command)
    assert asked.u[0, 0] * rig.inner.full_command == position
    there = moved(plant, plant.p[None], lanes, 0.0)
    assert there.ok.all()
    assert abs(there.u[0, 0]) < 1e-2


def test_a_closed_loop_answers_with_its_speed_gain_and_follows(rig):
    plant = build(rig)
    rest = equilibrium(plant)
    slow = np.array(linearise(plant, rest, ("command",), ("position",)).poles())
    real = slow[np.abs(np.imag(slow)) < 1]
    # at null both lands of each side are open: the speed gain is twice that of the passing flow
    assert np.min(np.abs(real + 2 * rig["loop_gain"] * LABEL["speed"])) < 0.2 * 2 * rig["loop_gain"] * LABEL["speed"]
    t = np.arange(0, 1.2, 1e-3)
    u = np.zeros((t.size, len(plant.inputs)))
    assert rig.inner is not None
    u[:, plant.input("command")] = 5e-3 / rig.inner.full_command
    end = Engine(plant).run(rest.x, t, u).x[-1]
    assert end[plant.state("x")] == pytest.approx(5e-3, abs=2e-6)


def test_a_force_loop_comes_to_the_force_that_it_is_asked(tmp_path):
    text = closed_loop_files(LABEL, "press")["rig.toml"]
    before, after = text.split("[inner]")[0], text.split("[limits]")[1]
    loop = """controls = "force"
full_command = "50 kN"
loop_gain = {value = 2e-6, unit = "1/N"}
loop_integral_time = {value = 0.5, unit = "s"}
"""
    before = before.replace('kind = "measured"\n', "").replace("ks = {value = 0.0", "ks = {value = 5e6")
    (tmp_path / "rig.toml").write_text(f"{before}[inner]\n{loop}[limits]{after}")
    rig = load_rig(tmp_path / "rig.toml")
    plant, t = build(rig), np.arange(0, 3, 1e-3)
    asked = Record("a", t, {"force_reference": np.full(t.size, 20e3), "force": np.zeros(t.size)})
    command = driven(Campaign(Path(), "x", (), (asked,), ()), rig).train[0].signals["command"]
    u = np.zeros((t.size, len(plant.inputs)))
    u[:, plant.input("command")] = command
    x = Engine(plant).run(equilibrium(plant).x, t, u).x
    assert plant.observe(x[-1], u[-1])[0, plant.output("force")] == pytest.approx(20e3, rel=1e-3)


def test_each_part_of_a_loop_is_in_its_graph(rig, tmp_path):
    text = tmp_path / "rig.toml"
    save_rig(rig, text)
    more = {
        "integral_time": (1, "s"), "derivative_time": (2, "ms"), "feed_forward": (10, "ms"),
        "pressure_feedback": (1e-9, "1/Pa"), "lag": (1, "ms"),
    }  # fmt: skip
    lines = [f'loop_{name} = {{value = {value}, unit = "{unit}"}}' for name, (value, unit) in more.items()]
    text.write_text(text.read_text().replace("[inner]\n", "[inner]\n" + "\n".join(lines) + "\n"))
    full = load_rig(text)
    plant, plain = build(full), build(rig)
    assert {s.name for s in plant.states} - {s.name for s in plain.states} == {
        "loop_integral", "loop_reference", "loop_output"
    }  # fmt: skip
    assert plant.delay == plain.delay == "loop_delay"
    again = tmp_path / "again.toml"
    save_rig(full, again)
    assert load_rig(again) == full
    x, u = equilibrium(plant).x, np.zeros(len(plant.inputs))
    moved = {name: x.copy() for name in ("x", "v", "P1", "loop_integral", "loop_reference")}
    for name, by in (("x", 1e-3), ("v", 0.1), ("P1", 1e6), ("loop_integral", 0.01), ("loop_reference", 1e-3)):
        moved[name][plant.state(name)] += by

    def output(state: np.ndarray) -> float:
        """What the lag of the loop is asked, which is the valve's command."""
        rate = float(plant.f(state, u, plant.p)[plant.state("loop_output")])
        return rate * full["loop_lag"] + state[plant.state("loop_output")]

    gain, base = full["loop_gain"], output(x)
    asked = {name: output(state) - base for name, state in moved.items()}
    assert asked["x"] == pytest.approx(-gain * 1e-3, rel=1e-6)
    assert asked["v"] == pytest.approx(-gain * 2e-3 * 0.1, rel=1e-6)
    assert asked["P1"] == pytest.approx(-1e-9 * 1e6, rel=1e-3)
    assert asked["loop_integral"] == pytest.approx(0.01, rel=1e-6)
    assert asked["loop_reference"] == pytest.approx(-gain * 10e-3 * 1e-3 / 2e-3, rel=1e-6)


def test_a_dead_band_and_unequal_gains_act_in_either_order(rig):
    uses = (EffectUse("main.asymmetry", "direction", {}), EffectUse("main.deadband", "lap", {}))
    both = [build(Rig(**{**vars(rig), "effects": order})) for order in (uses, uses[::-1])]
    x, u = equilibrium(build(rig)).x, np.zeros(len(both[0].inputs))
    x[both[0].state("z3")] = 0.3e-3
    rates = [np.array(p.f(x, u, p.parameter_values(None, **{"main.asymmetry.a": 0.2}))).ravel() for p in both]
    assert rates[0] == pytest.approx(rates[1], rel=1e-12)
    plain = np.array(both[0].f(x, u, both[0].parameter_values(None, **{"main.asymmetry.a": 0.0}))).ravel()
    assert rates[0][both[0].state("P1")] > 1.1 * plain[both[0].state("P1")]


def test_its_delay_is_that_of_the_command_and_is_sought_once(rig):
    late = [effect for effect in effects_for(rig) if effect.delay]
    assert late == []
    assert [effect for effect in effects_for(load_rig("festo-tp511")) if effect.delay]


def test_a_plan_asks_for_references(rig):
    ready = drive(rig)
    assert rig.inner is not None
    t = np.arange(0, 0.3, rig.period.value)
    run = play(ready, Excitation("slow", rig.period.value, 2e-3 * np.sin(2 * np.pi * 5 * t), np.zeros(t.size)))
    assert run.record.signals["command"][: t.size] == pytest.approx(
        2e-3 * np.sin(2 * np.pi * 5 * t) / rig.inner.full_command, abs=1e-9
    )


def test_a_measured_load_is_an_input(rig):
    record = played(rig)
    force = 1e3 * np.ones(record.t.size)
    whole = Campaign(Path(), "x", (), (Record("a", record.t, {**record.signals, "force": force}),), ())
    assert rig.inner is not None
    own = driven(whole, rig).train[0]
    assert "force" not in own.signals
    assert own.signals["disturbance"] == pytest.approx(force)
    assert own.signals["command"] == pytest.approx(record.signals["reference"] / rig.inner.full_command)


def test_every_experiment_of_the_starter_folder_runs(rig, tmp_path, monkeypatch):
    for name, text in closed_loop_files(LABEL, "press").items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    commands = {
        "step": "run",
        "specimen": "bench",
        "inverse": "inverse",
        "hybrid": "inverse",
        "learn": "learn",
        "sines": "sines",
    }
    for name, command in commands.items():
        assert main([command, f"{name}.toml", "--out", name]) == 0, name
    rows = json.loads(Path("step/metrics.json").read_text())["rows"]
    assert rows[0]["stable"]
    assert abs(rows[0]["steady_state_error"]) < 1e-3
    rows = json.loads(Path("inverse/metrics.json").read_text())["rows"]
    assert rows[0]["error_rms_inverse"] < 0.3 * rows[0]["error_rms"]
    hybrid = json.loads(Path("hybrid/metrics.json").read_text())
    assert hybrid["rows"][0]["factor"] > 1.5
    least, least_with = (
        min(row["gain_margin_db"] for row in hybrid["outer"] if row["reference"] == how)
        for how in ("as it is", "inverse")
    )
    assert least_with > least + 6  # dB
    assert "At the worse of null and moving its gain margin is" in Path("hybrid/report.html").read_text()


def test_a_live_rig_with_an_inner_loop_is_not_driven(rig):
    with pytest.raises(InputError, match="has an inner loop, whose reference a trip of the guard would set to 0"):
        stands(cast(LinkClient, SimpleNamespace(at="udp://127.0.0.1:1")), rig)


def test_a_loop_without_its_gain_is_told_how_to_give_one_that_nobody_knows(tmp_path):
    lines = closed_loop_files(LABEL, "press")["rig.toml"].splitlines()
    (tmp_path / "rig.toml").write_text("\n".join(line for line in lines if not line.startswith("loop_gain")))
    said = r"inner.loop_gain: missing, .* where nobody knows it give a rough value in wide bounds, such as (.*)"
    with pytest.raises(InputError, match=said) as refused:
        load_rig(tmp_path / "rig.toml")
    found = re.search(said, str(refused.value))
    assert found is not None
    (tmp_path / "rig.toml").write_text("\n".join(found[1] if line.startswith("loop_gain") else line for line in lines))
    assert load_rig(tmp_path / "rig.toml").numbers["loop_gain"].high == 2000.0


def test_a_force_loop_has_no_derivative_and_a_label_of_odd_numbers_is_a_rig(tmp_path):
    assert "loop_derivative_time" in inner_specs("position")
    assert "loop_derivative_time" not in inner_specs("force")
    odd = {"force": 12345.678, "stroke": 0.4117012345, "speed": 0.333333, "M": 77.7777}
    (tmp_path / "rig.toml").write_text(closed_loop_files(odd, "odd")["rig.toml"])
    rig = load_rig(tmp_path / "rig.toml")
    assert rig.limit("stroke") == pytest.approx(rig["S"] / 2, rel=1e-12)
