"""What a rig's model predicts of a record: in windows with refitted initial states, or in one free run."""

import math
from dataclasses import dataclass

import numpy as np

from ...plant import Plant
from ...records import Record
from ..data.noise_floor import NoiseFloor
from .initial_states import fit_states, free_runs, predicted_states
from .model import Model
from .windows import Windows, compared, cut_windows


@dataclass(frozen=True)
class Prediction:
    """Predicted signals of a record, name -> [n] SI, over the same rows; `failed` are start times of failed windows."""

    record: Record
    signals: dict[str, np.ndarray]
    failed: tuple[float, ...]

    def error(self, name: str) -> np.ndarray:
        """Measured less predicted, NaN where it is not to be compared, [n] SI."""
        error = self.record.signals[name] - self.signals[name]
        return np.where(self.record.valid[name], error, np.nan)


def predict_windows(plant: Plant, record: Record, floor: NoiseFloor) -> Prediction:
    """Predict every signal of a record in windows of 0.5 s with refitted initial states."""
    windows = cut_windows(plant, [record], floor)
    model = Model(plant, windows.names)
    x0, _ = predicted_states(model, windows, plant.p)
    return predictions(model, windows, x0, plant.p)[0]


def predict_whole(plant: Plant, record: Record, floor: NoiseFloor) -> Prediction:
    """Predict every signal of a record in one run from the state that fits its first rows; anew after a gap."""
    windows = cut_windows(plant, [record], floor, late=0.0, length=math.inf)
    model = Model(plant, windows.names)
    x0, _ = free_runs(model, windows, plant.p)
    return predictions(model, windows, x0, plant.p)[0]


def predictions(model: Model, windows: Windows, x0: np.ndarray, p: np.ndarray) -> list[Prediction]:
    """The predictions of every record of some windows from their initial states [w, n]."""
    parts = model.predict(windows, x0, p)
    predictions = []
    for index, (record, table) in enumerate(zip(windows.records, windows.by_record(parts), strict=True)):
        names = [(column, name) for column, name in enumerate(windows.names) if name in record.signals]
        starts = [record.t[first] for i, first, end in windows.spans if i == index and np.isnan(table[end - 1]).any()]
        predictions.append(Prediction(record, {n: table[:, c] for c, n in names}, tuple(float(t) for t in starts)))
    return predictions


def predict_free(plant: Plant, record: Record, floor: NoiseFloor) -> Prediction:
    """One run through the whole record from the initial state that fits its first window."""
    names = compared(plant, record, floor)
    model = Model(plant, names)
    first = cut_windows(plant, [record], floor, late=0.0).some([0])
    x0, _ = fit_states(model, first, model.starts(first, plant.p), plant.p)
    values = model.run_through(record, x0[0], plant.p)
    lost = np.flatnonzero(np.isnan(values).any(axis=1))
    failed = (float(record.t[max(lost[0] - 1, 0)]),) if lost.size else ()
    return Prediction(record, {name: values[:, column] for column, name in enumerate(names)}, failed)
