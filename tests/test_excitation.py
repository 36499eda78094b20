"""Excitations: what a drive may be given to play, and what it may not."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from workbench.base.errors import InputError
from workbench.commands.excite.study import excite
from workbench.loop.drive_simulation import drive, play, trouble, within_limits
from workbench.loop.standard_records import Design, designed
from workbench.records.excitation import (
    SIMPLE,
    chirp,
    crest_factor,
    excitation,
    excitation_text,
    harmonics,
    multisine,
    read_excitation,
)
from workbench.rigs.rig_file import load_rig

PERIOD = 1e-3
WAVES = {
    **SIMPLE,
    "linear chirp": lambda a, s, p: chirp(a, s, p, (2 / s, 0.1 / p), "linear"),
    "log chirp": lambda a, s, p: chirp(a, s, p, (2 / s, 0.1 / p), "log"),
    "multisine": lambda a, s, p: multisine(a, s, p, (2 / s, 0.1 / p), lines=12),
    "1/f multisine": lambda a, s, p: multisine(a, s, p, (2 / s, 0.1 / p), "1/f", 12),
}


@pytest.mark.parametrize("name", WAVES)
@settings(max_examples=6, deadline=None)
@given(
    amplitude=st.floats(1e-4, 1.0),
    rows=st.integers(60, 700),
    period=st.sampled_from([1e-4, 1e-3, 2e-3]),
)
def test_a_wave_begins_at_zero_has_its_peak_and_no_mean(name, amplitude, rows, period):
    """A jack integrates its command: a mean would drive it away, period after period."""
    wave = WAVES[name](amplitude, rows * period, period)
    assert wave.shape == (rows,)
    assert wave[0] == 0.0
    assert np.abs(wave).max() == pytest.approx(amplitude)
    assert abs(wave.mean()) < 1e-12


@pytest.mark.parametrize(("spectrum", "band"), [("flat", (0.5, 25.0)), ("1/f", (0.5, 25.0)), ("flat", (5.0, 30.0))])
def test_fifty_lines_have_a_low_crest_factor(spectrum, band):
    wave = multisine(0.1, 2.0, PERIOD, band, spectrum)
    assert harmonics(band, 2.0, PERIOD).size in (50, 51)
    assert crest_factor(wave) < 1.6


@pytest.mark.parametrize("spectrum", ["flat", "1/f"])
def test_a_multisine_has_its_lines_and_nothing_else(spectrum):
    wave = multisine(0.1, 2.0, PERIOD, (1.0, 100.0), spectrum, 20)
    size = np.abs(np.fft.rfft(wave))
    lines = harmonics((1.0, 100.0), 2.0, PERIOD, 20)
    expected = np.ones(lines.size) if spectrum == "flat" else lines[0] / lines
    assert size[lines] / size[lines[0]] == pytest.approx(expected, rel=1e-6)
    assert np.delete(size, lines).max() < 1e-9 * size.max()


def test_a_chirp_sweeps_its_band():
    wave = chirp(1.0, 4.0, PERIOD, (2.0, 50.0), "linear")
    f, size = np.fft.rfftfreq(4000, PERIOD), np.abs(np.fft.rfft(wave))
    inside = (f > 4) & (f < 45)
    assert size[inside].min() > 0.3 * np.median(size[inside])
    assert size[f > 80].max() < 0.05 * np.median(size[inside])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: multisine(1.0, 2.0, PERIOD, (0.1, 50.0)), "from 1/2 s = 0.5 Hz to below 500 Hz"),
        (lambda: multisine(1.0, 2.0, PERIOD, (50.0, 5.0)), "must rise"),
        (lambda: multisine(1.0, 2.0, PERIOD, (5.0, 50.0), lines=0), "at least 1"),
        (lambda: chirp(1.0, 2.0, PERIOD, (5.0, 600.0)), "half the control rate"),
        (lambda: SIMPLE["steps"](1.0, 0.01, PERIOD), "20 to 1000000 control periods"),
        (lambda: SIMPLE["ramps"](1.0, float("nan"), PERIOD), "20 to 1000000 control periods"),
    ],
)
def test_an_impossible_wave_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()


@pytest.mark.parametrize("signal", ["command", "reference"])
def test_a_file_plays_back_what_was_written(tmp_path, signal):
    wave = multisine(0.05, 1.0, PERIOD, (2.0, 40.0), lines=9)
    made = excitation("waves", signal, wave, PERIOD, 0.1, repeat=2)
    (tmp_path / "waves.csv").write_text(excitation_text(made))
    assert ("command [1]" in (tmp_path / "waves.csv").read_text()) == (signal == "command")
    back = read_excitation(tmp_path / "waves.csv", PERIOD, 0.1)
    assert back.name == "waves"
    assert len(back.t) == 2001
    assert back.reference == pytest.approx(made.reference, abs=1e-10)
    assert back.command == pytest.approx(made.command, abs=1e-10)
    assert (back.reference[-1], back.command[-1]) == (pytest.approx(0.1), 0.0)


@pytest.mark.parametrize(
    ("header", "cell", "words"),
    [
        ("t [s],speed [m/s]", "0", ["nothing to play", "reference [mm]"]),
        ("t [s],command [1]", "2", ["row 13", "command", "beyond"]),
        ("t [s],command [1]", "x", ["row 13", "not a number"]),
        ("t [s],command [1]", "", ["row 13", "empty"]),
        ("t [s],command", "0", ["command", "no unit"]),
        ("t [s],command [mm]", "0", ["command [mm]", "converted"]),
        ("t [ms],command [1]", "0", ["row 3", "control period"]),
        ("time [s],command [1]", "0", ['no column "t [unit]"']),
    ],
)
def test_a_bad_file_is_refused_by_row_and_column(tmp_path, header, cell, words):
    rows = [header, *(f"{k / 1000:g},{cell if k == 11 else '0'}" for k in range(30))]
    (tmp_path / "bad.csv").write_text("\n".join(rows))
    with pytest.raises(InputError) as caught:
        read_excitation(tmp_path / "bad.csv", PERIOD, 0.0)
    for word in (*words, "bad.csv"):
        assert word in str(caught.value)


def test_scaling_is_about_the_beginning():
    made = excitation("r", "reference", np.sin(np.arange(100) / 9.0), PERIOD, 0.3).scaled(0.5)
    assert made.reference[0] == pytest.approx(0.3)
    assert np.abs(made.reference - 0.3).max() == pytest.approx(0.5, rel=1e-3)


@pytest.fixture(scope="module")
def ready():
    return drive(load_rig("jack-10t"))


def test_the_drive_holds_the_jack_gently(ready):
    """Plain proportional control goes unstable at 0.5 per metre."""
    assert 0.1 < ready.loop.design.gain < 0.25


def test_what_is_too_large_is_made_smaller(ready):
    rig = ready.rig
    large = designed(Design("triangle", "command", 0.3, 1.0), rig)
    assert "too fast to stop" in str(trouble(play(ready, large)))
    fits = within_limits(ready, large)
    assert fits is not None
    assert trouble(play(ready, fits)) is None


def test_excite_writes_what_the_rig_can_play(tmp_path):
    out = tmp_path / "m.csv"
    rig = load_rig("jack-10t")
    said = excite(Design("multisine", "reference", 2.0, 1.0, 2, (1.0, 8.0), 6, "1/f"), rig, out)
    assert "crest factor" in said
    assert "lines from 1 to 8 Hz" in said
    played = read_excitation(out, PERIOD, 0.0)
    assert np.abs(played.reference).max() == pytest.approx(2e-3)
    with pytest.raises(InputError, match="--force"):
        excite(Design("steps", "reference", 2.0, 1.0), rig, out)


@pytest.mark.parametrize(
    ("design", "words"),
    [
        (Design("triangle", "command", 0.3, 1.0), ["amplitude 0.3", "too fast to stop", "fits"]),
        (Design("triangle", "command", 1.5, 1.0), ["at most 1"]),
        (Design("steps", "reference", 500.0, 1.0), ["at most 240"]),
        (Design("chirp", "command", 0.1, 1.0), ["needs its band"]),
        (Design("chrip", "command", 0.1, 1.0), ['did you mean "chirp"']),
        (Design("steps", "spool", 0.1, 1.0), ["command or reference"]),
        (Design("steps", "command", 0.01, 1.0, 0), ["repeat 0"]),
    ],
)
def test_excite_refuses_in_one_line_and_writes_nothing(tmp_path: Path, design, words):
    with pytest.raises(InputError) as caught:
        excite(design, load_rig("jack-10t"), tmp_path / "x.csv")
    for word in words:
        assert word in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())
