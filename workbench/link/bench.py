"""What is served: a plant at rest with its sensors, the range of its commands, and the limits at which it trips."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import InputError
from ..engine import Engine
from ..linear import Equilibrium, equilibrium
from ..linear.platform_modes import platform_equilibrium
from ..loop.platform.setup import platform_setup
from ..loop.rig_variations import with_delay
from ..plant import Plant, build
from ..rigs.limited import SignalLimit, limits_of
from ..rigs.platform import AXES, LEGS, Platform
from ..rigs.rig import Rig
from ..rigs.shut_off import ShutOff
from .hello import CommandRange

SIMULATION_FAILED = "the simulation failed"
_LEAVES = {"position": "stroke", "velocity": "speed limit", "force": "force limit"}
AtRest = tuple[Engine, Equilibrium, Callable[[np.ndarray], Equilibrium]]  # and the point where a state [n] stands


@dataclass(frozen=True)
class Bench:
    """A rig or a platform ready to be served. Sensors by output: `channels`, their `noise` and `resolution`, SI;
    `rates`: of the commands, in a period; `rest`: the operating point where a state [n] stands."""

    name: str
    engine: Engine
    period: float
    start: Equilibrium
    rest: Callable[[np.ndarray], Equilibrium]
    commands: tuple[CommandRange, ...]
    rates: np.ndarray
    channels: tuple[str, ...]
    noise: np.ndarray
    resolution: np.ndarray
    limits: tuple[SignalLimit, ...]
    shut_off: ShutOff | None = None

    @property
    def plant(self) -> Plant:
        """The plant."""
        return self.engine.plant

    def reason(self, trip: int) -> str:
        """Why it tripped: the number of a limit from 1, or -1."""
        if trip <= 0:
            return SIMULATION_FAILED
        leg, _, name = self.limits[trip - 1].signal.rpartition(".")
        return f"{leg + ': ' if leg else ''}beyond its {_LEAVES.get(name, f'limit of {name}')}"


def bench(rig: Rig | Platform, computes: bool, ideal: bool = False) -> Bench:
    """A rig or a platform at rest. Where it `computes`, a command acts after the rig's computing delay; `ideal` is
    without that, and without noise and resolution. Raises InputError."""
    whole = isinstance(rig, Platform)
    legs = [(f"leg{i}.", leg.rig) for i, leg in enumerate(rig.legs, 1)] if whole else [("", rig)]
    first = legs[0][1]
    delay = first.computing_delay.value if computes and not ideal else 0.0
    engine, start, rest = _platform_at_rest(rig, delay) if whole else _at_rest(rig, delay)
    sensors = {f"{at}{name}": sensor for at, own in legs for name, sensor in own.sensors.items()}
    outputs = engine.plant.outputs
    names = tuple(name for name in outputs if name in sensors)
    return Bench(
        name=rig.name,
        engine=engine,
        period=first.period.value,
        start=start,
        rest=rest,
        commands=tuple(_range(own, f"{at}command") for at, own in legs),
        rates=np.array([own.limit("command_rate") * own.period.value for _, own in legs]),
        channels=names,
        noise=np.array([0.0 if ideal else sensors[name].noise for name in names]),
        resolution=np.array([0.0 if ideal else sensors[name].resolution for name in names]),
        limits=tuple(limit for at, own in legs for limit in _limits(own, outputs, at)),
        shut_off=None if whole else first.shut_off,
    )


def _at_rest(rig: Rig, delay: float) -> AtRest:
    engine = Engine(build(with_delay(rig, delay)), brief=True)
    plant = engine.plant
    if "command" not in [variable.name for variable in plant.inputs]:
        raise InputError(f"rig {rig.name}: has no command to serve; name a rig with a valve or a pump")
    return engine, equilibrium(plant), lambda x: equilibrium(plant, position=float(x[plant.state("x")]))


def _platform_at_rest(platform: Platform, delay: float) -> AtRest:
    setup = platform_setup(platform, delay)
    plant = setup.engine.plant
    first = plant.state(AXES[0])
    return setup.engine, setup.null, lambda x: platform_equilibrium(plant, x[first : first + LEGS])


def _range(rig: Rig, name: str) -> CommandRange:
    largest = rig.limit("command") if "command" in rig.limits else 1.0
    return CommandRange(name, "1", -largest, largest)


def _limits(rig: Rig, outputs: tuple[str, ...], leg: str = "") -> tuple[SignalLimit, ...]:
    own = (replace(limit, signal=f"{leg}{limit.signal}") for limit in limits_of(rig))
    return tuple(limit for limit in own if limit.signal in outputs)
