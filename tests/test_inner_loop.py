"""A rig in the loop of its maker: its graph, its records, and what two of their columns say of the loop."""

import json
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.signal import lfilter

from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.fit.remains import _with_load, remains_sentence
from workbench.commands.frequency.config import load
from workbench.commands.frequency.two_columns import run_pairs
from workbench.commands.new.closed_loop import closed_loop_files
from workbench.commands.trace.told import told_section, told_sentence
from workbench.engine import Engine
from workbench.engine.delay_line import held_commands
from workbench.identify.data.causality import in_band
from workbench.identify.fit.followed import _off as off
from workbench.identify.trace.findings import Trace
from workbench.identify.trace.problem import estimation_problem
from workbench.identify.trace.refit import fit_rig
from workbench.identify.trace.told import ToldEffects, told_effects
from workbench.linear import equilibrium, linearise
from workbench.linear.equilibria import equilibria, moved
from workbench.link.client import LinkClient
from workbench.link.wire_loop import stands
from workbench.loop.drive_simulation import drive, play
from workbench.plant import build
from workbench.plant.effects.declared import effects_for
from workbench.records import Campaign, Record, write_csv
from workbench.records.excitation import Excitation, multisine
from workbench.report import Table
from workbench.rigs.driven import driven, load_driven
from workbench.rigs.inner_loop import inner_specs
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse, Rig
from workbench.rigs.rig_file import load_rig, save_rig

SHARED = Path(__file__).parents[2] / "shared"
LABEL = {"force": 1e5, "stroke": 0.15, "speed": 0.5, "M": 100.0}
PERIOD, K, DELAY = 2e-3, 30.0, 6e-3
TOLD = {"load.bias", "main.deadband", "main.asymmetry", "drive.lag"}


@pytest.fixture(scope="module")
def rig(tmp_path_factory) -> Rig:
    folder = tmp_path_factory.mktemp("closed")
    for name, text in closed_loop_files(LABEL, "press").items():
        (folder / name).write_text(text)
    return load_rig(folder / "rig.toml")


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


@cache
def played(rig_of: Callable[[], Rig], pressure: float = 0.0) -> Record:
    """Ten seconds of the loop, as its maker's controller logs them; a `pressure` with that noise [Pa], if any."""
    own = rig_of()
    plant = build(own)
    assert own.inner is not None
    t = np.arange(0, 10, PERIOD)
    reference = 3e-3 * multisine(1.0, 5.0, PERIOD, (0.2, 12.0), lines=40)
    reference = np.tile(reference / np.abs(reference).max(), 2)[: t.size] * 3e-3
    late = held_commands(np.append(t, t[-1] + PERIOD), reference / own.inner.full_command, plant.lateness())
    u = np.zeros((t.size, len(plant.inputs)))
    u[:, plant.input("command")] = late.mean
    x = Engine(plant).run(equilibrium(plant).x, t, u).x
    y, random = plant.observe(x, u), np.random.default_rng(3)
    sigma = {"position": 5e-6, **({"pa": pressure} if pressure else {})}
    seen = {name: y[:, plant.output(name)] + size * random.standard_normal(t.size) for name, size in sigma.items()}
    return Record("played", t, {"reference": reference, **seen})


def campaign(
    folder: Path, own: Rig, record: Record, change: Callable[[dict[str, np.ndarray]], None] | None = None
) -> Path:
    folder.mkdir()
    save_rig(own, folder / "rig.toml")
    (folder / "campaign.toml").write_text(
        'rig = "rig.toml"\n[records]\ntrain = [{file = "a.csv", to = 6.0}]\nheldout = [{file = "a.csv", from = 6.0}]\n'
    )
    signals = {name: values.copy() for name, values in record.signals.items()}
    if change:
        change(signals)
    write_csv(Record("a", record.t, signals), folder / "a.csv")
    return folder


def test_gain_and_delay_of_a_loop_are_found_from_reference_and_position(rig, tmp_path, monkeypatch):
    true = rig.with_values(loop_gain=75.0, loop_delay=6e-3, z0=0.004)
    folder = campaign(tmp_path / "c", rig, played(lambda: true))
    monkeypatch.chdir(tmp_path)
    assert main(["fit", str(folder), "--out", "f", "--starts", "1"]) == 0
    found = json.loads(Path("f/metrics.json").read_text())
    for name, value in (("loop_gain [1/m]", 75.0), ("loop_delay [s]", 6e-3), ("z0 [1]", 0.004)):
        best, low, high = found["parameters"][name]
        assert low - 0.5 * (high - low) <= value <= high + 0.5 * (high - low), (name, best, low, high)
    assert found["chi2"]["heldout"] < 1.1
    shares = found["shares"]
    assert shares["left"] == pytest.approx(shares["noise"], rel=0.1)
    assert shares["load"] is None
    assert shares["moves"] > 0.5
    ladder = found["ladder"]
    first, second, plant = (rung["left"] for rung in ladder["rungs"])
    assert ladder["bears"] == "this plant"  # whose lands bend, and which a servo is not
    assert min(first, second) > 1.5 * plant
    assert plant == shares["left"]


def test_what_remains_in_one_run_is_told_by_drift_frequency_and_load(rig, tmp_path, monkeypatch):
    """The held-out part has an offset of 0.05 mm and a tone of 7 Hz, 0.04 mm RMS, that nothing explains."""
    offset, tone = 5e-5, 4e-5

    def off(signals):
        t = np.linspace(0, 10.0, signals["position"].size, endpoint=False)
        signals["position"] += (t >= 6.0) * (offset + np.sqrt(2) * tone * np.sin(2 * np.pi * 7.0 * t))

    folder = campaign(tmp_path / "c", rig, played(lambda: rig), off)
    monkeypatch.chdir(tmp_path)
    assert main(["fit", str(folder), "--out", "f", "--starts", "1"]) == 0
    found = json.loads(Path("f/metrics.json").read_text())["remains"]
    assert found["drift"] == pytest.approx(1e3 * offset, rel=0.2)
    assert found["left"] == pytest.approx(1e3 * np.hypot(offset, tone), rel=0.1)
    assert found["below_hz"] == pytest.approx(7.0, abs=0.6)
    assert found["with_load"] is None
    assert "of which 0.048" in remains_sentence(found)
    assert "goes with the measured load" in remains_sentence({**found, "with_load": 0.3})


def test_a_share_goes_with_the_load_or_its_rate():
    random = np.random.default_rng(2)
    load = np.cumsum(random.standard_normal(4000))
    load -= load.mean()
    rest = 0.3 * load + random.standard_normal(4000)
    assert _with_load(rest, load) == pytest.approx(float(0.09 * load @ load), rel=0.05)
    assert _with_load(rest, None) == 0
    assert _with_load(random.standard_normal(4000), load) < 40


def _swapped(s: dict[str, np.ndarray]) -> None:
    s["reference"], s["position"] = s["position"], s["reference"]


def _late(s: dict[str, np.ndarray]) -> None:
    s["reference"] = np.roll(s["reference"], 60)


def _little_late(s: dict[str, np.ndarray]) -> None:
    s["reference"] = np.roll(s["reference"], 8)


def _times(name: str, factor: float) -> Callable[[dict[str, np.ndarray]], None]:
    def change(s: dict[str, np.ndarray]) -> None:
        s[name] = factor * s[name]

    return change


def _off(s: dict[str, np.ndarray]) -> None:
    s["position"][1000:2000] = s["position"][1000]


def _driving(s: dict[str, np.ndarray]) -> None:
    s["force"] = -3e4 * np.gradient(s["position"], PERIOD)


def _strong(s: dict[str, np.ndarray]) -> None:
    s["force"] = -6e5 * np.gradient(s["position"], PERIOD) / np.abs(np.gradient(s["position"], PERIOD)).max()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_strong, r"force reaches 58.* kN, 5[.]8.* times the limit of the rig; check its unit"),
        (_swapped, r"position leads reference by .* ms.*exchange their columns"),
        (_late, r"position leads reference by .* ms.*logged late"),
        (_little_late, r"position leads reference by .* ms.*logged late"),
        (_times("position", 10.0), r"position is (9|10)[.0-9]* times what reference asks for; give both their units"),
        (_times("position", -1.0), r"position goes against reference; give one of them scale = -1"),
        (_times("reference", 1e3), r"reference reaches 3000 mm, and full_command of \[inner\] is 75 mm"),
        (_off, r"position rests from 2 to [34].* s while reference moves: the loop was off"),
        (_driving, r"force drives the jack .*scale = -1 under \[signals\]"),
    ],
)
def test_records_that_are_no_closed_loop_are_refused_in_one_line(rig, tmp_path, capsys, change, words):
    folder = campaign(tmp_path / "c", rig, played(lambda: rig), change)
    assert main(["residual", str(folder), "--out", str(tmp_path / "r")]) == 2
    line = capsys.readouterr().err.strip().splitlines()[-1]
    assert re.search(words, line), line
    assert not (tmp_path / "r").exists()


def test_a_rig_without_an_inner_loop_says_what_to_do_with_a_reference_alone(rig, tmp_path):
    folder = campaign(tmp_path / "c", load_rig("jack-10t"), played(lambda: rig))
    with pytest.raises(InputError, match=r"no command, the input of rig jack-10t; .*\[inner\].*--ask closed-loop"):
        load_driven(folder)


def test_a_campaign_without_a_command_still_has_a_response(rig, tmp_path):
    folder = campaign(tmp_path / "c", load_rig("jack-10t"), played(lambda: rig))
    task = load(folder, ("reference", "position"))
    assert (task.rig, task.pairs[0].units) == (None, ("mm", "mm"))
    answer = run_pairs(task, True, no_checkpoint, lambda _: None)
    gains = [row["gain_db"] for row in answer.metrics["rows"]]
    assert -1.0 < gains[0] < 0.1
    assert gains[-1] < -3.0


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
    record = played(lambda: rig)
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


def test_a_loop_that_is_too_slow_for_its_reference_is_not_off():

    t = np.arange(0, 10, 1e-3)
    sweep = 2e-3 * np.sin(2 * np.pi * 1.5 * t**2)  # to 30 Hz
    slow = lfilter([0.005], [1, -0.995], sweep) + 1e-5 * np.random.default_rng(0).standard_normal(t.size)
    assert off(Record("slow", t, {"reference": sweep, "position": slow}), "reference", "position") is None
    slow[4000:6000] = slow[4000]
    assert off(Record("off", t, {"reference": sweep, "position": slow}), "reference", "position") == (4.0, 6.0)


def test_lines_that_are_sure_by_chance_beyond_a_slow_sweep_say_nothing_of_who_leads():
    f = 0.5 * np.arange(1, 1001)
    moved, chance = f <= 5, (f > 5) & (np.arange(f.size) % 20 == 0)
    kept = in_band(f, moved | chance)
    assert kept[moved].all()
    assert f[kept].max() < 20  # of 1000 lines to 500 Hz
    assert in_band(f, np.ones(f.size, bool)).all()
    assert not in_band(f, np.zeros(f.size, bool)).any()


def test_a_live_rig_with_an_inner_loop_is_not_driven(rig):
    with pytest.raises(InputError, match="has an inner loop, whose reference a trip of the guard would set to 0"):
        stands(cast(LinkClient, SimpleNamespace(at="udp://127.0.0.1:1")), rig)


def test_a_force_loop_has_no_derivative_and_a_label_of_odd_numbers_is_a_rig(tmp_path):
    assert "loop_derivative_time" in inner_specs("position")
    assert "loop_derivative_time" not in inner_specs("force")
    odd = {"force": 12345.678, "stroke": 0.4117012345, "speed": 0.333333, "M": 77.7777}
    (tmp_path / "rig.toml").write_text(closed_loop_files(odd, "odd")["rig.toml"])
    rig = load_rig(tmp_path / "rig.toml")
    assert rig.limit("stroke") == pytest.approx(rig["S"] / 2, rel=1e-12)


def test_a_pressure_makes_the_numbers_of_a_loop_sharper_and_the_page_says_by_how_much(rig, tmp_path, monkeypatch):
    folder = campaign(tmp_path / "c", rig, played(lambda: rig, 2e4))
    monkeypatch.chdir(tmp_path)
    assert main(["fit", str(folder), "--out", "f", "--starts", "1"]) == 0
    tells = json.loads(Path("f/metrics.json").read_text())["tells"]
    alone = dict(zip(tells["numbers"], tells["alone"]["position"], strict=True))
    assert min(alone["M"], alone["b"]) > 1.2
    told = [f"{alone[name]:.2g}" for name in ("loop_gain", "loop_delay", "b", "M")]
    said = f"the intervals of loop_gain, loop_delay, b and M would be {', '.join(told[:3])} and {told[3]} times as long"
    assert said in Path("f/report.html").read_text()


@pytest.mark.parametrize("pinned", [False, True])
def test_what_a_loop_hides_is_said_before_any_effect_is_tried(rig, tmp_path, pinned):
    """A lag of the drive is as good as a later reference, which nobody knows; unequal lands are as good as a bias."""
    numbers = {**rig.numbers, "loop_delay": Number("loop_delay", 2e-3, "s", "s", "measured")} if pinned else rig.numbers
    own = Rig(**{**vars(rig), "numbers": numbers})
    records, own = load_driven(campaign(tmp_path / "c", own, played(lambda: own)))
    problem = estimation_problem(records, own)
    told = told_effects(problem, fit_rig(problem), [e for e in effects_for(own) if e.name in TOLD])
    assert set(told.shown) | set(told.hidden) == TOLD
    assert ("drive.lag" in told.shown) == pinned
    assert told.alike == [["main.asymmetry", "load.bias"]]


def test_the_page_of_a_trace_says_what_a_loop_lets_through():
    told = ToldEffects(
        ["load.bias", "main.asymmetry", "main.deadband"], ["drive.lag"], [["load.bias", "main.asymmetry"]]
    )
    named = SimpleNamespace(candidate=SimpleNamespace(effect=SimpleNamespace(name="main.asymmetry")))
    trace = cast(Trace, SimpleNamespace(told=told, effects=(named,)))
    said = told_sentence(trace)
    assert "Of 4 effects these records of a closed loop could show 3" in said
    assert "They do not tell main.asymmetry from load.bias." in said
    (section,) = told_section(trace)
    (table,) = section.items
    assert isinstance(table, Table)
    assert ["load.bias", True, "main.asymmetry"] in table.rows
    assert ["drive.lag", False, ""] in table.rows
    open_loop = cast(Trace, SimpleNamespace(told=None, effects=()))
    assert told_sentence(open_loop) == ""
    assert told_section(open_loop) == []
