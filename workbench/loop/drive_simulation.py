"""A rig in simulation with the position loop of its drive: what it plays before a real one plays it.

The drive is a slow proportional position loop that holds the jack, or follows the reference of a file; the command of a
file is added to what the loop commands. A motion that it foresees has to stay clear of the rig's limits.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..base.errors import InputError
from ..control.controller_spec import ControllerSpec
from ..control.controller_type import controller
from ..engine import Engine
from ..linear import equilibrium
from ..linear.operating_point import moving_point
from ..plant import build
from ..records.excitation import Excitation
from ..rigs.inner_loop import InnerLoop
from ..rigs.limited import limits_of, nearest_limit
from ..rigs.oil import CAVITATES
from ..rigs.rig import Rig
from .margins import linear_loop
from .sampled_loop import LoopRun, SampledLoop
from .sensors import logged

_ENDS = 0.3  # s after a motion: one that ends in full speed shakes the jack then
CLEAR = 0.05  # of a limit: nothing that is foreseen may come nearer to it
MARGIN = 8.0  # dB of gain at null, where the lap doubles it
CROSSOVER = 1.0  # Hz, at most: the loop is there to hold the jack, not to explain it
STIRRED = 5e-4  # of full command, at most: what the position sensor's noise makes the loop command
SMALLER, TRIES = 0.7, 12
_CHUNK = 0.25  # s: how soon a run that has failed is given up


def with_end(course: np.ndarray, period: float, after: float | None = None) -> np.ndarray:
    """A reference, or a command that is added, [k] with what follows it: its last value, unless another is given."""
    return np.append(course, np.full(round(_ENDS / period), course[-1] if after is None else after))


def wave_with_end(wave: Excitation) -> Excitation:
    """An excitation, with the rest that follows it."""
    reference = with_end(wave.reference, wave.period)
    return replace(wave, reference=reference, command=with_end(wave.command, wave.period, 0.0))


def beyond(rig: Rig, signals: Mapping[str, np.ndarray]) -> tuple[str, int] | None:
    """Which limit signals [lanes, k] by name come too near to, furthest first, in words, and the lane; None where all
    stay clear of all. Of a further limit that is also where the guard's next sample is foreseen beyond it."""
    nearest = nearest_limit(limits_of(rig), signals)
    if nearest is not None and nearest.share > 1 - CLEAR:
        return nearest.limit.text(nearest.value), nearest.lane
    for limit in rig.further_limits:
        values = signals.get(limit.signal, np.zeros((0, 2)))
        lanes, samples = np.nonzero(~limit.holds(values[:, 1:], np.diff(values)))
        if len(lanes):
            return limit.text(float(values[lanes[0], samples[0] + 1])), int(lanes[0])
    return None


def emptied(signals: Mapping[str, np.ndarray]) -> str | None:
    """Whether gas comes out in a chamber in signals [.., k], in words."""
    lowest = float(signals["lowest_pressure"].min())
    return f"gas comes out of the oil in a chamber, at {lowest / 1e5:.3g} bar absolute" if lowest < CAVITATES else None


@dataclass(frozen=True)
class DriveSimulation:
    """A rig in simulation with the position loop of its drive."""

    rig: Rig
    engine: Engine
    loop: ControllerSpec


def drive(rig: Rig) -> DriveSimulation:
    """The rig with its position loop: as stiff as MARGIN at null, CROSSOVER and STIRRED allow; or with the loop that is
    inside it already, which is asked for the reference."""
    plant = build(rig)
    if rig.inner:
        return DriveSimulation(rig, Engine(plant), loop_inside(rig.inner))
    smooth = plant.without_dry_friction()
    period = rig.period.value

    def loop(gain: float) -> ControllerSpec:
        return controller("controllers.p:P", gain=gain).named("position loop")

    trial = 0.01
    linear = linear_loop(plant, equilibrium(plant, p=smooth), loop(trial).build(period), period, smooth)
    speed = float(np.abs(linear.open[0]) * 2 * np.pi * linear.f[0] / trial)  # of the jack, per unit of command [m/s]
    if speed == 0:  # a play in the valve answers no small move
        moving, passing = moving_point(plant, rig.passing_speed, p=smooth)
        speed = abs(passing / moving.u[plant.input("command")])
    margin, sensor = linear.gain_margin_db, rig.sensors.get("position")
    gains = [
        2 * np.pi * CROSSOVER / speed,
        np.inf if margin is None else trial * 10 ** ((margin - MARGIN) / 20),
        STIRRED / sensor.noise if sensor and sensor.noise > 0 else np.inf,
    ]
    return DriveSimulation(rig, Engine(plant), loop(float(f"{min(gains):.2g}")))


def loop_inside(inner: InnerLoop) -> ControllerSpec:
    """The controller that asks the loop inside a rig for the reference itself."""
    return controller("controllers.through:Through", gain=1 / inner.full_command).named("loop inside")


def play(drive: DriveSimulation, played: Excitation, seed: int | None = None) -> LoopRun:
    """Play an excitation from rest where its reference begins; with a seed, the loop sees noise and resolution."""
    return _loop(drive, played, seed).run(played.reference, added=played.command)


def trouble(run: LoopRun) -> str | None:
    """Why a simulated rig should not play that: a trip, or gas in a chamber."""
    if run.tripped is not None:
        return f"{run.tripped} after {run.record.t[-1]:.2f} s"
    return emptied(run.record.signals)


def within_limits(drive: DriveSimulation, played: Excitation, first: float = 1.0) -> Excitation | None:
    """The excitation at the first of the sizes `first`, 0.7 of it, and so on, that the rig takes; None if at none."""
    smaller = (played.scaled(float(factor)) for factor in first * SMALLER ** np.arange(TRIES))
    return next((trial for trial in smaller if _is_taken(drive, trial)), None)


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


def _is_taken(drive: DriveSimulation, played: Excitation) -> bool:
    loop, count = _loop(drive, played, None), max(1, round(len(played.reference) * played.period / _CHUNK))
    pieces = zip(np.array_split(played.reference, count), np.array_split(played.command, count), strict=True)
    return all(trouble(loop.run(reference, added=command)) is None for reference, command in pieces)


def _loop(drive: DriveSimulation, played: Excitation, seed: int | None) -> SampledLoop:
    start = equilibrium(drive.engine.plant, position=float(played.reference[0]) - drive.rig["xmid"])
    return SampledLoop(drive.engine, drive.rig, drive.loop.build(played.period), start, seed)


def logged_run(drive: DriveSimulation, run: LoopRun, seed: int) -> dict[str, np.ndarray]:
    """What the rig's sensors log of a run that the loop measured with the same seed, [n] SI by signal.

    Row k is y = h(x(t_k), u_k), after writing u_k, and its noise is the one that the controller met at t_k: a loop logs
    the sample that it acts on. A load cell that nothing acts on is left out.
    """
    rig = drive.rig
    readings = logged(run.record.signals, rig, drive.engine.plant.outputs, seed)
    idle = ("force",) if rig.cell_is_idle else ()
    given = {name: run.record.signals[name] for name in ("reference", "command")}
    return given | {name: values for name, values in readings.items() if name not in idle}


def recorded(drive: DriveSimulation, excitation: Excitation, entropy: list[int]) -> dict[str, Any]:
    """An excitation as the rig's sensors log it, `signals`, with the `effort` it took. Raises InputError for a trip."""
    seed = int(np.random.SeedSequence(entropy).generate_state(1)[0])
    run = play(drive, excitation, seed)
    if run.tripped is not None:
        raise InputError(
            f"{excitation.name}: on {drive.rig.name}, {trouble(run)}; make it smaller, or check the rig's limits"
        )
    return {"signals": logged_run(drive, run, seed), "effort": effort(run, drive.rig)}
