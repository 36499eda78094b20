"""Sines along one axis of a platform's pose, on the whole plant: what every axis answers, and the part of an axis's
envelope that a loop on six legs follows within 5 %."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...control.platform_controller import LEGS, PlatformController
from ...plant.platform import ACCELERATION
from ...rigs.platform import AXES
from ..performance.followed import WITHIN, Followed
from .loop import run_platform
from .setup import PlatformSetup

_SETTLING = 0.5  # s, and two cycles: before a sine is looked at
_LOOKED_AT = 4  # cycles
_SHARES = (0.9, 0.5, 0.2, 0.05)  # of an envelope, that are tried


@dataclass(frozen=True)
class PlatformSine:
    """A sine along `axis` at a frequency [Hz]: first harmonics of pose and acceleration [6], over those asked for,
    angles times the radius of the joints; the harmonics of the acceleration along the axis over the first. NaN where it
    tripped."""

    axis: int
    hz: float
    pose: np.ndarray
    acceleration: np.ndarray
    distortion: float

    def row(self) -> dict[str, Any]:
        """Of metrics.json: percent of the amplitude asked for, by axis."""
        axes = {
            key: {
                axis: None if np.isnan(part) else 100 * float(abs(part))
                for axis, part in zip(AXES, values, strict=True)
            }
            for key, values in (("pose_percent", self.pose), ("acceleration_percent", self.acceleration))
        }
        distortion = None if np.isnan(self.distortion) else 100 * self.distortion
        return {"axis": AXES[self.axis], "hz": self.hz, **axes, "distortion_percent": distortion}


def platform_sine(
    setup: PlatformSetup, controller: PlatformController, axis: int, hz: float, amplitude: float
) -> PlatformSine:
    """A sine of an amplitude [m] at the joints along one axis from home, without sensor noise."""
    period, weight = setup.platform.period, setup.platform.geometry.weights
    lead = np.ceil(max(2.0, _SETTLING * hz))
    t = np.arange(round((lead + _LOOKED_AT) / hz / period) + 1) * period
    pose = np.zeros((len(t), LEGS))
    size = amplitude / weight[axis]
    pose[:, axis] = size * np.sin(2 * np.pi * hz * t)
    run = run_platform(setup, controller, pose)
    if run.tripped is not None:
        nothing = np.full(LEGS, np.nan)
        return PlatformSine(axis, hz, nothing, nothing, float("nan"))
    late = run.t >= lead / hz - 1e-9
    accelerations = np.column_stack([run.signals[name] for name in ACCELERATION])[late]
    harmonics = np.array([_harmonic(run.t[late], accelerations[:, axis], n * hz) for n in range(1, 8)])
    first = np.array([_harmonic(run.t[late], run.pose[late, i], hz) for i in range(LEGS)])
    own = np.array([_harmonic(run.t[late], accelerations[:, i], hz) for i in range(LEGS)])
    asked = weight[axis] * size * -1j
    return PlatformSine(
        axis,
        hz,
        weight * first / asked,
        -weight * own / (asked * (2 * np.pi * hz) ** 2),
        float(np.linalg.norm(harmonics[1:]) / abs(harmonics[0])),
    )


def _harmonic(t: np.ndarray, y: np.ndarray, hz: float) -> complex:
    """Complex amplitude of a sine of this frequency, by least squares beside a mean."""
    turns = 2 * np.pi * hz * t
    columns = np.column_stack((np.cos(turns), np.sin(turns), np.ones_like(t)))
    a, b, _ = np.linalg.lstsq(columns, y, rcond=None)[0]
    return complex(a, -b)


def followed_along(
    setup: PlatformSetup, controller: PlatformController, axis: str, f: np.ndarray, most: np.ndarray
) -> Followed:
    """Of envelopes `most` [k] m or rad at f [k] Hz, without noise, up to the first frequency at which nothing is
    followed; nothing corrects amplitude and phase here."""
    amplitude, error = np.full((2, f.size), np.nan)
    exact = True  # whether the error was within so far
    for k, (each, top) in enumerate(zip(f.tolist(), most.tolist(), strict=True)):
        for share in _SHARES:
            response = _response(setup, controller, axis, each, share * top)
            if np.isnan(amplitude[k]) and abs(abs(response) - 1) <= WITHIN:
                amplitude[k] = share * top
            if exact and abs(response - 1) <= WITHIN:
                error[k] = share * top
            if np.isfinite(amplitude[k]) and (not exact or np.isfinite(error[k])):
                break
        exact = bool(np.isfinite(error[k]))
        if np.isnan(amplitude[k]):
            break
    return Followed(f, amplitude, error, np.full(f.size, np.nan))


def _response(setup: PlatformSetup, controller: PlatformController, axis: str, f: float, amplitude: float) -> complex:
    """Of the pose along the axis to a sine of an amplitude [m or rad]; NaN where it trips."""
    place = AXES.index(axis)
    sine = platform_sine(setup, controller, place, f, amplitude * float(setup.platform.geometry.weights[place]))
    return complex(sine.pose[place])
