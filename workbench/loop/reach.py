"""Whether a rig can do what a scenario asks for: its limits of position, speed, force and flow."""

from collections.abc import Sequence

import numpy as np

from ..base.errors import InputError
from ..base.signals import SIGNALS
from ..rigs.rig import Rig
from .capability import capability
from .own_references import Waveform, too_fast
from .scenarios import SCENARIOS, Scenario
from .step_metrics import LAST

_SIGNALS = {"position": "position", "speed": "velocity", "force": "force", "load": "force"}
_LONGEST = 10_000_000  # control periods of a scenario: hours of it
_ROUNDING = 1 + 1e-9


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
