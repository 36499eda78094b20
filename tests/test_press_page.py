"""The page of the press has the figures that its commands left, those of the trace aside."""

import re
from pathlib import Path

import numpy as np
import pytest

from experiments.studies import kept
from experiments.studies.closed_loop.press import run_press
from workbench.base.errors import InputError
from workbench.commands.common.outcome import no_checkpoint

PAGE = " ".join((Path(__file__).parents[1] / "docs" / "results" / "press.md").read_text().split())
KEPT = kept("closed_loop/press")


def row(command):
    (found,) = [each for each in KEPT.rows if each["command"].startswith(command)]
    return found


def half(interval):
    value, low, high = interval
    return value, (high - low) / 2


def test_the_page_names_the_command_that_made_its_figures():
    assert f"`{KEPT.command}`" in PAGE


def test_the_response_of_both_sweeps():
    found = row("frequency")
    (pole,) = found["poles"]
    assert f"one pole at {-pole:.1f} 1/s and a delay of {found['delay_ms']:.2f} ms, and nothing else" in PAGE


def test_both_floors_of_its_noise():
    fitted, rest = row("fit campaign"), row("residual rest")
    assert f"third differences: {fitted['floor']:.4f} mm" in PAGE
    assert f"`jackbench residual` has {rest['floor']:.4f} mm" in PAGE
    assert rest["floor"] > 1.3 * fitted["floor"]


def test_what_is_left_of_the_held_out_sweep():
    fitted, effects = row("fit campaign"), row("fit effects")
    gain, delay = half(fitted["servo"]["speed gain [1/s]"]), half(fitted["servo"]["delay [s]"])
    assert fitted["bears"] == "first order"
    assert f"moves by {fitted['shares']['moves']:.3f} mm RMS" in PAGE
    assert re.search(rf"\| the rig of a label .* \| {fitted['before']:.3f} \|", PAGE)
    assert re.search(rf"leaves within bounds \| {fitted['after']:.4f} \|", PAGE)
    servo = f"{gain[0]:.1f} +- {gain[1]:.2f} 1/s, {1e3 * delay[0]:.2f} +- {1e3 * delay[1]:.2f} ms"
    assert f"{servo} | {fitted['rungs']['first order']:.4f} |" in PAGE
    assert f"recorded force | {fitted['rungs']['first order, yielding to the force']:.3f} |" in PAGE
    names = {name.split(" ")[0]: half(interval) for name, interval in effects["parameters"].items()}
    unequal, lap = names["main.asymmetry.a"], names["main.deadband.overlap"]
    said = rf"direction: out {100 * unequal[0]:.1f} \+- {100 * unequal[1]:.1f} % faster than the mean of both ways, .*"
    said += rf"lap: {100 * lap[0]:.1f} \+- {100 * lap[1]:.1f} % of full travel \| {effects['after']:.4f} \|"
    assert re.search(said, PAGE)
    assert f"asymmetry and dead band leave {effects['remains']['left']:.4f} mm" in PAGE
    assert f"it moves the position by {fitted['shares']['load']:.3f} mm" in PAGE


def test_the_sweeps_exchanged():
    both = [row(f"fit {name}") for name in ("exchanged", "campaign")]
    (there, other), (here, own) = (half(1e3 * np.array(each["parameters"]["loop_delay [s]"])) for each in both)
    assert f"comes out as {there:.2f} +- {other:.2f} ms, where it was {here:.2f} +- {own:.2f}" in PAGE
    gain, delay = (half(both[0]["servo"][name]) for name in ("speed gain [1/s]", "delay [s]"))
    servo = f"{gain[0]:.1f} +- {gain[1]:.2f} 1/s and {1e3 * delay[0]:.2f} +- {1e3 * delay[1]:.2f} ms"
    assert f"The servo's stay: {servo}" in PAGE


def test_what_can_be_asked_of_it():
    hybrid, sines = row("inverse hybrid.toml"), row("sines")
    assert f"a sine of 3 Hz | its error divided by {row('inverse inverse.toml')['factor']:.2f} |" in PAGE
    learned = row("learn")
    assert f"{learned['fall_db']:.0f} dB less error in {learned['repetitions']} repetitions" in PAGE
    assert f"up to {max(sines['apc']):.0f} Hz, nowhere without it" in PAGE
    assert sines["alone"] == []
    asis, inverse = hybrid["outer"]["as it is"], hybrid["outer"]["inverse"]
    margins = f"{asis['gain_margin_db']:.1f} dB, {inverse['gain_margin_db']:.1f} dB with the delay taken out"
    assert f"{margins}, Ms {asis['ms']:.2f} and {inverse['ms']:.2f}; error divided by {hybrid['factor']:.2f}" in PAGE
    settles = row("bench")["settling_ms"]
    soft, stiff, free = (settles[name] for name in ("stiffness-1e6", "stiffness-1e7", "nominal"))
    assert f"settles in {soft:.0f} and {stiff:.0f} ms, in {free:.0f} ms without" in PAGE


def test_a_folder_without_the_recordings_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"chirp0A.csv.gz: no such file; give the folder of the recordings"):
        run_press(tmp_path, no_checkpoint, lambda _: None)
