"""What frees a valve that stays open without a command: a dither, beyond the command that got the jack moving."""

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...control.controller_type import controller
from ...control.shells import SineShell

_FASTEST = 250.0  # Hz: a load is far slower, and a torque motor as fast
_SAMPLES = 4  # of a period, at least
_OVER = 1.2  # times the command that got the jack moving


def sine(size: float, period: float) -> SineShell:
    """The dither beyond a command `size` [1] that got the jack moving, a whole number of samples a period."""
    samples = max(_SAMPLES, round(1 / (_FASTEST * period)))
    return SineShell(float(f"{_OVER * size:.2g}"), 1 / (samples * period), period)


def with_dither(spec: ControllerSpec, dither: SineShell | None) -> ControllerSpec:
    """A controller with it."""
    if dither is None:
        return spec
    numbers = {"amplitude": dither.amplitude, "frequency": dither.frequency}
    return (spec + controller("controllers.dither:Dither", **numbers)).named(spec.name)


def without_dither(values: np.ndarray, dither: SineShell) -> np.ndarray:
    """A signal [k] less a dither on it: its mean over a period."""
    samples = round(1 / (dither.frequency * dither.period))
    means = np.convolve(values, np.ones(samples) / samples, "valid")
    return np.pad(means, (samples // 2, samples - 1 - samples // 2), "edge")
