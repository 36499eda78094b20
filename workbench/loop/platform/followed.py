"""The part of an axis's envelope that a loop on six legs follows within 5 %, played on the engine."""

import numpy as np

from ...control.platform_controller import PlatformController
from ...rigs.platform import AXES
from ..performance.followed import WITHIN, Followed
from .setup import PlatformSetup
from .sines import platform_sine

_SHARES = (0.9, 0.5, 0.2, 0.05)  # of the envelope, that are tried


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
