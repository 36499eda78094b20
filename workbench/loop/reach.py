"""Whether a rig can do what a scenario asks for: its limits of position, speed, force and flow; recorded references,
sampled at the control period without aliasing, and slowed until a rig can follow them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.errors import InputError
from ..base.signals import SIGNALS
from ..rigs.rig import Rig
from .capability import Capability, capability
from .scenarios import SCENARIOS, Scenario
from .step_metrics import LAST

_PASS, _STOP = 0.4, 0.5  # of the control rate: what is kept, and from where on nothing is left
_KAISER, _CYCLES = 8.0, 26.0  # window of the low pass, -80 dB, and half its length over the control period
_ROUNDS, _CLOSE = 5, 1e-6
_CHUNK = 4096
_SIGNALS = {"position": "position", "speed": "velocity", "force": "force", "load": "force"}
_LONGEST = 10_000_000  # control periods of a scenario: hours of it
_ROUNDING = 1 + 1e-9


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


def check_reach(scenario: Scenario, rig: Rig) -> None:
    """Raises InputError for a scenario that leads beyond a rig's limits, or is over before it can settle."""
    _check_linear(scenario, rig)
    period, stroke, force = rig.period.value, rig.limit("stroke"), rig.limit("force")
    if scenario.frequency and scenario.frequency * period >= 0.5:
        raise _error(scenario, f"{scenario.frequency:g} Hz: must be below half the control rate of {rig.name}")
    if scenario.duration / period > _LONGEST:
        limit = f"{_LONGEST} control periods of {1e3 * period:g} ms"
        raise _error(scenario, f"a duration of {scenario.duration:g} s is above {limit}; shorten it")
    if scenario.arrives is not None and scenario.duration < scenario.arrives + LAST:
        least = f"{scenario.arrives + LAST:g} s, {LAST:g} s more than it takes to arrive"
        raise _error(scenario, f"a duration of {scenario.duration:g} s is too short; give at least {least}")
    t = np.arange(round(scenario.duration / period) + 1) * period
    course = scenario.reference(t)
    if scenario.frequency:
        course = scenario.size * np.array([-1.0, 1.0])  # the samples may miss its peaks
    asked = {"position": np.abs(scenario.position(stroke) + (course if scenario.signal == "position" else 0.0)).max()}
    asked["force"] = np.abs(course).max() if scenario.signal == "force" else 0.0
    asked["load"] = abs(scenario.load)
    asked["speed"] = _speed(scenario, t)
    for name, limit in {"position": stroke, "force": force, "load": force, "speed": rig.limit("speed")}.items():
        if asked[name] > limit * _ROUNDING:
            value, most = (rig.signal(_SIGNALS[name]).text(number) for number in (asked[name], limit))
            raise _error(scenario, f"asks for a {name} of {value}, the limit of {rig.name} is {most}; ask for less")


def _check_linear(scenario: Scenario, rig: Rig) -> None:
    """Raises InputError for what only a jack can do: stand elsewhere, move a specimen's far end, carry a load."""
    if (unit := rig.signal(scenario.signal).unit) != SIGNALS[scenario.signal].unit and scenario in SCENARIOS.values():
        raise _error(scenario, f"is a length, {rig.name} is measured in {unit}; write a table [scenario.NAME]")
    if not rig.is_jack and (scenario.start or scenario.start_share):
        raise _error(scenario, f"{rig.name} is a linear plant, the same everywhere; take the start out")
    if not rig.is_jack and scenario.travel:
        raise _error(scenario, f"{rig.name} is a linear plant without a specimen; take the travel out")
    if scenario.load and not rig.takes_load:
        raise _error(scenario, f"no force acts on {rig.name}; give it [signals] load, or E in [state_space]")


def check_flow(scenario: Scenario, rigs: Sequence[Rig]) -> None:
    """Raises InputError for a course of position that takes more acceleration than a rig has, or more flow while it
    accelerates, naming the weakest of them."""
    if scenario.waveform is None or scenario.signal != "position":
        return
    t, values = (np.array(part) for part in scenario.waveform)
    factors = {rig.name: too_fast(Waveform(t, values), capability(rig)) for rig in rigs if rig.is_jack}
    weakest = max(factors, key=lambda name: factors[name], default="")
    if not weakest or factors[weakest] <= _ROUNDING:
        return
    among = f", the weakest of {len(factors)} rigs" if len(factors) > 1 else ""
    remedy = "ask for less, or slow a file down with slow = true"
    if scenario.slowed_for:
        remedy = f"it is slowed for {scenario.slowed_for} alone; slow its file down"
    what = f"takes more acceleration and flow than {weakest} has{among}"
    raise _error(scenario, f"{what}: it is too fast by a factor of {factors[weakest]:.4g}; {remedy}")


def _speed(scenario: Scenario, t: np.ndarray) -> float:
    """The highest speed [m/s] of the reference or the far end; a step has none."""
    if scenario.signal != "position":
        return scenario.speed
    if scenario.frequency:
        return 2 * np.pi * scenario.frequency * abs(scenario.size)
    if scenario.waveform is not None:
        return float(np.abs(np.diff(scenario.reference(t))).max() / t[1])
    return 0.0 if np.isinf(scenario.rate) else scenario.rate


def _error(scenario: Scenario, what: str) -> InputError:
    return InputError(f'scenario "{scenario.name}": {what}')
