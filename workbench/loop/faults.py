"""Faults of sensors, controllers, drives and plants, and the closed loop in which one of them begins."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import copysign, nan
from typing import Any, cast

import numpy as np

from ..control.compensators import innermost
from ..control.protocol import Controller
from ..engine import Engine
from ..linear import Equilibrium
from ..rigs.rig import Rig
from .sampled_loop import SampledLoop
from .sensors import draws

Signals = dict[str, float]


@dataclass(frozen=True)
class Since:
    """What is known of a fault that acts: samples since it began, the readings, demanded and sent command then,
    standard normal numbers, and all that the controller demanded so far."""

    k: int
    began: Signals
    demanded: float
    command: float
    normal: np.random.Generator
    demands: Sequence[float]


@dataclass(frozen=True)
class Fault:
    """A fault by name, on one of four places: the readings, what the controller demands, what the drive does with the
    command, or factors on the plant's parameters. `signal`: the reading that it needs; `computes`: time [s] that the
    controller takes."""

    name: str
    signal: str = ""
    readings: Callable[[Signals, Since], Signals] | None = None
    demands: Callable[[float, Since], Any] | None = None
    drives: Callable[[float, Since], float] | None = None
    factors: Mapping[str, float] = field(default_factory=dict)
    computes: float = 0.0

    def applies(self, rig: Rig) -> bool:
        """Whether a rig has what it needs: a sensor, a specimen that can break."""
        broken = any(rig[name] == 0 for name in self.factors)
        return (not self.signal or self.signal in rig.sensors) and not broken


def _signal(name: str, signal: str, change: Callable[[float, Since], float]) -> Fault:
    """A fault of one reading: what it says of the true reading."""

    def readings(signals: Signals, since: Since) -> Signals:
        return signals | {signal: change(signals[signal], since)}

    return Fault(f"{signal} {name}", signal, readings=readings)


def _lost(signal: str) -> Fault:
    def readings(signals: Signals, _: Since) -> Signals:
        return {name: value for name, value in signals.items() if name != signal}

    return Fault(f"{signal} lost", signal, readings=readings)


def _swapped(signals: Signals, _: Since) -> Signals:
    return signals | {"pa": signals["pb"], "pb": signals["pa"]}


def _frozen(signal: str) -> Fault:
    return _signal("frozen", signal, lambda _, since: since.began[signal])


def _about(factor: float) -> Callable[[float, Since], float]:
    """A scale about the position at which the fault began, so that nothing jumps."""
    return lambda x, since: since.began["position"] + factor * (x - since.began["position"])


def _raises(_: float, since: Since) -> float:
    raise ArithmeticError("made to fail")


def _oscillating(_: float, since: Since) -> float:
    return copysign(1.0, np.sin(2 * np.pi * 0.01 * since.k + 0.1))


def _late(_: float, since: Since) -> float:
    return since.demands[-min(1 + _LATE, len(since.demands))]


POSITION_NOISE = 4e-5  # m: of a frozen sensor whose noise goes on
_SPIKE, _JUMP, _DRIFT, _LATE = 0.05, 0.02, 5e-5, 20  # m, m, m a sample, samples

FAULTS = (
    _frozen("position"),
    _signal("frozen with noise", "position", lambda _, f: f.began["position"] + POSITION_NOISE * f.normal.normal()),
    _signal("reversed", "position", _about(-1.0)),
    _signal("jumps by 20 mm", "position", lambda x, _: x + _JUMP),
    _signal("drifts by 50 mm/s", "position", lambda x, f: x + _DRIFT * f.k),
    _signal("x 2", "position", _about(2.0)),
    _signal("x 0.5", "position", _about(0.5)),
    _lost("position"),
    _signal("not a number", "position", lambda *_: nan),
    _signal("spikes of 50 mm", "position", lambda x, f: x + (_SPIKE if f.k % 20 == 0 else 0.0)),
    _signal("ten lost samples", "position", lambda x, f: f.began["position"] if f.k < 10 else x),
    _frozen("force"),
    _signal("reversed", "force", lambda force, _: -force),
    _lost("force"),
    _signal("jumps by 20 kN", "force", lambda force, _: force + 2e4),
    _frozen("pa"),
    Fault("pa and pb swapped", "pa", readings=_swapped),
    _lost("supply"),
    Fault("controller raises", demands=_raises),
    Fault("controller returns None", demands=lambda *_: None),
    Fault("controller returns an array", demands=lambda u, _: np.array([u, u])),
    Fault("controller returns a complex number", demands=lambda u, _: u + 0j),
    Fault("controller returns NaN", demands=lambda *_: nan),
    Fault("controller demands +1", demands=lambda *_: 1.0),
    Fault("controller demands -1", demands=lambda *_: -1.0),
    Fault("controller swings between +-1 at 10 Hz", demands=_oscillating),
    Fault("controller 20 ms late", demands=_late, computes=0.02),
    Fault("controller stale", demands=lambda _, f: f.demanded),
    Fault("controller's sign reversed", demands=lambda u, _: -u),
    Fault("valve stuck where it is", drives=lambda _, f: f.command),
    Fault("valve stuck at 0.3", drives=lambda *_: 0.3),
    Fault("drive's sign reversed", drives=lambda u, _: -u),
    Fault("supply pressure falls to half", factors={"Ps": 0.5}),
    Fault("specimen breaks", factors={"ks": 0.0}),
)


class _Faulty:
    """A controller whose demands pass through a loop's fault."""

    def __init__(self, inner: Controller, demanded: Callable[[float], Any]) -> None:
        self._inner, self._demanded = inner, demanded

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)

    def compute(self, reference: float, measurement: Mapping[str, float]) -> Any:
        """What the inner one demands, or the fault makes of it."""
        return self._demanded(self._inner.compute(reference, measurement))


class FaultyLoop(SampledLoop):
    """A loop in Python in which a fault begins at the first sample whose readings it is `due` at, k and readings given,
    and controllers compute for as long as the fault says.

    `began` and `tripped_at`: numbers of the samples at which the fault began and the guard tripped, or None.
    """

    def __init__(
        self,
        engine: Engine,
        rig: Rig,
        controller: Controller,
        start: Equilibrium,
        seed: int | None,
        fault: Fault | None,
        due: Callable[[int, Signals], bool],
    ) -> None:
        self._fault, self._due, self._k = fault, due, -2  # it measures once before its first sample
        self.began: int | None = None
        self.tripped_at: int | None = None
        self._since: Since | None = None
        self._last_demanded = self._last_sent = 0.0
        self._demands: list[float] = []
        self._clock = 0  # ns
        self._normal = draws(0 if seed is None else seed, 1)
        faulty = cast(Controller, _Faulty(controller, self._changed))
        super().__init__(engine, rig, faulty, start, seed, compiled=False)
        self._guarded.name = type(innermost(controller)).__name__

    def _measure(self) -> Signals:
        signals = super()._measure()
        self._k += 1
        if self.began is None and self._k >= 0 and self._due(self._k, signals):
            self._begin(signals)
        if self._since is None or self._fault is None:
            return signals
        self._since = replace(self._since, k=self._k - (self.began or 0))
        return signals if self._fault.readings is None else self._fault.readings(signals, self._since)

    def _begin(self, signals: Signals) -> None:
        self.began = self._k
        self._since = Since(0, signals, self._last_demanded, self._last_sent, self._normal, self._demands)
        if self._fault is not None and self._fault.factors:
            plant = self._engine.plant
            values = {key: factor * plant.p[plant.parameters.index(key)] for key, factor in self._fault.factors.items()}
            self._engine = Engine(replace(plant, p=plant.parameter_values(**values)))

    def _changed(self, demanded: float) -> Any:
        self._demands.append(demanded)
        if self._since is not None and self._fault is not None and self._fault.demands is not None:
            self._clock += round(self._fault.computes * 1e9)
            return self._fault.demands(demanded, self._since)
        self._last_demanded = demanded
        return demanded

    def _now(self) -> int:
        return self._clock

    def _send(self, command: float) -> tuple[tuple[float, float], ...]:
        if self._guard.tripped is not None and self.tripped_at is None:
            self.tripped_at = self._k
        if self._since is not None and self._fault is not None and self._fault.drives is not None:
            command = self._fault.drives(command, self._since)
        self._last_sent = command
        return super()._send(command)
