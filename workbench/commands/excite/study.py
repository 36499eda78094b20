"""Excitation designed on a rig: played in simulation by the rig's drive before a real one plays it."""

from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...base.files import check_place
from ...base.signals import SIGNALS
from ...base.units import from_si
from ...base.words import counted
from ...loop.drive_simulation import SMALLER, DriveSimulation, drive, effort, play, trouble, within_limits
from ...loop.sampled_loop import LoopRun
from ...loop.standard_records import Design, designed
from ...records.excitation import (
    Excitation,
    crest_factor,
    excitation_text,
    harmonics,
)
from ...rigs.rig import Rig


def excite(design: Design, rig: Rig, out: Path, force: bool = False) -> str:
    """Design, play on the simulated rig, write the file; the sentences to print. Raises InputError, writing nothing."""
    check_place(out, "--out")
    if out.suffix != ".csv":
        raise InputError(f"{out}: name a .csv file")
    if out.exists() and not force:
        raise InputError(f"{out}: exists already; choose another --out or add --force to replace it")
    played, ready = designed(design, rig), drive(rig)
    run = play(ready, played)
    if reason := trouble(run):
        smaller = within_limits(ready, played, SMALLER)
        fits = "nor does it at smaller ones" if smaller is None else f"{_peak(design, smaller):.2g} fits"
        raise InputError(f"amplitude {design.amplitude:g}: on {rig.name}, {reason}; {fits}")
    out.write_text(excitation_text(played), encoding="utf-8", newline="\n")
    return "\n".join([_shape(design, played), _effort(ready, run), f"written: {out}"])


def _shape(design: Design, played: Excitation) -> str:
    values = _wave(design, played)
    rms = _shown(design, float(np.sqrt(np.mean(values**2))))
    what = f"{design.kind} on {SIGNALS[design.signal].label}"
    text = f"{what}: peak {_peak(design, played):.4g}, RMS {rms:.4g}, crest factor {crest_factor(values):.3g}"
    if design.kind == "multisine" and design.band:
        lines = harmonics(design.band, design.seconds, played.period, design.lines) / design.seconds
        return f"{text}; {counted(lines.size, 'line')} from {lines[0]:.3g} to {lines[-1]:.4g} Hz, {design.spectrum}"
    return f"{text}; {design.band[0]:g} to {design.band[1]:g} Hz" if design.kind == "chirp" and design.band else text


def _wave(design: Design, played: Excitation) -> np.ndarray:
    return played.command if design.signal == "command" else played.reference - played.reference[0]


def _peak(design: Design, played: Excitation) -> float:
    return _shown(design, float(np.abs(_wave(design, played)).max()))


def _shown(design: Design, value: float) -> float:
    signal = SIGNALS[design.signal]
    return float(from_si(value, signal.unit, signal.si))


def _effort(drive: DriveSimulation, run: LoopRun) -> str:
    peaks, rig = effort(run, drive.rig), drive.rig
    return (
        f"on {rig.name}, under a position loop of {drive.loop.design.gain:g} 1/m: position within "
        f"{peaks['peak_position_mm']:.3g} of {rig.limit('stroke') * 1e3:g} mm, speed {peaks['peak_speed_m_s']:.3g} of "
        f"{rig.limit('speed'):g} m/s, command {peaks['peak_command']:.3g}, lowest pressure "
        f"{peaks['lowest_pressure_bar']:.3g} bar, limited for {peaks['limited_s']:.3g} s"
    )
