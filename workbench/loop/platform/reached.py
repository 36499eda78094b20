"""Whether a sine along one axis of a platform is reached on the engine, as performance/reached.py asks of one jack.

Slow position loops hold home, and commands are added that the legs' lands need, before their valves. What the motion
lacks of each harmonic, along all six axes, is multiplied by the inverse of the linear plant's response, 6 x 6, and
added to the commands, cycle by cycle.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...control.platform_controller import LEGS, PlatformSpec
from ...linear.linearisation import jacobians
from ...rigs.platform import AXES
from ..performance.carried import carried_along
from ..performance.reached import OF_SPEED, ROUNDS, Cycle, Reached, blocks_of
from .loop import run_platform
from .setup import PlatformSetup

_LONGER = 4  # times as long as one jack's: a round, whose first part grows
_CORRECTED = 0.7  # of what is lacking: at null, where the response is from, lands give twice as much as beyond
_COMMANDS = tuple(f"command{i + 1}" for i in range(LEGS))


def reached_along(
    setup: PlatformSetup, loops: Sequence[ControllerSpec], axis: str, f: float, amplitude: float, bound: str
) -> Reached:
    """A sine of an amplitude [m or rad] along an axis whose cycle is whole samples, next to f [Hz]; `loops` hold the
    legs."""
    period, place = setup.platform.period, AXES.index(axis)
    whole = Cycle.near(f, period)
    f, cycle, orders, turn = whole
    poses, spools = _responses(setup, orders * f)
    inverse, wanted = np.linalg.inv(poses), np.zeros((orders.size, LEGS), complex)
    wanted[0, place] = amplitude
    legs = [whole.opening(carried, amplitude) for carried in carried_along(setup, axis, np.array([f]))]
    sent, best = np.stack(legs, axis=1) / spools, Reached(f, amplitude, bound)
    controller = PlatformSpec("slow", tuple(loops)).build(period, setup.directions)
    rows = np.arange(cycle * _LONGER * blocks_of(f) + 1)
    rise = np.minimum(_LONGER * rows / rows[-1], 1.0)[:, None]  # the modes of six legs on their oil ring long
    for _ in range(ROUNDS):
        wave = rise * np.real(turn @ sent)[rows % cycle]
        run = run_platform(setup, controller, np.zeros((rows.size, LEGS)), added=wave)
        if run.tripped is not None:
            return replace(best, told=run.tripped)
        last = _level(run.pose[-cycle - 1 :])
        off = _off(last[:, place], amplitude, bound)
        if off < best.off:
            best = replace(best, off=off, lowest=float(run.legs("lowest_pressure")[-cycle:].min()))
        if best.there:
            break
        lacking = wanted - 2 * turn.conj().T @ last / cycle
        sent = sent + _CORRECTED * (inverse @ lacking[..., None])[..., 0]
    return best


def _responses(setup: PlatformSetup, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Responses of poses to commands [k, 6, 6], and of each leg's opening over full travel to its command [k, 6]."""
    plant, legs = setup.engine.plant, setup.platform.legs
    outputs = (*AXES, *(f"leg{i + 1}.spool" for i in range(LEGS)))
    a, b, c, d = jacobians(plant, setup.smooth, _COMMANDS, outputs, setup.p_smooth)
    turns = 2j * np.pi * f[:, None, None] * np.eye(len(a)) - a
    whole = c @ np.linalg.solve(turns, np.broadcast_to(b.astype(complex), (f.size, *b.shape))) + d
    whole = whole * np.exp(-2j * np.pi * f * plant.lateness())[:, None, None]
    spools = np.diagonal(whole[:, LEGS:], axis1=1, axis2=2)
    return whole[:, :LEGS], spools / np.array([leg.rig["z3max"] for leg in legs])


def _level(pose: np.ndarray) -> np.ndarray:
    """One cycle [k, 6] of k + 1 poses, without its mean and without what they drift by."""
    drift = (np.arange(len(pose)) / (len(pose) - 1))[:, None] * (pose[-1] - pose[0])
    level = (pose - drift)[:-1]
    return level - level.mean(axis=0)


def _off(position: np.ndarray, amplitude: float, bound: str) -> float:
    """How far the speed or the acceleration of one cycle [k] is off that of `amplitude` cos, over its amplitude."""
    lines = np.fft.rfft(position)
    wanted = np.zeros_like(lines)
    wanted[1] = amplitude * position.size / 2
    power = 1 if bound in OF_SPEED else 2
    beyond = np.fft.irfft((lines - wanted) * (1j * np.arange(lines.size)) ** power, position.size)
    return float(np.abs(beyond).max()) / amplitude
