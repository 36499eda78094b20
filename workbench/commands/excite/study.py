"""Excitation designed on a rig: played in simulation by the rig's drive before a real one plays it.

The drive is a slow proportional position loop that holds the jack, or follows the reference of a file; the command of a
file is added to what the loop commands.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.errors import InputError, nearest
from ...base.files import check_place
from ...base.signals import SIGNALS
from ...base.units import from_si, to_si
from ...base.words import counted
from ...control.controller_spec import ControllerSpec
from ...control.controller_type import controller
from ...engine import Engine
from ...linear import equilibrium
from ...loop.margins import linear_loop
from ...loop.sampled_loop import LoopRun, SampledLoop
from ...plant import build
from ...records.excitation import (
    MOST_ROWS,
    SIMPLE,
    Excitation,
    chirp,
    crest_factor,
    excitation,
    excitation_text,
    harmonics,
    multisine,
)
from ...rigs.rig import Rig
from .config import KINDS, Design

MARGIN = 8.0  # dB of gain at null, where the lap doubles it
CROSSOVER = 1.0  # Hz, at most: the loop is there to hold the jack, not to explain it
STIRRED = 5e-4  # of full command, at most: what the position sensor's noise makes the loop command
SMALLER, TRIES = 0.7, 12
_CHUNK = 0.25  # s: how soon a run that has failed is given up


@dataclass(frozen=True)
class DriveSimulation:
    """A rig in simulation with the position loop of its drive."""

    rig: Rig
    engine: Engine
    loop: ControllerSpec


def drive(rig: Rig) -> DriveSimulation:
    """The rig with its position loop: as stiff as MARGIN at null, CROSSOVER and STIRRED allow."""
    plant = build(rig)
    smooth = plant.without_dry_friction()
    period = rig.period.value

    def loop(gain: float) -> ControllerSpec:
        return controller("controllers.p:P", gain=gain).named("position loop")

    trial = 0.01
    linear = linear_loop(plant, equilibrium(plant, p=smooth), loop(trial).build(period), period, smooth)
    speed = float(np.abs(linear.open[0]) * 2 * np.pi * linear.f[0] / trial)  # of the jack, per unit of command [m/s]
    margin, sensor = linear.gain_margin_db, rig.sensors.get("position")
    gains = [
        2 * np.pi * CROSSOVER / speed,
        np.inf if margin is None else trial * 10 ** ((margin - MARGIN) / 20),
        STIRRED / sensor.noise if sensor and sensor.noise > 0 else np.inf,
    ]
    return DriveSimulation(rig, Engine(plant), loop(float(f"{min(gains):.2g}")))


def play(drive: DriveSimulation, played: Excitation, seed: int | None = None) -> LoopRun:
    """Play an excitation from rest where its reference begins; with a seed, the loop sees noise and resolution."""
    return _loop(drive, played, seed).run(played.reference, added=played.command)


def trouble(run: LoopRun) -> str | None:
    """Why a simulated rig should not play that: a trip, or a chamber below 0 bar, where no model holds."""
    lowest = run.record.signals["lowest_pressure"].min()
    if run.tripped is not None:
        return f"{run.tripped} after {run.record.t[-1]:.2f} s"
    return f"a chamber falls to {lowest / 1e5:.3g} bar" if lowest < 0 else None


def within_limits(drive: DriveSimulation, played: Excitation, first: float = 1.0) -> Excitation | None:
    """The excitation at the first of the sizes `first`, 0.7 of it, and so on, that the rig takes; None if at none."""
    smaller = (played.scaled(float(factor)) for factor in first * SMALLER ** np.arange(TRIES))
    return next((trial for trial in smaller if _is_taken(drive, trial)), None)


def designed(design: Design, rig: Rig) -> Excitation:
    """The excitation that is asked for, on the rig's control period about its middle. Raises InputError."""
    if design.kind not in KINDS:
        raise InputError(f'no excitation "{design.kind}"; {nearest(design.kind, KINDS)}')
    if design.signal not in ("command", "reference"):
        raise InputError(f'signal "{design.signal}": write command or reference')
    if design.repeat < 1:
        raise InputError(f"repeat {design.repeat}: must be 1 or more")
    if design.repeat * design.seconds > MOST_ROWS * rig.period.value:
        raise InputError(f"repeat {design.repeat}: more than {MOST_ROWS} control periods in all; repeat less often")
    signal = SIGNALS[design.signal]
    size, period = float(to_si(design.amplitude, signal.unit, signal.si)), rig.period.value
    most = 1.0 if design.signal == "command" else rig.limit("stroke")
    if not 0 < size <= most:
        limit = float(from_si(most, signal.unit, signal.si))
        raise InputError(f"amplitude {design.amplitude:g} {signal.unit}: must be above 0, at most {limit:g}")
    if design.kind in SIMPLE:
        wave = SIMPLE[design.kind](size, design.seconds, period)
    elif design.band is None:
        raise InputError(f"a {design.kind} needs its band, two frequencies in Hz")
    elif design.kind == "chirp":
        wave = chirp(size, design.seconds, period, design.band, design.spacing)
    else:
        wave = multisine(size, design.seconds, period, design.band, design.spectrum, design.lines)
    return excitation(design.kind, design.signal, wave, period, rig["xmid"], design.repeat)


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


def effort(run: LoopRun, rig: Rig) -> dict[str, float]:
    """What a run reached, in the units that people read."""
    signals = run.record.signals
    altered = ~np.isclose(run.demanded, signals["command"], atol=1e-9)
    return {
        "seconds": float(run.record.t[-1]),
        "peak_position_mm": float(np.abs(signals["position"] - rig["xmid"]).max() * 1e3),
        "peak_speed_m_s": float(np.abs(signals["velocity"]).max()),
        "peak_command": float(np.abs(signals["command"]).max()),
        "lowest_pressure_bar": float(signals["lowest_pressure"].min() / 1e5),
        "limited_s": float(altered.sum() * rig.period.value),
    }


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


def _is_taken(drive: DriveSimulation, played: Excitation) -> bool:
    loop, count = _loop(drive, played, None), max(1, round(len(played.reference) * played.period / _CHUNK))
    pieces = zip(np.array_split(played.reference, count), np.array_split(played.command, count), strict=True)
    return all(trouble(loop.run(reference, added=command)) is None for reference, command in pieces)


def _loop(drive: DriveSimulation, played: Excitation, seed: int | None) -> SampledLoop:
    start = equilibrium(drive.engine.plant, position=float(played.reference[0]) - drive.rig["xmid"])
    return SampledLoop(drive.engine, drive.rig, drive.loop.build(played.period), start, seed)
