"""The automatic tuning run: P with pressure feedback from moves of a millimetre, and no model.

Under a slow loop the command is pulsed; each edge starts a speed, and the load swings on its oil. Read are the speed
gain, and of the swing of the load pressure pa - pb its frequency, damping, size and lag. With P the swing per unit of
command, w the mode's frequency and Kv the speed gain:

damping    A pressure gain K adds the damping ratio K Kv w M/(2 A) to the mode (dynamic pressure feedback, Merritt,
           Hydraulic Control Systems, 1967, ch. 6). A speed v that starts at once swings a mass M on its oil by the
           pressure M w v/A, so that this is K P/2: neither mass nor area is asked for.
ultimate   What lags the swing by a grows with the frequency as a delay does at least. Where it is 90 degrees, at r w
           with r = 90 deg/a, the feedback excites; the loop gain is 1 there at K = (r - 1/r)/P, its ultimate gain
           (Ziegler and Nichols, Trans. ASME 64, 1942), of which a share is taken. Heavy masses are bound by damping,
           light ones by this.
loop gain  With a damping ratio d the loop is stable up to the gain 2 d w/Kv (Merritt, ch. 6); a share of it is taken.
no swing   A load that does not swing, or is damped enough by itself, needs no pressure: a jack that integrates, late by
           t, gets P of 1/(2 Kv t) (Skogestad, J. Process Control 13, 2003, for integrating processes).
"""

from dataclasses import dataclass
from math import pi

import numpy as np

from .controller_spec import ControllerSpec
from .controller_type import controller

READ = "position", "pa", "pb"  # what the moves are told by
MOVE = 1e-3  # m: of a small move
PULSE = 0.1  # s: how long the command stands on each side
GAP = 0.25  # s at rest between pulses

DAMPING = 0.5  # wanted of the mode
ULTIMATE = (
    0.2  # of the pressure gain at which what lags excites: a valve lags faster than a delay, and light oil lags more
)
SHARE = 0.45  # of the loop gain at which the mode becomes unstable; about null a lap raises both as much
MOST_GAIN = 1e3  # 1/m, of P
_CORNER = 0.5  # Hz above which pressures are fed back

_SLOWEST, _FASTEST = 4.0, 0.25  # Hz of a mode; of the sampling frequency
_SCANNED, _DAMPINGS = 60, (0.03, 0.2)  # frequencies and damping ratios tried before the fit
_MOST_DAMPED = 0.9
_WIDE = 10.0  # of logarithms that are looked at
_SWINGS = 0.3  # damping ratio above which nothing swings
_EXPLAINED = 0.5  # of the load pressure's variance: less is no swing of a mode


@dataclass(frozen=True)
class Mode:
    """The swing of the load pressure after a step of the command: frequency [Hz], damping ratio [1], size per unit of
    command [Pa], and by how much it lags that of a valve which opens at once [rad at that frequency]."""

    hz: float
    damping: float
    swing: float
    lag: float


@dataclass(frozen=True)
class SmallMoves:
    """What small moves tell: speed per unit of command [m/s], negative where the jack goes the other way; how `late`
    [s] it moves; the mode of load and oil, None where nothing swings or no pressures are measured."""

    speed_gain: float
    late: float
    mode: Mode | None


def pulses(size: float, period: float) -> np.ndarray:
    """Commands [k] that move a jack out and back, twice: pulses of a size [1], sampled every period [s]."""
    on, off = np.full(round(PULSE / period), size), np.zeros(round(GAP / period))
    return np.concatenate([off, on, off, -on, off, on, off, -on, off])


def small_moves(command: np.ndarray, position: np.ndarray, load: np.ndarray | None, period: float) -> SmallMoves:
    """What pulses tell, of the commands sent less the one that holds the jack, positions [m] and load pressures [Pa],
    each [k]."""
    speed_gain, late = _integrated(command, position, period)
    return SmallMoves(speed_gain, late, None if load is None else swing(command, load, period))


def _integrated(command: np.ndarray, position: np.ndarray, period: float) -> tuple[float, float]:
    """Speed gain [m/s] and dead time [s] of the integral of the commands that is nearest to the positions."""
    gone, x = np.cumsum(command) * period, position - position.mean()
    best = 0.0, 0.0, period
    for samples in range(1, round(PULSE / period)):
        way = np.concatenate([np.zeros(samples), gone[:-samples]])
        way -= way.mean()
        size, along = float(way @ way), float(way @ x)
        if size and along**2 / size > best[0]:
            best = along**2 / size, along / size, samples * period
    return best[1:]


def swing(command: np.ndarray, load: np.ndarray, period: float) -> Mode | None:
    """The mode whose swing after every change of commands [k] is nearest to load pressures [k], by least squares; None
    where that explains little, or is damped enough."""
    from scipy.optimize import minimize  # a list of controllers needs no solver

    every = float(np.sum((load - load.mean()) ** 2))
    if every == 0:
        return None

    def missed(logarithms: np.ndarray) -> float:
        w, damping = np.exp(np.clip(logarithms, -_WIDE, _WIDE))
        return _fitted(command, load, w * period, min(damping, _MOST_DAMPED))[1] / every

    scanned = np.log(2 * pi * np.geomspace(_SLOWEST, _FASTEST / period, _SCANNED))
    tried = [np.array([w, d]) for w in scanned for d in np.log(_DAMPINGS)]
    first = min(tried, key=missed)
    corners = first + np.array([[0.0, 0.0], [0.03, 0.0], [0.0, 0.5]])
    options = {"initial_simplex": corners, "xatol": 1e-3, "fatol": 1e-5}
    found = minimize(missed, first, method="Nelder-Mead", options=options)
    w, damping = (float(number) for number in np.exp(np.clip(found.x, -_WIDE, _WIDE)))
    (sine, cosine), left = _fitted(command, load, w * period, min(damping, _MOST_DAMPED))
    if damping > _SWINGS or not left < (1 - _EXPLAINED) * every:
        return None
    return Mode(w / (2 * pi), damping, float(np.hypot(sine, cosine)), float(np.arctan2(-cosine, sine)))


def _fitted(command: np.ndarray, load: np.ndarray, angle: float, damping: float) -> tuple[tuple[float, float], float]:
    """Sine and cosine part [Pa per unit of command] of a mode that turns by an angle [rad] a sample, and the sum of
    squares that it leaves, beside a constant and a pressure that goes with the command."""
    from scipy.signal import lfilter

    pole = np.exp(angle * complex(-damping, np.sqrt(1 - damping**2)))
    changes = np.diff(command, prepend=command[0]).astype(complex)
    rung = np.asarray(lfilter([1.0], [1.0, -pole], changes))
    parts = np.stack([np.imag(rung), np.real(rung), np.ones(len(command)), command])
    scale = np.sqrt(np.sum(parts**2, axis=1))
    scale[scale == 0] = 1.0
    parts /= scale[:, None]
    weights = np.linalg.lstsq(parts @ parts.T, parts @ load, rcond=1e-9)[0]
    left = float(np.sum((load - weights @ parts) ** 2))
    return (float(weights[0] / scale[0]), float(weights[1] / scale[1])), left


def gains(moves: SmallMoves) -> tuple[float, float]:
    """Gain of P [1/m] and of the pressure feedback [1/Pa] by the rules."""
    mode = moves.mode
    if mode is None:
        return min(1 / (2 * moves.speed_gain * moves.late), MOST_GAIN), 0.0
    r = pi / 2 / min(max(mode.lag, 1e-3), pi / 2)
    wanted, ultimate = 2 * (DAMPING - mode.damping) / mode.swing, (r - 1 / r) / mode.swing
    pressure = min(wanted, ULTIMATE * ultimate)
    damping = mode.damping + pressure * mode.swing / 2
    return min(SHARE * 2 * damping * 2 * pi * mode.hz / moves.speed_gain, MOST_GAIN), pressure


def tuned(moves: SmallMoves, column: float, middle: float) -> ControllerSpec:
    """P with pressure feedback by the rules, gains to three digits; `column` and `middle` [m] as PressureFeedback has
    them."""
    gain, pressure = (float(f"{number:.3g}") for number in gains(moves))
    feedback = controller(
        "controllers.pressure:PressureFeedback", gain=pressure, corner=_CORNER, column=column, middle=middle
    )
    return (controller("controllers.p:P", gain=gain) + feedback).named("automatic")
