"""Records on drawn plants: learned and filtered in lanes as on each plant by itself; what the experiments leave."""

import json
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest
from made_experiments import P_DP

from workbench.cli import main
from workbench.commands.learn.options import LearnConfig
from workbench.loop.learning import STOPS, learn, learn_lanes, learning_filter, record_frequencies
from workbench.loop.repeated_record import PlayedLanes
from workbench.loop.rows import linear_loops

PERIOD, SAMPLES = 1e-3, 2000
F = record_frequencies(SAMPLES, PERIOD)
RECORD = (
    """
rig = "jack-10t"
rigs = ["nominal", "beta-50"]
scenarios = ["sine"]
rest = "0.3 s"
fade = "0.5 s"
plants = 12
stroke = 0.9
[within]
M = [0.5, 1.5]
beta = [0.5, 1.15]
[scenario.sine]
size = "20 mm"
frequency = "4 Hz"
seconds = "1.4 s"
"""
    + P_DP
)
LEARN = f'experiment = "learn"\niterations = 3\n{RECORD}'
INVERSE = (
    f'experiment = "inverse"\ndesigned_on = ["nominal"]\npreview = "60 ms"\nlength = "200 ms"\nband = "5 Hz"\n{RECORD}'
)


def lag(corner):
    """A closed loop of second order, complex at F."""
    s = 1j * F / corner
    return 1 / (1 + s + s**2)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "learn.toml").write_text(LEARN)
    (tmp_path / "inverse.toml").write_text(INVERSE)
    return tmp_path


def test_lanes_learn_what_each_loop_learns_by_itself(folder):
    """The first drawn plant is the nominal one: the same iterations, noise on."""
    config = LearnConfig.load("learn.toml")
    record, spec = config, config.controller
    (setup, _) = record.setups(spec).values()
    reference = record.reference
    f = record_frequencies(len(reference), PERIOD)
    loop = linear_loops(spec, setup).null
    closed = np.interp(f, loop.f, loop.closed)[None]
    learning = learning_filter(f, len(reference), closed, closed, 20.0)
    alone = learn(learning, reference, record.repeated(spec, setup).play, 3)
    (lanes,) = record.lanes(spec, record.drawn)
    together = learn_lanes(learning, reference, lanes.play, len(lanes.p), 3)
    errors = [alone.error(iteration) for iteration in alone.iterations]
    assert together.errors[0][: len(errors)] == pytest.approx(errors, rel=1e-4)
    assert together.kept[0][: len(errors)].tolist() == [iteration.kept for iteration in alone.iterations]
    assert together.floor[0] == pytest.approx(alone.floor, rel=1e-4)
    assert together.fall_db[0] == pytest.approx(alone.fall_db, abs=1e-3)
    assert together.fall_db.shape == (12,)


def linear_lanes(loops, noise, broken=()):
    """Plays drives on linear loops [lanes, k], with noise of its own each time; `broken` lanes trip."""
    filters = [replace(learning_filter(F, SAMPLES, t[None], t[None], 50.0), q=np.ones(len(F))) for t in loops]

    def play(number, drives, lanes):
        random = np.random.default_rng(number + 2)
        true = np.array(
            [filters[lane]._filtered(loops[lane], drive) for lane, drive in zip(lanes, drives, strict=True)]
        )
        return PlayedLanes(true, true + noise * random.standard_normal(true.shape), np.isin(lanes, broken))

    return play


def test_each_lane_stops_for_its_own_reason():
    """A loop as the filter knows it, one of 2.4 times its gain, one of 12 times, and one whose record trips."""
    t = np.arange(SAMPLES) * PERIOD
    reference = 0.05 * np.sin(2 * np.pi * 5 * t) * np.sin(np.pi * t / t[-1]) ** 2
    learning = learning_filter(F, SAMPLES, lag(8.0)[None], lag(8.0)[None], 100.0)
    loops = [lag(8.0), 2.4 * lag(8.0), 12 * lag(8.0), lag(8.0)]
    learned = learn_lanes(learning, reference, linear_lanes(loops, 1e-4, broken=[3]), 4, 8)
    assert STOPS[learned.stopped[0]] == "what is left of the error does not repeat"
    assert STOPS[learned.stopped[2]] == "a smaller gain makes the error no smaller"
    assert learned.taken_back.tolist() == [False, True, True, False]
    assert (learned.fall_db[:2] > 20).all()
    assert learned.fall_db[2:].tolist() == [0.0, 0.0]
    assert learned.tripped[3].tolist() == [True, *[False] * 8]
    assert np.isnan(learned.errors[3, 1:]).all()


def test_the_drive_file_is_learned_on_drawn_plants(folder):
    assert main(["learn", "learn.toml", "--plants", "5"]) == 0
    (row,) = json.loads((folder / "out/learn/metrics.json").read_text())["plants"]
    table = pq.read_table(folder / "out/learn/plants.parquet")
    assert (row["controller"], row["plants"], row["trips"]) == ("p-dp", 5, 0)
    assert row["fallen"] == 5
    assert row["fall_least_db"] == pytest.approx(np.min(table["fall_db"]))
    assert sum(row["stopped"].values()) == 5
    assert "Drawn plants" in (folder / "out/learn/report.html").read_text()


def test_an_inverse_is_judged_on_drawn_plants_by_every_controller(folder):
    other = '[controllers.p]\nuse = "controllers.p:P"\ngain = "0.1 1/m"\n'
    (folder / "inverse.toml").write_text(INVERSE + other)
    assert main(["inverse", "inverse.toml"]) == 0
    metrics = json.loads((folder / "out/inverse/metrics.json").read_text())
    assert [(row["controller"], row["rig"]) for row in metrics["rows"]] == [
        (name, rig) for name in ("p-dp", "p") for rig in ("nominal", "beta-50")
    ]
    row = metrics["plants"][0]
    table = pq.read_table(folder / "out/inverse/plants-p-dp.parquet")
    assert (row["plants"], row["tripped"], row["tripped_inverse"]) == (12, 0, 0)
    assert row["error_rms_worst"] == pytest.approx(np.max(table["error_rms"]))
    assert row["larger"] == np.sum(np.array(table["error_rms_inverse"]) > np.array(table["error_rms"])) == 0
    assert row["factor_least"] > 2
    nominal = metrics["rows"][0]
    assert table["error_rms"][0].as_py() == pytest.approx(nominal["error_rms"], rel=1e-4)
    assert table["error_rms_inverse"][0].as_py() == pytest.approx(nominal["error_rms_inverse"], rel=1e-3)


@pytest.mark.parametrize("command", ["learn", "inverse"])
@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("plants = 12", "", "how many under `plants`"),
        ("stroke = 0.9", "stroke = 0.05", "stroke: the record of 20 mm leaves it even from mid stroke"),
        ("stroke = 0.9", "", "stroke"),
        ("M = [0.5, 1.5]", "m = [0.5, 1.5]", "no such number"),
    ],
)
def test_what_cannot_be_drawn_is_refused(folder, capsys, command, old, new, said):
    text = {"learn": LEARN, "inverse": INVERSE}[command]
    (folder / "bad.toml").write_text(text.replace(old, new))
    assert main([command, "bad.toml"]) == 2
    assert said in capsys.readouterr().err


def test_plants_of_an_experiment_that_draws_none_are_refused(folder, capsys):
    start, rest = LEARN.split("plants = 12")
    (folder / "bad.toml").write_text(start + rest.partition("beta = [0.5, 1.15]\n")[2])
    assert main(["learn", "bad.toml", "--plants", "5"]) == 2
    assert "the experiment draws none" in capsys.readouterr().err
