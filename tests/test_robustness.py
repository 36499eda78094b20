"""Robustness: the margins in lanes are those one by one, and the command leaves what the contract says."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.common.run_folder import metrics_json
from workbench.commands.common.step_experiment import load_steps
from workbench.commands.robustness.options import RobustnessConfig
from workbench.commands.robustness.study import run_robustness
from workbench.linear import Equilibrium, equilibrium
from workbench.linear.equilibria import equilibria
from workbench.loop.lane_laws import lane_laws
from workbench.loop.margins import LaneMargins, LoopLanes, linear_loop
from workbench.loop.rig_variations import with_delay
from workbench.loop.robustness import workers
from workbench.loop.robustness.drawn_plants import drawn, plants_by_block
from workbench.loop.robustness.linear_loops import linear_loops, places
from workbench.loop.rows import MOVING
from workbench.loop.sampled_lanes import sampled_lanes
from workbench.loop.step_metrics import hunting_lanes
from workbench.plant import build
from workbench.report import Table
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
SHIPPED = EXPERIMENTS / "robustness.toml"
KEYS = [
    "controller", "plants", "unstable", "tripped", "hunting", "settling_p50_s", "settling_p99_s", "settling_worst_s",
    "overshoot_worst_percent", "ms_worst", "gain_margin_worst_db",
]  # fmt: skip


def same_margins(margins, lane, loop):
    """A lane's margins are those of its loop alone, but for the resonances of others that its grid has too."""
    assert margins.stable[lane] == loop.stable
    if loop.stable:
        assert margins.ms[lane] == pytest.approx(loop.ms, rel=1e-4)
        assert margins.gain_margin_db[lane] == pytest.approx(loop.gain_margin_db, abs=1e-3)
        assert margins.phase_margin_deg[lane] == pytest.approx(loop.phase_margin_deg, abs=1e-2)


@pytest.mark.parametrize("delay", [0.0, 0.3e-3, 1e-3, 2.4e-3])
@pytest.mark.parametrize("name", ["p-dp", "crone2", "tvc"])
def test_margins_in_lanes_are_those_of_the_loop(delay, name):
    specs = {spec.name: spec for spec in load_steps(EXPERIMENTS / "position_tuned.toml").controllers}
    rig = load_rig("jack-10t")
    plant = build(with_delay(rig, delay) if delay else rig)
    p = np.tile(plant.p, (3, 1))
    p[1, plant.parameters.index("M")] *= 0.5
    p[2, plant.parameters.index("beta")] *= 0.5
    points = equilibria(plant, p, np.array([0.0, 0.1, -0.15]))
    sampled = sampled_lanes(plant, points, p, tuple(specs[name].build(1e-3).measures), 1e-3)
    margins = LoopLanes(sampled, lane_laws(specs[name].build(1e-3), sampled.signals)).margins()
    for lane in range(3):
        about = Equilibrium(points.x[lane], points.u[lane], 0.0)
        loop = linear_loop(plant, about, specs[name].build(1e-3), 1e-3, p[lane])
        same_margins(margins, lane, loop)


def test_hunting_is_an_oscillation_that_stays():
    """Not a loop that is still on its way, nor a mode of damping 0.02 at 27 Hz that is dying away."""
    t = np.arange(1000) * 1e-3
    slow, ringing = 0.01 * (1 - np.exp(-t)), 1e-3 * np.exp(-0.02 * 2 * np.pi * 27 * t) * np.sin(2 * np.pi * 27 * t)
    y = np.stack((slow, 0.01 + ringing, 0.01 + 3e-5 * np.sin(2 * np.pi * 80 * t)))
    assert hunting_lanes(1e-3, y, 0.01, 0.002).tolist() == [False, False, True]


def test_plants_are_drawn_within_bounds_and_factors_from_the_seed():
    config = RobustnessConfig.load(SHIPPED, plants=500)
    plant = build(config.rig)
    first, again = drawn(config, plant), drawn(config, plant)
    assert np.array_equal(first.p, again.p)
    assert np.array_equal(first.p[0], plant.p)
    for name, values in first.numbers.items():
        number = config.rig.numbers[name]
        low, high = number.low, number.high
        if name in config.factors:
            low, high = (factor * number.value for factor in config.factors[name])
        assert low is not None
        assert high is not None
        assert values.min() >= low
        assert values.max() <= high
        assert np.ptp(values) > 0.9 * (high - low)
    assert {"M", "beta", "Ps", "Kp", "V0"} <= first.numbers.keys()
    assert np.abs(first.position + config.step / 2).max() <= 0.9 * config.rig.limit("stroke")


def test_a_block_of_plants_is_what_it_is_among_all():
    config = RobustnessConfig.load(SHIPPED, plants=500)
    plant = build(config.rig)
    whole = drawn(config, plant)
    for block in (range(500), range(7), range(7, 260), range(499, 500)):
        part = drawn(config, plant, block)
        assert np.array_equal(part.p, whole.p[block.start : block.stop])
        assert np.array_equal(part.position, whole.position[block.start : block.stop])


def test_results_do_not_depend_on_the_blocks(tmp_path, monkeypatch):
    """Draws, noise and counts: a plant plays as it does among all."""
    config = RobustnessConfig.load(few(tmp_path, '["p-dp", "mpc"]'), plants=25)
    whole = run_robustness(config, no_checkpoint, lambda _: None)
    monkeypatch.setattr(workers, "BLOCK", 9)
    parts = run_robustness(config, no_checkpoint, lambda _: None)
    assert list(parts.tables) == list(whole.tables)
    for table, columns in whole.tables.items():
        for name, values in columns.items():
            np.testing.assert_allclose(parts.tables[table][name], values, rtol=1e-9, equal_nan=True)
    for key in ("rows", "linear"):
        assert metrics_json({key: parts.metrics[key]}) == metrics_json({key: whole.metrics[key]})


def few(folder, controllers):
    """The shipped experiment with a few controllers, in a folder; its path."""
    start = SHIPPED.read_text().split("[from]")[0]
    (folder / "few.toml").write_text(f'{start}[from]\n"{EXPERIMENTS}/position_tuned.toml" = {controllers}\n')
    return folder / "few.toml"


def test_linear_loops_at_every_position_are_those_of_the_loop(tmp_path):
    config = RobustnessConfig.load(few(tmp_path, '["p-dp", "mpc"]'), plants=3)
    plants = plants_by_block(config)(0.3e-3, range(3))
    controllers = {spec.name: spec.build(1e-3) for spec in config.controllers}
    plant, limit = plants.engine.plant, config.rig.limit("stroke")
    positions = {place.position for place in places(config) if place.position is not None}
    assert sorted(positions) == pytest.approx([-0.9 * limit, -0.5 * limit, 0, 0.5 * limit, 0.9 * limit])
    assert len(places(config)) == 12
    for place in places(config):
        columns = linear_loops(plants, controllers, place)
        speed = {"null": 0.0, "moving": MOVING}[place.point]
        for name, controller in controllers.items():
            for lane in range(3):
                x = float(plants.draw.position[lane]) if place.position is None else place.position
                p = plants.draw.p[lane]
                about = equilibrium(plant, speed=speed, position=x, p=p, specimen_velocity=speed)
                loop = linear_loop(plant, about, controller, 1e-3, p)
                same_margins(LaneMargins(**columns[name]), lane, loop)


def test_the_command_leaves_what_the_contract_says(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    few(tmp_path, '["p-dp", "mpc"]')
    assert main(["robustness", "few.toml", "--plants", "40"]) == 0
    metrics = json.loads((tmp_path / "out" / "few" / "metrics.json").read_text())
    assert metrics["left_out"] == []
    assert [row["controller"] for row in metrics["rows"]] == ["p-dp", "mpc"]
    row = metrics["rows"][0]
    assert list(row)[: len(KEYS)] == KEYS
    assert {"x [m]", "beta [Pa]", "M [kg]"} <= row["worst"].keys()
    assert row["plants"] == 40
    assert 0.05 < row["settling_p50_s"] < 0.2
    assert row["times_limit"] == pytest.approx(row["settling_p99_s"] / metrics["limit_s"], rel=1e-8)
    assert metrics["timing"]["closed_loop_seconds_per_cpu_second"]["p-dp"] > 0
    for name in ("p-dp", "mpc"):
        rows = [row for row in metrics["linear"] if row["controller"] == name]
        places = [(row["position"], row["point"]) for row in rows]
        positions = [None, -0.216, -0.12, 0.0, 0.12, 0.216]
        assert places == [(position, point) for position in positions for point in ("null", "moving")]
    of_p_dp = [row["unstable"] for row in metrics["linear"] if row["controller"] == "p-dp"]
    assert max(of_p_dp) <= row["unstable"] <= sum(of_p_dp)
    assert (row["ms_worst"] is None) == (row["unstable"] > 0)
    assert main(["robustness", "few.toml", "--plants", "40", "--out", "again", "--jobs", "1"]) == 0
    other = json.loads((tmp_path / "again" / "metrics.json").read_text())
    assert other["rows"] == metrics["rows"]
    assert other["linear"] == metrics["linear"]


@pytest.mark.parametrize(
    ("was", "now", "message"),
    [
        ("M = [0.5, 1.5]", "Mass = [0.5, 1.5]", "no such number"),
        ("M = [0.5, 1.5]", "M = [1.5, 0.5]", "least and the largest factor"),
        ("stroke = 0.9", "stroke = 1.9", "at most 1"),
        ("stroke = 0.9", "stroke = 0.9\npositions = [0, 1.1]", "from -1 to 1"),
        ("stroke = 0.9", "stroke = 0.9\nknown = 60", "at most 50"),
        ("plants = 10000", "plants = 0", "whole number"),
        ('unit = "mm"', 'unit = "kg"', "cannot be converted"),
        ("plants = ", 'computing_delay = "0.3 ms"\nplants = ', "the rig or a controller says it"),
    ],
)
def test_nonsense_is_refused_in_one_line(tmp_path, monkeypatch, capsys, was, now, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.toml").write_text(SHIPPED.read_text().replace(was, now))
    (tmp_path / "position_tuned.toml").write_text((EXPERIMENTS / "position_tuned.toml").read_text())
    (tmp_path / "position_crone.toml").write_text((EXPERIMENTS / "position_crone.toml").read_text())
    assert main(["robustness", "bad.toml"]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_the_tuned_loop_holds_on_drawn_plants_over_the_stroke_with_noise_and_delay(tmp_path):
    """10 mm within 0.10 s on the nominal rig and 0.14 s on 99 of 100 plants; none unstable, none hunts, Ms <= 2.5."""
    config = RobustnessConfig.load(few(tmp_path, '["p-dp"]'), plants=200)
    outcome = run_robustness(config, no_checkpoint, lambda _: None)
    (row,) = outcome.metrics["rows"]
    assert row["unstable"] == row["tripped"] == row["hunting"] == 0
    assert outcome.tables["plants_p_dp"]["settling_s"][0] <= 0.10
    assert row["settling_p99_s"] <= 0.14
    assert row["ms_worst"] <= 2.5
    at_nominal = [line["ms_p50"] for line in outcome.metrics["linear"] if line["position"] is not None]
    assert max(at_nominal) <= 2.0


def test_a_controller_s_own_delay_counts_and_an_ideal_loop_has_none(tmp_path):
    plain = few(tmp_path, '["p-dp"]')
    late = (
        (EXPERIMENTS / "position_tuned.toml")
        .read_text()
        .replace("[controllers.p-dp]", '[controllers.p-dp]\ncomputing_delay = "2 ms"')
    )
    (tmp_path / "late.toml").write_text(late)
    texts = {
        "rig's": plain.read_text(),
        "own": plain.read_text().replace(f"{EXPERIMENTS}/position_tuned.toml", "late.toml"),
        "none": "ideal = true\n" + plain.read_text(),
    }
    ms = {}
    for name, text in texts.items():
        plain.write_text(text)
        outcome = run_robustness(RobustnessConfig.load(plain, plants=2), no_checkpoint, lambda _: None)
        ms[name] = outcome.metrics["rows"][0]["ms_worst"]
        delay = {"rig's": 0.3e-3, "own": 2e-3, "none": 0.0}[name]
        table = outcome.page.sections[-2].items[0]
        assert isinstance(table, Table)
        drawn = {row[0]: row[1:] for row in table.rows}
        assert drawn["computing delay"] == [delay, delay, "s"]
    assert ms["none"] < ms["rig's"] < ms["own"]


FORCE = EXPERIMENTS / "robustness_force.toml"


def test_force_loops_hold_on_specimens_a_decade_apart_over_the_stroke(tmp_path):
    text = FORCE.read_text().split('"force_step.toml"')[0].replace('["p-dp-force", "mpc-force"]', '["p-dp-force"]')
    (tmp_path / "force.toml").write_text(text.replace('"force_tuned.toml"', f'"{EXPERIMENTS}/force_tuned.toml"'))
    config = RobustnessConfig.load(tmp_path / "force.toml", plants=200)
    assert (config.signal.name, config.step) == ("force", 20e3)
    stiffness = drawn(config, build(config.rig)).numbers["ks"]
    assert 1e6 <= stiffness.min() < 1.2e6
    assert 8e6 < stiffness.max() <= 1e7
    assert np.median(stiffness) == pytest.approx(10**6.5, rel=0.2)  # even over the decade
    row = run_robustness(config, no_checkpoint, lambda _: None).metrics["rows"][0]
    assert (row["unstable"], row["tripped"], row["hunting"]) == (0, 0, 0)
    assert row["ms_worst"] <= 2.5
    assert row["settling_p50_s"] <= 0.15


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            '"position_tuned.toml" = ["p-dp"]\n"force_tuned.toml" = ["mpc-force"]',
            "from: mpc-force controls the force, p-dp the position",
        ),
        ('"force_tuned.toml" = ["mpc-force"]', "specimen: a force needs something to act on"),
    ],
)
def test_loops_that_do_not_go_together_are_refused(tmp_path, text, message):
    text = text.replace('"position', f'"{EXPERIMENTS}/position').replace('"force', f'"{EXPERIMENTS}/force')
    (tmp_path / "bad.toml").write_text(SHIPPED.read_text().split("[from]")[0] + f"[from]\n{text}\n")
    with pytest.raises(InputError, match=message):
        RobustnessConfig.load(tmp_path / "bad.toml")


@pytest.mark.parametrize("command", ["robustness", "faults", "sines"])
def test_an_experiment_of_another_kind_is_called_that(capsys, command):
    """Before any key of it is called unknown."""
    assert main([command, "first_loop"]) == 2
    assert f'"step" is not "{command}"; jackbench run takes it' in capsys.readouterr().err


def test_the_numbers_of_effects_that_were_found_are_drawn_within_their_intervals():
    found = Number("Fc", 500.0, "N", "N", "found", 0.0, 5000.0, (400.0, 600.0))
    config = RobustnessConfig.load(SHIPPED, plants=50)
    rig = replace(config.rig, effects=(EffectUse("jack.friction", "coulomb", {"Fc": found}),))
    plant = build(rig)
    draw = drawn(replace(config, rig=rig), plant)
    forces = draw.p[:, plant.parameters.index("jack.friction.Fc")]
    assert forces[0] == 500.0
    assert 400.0 <= forces.min() < 420.0
    assert 580.0 < forces.max() <= 600.0
    assert draw.columns(rig)["jack.friction.Fc [N]"] == pytest.approx(forces)
