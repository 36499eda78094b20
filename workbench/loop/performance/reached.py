"""Whether a sine is reached on the engine: the command that it takes, added to a slow loop, learned cycle by cycle.

The loop holds the middle. The command is a sum of harmonics, at first the opening that the lands need, before the
valve; what the motion lacks of each is then divided by the linear plant's response and added (iterative learning in the
frequency domain; Moore, Iterative Learning Control for Deterministic Systems, 1993, ch. 2). A sine counts as reached
where what its bound is of, speed or acceleration, is nowhere in a cycle further than `NEAR` of its amplitude from the
sine's: beyond the envelope a valve still moves a jack, but by no sine. Of an envelope a loop follows a part within 5 %,
alone and with its sines corrected.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...linear.linearisation import linear_plant
from ...rigs.oil import CAVITATES
from ..describing_function import SinePoint, played_sines, sampled_frequencies
from ..rows import LinearLoops, LoopSetup
from ..sampled_loop import SampledLoop
from ..sines import amplitude_phase
from .bounds import HarmonicMotion
from .carried import LoadResponse, carried_by_jack, response

WITHIN = 0.05
SHARES = (1.0, 0.9, 0.8, 0.65, 0.5, 0.35, 0.2, 0.1, 0.05)  # of the envelope, that are tried
NEAR = 0.05
OF_SPEED = ("flow", "valve", "command rate")  # bounds of the speed; others that are played are of the acceleration
PLAYED = (*OF_SPEED, "supply", "cavitation")
HARMONICS, ROUNDS = 15, 30
_BLOCK, _CORRECTED = 0.4, 0.4  # s of a round at least; share of what is lacking that is added


@dataclass(frozen=True, eq=False)
class Followed:
    """The largest amplitudes [k] m at f [k] Hz of which a loop's position has the `amplitude` within 5 %; is off by no
    more in amplitude and phase together, its `error`; and that under amplitude and phase `control`. NaN where none.
    `uncontrolled`: why nothing controls amplitude and phase, where nothing does."""

    f: np.ndarray
    amplitude: np.ndarray
    error: np.ndarray
    control: np.ndarray
    uncontrolled: str = ""


def followed(setup: LoopSetup, spec: ControllerSpec, loops: LinearLoops, f: np.ndarray, most: np.ndarray) -> Followed:
    """What a position loop without noise follows of amplitudes `most` [k] m at f [k] Hz, whole samples a cycle."""
    sines = [(float(each), share * float(top)) for each, top in zip(f, most, strict=True) for share in SHARES]
    period = setup.rig.period.value
    points = played_sines(setup.engine, setup.rig, lambda: spec.build(period), setup.null, sines)
    response = np.array([_settled(point) for point in points]).reshape(f.size, len(SHARES))
    control, why = np.full(f.size, np.nan), ""
    try:
        control[:] = [_controlled(setup, spec, loops, *each) for each in zip(f.tolist(), most.tolist(), strict=True)]
    except ValueError as error:
        why = str(error)
    return Followed(f, _largest(np.abs(np.abs(response) - 1), most), _largest(np.abs(response - 1), most), control, why)


def highest(f: np.ndarray, amplitude: np.ndarray) -> tuple[float, float, float] | None:
    """The frequency [Hz] up to which something is followed without a gap, itself and the next that was played; None
    where nothing is at the first."""
    lost = np.flatnonzero(np.isnan(amplitude))
    last = int(lost[0]) - 1 if lost.size else f.size - 1
    return None if last < 0 else (float(f[last]), float(f[last]), float(f[min(last + 1, f.size - 1)]))


def _controlled(setup: LoopSetup, spec: ControllerSpec, loops: LinearLoops, f: float, most: float) -> float:
    """The largest amplitude [m] at f [Hz] that is tried with success; NaN for none. Raises ValueError for a loop that
    has no linear view to correct by."""
    sensor, period = setup.rig.sensors["position"], setup.rig.period.value
    corrected = amplitude_phase(spec, loops, f, 1, sensor.noise)

    def holds(share: float) -> bool:
        sine = [(f, share * most)]
        (point,) = played_sines(setup.engine, setup.rig, lambda: corrected.build(period), setup.null, sine)
        return abs(_settled(point) - 1) <= WITHIN

    return most * _first(holds)


def _settled(point: SinePoint) -> complex:
    """The response; NaN of what goes on by itself, such as a limit cycle, and of what tripped."""
    return complex(np.nan, np.nan) if point.response is None or not point.settled else point.response


def _first(holds: Callable[[float], bool]) -> float:
    return next((share for share in SHARES if holds(share)), float("nan"))


def _largest(off: np.ndarray, most: np.ndarray) -> np.ndarray:
    """The largest of the amplitudes that were tried that is within, [k]."""
    good = off <= WITHIN  # of what trips it is NaN, and False
    share = np.where(good.any(axis=1), np.array(SHARES)[np.argmax(good, axis=1)], np.nan)
    return share * most


@dataclass(frozen=True)
class Reached:
    """A sine of `amplitude` [m] at f [Hz] on a `bound`: `off`, by what share the bounded quantity misses it at best;
    `lowest`, the lowest chamber pressure [Pa] then; `told`, why the guard stopped it, if it did."""

    f: float
    amplitude: float
    bound: str
    off: float = np.inf
    lowest: float = np.inf
    told: str = ""

    @property
    def there(self) -> bool:
        """Whether it counts as reached: by a sine, and with both chambers full."""
        return self.off <= NEAR and self.lowest >= CAVITATES


class Cycle(NamedTuple):
    """A sine's cycle of whole `samples`, next to a frequency: f [Hz], the `orders` [k] of harmonics that are looked at,
    and their turns [samples, k]."""

    f: float
    samples: int
    orders: np.ndarray
    turn: np.ndarray

    @classmethod
    def near(cls, f: float, period: float) -> "Cycle":
        """The one next to f [Hz] at a control period [s]."""
        f = float(sampled_frequencies(f, f, 1, period)[0])
        samples = round(1 / (f * period))
        orders = np.arange(1, min(HARMONICS, samples // 4) + 1)
        return cls(f, samples, orders, np.exp(2j * np.pi * np.outer(np.arange(samples) / samples, orders)))

    def opening(self, carried: LoadResponse, amplitude: float) -> np.ndarray:
        """Harmonics [k] of the opening that the lands need, at most full, for a sine of what a jack carries at f."""
        opening = np.clip(HarmonicMotion(carried).opening(np.array([amplitude]))[0], -1.0, 1.0)
        at = np.arange(opening.size) / opening.size
        return 2 * np.exp(-2j * np.pi * np.outer(self.orders, at)) @ opening / opening.size


def reached(setup: LoopSetup, loop: ControllerSpec, f: float, amplitude: float, bound: str) -> Reached:
    """A sine whose cycle is whole samples, next to f [Hz]; infinitely far off where the loop trips at once."""
    period = setup.rig.period.value
    whole = Cycle.near(f, period)
    f, cycle, orders, turn = whole
    signal = "velocity" if bound in OF_SPEED else "acceleration"
    linear = linear_plant(setup.engine.plant, setup.moving, outputs=(signal, "spool"), p=setup.smooth)
    gain, spool = response(linear, orders * f)
    wanted = np.zeros(orders.size, complex)
    wanted[0] = amplitude * (2j * np.pi * f) ** (1 if bound in OF_SPEED else 2)
    sent = whole.opening(carried_by_jack(setup.rig, np.array([f])), amplitude) * setup.rig["z3max"] / spool
    blocks, best = blocks_of(f), Reached(f, amplitude, bound)
    played = SampledLoop(setup.engine, setup.rig, loop.build(period), setup.null)
    for _ in range(ROUNDS):
        wave = np.real(turn @ sent)
        run = played.run(np.full(cycle * blocks, setup.rig.middle), added=np.tile(wave, blocks))
        if run.tripped:
            return replace(best, told=run.tripped)
        last, lowest = (run.record.signals[name][-cycle:] for name in (signal, "lowest_pressure"))
        off = float(np.abs(last - np.real(turn @ wanted)).max() / abs(wanted[0]))
        if off < best.off:
            best = replace(best, off=off, lowest=float(lowest.min()))
        sent = sent + _CORRECTED * (wanted - 2 * turn.conj().T @ last / cycle) / gain
    return best


def blocks_of(f: float) -> int:
    """Cycles of a round at f [Hz]."""
    return max(2, int(np.ceil(_BLOCK * f)))
