"""A platform's loop compiled: the sensors of its legs, what comes in at each instant, and plant, laws and guards in one
run of the engine, alone or in lanes.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...base.errors import InputError
from ...control.platform_controller import LEGS
from ...control.platform_law import PlatformLaw
from ...engine import Batch
from ...engine.guard_rules import COUPLED
from ...engine.guard_shape import BESIDE, packed
from ...engine.sampled_law import OUT, LawShape
from ...linear import Equilibrium
from ..compiled_loop import CompiledLaw, with_drives
from ..guard_numbers import guard_numbers, guard_shape, left_to_brake, trip_reason
from ..sampled_loop import SIMULATION_FAILED
from ..sensors import Disturbance, draws
from .setup import PlatformSetup

_NOT_GUARDED = "force"  # a platform's load cells say more than one moving mass explains


@dataclass(frozen=True)
class LegSensors:
    """The signals that all legs measure and a loop reads, `noise` and `resolution` of each [6, sensors], SI, and the
    `places` of the true values among the plant's outputs [6, sensors]. `noisy`: noise and resolution are on."""

    names: tuple[str, ...]
    noise: np.ndarray
    resolution: np.ndarray
    places: np.ndarray
    noisy: bool

    @classmethod
    def of(cls, setup: PlatformSetup, measures: Sequence[str], noisy: bool) -> "LegSensors":
        """Those of a platform, for laws that need `measures`. Raises InputError for one that a leg does not measure."""
        plant, rigs = setup.engine.plant, [leg.rig for leg in setup.platform.legs]
        outputs = [name.partition(".")[2] for name in plant.outputs if name.startswith("leg1.")]
        shared = [name for name in outputs if all(name in rig.sensors for rig in rigs)]
        for name in measures:
            if name not in shared:
                raise InputError(f"platform {setup.platform.name}: its legs have no {name} sensor, which a law needs")
        names = tuple(name for name in shared if name != _NOT_GUARDED or name in measures)
        noise, resolution = (
            np.array([[getattr(rig.sensors[name], key) for name in names] for rig in rigs])
            for key in ("noise", "resolution")
        )
        places = [[plant.output(f"leg{i + 1}.{name}") for name in names] for i in range(LEGS)]
        return cls(names, noise, resolution, np.array(places), noisy)

    def read(self, outputs: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """What they say [.., 6, sensors] of all outputs of the plant [.., n], with standard normal numbers
        [.., 6 sensors]."""
        values = outputs[..., self.places]
        if not self.noisy:
            return values
        return Disturbance(self.noise, self.resolution).readings(values, normal.reshape(values.shape))

    def named(self, outputs: np.ndarray, normal: np.ndarray) -> dict[str, np.ndarray]:
        """What they say of the outputs [n] of the plant, of all legs [6] by name."""
        return dict(zip(self.names, self.read(np.ravel(outputs), normal).T, strict=True))

    def picked(self, names: Sequence[str]) -> list[int]:
        """Their columns."""
        return [self.names.index(name) for name in names]

    def draws(self, instants: int, seed: int | None, lane: int = 0) -> np.ndarray:
        """Standard normal numbers [1 + k, 6 sensors]: a loop measures once before its first sample."""
        shape = instants + 1, LEGS * len(self.names)
        return np.zeros(shape) if seed is None else draws(seed, lane).standard_normal(shape)


@dataclass(frozen=True)
class Inputs:
    """What comes in at k instants: the pose asked for and references of the legs [k, 6], feed-forward of the laws
    [k, 6], the plant's inputs but for the commands [k, 6], and standard normal numbers [1 + k, 6 sensors]."""

    pose: np.ndarray
    reference: np.ndarray
    forward: np.ndarray
    others: np.ndarray
    normal: np.ndarray


@dataclass(frozen=True)
class PlatformSamples:
    """What a loop did at k instants: states x [k, n], commands held, sent and demanded [k, 6], and why it stopped."""

    x: np.ndarray
    held: np.ndarray
    sent: np.ndarray
    demanded: np.ndarray
    tripped: str | None


Lane = tuple[Equilibrium, Inputs, np.ndarray]  # where it begins, what comes in, and its parameters p [k]


@dataclass(frozen=True, eq=False)
class CompiledPlatform:
    """A platform with its sensors, six guards and a law, ready to run in lanes.

    A lane is its state of the plant x [n] and its `memory`: the commands on their way, the guards and the law.
    """

    setup: PlatformSetup
    sensors: LegSensors
    law: PlatformLaw

    @cached_property
    def whole(self) -> CompiledLaw:
        """The law with guards, drives and sensors of all legs."""
        setup, sensors = self.setup, self.sensors
        legs = list(zip(setup.guarded, setup.carried, strict=True))
        guard = guard_shape(legs[0][0], sensors.names, self.law.measures, legs[0][1])
        shape = LawShape(self.law.graphs, self.law.measures, sensors.names, guard, noisy=sensors.noisy, jacks=len(legs))
        limits = [guard_numbers(rig, guard, self.law.measures, sensors.noisy, carried) for rig, carried in legs]
        read, guards = sensors.picked(guard.read), np.concatenate([packed(guard.numbers, **own) for own in limits])
        numbers = guards, sensors.noise[:, read].ravel(), sensors.resolution[:, read].ravel(), coupling_numbers(setup)
        plant = setup.engine.plant
        return with_drives(plant, plant.p[None], setup.platform.period, shape, *numbers)

    @property
    def shape(self) -> LawShape:
        """What the machine code is of."""
        return self.whole.shape

    def memory(self, command: np.ndarray, law: np.ndarray) -> np.ndarray:
        """The memory of a lane whose drives have held commands [6] for long and whose law is in this state."""
        return self.whole.start(law[None], command[None])[0]

    def numbers(self, offset: np.ndarray) -> np.ndarray:
        """The numbers of law, guards and sensors, one leg after the other; `offset` [6] is what the law begins with."""
        return self.whole.parameters(self.law.numbers[None], offset[None])[0]

    def play(self, lanes: Sequence[Lane]) -> tuple[Batch, dict[str, np.ndarray]]:
        """Lanes along as many instants each. States as in Engine.run_batch, and what each instant put out, by the names
        of OUT, [lanes, k, 6]."""
        x, memory, rows, numbers = map(np.array, zip(*(self._begun(*lane) for lane in lanes), strict=True))
        p, durations = np.array([own for *_, own in lanes]), self.whole.durations
        batch, out = self.setup.engine.run_sampled(self.shape, x, durations, memory, rows, numbers, p=p)
        return batch, dict(zip(OUT, np.split(out, len(OUT), axis=2), strict=True))

    def trip(self, codes: np.ndarray) -> str | None:
        """Why the first of the legs that tripped by themselves did, in words, of the codes of all [6]."""
        legs = np.flatnonzero((codes > 0) & (codes != BESIDE))
        rig = self.setup.guarded[legs[0]] if len(legs) else None
        return None if rig is None else f"leg {legs[0] + 1}: {trip_reason(rig, int(codes[legs[0]]))}"

    def _begun(self, start: Equilibrium, inputs: Inputs, p: np.ndarray) -> tuple[np.ndarray, ...]:
        """State, memory, rows of instants [k, inputs] and numbers of a lane, before the first of its inputs."""
        engine, command = self.setup.engine, start.u[:LEGS]
        first = self.sensors.read(engine.observe(start.x, start.u, p), inputs.normal[0])
        measured = first[:, self.sensors.picked(self.law.measures)].ravel()
        x, offset = self.law.start(np.concatenate((inputs.reference[0], inputs.forward[0], measured)), command)
        noise = inputs.normal[1:] if self.sensors.noisy else inputs.normal[1:, :0]
        rows = np.hstack((inputs.reference, inputs.forward, inputs.others, noise))
        return start.x, self.memory(command, x), rows, self.numbers(offset)


def coupling_numbers(setup: PlatformSetup) -> np.ndarray:
    """What guards know of what the legs do to each other: the numbers [k] of guard_coupling, SI."""
    pairs = list(zip(setup.guarded, setup.carried, strict=True))
    left = np.array([left_to_brake(rig, carried) for rig, carried in pairs])
    return packed(
        COUPLED,
        inertia=setup.inertia.ravel(),
        mobility=np.linalg.inv(setup.inertia).ravel(),
        load=np.array([carried.load for carried in setup.carried]),
        drag=np.array([rig["b"] for rig in setup.guarded]),
        left=left,
        least=left / np.array([carried.most for carried in setup.carried]),
    )


def run_compiled(setup: PlatformSetup, sensors: LegSensors, law: PlatformLaw, inputs: Inputs) -> PlatformSamples:
    """The loop of a law along its inputs, from the setup's operating point."""
    loop = CompiledPlatform(setup, sensors, law)
    batch, out = loop.play([(setup.null, inputs, setup.engine.plant.p)])
    failed = int(batch.failed[0])
    k = len(inputs.reference) if failed < 0 else failed + 1
    reason = loop.trip(out["trip"][0, k - 1]) if failed < 0 else SIMULATION_FAILED
    return PlatformSamples(batch.x[0, :k], out["held"][0, :k], out["sent"][0, :k], out["demanded"][0, :k], reason)
