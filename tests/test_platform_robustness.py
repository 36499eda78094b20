"""Drawn platforms: what is drawn, and that loops and steps on them are those of each by itself."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.base.checkpoint import no_checkpoint
from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.common.shipped import experiment
from workbench.commands.robustness.options import PlatformRobustness
from workbench.commands.robustness.platform_study import run_platform_robustness
from workbench.loop.platform.loop import run_platform
from workbench.loop.platform.robustness import drawn_platform, linear_columns, step_columns
from workbench.loop.platform.setup import platform_setup
from workbench.loop.platform.transfer import platform_transfer
from workbench.rigs.platform import AXES

SHIPPED = experiment("robustness_hexapod")
LIGHT = experiment("robustness_hexapod_light")
CONFIG = PlatformRobustness.load(SHIPPED, plants=4)


@pytest.fixture(scope="module")
def setup():
    return platform_setup(CONFIG.rig, CONFIG.delay)


@pytest.fixture(scope="module")
def drawn(setup):
    return [drawn_platform(setup, CONFIG.draw, 1, number) for number in range(4)]


def test_a_draw_lies_in_its_ranges_and_stands_still(setup, drawn):
    plant = setup.engine.plant
    for each in drawn:
        share = each.numbers["mass"] / CONFIG.rig["mass"]
        assert 0.75 <= share <= 1.25
        assert each.p[plant.parameters.index("Izz")] == pytest.approx(share * CONFIG.rig["Izz"])
        assert all(abs(each.numbers[name] - CONFIG.rig[name]) <= 0.2 for name in ("cx", "cy", "cz"))
        assert np.all(np.abs(each.pose) <= CONFIG.draw.pose)
        oils = [each.p[plant.parameters.index(f"leg{i + 1}.beta")] for i in range(6)]
        assert len(set(oils)) == 6
        assert 0.8e9 <= min(oils) < max(oils) <= 1.1e9
        rates = np.array(plant.f(each.setup.null.x, each.setup.null.u, each.p)).ravel()
        moving = [plant.state(axis) for axis in AXES]
        assert np.abs(rates[moving]).max() < 1e-6
    again = drawn_platform(setup, CONFIG.draw, 1, 2)
    assert np.array_equal(again.p, drawn[2].p)


def test_loops_and_steps_on_a_drawn_platform_are_those_of_the_platform_built_by_itself(setup, drawn):
    """One in which only the payload and the pose are drawn, built anew."""
    draw = replace(CONFIG.draw, factors={})
    each = drawn_platform(setup, draw, 7, 0)
    names = ("mass", "cx", "cy", "cz")
    inertia = {name: each.numbers["mass"] / CONFIG.rig["mass"] * CONFIG.rig[name] for name in ("Ixx", "Iyy", "Izz")}
    p = setup.engine.plant.parameter_values(None, **{name: each.numbers[name] for name in names}, **inertia)
    plain = replace(each, p=p)
    own = platform_setup(
        CONFIG.rig.with_values(**{name: each.numbers[name] for name in names}, **inertia), CONFIG.delay, each.pose
    )
    plain = replace(plain, setup=own.known_as(setup))
    step = CONFIG.steps[1]
    for spec in CONFIG.controllers:
        controller = spec.build(setup.platform.period, setup.directions)
        alone = run_platform(plain.setup, controller, each.pose + step.pose(setup.platform.period))
        beside = step_columns(setup, [drawn[0], plain], controller, step, None)
        moved = alone.pose[:, step.axis] - alone.pose[0, step.axis]
        late = np.flatnonzero(np.abs(moved - step.size) > 0.02 * step.size)[-1] + 1
        assert beside.settling[1] == pytest.approx(late * setup.platform.period, abs=2e-3)
        assert beside.overshoot[1] == pytest.approx(100 * (moved.max() / step.size - 1), abs=0.01)
        assert not beside.tripped.any()
        loop = platform_transfer(plain.setup, controller, np.geomspace(0.5, 100.0, 120))
        assert linear_columns([plain], controller).ms[0] == pytest.approx(float(loop.sensitivity.max()), rel=1e-6)


def test_a_bare_platform_is_unstable_and_hunts_about_where_it_stands(setup, drawn):
    """One payload of the light end beside one of the others; under p-dp it swings on, too little for a trip."""
    light = drawn_platform(setup, replace(CONFIG.draw, mass=(0.075, 0.1)), 1, 0)
    p_dp = CONFIG.controllers[0].build(setup.platform.period, setup.directions)
    assert linear_columns([drawn[0], light], p_dp).stable.tolist() == [True, False]
    played = step_columns(setup, [drawn[0], light], p_dp, CONFIG.steps[1], 3)
    assert played.hunting.tolist() == [False, True]
    assert not played.tripped.any()


def test_rows_say_on_which_payloads_a_controller_fails():
    light = PlatformRobustness.load(LIGHT, plants=3)
    only = replace(light, draw=replace(light.draw, mass=(0.075, 0.09)), steps=light.steps[:1])
    metrics = run_platform_robustness(only, no_checkpoint, lambda _: None).metrics
    (linear,) = (row for row in metrics["linear"] if row["controller"] == "p-dp")
    assert linear["unstable"] == 3
    assert 300 <= linear["unstable_least_kg"] < linear["unstable_most_kg"] <= 360
    (row,) = (row for row in metrics["rows"] if row["controller"] == "p-dp")
    assert row["hunting"] == 3
    assert (row["failing_least_kg"], row["failing_most_kg"]) == (
        linear["unstable_least_kg"],
        linear["unstable_most_kg"],
    )


def test_the_study_counts_and_draws(tmp_path):
    outcome = run_platform_robustness(CONFIG, no_checkpoint, lambda _: None)
    rows = outcome.metrics["rows"]
    assert [(row["controller"], row["scenario"]) for row in rows] == [
        (spec.name, step.name) for spec in CONFIG.controllers for step in CONFIG.steps
    ]
    assert all(row["tripped"] == row["hunting"] == row["never"] == 0 for row in rows)
    assert all(row["failing_least_kg"] is None for row in rows)
    assert all(0.05 < row["settling_p50_s"] <= row["settling_worst_s"] < 0.3 for row in rows)
    linear = {row["controller"]: row for row in outcome.metrics["linear"]}
    assert linear["modal"]["coupling_worst_percent"] < linear["p-dp"]["coupling_median_percent"]
    assert outcome.page.verdict.startswith("modal holds on all platforms")
    assert set(outcome.tables["plants"]) >= {"mass", "pitch", "modal_heave-10mm_settling"}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mass = [0.75, 1.25]", "mass = [1.25, 0.75]", "the least and the largest factor"),
        ("beta = [0.8, 1.1]", "betta = [0.8, 1.1]", "no such number"),
        ('"heave-10mm"', '"heave-10deg"', "heave is in mm"),
        ("plants = 1000", "plants = 1000\nstep = '10 mm'", "step"),
    ],
)
def test_bad_input_is_one_line(old, new, message, tmp_path, capsys):
    path = tmp_path / "mine.toml"
    text = SHIPPED.read_text().replace('"hexapod.toml"', f'"{SHIPPED.with_name("hexapod.toml")}"')
    path.write_text(text.replace(old, new))
    with pytest.raises(SystemExit) as stopped:
        raise SystemExit(main(["robustness", str(path), "--out", str(tmp_path / "out")]))
    assert stopped.value.code == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_jacks_that_cannot_hold_a_platform_are_told(setup):
    with pytest.raises(InputError, match="drawn platform 0"):
        drawn_platform(setup, replace(CONFIG.draw, mass=(60.0, 60.0)), 1, 0)
