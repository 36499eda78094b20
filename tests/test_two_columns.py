"""Two columns of any recording: what goes in and what comes out, as a response, a delay and a plant."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

import workbench as wb
from workbench.base.errors import InputError
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.frequency.config import load
from workbench.commands.frequency.two_columns import pair_model, run_pairs
from workbench.identify.data.causality import lead_problem
from workbench.identify.data.frequency_response import averaged, between, measured_response
from workbench.records import Record
from workbench.records.pair import read_pair
from workbench.rigs.linear_rig import LinearRig
from workbench.rigs.rig_file import load_rig

SHARED = Path(__file__).parents[2] / "shared"
PERIOD, K, DELAY = 2e-3, 30.0, 6e-3


def recording(path: Path, seed: int) -> Path:
    """A loop of one speed gain and a delay, asked for noise of 0 to 20 Hz, with a header of its own."""
    random = np.random.default_rng(seed)
    t = np.arange(0, 40, PERIOD)
    smooth = np.convolve(random.standard_normal(t.size), np.ones(10) / 10, mode="same")
    pole = np.exp(-K * PERIOD)
    y = lfilter([0.0, 1 - pole], [1.0, -pole], np.concatenate((np.zeros(3), smooth[:-3])))
    y += 0.003 * random.standard_normal(t.size)
    lines = [f"{k:.3f},{u:.6f},{v:.6f}" for k, u, v in zip(t, smooth, y, strict=True)]
    path.write_text("Time (s),Set point (mm),Actual (mm)\n" + "\n".join(lines) + "\n")
    return path


def test_two_columns_give_gain_delay_and_a_plant(tmp_path, monkeypatch):
    files = [recording(tmp_path / f"{name}.csv", seed) for seed, name in enumerate("ab")]
    task = load(files, ("Set point", "Actual"))
    assert task.pairs[0].units == ("mm", "mm")
    outcome = run_pairs(task, True, no_checkpoint, lambda _: None)
    model = outcome.metrics["model"]
    assert len(model["denominator"]) == 2
    assert model["denominator"][1] / model["denominator"][0] == pytest.approx(K, rel=0.03)
    assert outcome.metrics["delay_s"] == pytest.approx(DELAY + PERIOD / 2, abs=0.5e-3)
    monkeypatch.chdir(tmp_path)
    Path("plant.toml").write_text(str(outcome.files["plant.toml"]))
    plant = load_rig("plant.toml")
    assert isinstance(plant, LinearRig)
    assert plant.full_command == pytest.approx(max(np.abs(p.record.signals["Set point"]).max() for p in task.pairs))
    assert plant.numbers["delay"].value == pytest.approx(outcome.metrics["delay_s"], rel=1e-8)


def test_in_python_it_is_an_object_with_its_plant(tmp_path):
    answer = wb.frequency_response(recording(tmp_path / "a.csv", 2), "Set point", "Actual")
    assert answer.response.gain_band[0].shape == answer.response.f.shape
    assert answer.plant.numbers["delay"].value == pytest.approx(DELAY + PERIOD / 2, abs=1e-3)
    noise = np.random.default_rng(0).standard_normal((2, 400))
    text = "\n".join(f"{PERIOD * k:.3f},{a:.6f},{b:.6f}" for k, (a, b) in enumerate(noise.T))
    (tmp_path / "b.csv").write_text(f"t [s],a [1],b [1]\n{text}\n")
    none = wb.frequency_response(tmp_path / "b.csv", "a", "b")
    assert none.model is None
    assert "No model" in repr(none)
    with pytest.raises(InputError, match="bear no model"):
        _ = none.plant


def test_noise_on_either_side_is_between_h1_and_h2(tmp_path):
    random, n = np.random.default_rng(5), 40_000
    u = np.convolve(random.standard_normal(n), np.ones(5) / 5, mode="same")
    noisy = Record("n", np.arange(n) * 1e-3, {"in": u + 0.2 * random.standard_normal(n), "out": 2 * u})
    found = measured_response(noisy, "in", "out")
    low = found.f < 50
    h1, hv, h2 = (np.median(np.abs(each[low])) for each in (found.response, found.hv, found.h2))
    assert h1 < hv < h2
    assert h2 == pytest.approx(2.0, rel=0.02)
    assert found.hv == pytest.approx(between(found.response, found.h2))


def test_records_are_averaged_to_a_narrower_band(tmp_path):
    pairs = [read_pair(recording(tmp_path / f"{seed}.csv", seed), "Set point", "Actual") for seed in range(4)]
    single = [measured_response(p.record, "Set point", "Actual") for p in pairs]
    whole = averaged(single)
    both = np.isin(np.round(24 * np.log2(single[0].f)), np.round(24 * np.log2(whole.f)))
    assert np.median(whole.radius) < 0.7 * np.median(single[0].radius[both])
    truth = np.exp(-2j * np.pi * whole.f * (DELAY + PERIOD / 2)) * K / (2j * np.pi * whole.f + K)
    low = whole.f < 20
    assert np.median(np.abs(whole.response - truth)[low] / np.abs(truth[low])) < 0.05


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        (("Set pont", "Actual"), r'"Set pont" is no column; did you mean "Set point"'),
        (("Time", "Nothing"), r'"Nothing" is no column'),
    ],
)
def test_a_column_that_is_not_there_is_named(tmp_path, columns, words):
    with pytest.raises(InputError, match=words):
        load(recording(tmp_path / "a.csv", 0), columns)


@pytest.mark.parametrize(
    ("columns", "shift", "leaves", "refused"),
    [
        (("Set point", "Actual"), 0, True, False),
        (("Actual", "Set point"), 0, False, True),  # exchanged
        (("Set point", "Actual"), 10, False, True),  # 20 ms late, of 6 ms and a servo's lag of 33 ms
        (("Set point", "Actual"), 10, True, True),
    ],
)
def test_an_output_that_leads_its_input_is_refused(tmp_path, columns, shift, leaves, refused):
    path = recording(tmp_path / "a.csv", 0)
    head, *lines = path.read_text().splitlines()
    t, u, y = np.loadtxt(lines, delimiter=",", unpack=True)
    np.savetxt(path, np.column_stack((t, np.roll(u, shift), y)), "%.6f", ",", header=head, comments="")
    task = load(path, columns)
    if not refused:
        assert run_pairs(task, leaves, no_checkpoint, lambda _: None).files
        return
    with pytest.raises(InputError, match=f"{columns[1]} leads {columns[0]} by .* ms.*exchange their columns"):
        run_pairs(task, leaves, no_checkpoint, lambda _: None)


def test_a_spring_with_a_damper_may_be_ahead_of_its_position():
    random = np.random.default_rng(1)
    x = lfilter([1e-4], np.poly([0.9, 0.9]), random.standard_normal(20_000))  # to 8 Hz
    force = x + 0.02 * np.gradient(x, PERIOD) + 1e-3 * random.standard_normal(x.size)
    whole = Record("s", PERIOD * np.arange(x.size), {"x": x, "force": force, "early": np.roll(force, -20)})
    problems = [lead_problem(measured_response(whole, "x", name), PERIOD, False, True) for name in ("force", "early")]
    assert problems[0] == ""
    assert "early leads x by" in problems[1]


def pressed(shift: dict[str, int]) -> list[str]:
    """What is wrong with both recordings of the press where columns are late by so many ms."""
    said = []
    for name in ("chirp0A", "chirp1A"):
        pair = read_pair(SHARED / "data" / "mts_press" / f"{name}.csv.gz", "reference", "position")
        signals = {key: np.roll(values, shift.get(key, 0)) for key, values in pair.record.signals.items()}
        own = measured_response(Record(name, pair.record.t, signals), "reference", "position")
        said.append(lead_problem(own, pair.record.period))
    return said


@pytest.mark.skipif(not (SHARED / "data" / "mts_press").exists(), reason="the recordings of the press are not here")
def test_a_lead_of_the_press_does_not_hide_behind_its_servo_s_lag():
    assert pressed({}) == ["", ""]
    assert all("by 7." in said for said in pressed({"position": -12}))  # its delay is 4.5 ms
    assert all("by 5." in said for said in pressed({"reference": 10}))


@pytest.mark.skipif(not (SHARED / "data" / "mts_press").exists(), reason="the recordings of the press are not here")
def test_the_press_is_a_speed_gain_and_a_delay():
    folder = SHARED / "data" / "mts_press"
    task = load([folder / "chirp0A.csv.gz", folder / "chirp1A.csv.gz"], ("reference", "position"))
    found = pair_model([measured_response(p.record, p.input, p.output) for p in task.pairs])
    numerator, denominator = found.fit.numerator, found.fit.denominator
    assert len(denominator) == 2
    assert denominator[1] / denominator[0] == pytest.approx(45.3, abs=1.0)  # ../shared/data/README.md
    assert found.fit.delay == pytest.approx(4.5e-3, abs=0.5e-3)
    assert numerator[0] / denominator[1] == pytest.approx(1.0, abs=0.01)


def test_a_clock_in_another_unit_is_read_in_seconds(tmp_path):
    plain = read_pair(recording(tmp_path / "s.csv", 0), "Set point", "Actual")
    head, *lines = (tmp_path / "s.csv").read_text().splitlines()
    rows = [line.split(",", 1) for line in lines]
    text = "\n".join(f"{1e3 * float(t):g},{rest}" for t, rest in rows)
    (tmp_path / "ms.csv").write_text(f"{head.replace('(s)', '(ms)')}\n{text}\n")
    late = read_pair(tmp_path / "ms.csv", "Set point", "Actual")
    assert late.record.period == pytest.approx(plain.record.period)
    (tmp_path / "mm.csv").write_text(f"{head.replace('(s)', '(mm)')}\n{text}\n")
    with pytest.raises(InputError, match=r"is the clock, and \"mm\" is no unit of time"):
        read_pair(tmp_path / "mm.csv", "Set point", "Actual")
