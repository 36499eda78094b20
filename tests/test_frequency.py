"""Measured frequency responses against systems whose response is known, and the rig's model beside recordings."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from workbench.base.errors import InputError
from workbench.base.table import ConfigTable
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.frequency.config import FrequencyTask, load
from workbench.commands.frequency.study import _linear, run_frequency
from workbench.engine import Engine
from workbench.identify.data.frequency_response import excited, measured_response, same_estimate
from workbench.identify.data.noise_floor import NoiseFloor
from workbench.identify.fit.predict import predict_free
from workbench.linear import equilibrium
from workbench.plant import build
from workbench.records import Campaign, Record, load_campaign
from workbench.records.excitation import chirp, harmonics, multisine
from workbench.records.frequency_sheet import listed_sheet, read_sheet
from workbench.rigs.rig_file import load_rig

SHARED = Path(__file__).parents[2] / "shared"
PERIOD = 1e-3
OMEGA, ZETA = 2 * np.pi * 20, 0.2
NUMERATOR, DENOMINATOR, _ = cont2discrete(([OMEGA**2], [1, 2 * ZETA * OMEGA, OMEGA**2]), PERIOD)
NUMERATOR = NUMERATOR.ravel()


def truth(f: np.ndarray) -> np.ndarray:
    z = np.exp(2j * np.pi * f * PERIOD)
    return np.polyval(NUMERATOR, z) / np.polyval(DENOMINATOR, z)


def recorded(u: np.ndarray, noise: float, seed: int = 0) -> Record:
    y = lfilter(NUMERATOR, DENOMINATOR, u) + noise * np.random.default_rng(seed).standard_normal(u.size)
    return Record("made", np.arange(u.size) * PERIOD, {"command": u, "position": y})


@cache
def inputs() -> dict[str, np.ndarray]:
    random = np.random.default_rng(1)
    t = np.arange(6000) * PERIOD
    return {
        "log chirp": chirp(0.1, 6.0, PERIOD, (0.5, 100.0)),
        "linear chirp": chirp(0.1, 6.0, PERIOD, (0.5, 100.0), "linear"),
        "periodic": np.tile(multisine(0.1, 1.5, PERIOD, (1.0, 100.0), lines=40), 4),
        "steps": np.repeat(0.1 * random.standard_normal(12), 500),
        "no whole periods": 0.02 * sum(np.sin(2 * np.pi * f * t + 7 * f) for f in np.geomspace(0.7, 95, 24)),
        "noise": 0.05 * random.standard_normal(6000),
    }


@pytest.mark.parametrize("kind", inputs())
@pytest.mark.parametrize("noise", [1e-4, 3e-3])
def test_the_band_holds_the_truth_as_often_as_it_says(kind, noise):
    held = []
    for seed in range(20):
        found = measured_response(recorded(inputs()[kind], noise, seed), "command", "position")
        held.append(found.holds(truth(found.f)))
    assert ("periods" in found.method) == (kind == "periodic")
    assert found.f[0] < 1.5
    assert found.f[-1] > 90
    assert 0.89 < np.mean(np.concatenate(held)) < 0.99


def test_the_coherence_is_that_of_signal_and_noise():
    u = 0.05 * np.random.default_rng(2).standard_normal(40_000)
    found = measured_response(recorded(u, 0.01), "command", "position")
    signal = 25 * np.abs(truth(found.f)) ** 2  # input and noise are white
    expected = signal / (signal + 1)
    assert found.coherence[expected > 0.9].mean() == pytest.approx(expected[expected > 0.9].mean(), abs=0.02)
    some = (expected > 0.3) & (expected < 0.7)
    assert found.coherence[some].mean() == pytest.approx(expected[some].mean(), abs=0.12)
    assert found.coherence[expected < 0.05].mean() < 0.3


def test_noise_in_a_loop_leans_an_estimate_towards_the_controller_but_not_one_by_the_reference():
    """An integrator under u = 20 (r - y): what the sensor's noise adds to u shows y = -u/20."""
    random = np.random.default_rng(3)
    reference = lfilter([0.05], [1, -0.95], random.standard_normal(60_000))
    noise = 0.4 * random.standard_normal(reference.size)
    y, u, level = np.empty(reference.size), np.empty(reference.size), 0.0
    for k in range(reference.size):
        y[k] = level + noise[k]
        u[k] = 20 * (reference[k] - y[k])
        level += 5e-3 * u[k]
    signals = {"command": u, "position": y}
    t = np.arange(reference.size) * PERIOD

    def lean(record: Record) -> tuple[float, float]:
        found = measured_response(record, "command", "position")
        some = (found.f > 1) & (found.f < 6)
        true = 5e-3 / (np.exp(2j * np.pi * found.f * PERIOD) - 1)
        return abs(np.mean(found.response[some] / true[some]) - 1), np.mean(found.instrument[some])

    blind, by_reference = lean(Record("loop", t, signals)), lean(Record("loop", t, {**signals, "reference": reference}))
    assert (blind[1], by_reference[1] > 0.5) == (0.0, True)
    assert blind[0] > 0.1
    assert by_reference[0] < 0.5 * blind[0]


def test_only_what_the_input_excites_is_shown():
    f = np.arange(200) / 2.0
    size = np.full(200, 1e-3)
    size[[10, 20, 40, 80]] = 1.0, 0.5, 0.25, 0.125
    assert np.flatnonzero(excited(f, size)).tolist() == [10, 20, 40, 80]
    wave = np.tile(multisine(0.1, 2.0, PERIOD, (5.0, 50.0), lines=10), 4)
    found = measured_response(recorded(wave, 1e-4), "command", "position")
    assert found.f.size == 10
    assert found.f[[0, -1]] == pytest.approx([5.0, 50.0])


def test_an_uneven_clock_is_resampled_and_said():
    u = chirp(0.1, 6.0, PERIOD, (0.5, 40.0))
    clean = recorded(u, 1e-4)
    keep = np.ones(u.size, bool)
    keep[[1501, 3000, 4203]] = False
    thin = Record("thin", clean.t[keep], {name: values[keep] for name, values in clean.signals.items()})
    found = measured_response(thin, "command", "position")
    assert "3 uneven intervals" in found.notes[0]
    assert "commands held" in found.notes[0]
    low = (found.f > 2) & (found.f < 20)
    assert found.response[low] == pytest.approx(truth(found.f[low]), rel=0.05)


def test_missing_samples_are_said():
    made = recorded(chirp(0.1, 6.0, PERIOD, (0.5, 40.0)), 1e-4)
    known = np.ones(made.t.size, bool)
    known[100:103] = False
    found = measured_response(Record("holes", made.t, made.signals, {"position": known}), "command", "position")
    assert any("3 samples" in note for note in found.notes)


@pytest.mark.parametrize(
    ("pair", "period", "words"),
    [
        (("command", "pa"), None, "no signal pa"),
        (("command", "supply"), None, "supply never moves"),
        (("command", "position"), 4.0, "do not hold two periods of 4 s"),
    ],
)
def test_what_can_not_be_measured_is_refused(pair, period, words):
    made = recorded(chirp(0.1, 6.0, PERIOD, (0.5, 40.0)), 1e-4)
    still = Record("r", made.t, {**made.signals, "supply": np.full(made.t.size, 2e7)})
    with pytest.raises(InputError, match=words):
        measured_response(still, *pair, period)
    with pytest.raises(InputError, match="needs 60"):
        measured_response(still.slice(0.0, 0.05), "command", "position")


def test_small_signals_show_the_linear_model(engine, moving, commanded):
    """At 0.1 m/s, outside the lap, a command of 0.05 % is small: the valve answers as linearised there."""
    wave = np.tile(multisine(5e-4, 0.5, PERIOD, (4.0, 200.0), lines=20), 4)
    u = commanded(moving.u[0] + wave)
    t = np.arange(wave.size) * PERIOD
    y = engine.plant.observe(engine.run(moving.x, np.append(t, t[-1] + PERIOD), u).x[:-1], u)
    signals = {name: y[:, engine.plant.output(name)] for name in ("spool", "current")}
    record = Record("small", t, {"command": u[:, 0], **signals})
    for name in signals:
        found = measured_response(record, "command", name)
        linear = _linear(load_rig("jack-10t"), ("command", name), found.f, PERIOD)["linear, 0.1 m/s"]
        assert found.f.size == harmonics((4.0, 200.0), 0.5, PERIOD, 20).size
        assert np.median(np.abs(found.response / linear - 1)) < 0.03


@pytest.mark.skipif(not (SHARED / "campaigns/p05").is_dir(), reason="the practice campaigns are not beside the project")
def test_a_true_model_lies_in_the_band_of_an_independent_recording():
    listed = json.loads((SHARED / "campaigns/truth.json").read_text())["campaigns"]
    true = next(entry for entry in listed if entry["id"] == "p05")
    rig = load_rig("jack-10t").with_values(**{name: true["true"][name] for name in true["ratio"]})
    (record,) = load_campaign(SHARED / "campaigns/p05").heldout
    sigma = {name: sensor.noise for name, sensor in rig.sensors.items()}
    plain = NoiseFloor(sigma, dict.fromkeys(sigma, 1.0), dict.fromkeys(sigma, "rig file"))
    free = predict_free(build(rig), record, plain)
    model = Record("model", record.t, {**record.signals, **free.signals})
    for output in ("spool", "pa", "acceleration"):
        found = measured_response(record, "command", output)
        assert found.f[-1] > 300
        assert np.mean(found.holds(same_estimate(found, model))) > 0.8
        off = np.abs(same_estimate(found, model) / found.response - 1)
        assert np.median(off) < 0.02


def test_the_study_puts_the_model_beside_the_record():
    rig = load_rig("festo-tp511")
    plant = build(rig)
    engine = Engine(plant)
    wave = np.tile(multisine(0.05, 0.5, PERIOD, (2.0, 60.0), lines=12), 3)
    u = np.zeros((wave.size, len(plant.inputs)))
    u[:, 0] = wave
    t = np.arange(wave.size) * PERIOD
    y = plant.observe(engine.run(equilibrium(plant).x, np.append(t, t[-1] + PERIOD), u).x[:-1], u)
    random = np.random.default_rng(5)
    sigma = {"pa": 3e4, "pb": 3e4, "position": 3e-4}
    signals = {n: y[:, plant.output(n)] + s * random.standard_normal(t.size) for n, s in sigma.items()}
    record = Record("waves", t, {"command": wave, **signals})
    campaign = Campaign(Path("made"), rig.name, (), (), (record,))
    outcome = run_frequency(
        FrequencyTask(rig, "made", ("command", "pa"), (record,), (), campaign), no_checkpoint, lambda _: None
    )
    rows = outcome.metrics["rows"]
    assert list(rows[0]) == [
        "record", "input", "output", "f_hz", "gain_db", "gain_low_db", "gain_high_db", "phase_deg", "coherence",
        "model_gain_db", "model_phase_deg",
    ]  # fmt: skip
    assert [row["f_hz"] for row in rows] == pytest.approx(
        np.fft.rfftfreq(500, PERIOD)[np.abs(np.fft.rfft(wave[:500])) > 1e-6]
    )
    assert sum(row["gain_low_db"] <= row["model_gain_db"] <= row["gain_high_db"] for row in rows) > 0.7 * len(rows)
    assert "inside the 95 % band" in outcome.page.verdict
    assert set(outcome.tables) == {"response-waves"}


SHEET = "frequency [Hz],gain [dB],phase [deg]\n10,0.5,-20\n20,0,-45\n73,-3,-90\n"


def test_a_sheet_is_read_relative_to_its_lowest_frequency(tmp_path):
    (tmp_path / "maker.csv").write_text(SHEET)
    sheet = read_sheet(tmp_path / "maker.csv", 1.0, "command", "flow")
    assert (sheet.name, sheet.amplitude, sheet.relative) == ("maker", 1.0, True)
    assert sheet.f == pytest.approx([10, 20, 73])
    assert 20 * np.log10(np.abs(sheet.response)) == pytest.approx([0, -0.5, -3.5])
    assert np.degrees(np.angle(sheet.response)) == pytest.approx([0, -25, -70])


def test_a_sheet_may_state_its_amplitude_and_its_units(tmp_path):
    rows = SHEET.replace("gain [dB]", "gain [l/min]").replace(",0,", ",600,").replace("-3", "420").splitlines()
    text = "\n".join([rows[0] + ",amplitude [percent]", *(row + ",25" for row in rows[1:])])
    (tmp_path / "maker.csv").write_text(text)
    sheet = read_sheet(tmp_path / "maker.csv", None, "command", "flow")
    assert not sheet.relative
    assert sheet.amplitude == pytest.approx(0.25)
    assert abs(sheet.response[1]) == pytest.approx(600 / 6e4)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("20,0", "20,x", ["row 3", "gain [dB]", "not a number"]),
        ("20,0", "20,", ["row 3", "gain [dB]", "empty"]),
        ("20,0", "8,0", ["row 3", "frequency [Hz]", "rise"]),
        ("10,0.5", "0,0.5", ["row 2", "above 0"]),
        ("gain [dB]", "gain", ["gain", "no unit"]),
        ("gain [dB]", "gain [mm]", ["gain [mm]", "converted"]),
        ("gain [dB]", "amplification [dB]", ['no column "gain [unit]"']),
        ("phase [deg]", "phase [s]", ["phase [s]", "converted"]),
        ("gain [dB]", "gain [l/min]", ["row 3", "above 0"]),
        ("20,0,-45\n73,-3,-90\n", "", ["at least 2"]),
    ],
)
def test_a_bad_sheet_is_refused_by_row_and_column(tmp_path, old, new, words):
    (tmp_path / "maker.csv").write_text(SHEET.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        read_sheet(tmp_path / "maker.csv", 1.0, "command", "flow")
    for word in (*words, "maker.csv"):
        assert word in str(caught.value)


def test_a_sheet_needs_an_amplitude(tmp_path):
    (tmp_path / "maker.csv").write_text(SHEET)
    with pytest.raises(InputError, match="at which amplitude"):
        read_sheet(tmp_path / "maker.csv", None, "command", "flow")


def test_a_campaign_lists_sheets(tmp_path):
    (tmp_path / "maker.csv").write_text(SHEET)
    file = tmp_path / "campaign.toml"
    entry = {"file": "maker.csv", "input": "current", "output": "pilot_spool", "amplitude": 5}
    sheet = listed_sheet(ConfigTable(entry, str(file)), tmp_path)
    assert (sheet.input, sheet.output, sheet.amplitude) == ("current", "pilot_spool", pytest.approx(5e-3))
    for entry, words in (
        ({"file": "maker.csv", "ampl": 1}, 'did you mean "amplitude"'),
        ({"file": "maker.csv", "amplitude": "x"}, "must be a positive number"),
        ({"file": "none.csv", "amplitude": 1}, "no such file"),
        ({"file": "maker.csv", "input": "comand", "amplitude": 1}, 'did you mean "command"'),
    ):
        with pytest.raises(InputError, match=words):
            listed_sheet(ConfigTable(entry, str(file)), tmp_path)
    with pytest.raises(InputError, match=r"must be a list of tables; write \[\[sheets\]\]"):
        ConfigTable({"sheets": ["maker.csv"]}, str(file)).tables("sheets")


def test_the_paper_s_corner_is_a_sheet(tmp_path):
    """The paper's own model of the main stage at 100 %: -3 dB at 70 Hz, -90 degrees at 73 Hz."""
    (tmp_path / "paper.csv").write_text("frequency [Hz],gain [dB],phase [deg]\n5,0,0\n70,-3,-87\n73,-3.3,-90\n")
    task = load(tmp_path / "paper.csv", ("command", "flow"), "jack-10t", amplitude=1.0)
    outcome = run_frequency(task, no_checkpoint, lambda _: None)
    rows = outcome.metrics["rows"]
    assert [row["model_gain_db"] for row in rows] == pytest.approx([row["gain_db"] for row in rows], abs=0.3)
    assert rows[2]["model_phase_deg"] == pytest.approx(-90, abs=8)
    assert all(np.isnan(row["coherence"]) for row in rows)


def test_a_closed_loop_sheet_is_played_in_the_position_loop(tmp_path):
    (tmp_path / "loop.csv").write_text("frequency [Hz],gain [1],phase [deg]\n1,0.3,-70\n2,0.2,-80\n")
    task = load(tmp_path / "loop.csv", ("reference", "position"), "jack-10t", amplitude=5.0)
    rows = run_frequency(task, no_checkpoint, lambda _: None).metrics["rows"]
    assert rows[0]["model_gain_db"] - rows[1]["model_gain_db"] == pytest.approx(6, abs=1)
    assert rows[0]["model_phase_deg"] == pytest.approx(-80, abs=12)


@pytest.mark.parametrize(
    ("pair", "rig", "words"),
    [
        (("command", "flwo"), "jack-10t", 'did you mean "flow"'),
        (("command", "flow"), None, "add --rig"),
        (("command", "pa"), "jack-10t", "gives no pa"),
        (("spool", "pa"), "jack-10t", "is measured on no bench"),
    ],
)
def test_a_sheet_that_nothing_can_stand_beside_is_refused(tmp_path, pair, rig, words):
    (tmp_path / "maker.csv").write_text(SHEET)
    with pytest.raises(InputError, match=words):
        run_frequency(load(tmp_path / "maker.csv", pair, rig, amplitude=1.0), no_checkpoint, lambda _: None)
