"""Six control laws on the six jacks of a platform: one a leg, or one a mode through a matrix that decouples.

With directions U [6, 6], orthogonal, law j sees U_j . r as its reference and U_j . y of every signal y of the legs, and
the jacks get U v of the commands v of all laws, through a static map each where there is one. Where the legs are alike,
the columns of U that make J M^-1 J^T diagonal (J: twist to leg speeds, M: mass matrix) make each law that of one jack
with one mass: a mode (modal control). The unit matrix puts law j on leg j.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from ..base.errors import InputError
from .controller_spec import ControllerSpec
from .piecewise_linear import CommandMap
from .protocol import Controller, design_numbers, number

LEGS = 6


@design_numbers
class Forward:
    """Feed-forward of a law's reference: the inverse of a mass on its oil, u = (s + 2 d s^2/w + s^3/w^2)/Kv r.

    A reference that is a step goes through it as a blow: smooth it.
    """

    velocity_gain: float = number("m/s", 1e-3, 1e3, "speed of a jack at full command Kv")
    frequency: float = number("Hz", 0.1, 1e4, "natural frequency of the law's mode w", 1e4)
    damping: float = number("1", 0.0, 10.0, "damping ratio that the loop gives it d", 0.0)

    @property
    def gains(self) -> np.ndarray:
        """Commands [3] per velocity [s/m], acceleration [s^2/m] and jerk [s^3/m]."""
        w = 2 * np.pi * self.frequency
        return np.array([1.0, 2 * self.damping / w, 1 / w**2]) / self.velocity_gain


@design_numbers
class Smoothing:
    """Four lags that every axis of the pose asked for goes through, (1 + s/w)^-4."""

    corner: float = number("Hz", 0.1, 1e3, "corner of each lag w")

    def of(self, pose: np.ndarray, period: float) -> np.ndarray:
        """Poses [k, 6], at rest before the first, after the lags."""
        keep = np.exp(-2 * np.pi * self.corner * period)
        for _ in range(4):
            pose = _lagged(pose, keep)
        return pose

    def response(self, f: np.ndarray, period: float) -> np.ndarray:
        """Its frequency response [k]."""
        keep = np.exp(-2 * np.pi * self.corner * period)
        return ((1 - keep) / (1 - keep * np.exp(-2j * np.pi * f * period))) ** 4


def _lagged(values: np.ndarray, keep: float) -> np.ndarray:
    from scipy.signal import lfilter, lfilter_zi

    filtering = [1 - keep], [1.0, -keep]
    start = lfilter_zi(*filtering)[:, None] * values[:1]
    return np.asarray(lfilter(*filtering, values, axis=0, zi=start)[0])


@dataclass(frozen=True)
class PlatformSpec:
    """A named platform controller: a spec a law, whether they are on modes or on legs, the map of each jack's command,
    the feed-forward of each law, and the smoothing of the pose asked for."""

    name: str
    laws: tuple[ControllerSpec, ...]
    modal: bool = False
    command_map: ControllerSpec | None = None
    forward: tuple[Forward, ...] = ()
    smoothing: Smoothing | None = None

    def build(self, period: float, directions: np.ndarray) -> "PlatformController":
        """The controller for a control period [s]; `directions` [6, 6] are those of the modes, where it is on them."""
        laws = [law.build(period) for law in self.laws]
        command_map = cast(Any, self.command_map.build(period)).command_map if self.command_map else None
        directions = directions if self.modal else np.eye(LEGS)
        return PlatformController(laws, directions, command_map, self.forward, self.smoothing)


class PlatformController:
    """The laws with their directions. Signals [6] are leg by leg, SI; commands are -1..1."""

    def __init__(
        self,
        laws: Sequence[Controller],
        directions: np.ndarray,
        command_map: CommandMap | None = None,
        forward: Sequence[Forward] = (),
        smoothing: Smoothing | None = None,
    ) -> None:
        self.laws, self.directions, self.command_map = tuple(laws), directions, command_map
        self.forward, self.smoothing = tuple(forward), smoothing
        self._forward = np.zeros(LEGS)
        self.measures = tuple(dict.fromkeys(name for law in laws for name in law.measures))
        if len({law.measures[0] for law in laws}) > 1:
            raise InputError("the laws of a platform must control one signal, the position of the legs")

    def reset(self, reference: np.ndarray, measured: Mapping[str, np.ndarray], command: np.ndarray) -> None:
        """Start without a bump: the next `compute` with these signals, without feed-forward, returns `command` [6]."""
        own = self._of_laws(self._unmapped(command))
        for law, at, v in zip(self.laws, self._seen(reference, measured), own, strict=True):
            law.reset(*at, float(v))

    def compute(self, reference: np.ndarray, measured: Mapping[str, np.ndarray], forward: np.ndarray) -> np.ndarray:
        """The demanded commands [6], with feed-forward [6] added to those of the laws."""
        self._forward = forward
        v = [law.compute(*at) for law, at in zip(self.laws, self._seen(reference, measured), strict=True)]
        u = self.directions @ (v + forward)
        return u if self.command_map is None else u + self.command_map.shift.over(u)

    def update(self, realised: np.ndarray) -> None:
        """Advance by one period, knowing the commands [6] that the drives really got."""
        for law, v in zip(self.laws, self._of_laws(self._unmapped(realised)) - self._forward, strict=True):
            law.update(float(v))

    def smoothed(self, pose: np.ndarray, period: float) -> np.ndarray:
        """The poses [k, 6] that the legs follow."""
        return pose if self.smoothing is None else self.smoothing.of(pose, period)

    def forward_commands(self, reference: np.ndarray, period: float) -> np.ndarray:
        """Feed-forward [k, 6] of the laws for references [k, 6] of the legs, of central differences; 0 where there is
        none."""
        derivatives, commands = reference @ self.directions, np.zeros_like(reference)
        for gains in np.transpose([forward.gains for forward in self.forward]):
            derivatives = np.gradient(derivatives, period, axis=0)
            commands += derivatives * gains
        return commands

    def _seen(self, reference: np.ndarray, measured: Mapping[str, np.ndarray]) -> list[tuple[float, dict[str, float]]]:
        """Reference and signals of each law."""
        own = {name: self._of_laws(measured[name]) for name in self.measures}
        references = self._of_laws(reference)
        return [
            (float(references[j]), {name: float(own[name][j]) for name in law.measures})
            for j, law in enumerate(self.laws)
        ]

    def _of_laws(self, legs: np.ndarray) -> np.ndarray:
        return self.directions.T @ legs

    def _unmapped(self, command: np.ndarray) -> np.ndarray:
        return command if self.command_map is None else command + self.command_map.back.over(command)
