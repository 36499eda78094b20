"""What a rig's sensors say: noise from a counter-based generator, and steps of their resolution."""

from collections.abc import Mapping

import numpy as np

from ..base.errors import InputError
from ..rigs.rig import Rig
from ..rigs.sampling import in_steps


def draws(seed: int, lane: int = 0) -> np.random.Generator:
    """The generator of a loop's sensor noise: the same draws for the same seed and lane, in Python and compiled."""
    return np.random.Generator(np.random.Philox(key=[seed, lane]))


def settling_band(rig: Rig, signal: str, size: float) -> float:
    """The band of a step, SI: 2 % of its size, but never below three standard deviations of the sensor's noise."""
    sensor = rig.sensors.get(signal)
    return max(0.02 * abs(size), 3 * sensor.noise if sensor else 0.0)


def check_sensors(rig: Rig, measures: tuple[str, ...]) -> None:
    """Raises InputError for a signal that a controller measures and the rig does not."""
    for name in measures:
        if name not in rig.sensors:
            raise InputError(f"rig {rig.name} has no {name} sensor, which the controller needs; declare one")


def logged(
    signals: Mapping[str, np.ndarray], rig: Rig, outputs: tuple[str, ...], seed: int | None, lane: int = 0
) -> dict[str, np.ndarray]:
    """The readings [k] by name that a loop with a seed acted on, of the plant's outputs [k] by name; with a `lane`
    those of other draws."""
    sensors = Sensors(rig, outputs, seed, lane)
    true = np.column_stack([signals[name] for name in outputs])
    noise = sensors.noise_rows(1 + len(true))[1:]  # the loop measures once before its first sample
    return dict(zip(sensors.names, sensors.readings(true, noise).T, strict=True))


def logged_lanes(
    values: np.ndarray, signal: str, rig: Rig, outputs: tuple[str, ...], seed: int | None, first: int = 0
) -> np.ndarray:
    """The readings [lanes, k] of one sensor that loops in lanes with a seed acted on, of its true values [lanes, k].

    Lanes are numbered from `first` for their noise.
    """
    if seed is None:
        return values
    names, sensor = [name for name in outputs if name in rig.sensors], rig.sensors[signal]
    shape = 1 + values.shape[1], len(names)  # a loop measures once before its first sample
    normal = [
        draws(seed, lane).standard_normal(shape)[1:, names.index(signal)] for lane in range(first, first + len(values))
    ]
    return Disturbance(sensor.noise, sensor.resolution).readings(values, np.array(normal))


class Disturbance:
    """Noise and resolution of sensors, SI: numbers, or arrays that go with the last axes of readings; a resolution of 0
    is none."""

    def __init__(self, noise: np.ndarray | float, resolution: np.ndarray | float) -> None:
        self._noise, self._coarse = noise, np.asarray(resolution) > 0
        self._step = np.where(self._coarse, resolution, 1.0)

    def readings(self, true: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """Readings [..] of true values [..], with standard normal numbers [..] as their noise."""
        return self.in_steps(true + self._noise * normal)

    def in_steps(self, noisy: np.ndarray) -> np.ndarray:
        """Noisy values [..] in steps of the resolution."""
        return in_steps(noisy, self._coarse, self._step, np.floor, np.where)


class Sensors:
    """What the rig's sensors say of the plant's outputs: with a seed, each with its white noise and resolution."""

    def __init__(self, rig: Rig, outputs: tuple[str, ...], seed: int | None, lane: int = 0) -> None:
        self.names = tuple(name for name in outputs if name in rig.sensors)
        self._columns = np.array([outputs.index(name) for name in self.names], int)
        self.noise = np.array([rig.sensors[name].noise for name in self.names])
        self.resolution = np.array([rig.sensors[name].resolution for name in self.names])
        self._disturbance = Disturbance(self.noise, self.resolution)
        self._random = None if seed is None else draws(seed, lane)

    @property
    def noisy(self) -> bool:
        """Whether noise and resolution are on."""
        return self._random is not None

    def read(self, outputs: np.ndarray) -> dict[str, float]:
        """Readings by name, of all outputs [k] of the plant."""
        normal = np.zeros(0) if self._random is None else self._random.standard_normal(len(self.names))
        return dict(zip(self.names, self.readings(outputs, normal).tolist(), strict=True))

    def readings(self, outputs: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """Readings [.., sensors] of all outputs [.., k] of plants, with standard normal numbers where noise is on."""
        readings = outputs.take(self._columns, -1)
        return readings if self._random is None else self._disturbance.readings(readings, normal)

    def noise_rows(self, instants: int) -> np.ndarray:
        """The standard normal numbers [instants, sensors] that the next so many readings draw; none without a seed."""
        if self._random is None:
            return np.zeros((instants, 0))
        return self._random.standard_normal((instants, len(self.names)))
