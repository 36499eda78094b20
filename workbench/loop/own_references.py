"""Recorded references: sampled at the control period without aliasing, and slowed until a rig can follow them."""

from dataclasses import dataclass

import numpy as np

from .capability import Capability

_PASS, _STOP = 0.4, 0.5  # of the control rate: what is kept, and from where on nothing is left
_KAISER, _CYCLES = 8.0, 26.0  # window of the low pass, -80 dB, and half its length over the control period
_ROUNDS, _CLOSE = 5, 1e-6
_CHUNK = 4096


@dataclass(frozen=True)
class Waveform:
    """Times t [k] s and values [k] (SI), from 0 on; `left_out`: part of the record's energy above the control's
    Nyquist frequency; `slowed`: by which factor the record is played slower than it was recorded."""

    t: np.ndarray
    values: np.ndarray
    left_out: float = 0.0
    slowed: float = 1.0


def sampled_record(t: np.ndarray, values: np.ndarray, period: float) -> Waveform:
    """A record t [k] s, values [k] at a control period [s]. One that is slower than that stays as it is.

    A faster one goes through a low pass of linear phase, a sinc under a Kaiser window, which keeps its first and last
    value (Oppenheim and Schafer, Discrete-Time Signal Processing, 2010, ch. 7.6); a sine above the new Nyquist
    frequency leaves 0.1 % at most.
    """
    t, values = t - t[0], values - values[0]
    spacing = float(np.diff(t).min())
    if spacing > period * (1 - _CLOSE):
        return Waveform(t, values)
    count = round(float(t[-1]) / spacing)
    even = np.arange(count + 1) * (float(t[-1]) / count)
    values = np.interp(even, t, values)
    at = np.arange(int(even[-1] / period + _CLOSE) + 1) * period
    rest = values - _low_pass(values, even[1], even, period)
    energy = float(np.sum((values - values.mean()) ** 2))
    left_out = float(np.sum(rest**2)) / energy if energy else 0.0
    return Waveform(at, _low_pass(values, even[1], at, period), left_out)


def _low_pass(values: np.ndarray, spacing: float, at: np.ndarray, period: float) -> np.ndarray:
    """Evenly spaced values [k], continued at both ends as if turned about them, filtered at times [m]."""
    half = min(int(_CYCLES * period / spacing), len(values) - 1)
    padded = np.pad(values, half, mode="reflect", reflect_type="odd")
    offsets = np.arange(-half, half + 1)
    corner, out = (_PASS + _STOP) / period, np.empty(len(at))  # twice the middle of the transition
    for first in range(0, len(at), _CHUNK):
        some = at[first : first + _CHUNK]
        near = np.minimum(np.rint(some / spacing).astype(int), len(values) - 1)[:, None] + offsets
        away = some[:, None] - near * spacing
        window = np.i0(_KAISER * np.sqrt(np.maximum(0.0, 1 - (away / (half * spacing)) ** 2)))
        weights = np.sinc(corner * away) * window
        out[first : first + _CHUNK] = np.sum(weights * padded[near + half], axis=1) / weights.sum(axis=1)
    return out


def too_fast(waveform: Waveform, rig: Capability) -> float:
    """By which factor the fastest moment of a waveform of positions [m] must be slower for a rig; below 1: none.

    Slower by s, speeds are v/s and accelerations a/s^2: a0 (1 - (v/(s v0))^2) = a/s^2 gives s^2 = a/a0 + (v/v0)^2,
    while braking takes no flow.
    """
    v = np.diff(waveform.values) / np.diff(waveform.t)
    fastest = float(np.abs(v).max()) / min(rig.limit, rig.v0)
    if len(v) < 2:
        return fastest
    a = np.diff(v) / (np.diff(waveform.t)[1:] + np.diff(waveform.t)[:-1]) * 2
    mean = (v[1:] + v[:-1]) / 2
    squared = np.abs(a) / rig.a0 + np.where(a * mean > 0, (mean / rig.v0) ** 2, 0.0)
    return max(fastest, float(np.sqrt(squared.max())))


def slowed_record(t: np.ndarray, values: np.ndarray, period: float, rig: Capability) -> Waveform:
    """`sampled_record`, played slower until a rig can follow it."""
    slowed, waveform = 1.0, sampled_record(t, values, period)
    for _ in range(_ROUNDS):
        if (factor := too_fast(waveform, rig)) <= 1:
            break
        slowed *= factor * (1 + _CLOSE)
        waveform = sampled_record(t * slowed, values, period)
    return Waveform(waveform.t, waveform.values, waveform.left_out, slowed)
