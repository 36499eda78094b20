"""One free run against the mean of repeats: phases told apart, what is clipped left out, the spread of the repeats."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.residual.study import run_residual
from workbench.engine import Engine
from workbench.identify.data.noise_floor import NoiseFloor, noise_floor
from workbench.identify.fit.repeats import MOVING, STANDING, WHOLE, against_mean, mean_of, repeated
from workbench.linear import equilibrium
from workbench.plant import build
from workbench.records import Campaign, Record, load_campaign
from workbench.rigs.rig_file import load_rig

SIGMA = {"pa": 3e4, "pb": 3e4, "position": 3e-4}
DATA = Path(__file__).parents[2] / "shared" / "data" / "festo_tp511"
FLOOR = NoiseFloor(SIGMA, dict.fromkeys(SIGMA, 1.0), dict.fromkeys(SIGMA, "static record"))


@pytest.fixture(scope="module")
def plant():
    return build(load_rig("festo-tp511"))


def command(rows: int) -> np.ndarray:
    """Nothing, a move, and a halt at null: 0.1 s, 0.5 s and the rest."""
    t = np.arange(rows) * 1e-3
    return np.where((t >= 0.1) & (t < 0.6), 0.3, 0.0)


def repeat(plant, seed: int, names=("pa", "position"), rows: int = 1200) -> Record:
    random = np.random.default_rng(seed)
    t = np.arange(rows) * 1e-3
    u = np.zeros((rows, len(plant.inputs)))
    u[:, plant.input("command")] = command(rows)
    y = plant.observe(Engine(plant).run(equilibrium(plant).x, t, u).x, u)
    noisy = {n: y[:, plant.output(n)] + SIGMA[n] * random.standard_normal(rows) for n in names}
    return Record(f"run {seed}", t, {"command": u[:, plant.input("command")], **noisy})


@pytest.fixture(scope="module")
def runs(plant):
    """Four repeats, two of them with one pressure and two with the other."""
    return [repeat(plant, seed, (pressure, "position")) for seed, pressure in enumerate(("pa", "pa", "pb", "pb"))]


def test_records_of_one_command_are_repeats_and_cut_to_the_shortest(plant, runs):
    short = repeat(plant, 9, rows=1100)
    other = replace(runs[0], signals=dict(runs[0].signals) | {"command": 2 * runs[0].signals["command"]})
    alone = replace(runs[0], signals=dict(runs[0].signals) | {"command": 0 * runs[0].signals["command"]})
    (group,) = repeated([runs[0], other, short, alone])
    assert [record.name for record in group] == ["run 0", "run 9"]
    assert {record.t.size for record in group} == {1100}


def test_the_mean_has_every_signal_that_some_repeat_carries(runs):
    mean = mean_of(runs)
    assert set(mean.signals) == {"command", "pa", "pb", "position"}
    assert mean.signals["pb"] == pytest.approx((runs[2].signals["pb"] + runs[3].signals["pb"]) / 2)
    assert np.std(mean.signals["position"][:100]) == pytest.approx(SIGMA["position"] / 2, rel=0.3)


def test_a_true_model_is_as_near_to_the_mean_as_its_noise(plant, runs):
    """The mean of n repeats has their noise over the root of n; a repeat differs by the noise."""
    found = {one.name: one for one in against_mean(plant, runs, FLOOR)}
    for name, count in (("pa", 2), ("pb", 2), ("position", 4)):
        assert found[name].errors[WHOLE] == pytest.approx(SIGMA[name] / np.sqrt(count), rel=0.15)
        assert found[name].repeatability[WHOLE] == pytest.approx(SIGMA[name], rel=0.15)
    assert found["pa"].records == ("run 0", "run 1")


def test_phases_are_told_apart_by_the_speed_of_the_measured_position(plant, runs):
    """An error that is there only while the piston moves is not seen standing."""
    moves = (runs[0].t > 0.15) & (runs[0].t < 0.55)
    wrong = [
        replace(r, signals=dict(r.signals) | {"pa": r.signals["pa"] + 2e6 * moves}) if "pa" in r.signals else r
        for r in runs
    ]
    pa = next(one for one in against_mean(plant, wrong, FLOOR) if one.name == "pa")
    assert pa.errors[MOVING] == pytest.approx(2e6, rel=0.2)
    whole, standing = (pa.errors[phase] or np.inf for phase in (WHOLE, STANDING))
    assert standing < 2 * SIGMA["pa"]
    assert 10 * standing < whole < 2e6


def test_what_is_clipped_in_one_repeat_is_not_compared(plant, runs):
    far = np.where(runs[0].t > 0.9, 1.0, 0.0)
    clipped = replace(
        runs[0],
        signals=dict(runs[0].signals) | {"position": runs[0].signals["position"] + far},
        valid={"position": far == 0},
    )
    position = next(one for one in against_mean(plant, [clipped, *runs[1:]], FLOOR) if one.name == "position")
    assert (position.errors[WHOLE] or np.inf) < SIGMA["position"]


def test_the_residual_study_reports_it(runs, plant):
    rig = load_rig("festo-tp511")
    campaign = Campaign(Path("made"), "festo-tp511", (), (), tuple(runs))
    outcome = run_residual(campaign, rig, no_checkpoint, lambda _: None, free_run=True)
    rows = {row["signal"]: row for row in outcome.metrics["free_run"]}
    assert set(rows) == {"pa", "pb", "position"}
    assert rows["pa"]["unit"] == "bar"
    assert rows["pa"]["records"] == ["run 0", "run 1"]
    assert rows["position"]["whole"] < 0.3
    assert rows["position"]["repeatability"]["whole"] == pytest.approx(0.3, rel=0.15)
    assert "Free run" in [section.title for section in outcome.page.sections]
    assert "free_run" not in run_residual(campaign, rig, no_checkpoint, lambda _: None).metrics


def test_a_record_without_repeats_has_the_error_of_its_own_free_run(runs):
    campaign = Campaign(Path("made"), "festo-tp511", (), (), (runs[0],))
    outcome = run_residual(campaign, load_rig("festo-tp511"), no_checkpoint, lambda _: None, free_run=True)
    rows = outcome.metrics["free_run"]
    assert [(row["records"], row["signal"]) for row in rows] == [(["run 0"], "pa"), (["run 0"], "position")]
    assert [row["whole"] for row in rows] == pytest.approx([row["free_run_rms"] for row in outcome.metrics["rows"]])
    assert rows[0]["repeatability"] == {"whole": None, "moving": None, "standing": None}
    assert f"position {rows[1]['whole']:.3g} mm in run 0." in outcome.page.verdict


@pytest.mark.skipif(not DATA.is_dir(), reason="no real recordings here")
def test_what_a_trace_found_follows_a_real_rig_at_a_voltage_that_was_never_fitted():
    """Five effects, fitted to 1 and 5 V; the mean of the repeats at 3 V within 0.9 mm, 1.3 bar and 1.1 bar."""
    campaign = load_campaign(DATA)
    (group,) = repeated(campaign.heldout)
    plant = build(load_rig(Path(__file__).parent / "festo_found.toml"))
    found = {one.name: one.errors for one in against_mean(plant, group, noise_floor(campaign))}
    for name, most in (("position", 0.9e-3), ("pa", 1.3e5), ("pb", 1.1e5)):
        assert (found[name][WHOLE] or np.inf) < most
    assert (found["position"][MOVING] or np.inf) < 1.5e-3
    assert (found["pa"][MOVING] or np.inf) < 1.1e5
