"""Iterative learning: the filter, monotone iterations, the command, and what it leaves when it is resumed."""

import json
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest
from made_experiments import P_DP

from workbench.cli import main
from workbench.loop.learning import BOUND, STOPS, Iteration, learn, learning_filter, record_frequencies, rms, stops
from workbench.loop.repeated_record import faded
from workbench.loop.scenarios import Scenario
from workbench.records.road import CLASSES, road

PERIOD, SAMPLES = 1e-3, 3000
F = record_frequencies(SAMPLES, PERIOD)


def lag(corner, damping=0.5):
    """A closed loop of second order, complex at F."""
    s = 1j * F / corner
    return 1 / (1 + 2 * damping * s + s**2)


def played(drive, true, noise=0.0):
    return Iteration(drive, true, true + noise, np.zeros(len(drive)), 0.0, {}, None)


def linear_plant(response, noise=0.0):
    """Plays a drive on a linear loop, padded as the filter pads, with noise of its own each time."""
    loop = replace(learning_filter(F, SAMPLES, lag(8.0)[None], lag(8.0)[None], 50.0), q=np.ones(len(F)))

    def play(number, drive, gain):
        random = np.random.default_rng(number + 2)
        true = loop._filtered(response, drive)
        return replace(played(drive, true, noise * random.standard_normal(SAMPLES)), gain=gain)

    return play


@pytest.fixture(scope="module")
def sine():
    return faded(Scenario("sine", "position", 0.05, 2.0, frequency=5.0), 0.4995, 0.5, PERIOD)


def test_the_cutoff_is_the_highest_that_converges_on_all_plants():
    plants = np.array([lag(8.0), lag(5.5), lag(8.0, 0.2)])
    learning = learning_filter(F, SAMPLES, plants[:1], plants, 100.0)
    assert learning.contraction(plants).max() < BOUND
    higher = 1 / (1 + (F / (1.05 * learning.cutoff)) ** 8)
    assert np.abs(higher * (1 - learning.inverse * plants)).max() > BOUND


def test_the_error_shrinks_by_what_the_filter_promises(sine):
    plants = np.array([lag(8.0), lag(6.5)])
    learning = learning_filter(F, SAMPLES, plants[:1], plants, 100.0)
    learned = learn(learning, sine, linear_plant(plants[1]), 6)
    errors = [learned.error(iteration) for iteration in learned.iterations]
    there = learning.contraction(plants[1])[np.argmin(np.abs(F - 5.0))]
    assert errors[1] / errors[0] == pytest.approx(there, rel=0.2)
    assert learned.fall_db > 20
    assert all(iteration.kept for iteration in learned.iterations)


def test_an_iteration_that_makes_the_error_larger_is_taken_back_and_the_gain_halved(sine):
    """A loop of twice the gain that the filter knows, and more: with half the gain it converges."""
    learning = learning_filter(F, SAMPLES, lag(8.0)[None], lag(8.0)[None], 100.0)
    learned = learn(learning, sine, linear_plant(2.4 * lag(8.0)), 8)
    kept = [learned.error(iteration) for iteration in learned.iterations if iteration.kept]
    assert not all(iteration.kept for iteration in learned.iterations)
    assert np.all(np.diff(kept) < 0)
    assert learned.best.gain == 0.5
    assert learned.fall_db > 20


def test_a_small_rise_halves_the_gain_and_a_small_fall_is_the_last():
    """Of errors far above what does not repeat: a rise says that the gain was too much, not that all is learned."""
    assert [STOPS[k] for k in stops(1.0, 0.1, 0.5, np.array([0.5, -0.5, -2.0, np.nan]))] == ["", STOPS[3], "", ""]


def test_it_stops_where_what_is_left_does_not_repeat(sine):
    learning = learning_filter(F, SAMPLES, lag(8.0)[None], lag(8.0)[None], 100.0)
    learned = learn(learning, sine, linear_plant(lag(8.0), noise=1e-4), 20)
    assert "does not repeat" in learned.stopped
    assert len(learned.iterations) < 6
    assert learned.floor == pytest.approx(1e-4, rel=0.1)


def test_a_record_that_trips_is_not_learned(sine):
    learning = learning_filter(F, SAMPLES, lag(8.0)[None], lag(8.0)[None], 100.0)

    def play(number, drive, gain):
        return replace(played(drive, 0 * drive), tripped="speed above 5 m/s")

    learned = learn(learning, sine, play, 6)
    assert len(learned.iterations) == 1
    assert "speed above 5 m/s" in learned.stopped


def test_a_road_has_the_spectrum_of_its_class():
    t, heights = road("C", 20.0, 200.0, (0.5, 20.0), 3)
    step = t[1]
    f = np.fft.rfftfreq(len(t) - 1, step)
    density = 2 * np.abs(np.fft.rfft(heights[:-1]) * step) ** 2 / 200.0
    band = (f > 1.0) & (f < 10.0)
    assert density[band] == pytest.approx(CLASSES["C"] * 0.1**2 * 20.0 / f[band] ** 2, rel=1e-6)
    assert np.array_equal(road("C", 20.0, 200.0, (0.5, 20.0), 3)[1], heights)
    assert not np.array_equal(road("C", 20.0, 200.0, (0.5, 20.0), 4)[1], heights)


EXPERIMENT = (
    """
experiment = "learn"
rig = "jack-10t"
rigs = ["nominal", "beta-50"]
scenarios = ["{scenario}"]
iterations = 3
rest = "0.5 s"
fade = "0.5 s"
"""
    + P_DP
)
SINE = '[scenario.sine]\nsize = "50 mm"\nfrequency = "5 Hz"\nseconds = "2 s"\n'
ROAD = """[scenario.road]
seconds = "3 s"
road = {class = "C", speed = "72 km/h", low = "0.5 Hz", high = "10 Hz", seed = 1}
[measure]
amplitude = "10 mm"
low = "0.5 Hz"
high = "40 Hz"
seconds = "2 s"
lines = 30
"""


FILE = '[scenario.file]\nfile = "own.csv"\n'


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    t = np.arange(0, 3, 5e-3)
    rows = zip(t, 20 * np.sin(2 * np.pi * 1.5 * t) * np.sin(np.pi * t / 3) ** 2, strict=True)
    (tmp_path / "own.csv").write_text("t [s],position [mm]\n" + "".join(f"{a:.6g},{b:.6g}\n" for a, b in rows))
    return tmp_path


@pytest.mark.parametrize(("name", "text"), [("sine", SINE), ("road", ROAD), ("file", FILE)])
def test_the_error_falls_by_20_db_on_both_rigs(folder, name, text, capsys):
    (folder / "learn.toml").write_text(EXPERIMENT.format(scenario=name) + text)
    assert main(["learn", "learn.toml"]) == 0
    shown = capsys.readouterr().err.splitlines()
    assert "must be below 1" in shown[0]  # before the first iteration
    metrics = json.loads((folder / "out/learn/metrics.json").read_text())
    assert max(metrics["contraction"].values()) < 1
    for row in metrics["learned"]:
        rig = row["rig"]
        assert row["fall_db"] > 20
        assert (folder / f"out/learn/drive-{rig}.csv").read_text().startswith("t [s],reference [mm]")
        table = pq.read_table(folder / f"out/learn/{rig}-0.parquet")
        assert np.array_equal(table["drive"], table["reference"])
        noise = np.array(table["measured"]) - np.array(table["true"])
        assert rms(noise) == pytest.approx(40e-6, rel=0.1)


def test_a_record_out_of_reach_is_called_so(folder, capsys):
    text = EXPERIMENT.format(scenario="sine") + SINE.replace("50 mm", "110 mm")  # 109 m/s2 of 1 t: 109 kN
    (folder / "learn.toml").write_text(text)
    assert main(["learn", "learn.toml"]) == 0
    rows = json.loads((folder / "out/learn/metrics.json").read_text())["rows"]
    best = [row for row in rows if row["rig"] == "nominal" and row["kept"]][-1]
    assert 0 < best["lowest_pressure_bar"] < 1
    time = f"{1e3 * best['cavitation_s']:.3g} ms and down to {best['lowest_pressure_bar']:.2g} bar absolute"
    assert best["cavitation_s"] > 0
    said = f"Out of reach on nominal: gas comes out of the oil in a chamber, for {time}."
    assert said in capsys.readouterr().out


def test_a_resumed_run_is_the_same(folder, monkeypatch):
    from workbench.loop.repeated_record import RepeatedRecord

    (folder / "learn.toml").write_text(EXPERIMENT.format(scenario="sine") + SINE)
    whole, calls = RepeatedRecord.play, []

    def play(self, number, drive, gain):
        calls.append(number)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return whole(self, number, drive, gain)

    monkeypatch.setattr(RepeatedRecord, "play", play)
    assert main(["learn", "learn.toml"]) == 130
    assert main(["learn", "learn.toml"]) == 0
    assert calls[:5] == [0, -1, 1, 2, 2]
    monkeypatch.setattr(RepeatedRecord, "play", whole)
    assert main(["learn", "learn.toml", "--out", "again"]) == 0
    assert (folder / "again/metrics.json").read_bytes() == (folder / "out/learn/metrics.json").read_bytes()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('size = "50 mm"', 'size = "200 mm"', "speed"),  # 6.3 m/s
        ('size = "50 mm"', 'size = "300 mm"', "position"),
        ('fade = "0.5 s"', 'fade = "3 s"', "fade"),
        ('frequency = "5 Hz"\n', "", "no record"),
        ('gain = "3 1/m"', 'gain = "90 1/m"', "no linear stable loop"),
        ("iterations = 3", "", "iterations"),
        ('["nominal", "beta-50"]', '["nominal", "beta-60"]', "beta-50"),
    ],
)
def test_what_cannot_be_learned_is_refused(folder, capsys, old, new, said):
    text = EXPERIMENT.format(scenario="sine") + SINE
    assert old in text
    (folder / "learn.toml").write_text(text.replace(old, new))
    assert main(["learn", "learn.toml"]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("jackbench:") == 1
