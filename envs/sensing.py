"""The rig's sensors over N lanes, as workbench.loop.Sensors has them; their noise is drawn beforehand."""

import numpy as np

from workbench.rigs.rig import Rig


class LaneSensors:
    """What the rig's sensors say of a plant's outputs; ideal ones have neither noise nor resolution.

    `names` are those that the rig has, `noise` the standard deviations of the noisy ones (none if ideal), SI.
    """

    def __init__(self, rig: Rig, outputs: tuple[str, ...], ideal: bool) -> None:
        self.names = tuple(name for name in outputs if name in rig.sensors)
        self._columns = np.array([outputs.index(name) for name in self.names])
        self._ideal = ideal
        self.noise = np.array([rig.sensors[name].noise for name in self.names[: 0 if ideal else None]], np.float32)
        quantum = np.array([rig.sensors[name].resolution for name in self.names])
        self._coarse = quantum > 0
        self._quantum = np.where(self._coarse, quantum, 1.0)

    def read(self, outputs: np.ndarray, noise: np.ndarray, now: np.ndarray | int) -> np.ndarray:
        """Readings [N, names] of the outputs [N, outputs] with the rows `now` [N] of the noise [k, names], SI.

        One lane may come without its axis, and with its row as a number.
        """
        readings = outputs.take(self._columns, -1)
        if self._ideal:
            return readings
        readings += noise[now]
        return np.where(self._coarse, np.rint(readings / self._quantum) * self._quantum, readings)
