"""Whether the loop that a fit found comes to rest, as the one that was recorded did."""

import numpy as np

from ...base.errors import InputError
from ...linear import equilibrium, linearise
from .model import Model

_SLOW = 1e-3  # 1/s: a pole that grows slower is rounding


def growing_pole(model: Model, p: np.ndarray) -> complex | None:
    """The pole [1/s] that grows fastest of the plant at rest, of parameters p [k]; None where none grows, or where the
    plant stands nowhere.

    The plant has the loop of its maker closed inside; that loop's delay is on its reference, and moves no pole.
    """
    plant, own = model.plant, p[: len(model.plant.parameters)]
    try:
        poles = linearise(plant, equilibrium(plant, p=own), p=own).poles()
    except InputError:
        return None
    fastest = max(map(complex, poles), key=lambda pole: pole.real)
    return fastest if fastest.real > _SLOW else None
