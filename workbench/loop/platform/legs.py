"""The sensors of a platform's legs, and what comes in at each instant of a loop."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...control.platform_controller import LEGS
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
class Instants:
    """What a loop did at k instants: states x [k, n], commands held, sent and demanded [k, 6], and why it stopped."""

    x: np.ndarray
    held: np.ndarray
    sent: np.ndarray
    demanded: np.ndarray
    tripped: str | None
