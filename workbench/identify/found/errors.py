"""Held-out errors before and after a change of the model, signal by signal, beside the noise."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...base.numbers import finite
from ...base.signals import SIGNALS
from ...base.units import from_si
from ..data.noise_floor import NoiseFloor
from ..fit.predict import Prediction

Rms = Mapping[str, Mapping[str, float | None]]


def rms_of(floor: NoiseFloor, before: Sequence[Prediction], after: Sequence[Prediction]) -> Rms:
    """{"pa [bar]": {"before", "after", "floor"}} over all records, in each signal's unit; None where there is none."""
    table = {}
    for name in dict.fromkeys(name for prediction in after for name in prediction.signals):
        signal = SIGNALS[name]
        values = (*(_root_mean_square(some, name) for some in (before, after)), floor.sigma[name])
        shown = [finite(from_si(v, signal.unit, signal.si)) for v in values]
        table[signal.label] = dict(zip(("before", "after", "floor"), shown, strict=True))
    return table


def _root_mean_square(some: Sequence[Prediction], name: str) -> float:
    errors = np.concatenate([prediction.error(name) for prediction in some if name in prediction.signals])
    return float(np.sqrt(np.nanmean(errors**2))) if np.isfinite(errors).any() else np.nan
