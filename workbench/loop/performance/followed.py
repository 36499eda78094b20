"""The part of an envelope that a loop follows within 5 %, played on the engine, alone and with its sines corrected."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...control.controller_spec import ControllerSpec
from ..describing_function import SinePoint, played_sines
from ..rows import LinearLoops, LoopSetup
from ..sines import amplitude_phase

WITHIN = 0.05
SHARES = (1.0, 0.9, 0.8, 0.65, 0.5, 0.35, 0.2, 0.1, 0.05)  # of the envelope, that are tried


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
    """Of envelopes `most` [k] m at f [k] Hz, whole samples a cycle, by a position loop without noise."""
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
