"""The motions that a plan compares on a platform: multisines, steps and triangles of one length along its axes."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...loop.platform.excitation import AxesMultisine, at_joints, sines
from ...records.frequency_sheet import table_text
from ...rigs.platform import AXES, Platform
from .family import SECONDS

_CORNER = 0.1  # s: over which a step goes or a triangle turns, so that no leg has to take a jump
_BEFORE = 0.25  # s: at home before and after waypoints


@dataclass(frozen=True)
class MotionDesign:
    """A motion of `axes` by name, of at most `wished` m at the joints: a sine or multisine in a `band` [Hz], or
    waypoints, as shares of its size, that lie evenly in its time and are stepped to or approached at even speed."""

    name: str
    kind: str
    axes: tuple[str, ...]
    wished: float
    band: tuple[float, float] | None = None
    waypoints: tuple[float, ...] = ()

    def shape(self, platform: Platform) -> np.ndarray:
        """Poses [k, 6] at the control period, of size 1 m at the joints, from home and back."""
        if self.band is not None:
            return sines(platform, AxesMultisine(self.name, SECONDS, self.band, 1), self.axes)
        pose = np.zeros((round(SECONDS / platform.period), len(AXES)))
        pose[:, [AXES.index(axis) for axis in self.axes]] = self._course(platform.period, len(pose))[:, None]
        return at_joints(platform, pose)

    def _course(self, period: float, count: int) -> np.ndarray:
        """The waypoints as a wave [count], its corners rounded."""
        still = np.zeros(round(_BEFORE / period))
        at = np.linspace(0, 1, count - 2 * len(still))
        points = np.array(self.waypoints)
        if self.kind == "steps":
            moving = points[np.minimum((at * len(points)).astype(int), len(points) - 1)]
        else:
            moving = np.interp(at, np.linspace(0, 1, len(points)), points)
        kernel = np.hanning(round(_CORNER / period) + 2)
        return np.convolve(np.concatenate((still, moving, still)), kernel / kernel.sum(), mode="same")


_ROUND_TRIP = (0.0, 1.0, 0.0, -1.0, 0.0)
_TO_AND_FRO = (0.0, *(1.0, -1.0) * 6, 0.0)
_STAIRS = (0.5, 1.0, 0.5, -0.5, -1.0, -0.5)

MOTIONS: tuple[MotionDesign, ...] = (
    MotionDesign("sines-slow", "multisine", AXES, 0.2, (0.25, 2.0)),
    MotionDesign("sines-wide", "multisine", AXES, 0.1, (0.25, 10.0)),
    MotionDesign("sines-fast", "multisine", AXES, 0.05, (5.0, 60.0)),
    MotionDesign("sines-small", "multisine", AXES, 1e-3, (0.5, 30.0)),
    MotionDesign("heave-sine-1hz", "sine", ("heave",), 0.1, (1.0, 1.0)),
    MotionDesign("heave-sine-5hz", "sine", ("heave",), 0.05, (5.0, 5.0)),
    MotionDesign("heave-steps", "steps", ("heave",), 0.05, None, _STAIRS),
    MotionDesign("heave-steps-small", "steps", ("heave",), 1e-3, None, _STAIRS),
    MotionDesign("surge-steps", "steps", ("surge",), 0.05, None, _STAIRS),
    MotionDesign("pitch-steps", "steps", ("pitch",), 0.05, None, _STAIRS),
    MotionDesign("heave-triangle", "triangle", ("heave",), 0.3, None, _ROUND_TRIP),
    MotionDesign("heave-triangle-fast", "triangle", ("heave",), 0.1, None, _TO_AND_FRO),
    MotionDesign("heave-creep", "triangle", ("heave",), 2e-3, None, _ROUND_TRIP),
    MotionDesign("surge-triangle", "triangle", ("surge",), 0.3, None, _ROUND_TRIP),
    MotionDesign("pitch-triangle", "triangle", ("pitch",), 0.3, None, _ROUND_TRIP),
)
"""As large as they are wished."""


@dataclass(frozen=True, eq=False)
class PlannedMotion:
    """A motion as the platform takes it: its size [m] at the joints, and its poses [k, 6] at a period [s]."""

    design: MotionDesign
    size: float
    course: np.ndarray
    period: float

    @classmethod
    def sized(cls, design: MotionDesign, platform: Platform, size: float) -> "PlannedMotion":
        """A motion of a size [m] at the joints."""
        return cls(design, size, size * design.shape(platform), platform.period)

    @property
    def t(self) -> np.ndarray:
        """Times [k], s."""
        return np.arange(len(self.course)) * self.period

    def columns(self) -> dict[str, np.ndarray]:
        """What a file of it has, SI by column: t and the axes that move."""
        return {"t": self.t} | {axis: self.course[:, AXES.index(axis)] for axis in self.design.axes}

    @property
    def row(self) -> dict[str, Any]:
        """What a platform plays, as metrics.json has it; `peak` in mm at the joints along each of its axes."""
        design, peak = self.design, 1e3 * self.size
        band = None if design.band is None else list(design.band)
        return {"kind": design.kind, "axes": list(design.axes), "peak": peak, "seconds": SECONDS, "band": band}

    @property
    def text(self) -> str:
        """The file that a platform plays."""
        return table_text(self.columns())
