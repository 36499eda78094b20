"""Prediction in short windows: the recorded command drives the model, whose initial state is refitted in each window.

A jack integrates, so a run through a whole record drifts away from any rig; errors are therefore those of windows of
0.5 s (the last one takes the remainder), each from the initial state that fits it best.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..engine import Engine
from ..errors import InputError
from ..plant import Plant
from ..records import Record
from ..signals import MEASURED
from ..views import equilibrium
from .noise import Floor

WINDOW = 0.5  # s
_ROUNDS = 6
_ENOUGH = 0.01  # relative fall of the cost below which a window is done
_NUDGE = 1e-3  # of a state's scale, for sensitivities to the initial state


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


def compared(plant: Plant, record: Record, floor: Floor) -> list[str]:
    """The signals that plant, record and noise floor share. Raises InputError when there are none."""
    names = [n for n in MEASURED if n in plant.outputs and n in record.signals and n in floor.sigma]
    if not names:
        raise InputError(f"record {record.name}: no signal that rig {plant.name} predicts; check names and rig")
    return names


def predict_windows(engine: Engine, record: Record, floor: Floor) -> Prediction:
    """Predict every signal of a record in windows of 0.5 s with refitted initial states."""
    names = compared(engine.plant, record, floor)
    guess = resting_state(engine.plant, record)
    parts = [_Window(engine, piece, names, floor) for piece in _cut(record)]
    predicted, failed = [], []
    for part in parts:
        start = part.fit(part.first_guess(guess))
        states, values = part.simulate(start)
        if values is None:
            failed.append(float(part.t[0]))
            values = np.full((len(part.t), len(engine.plant.outputs)), np.nan)
        else:
            guess = states[-1]
        predicted.append(values)
    table = np.concatenate(predicted)
    return Prediction(record, {n: table[:, engine.plant.output(n)] for n in names}, tuple(failed))


def predict_free(engine: Engine, record: Record, floor: Floor) -> Prediction:
    """One run through the whole record from the initial state that fits its first window."""
    names = compared(engine.plant, record, floor)
    first = _Window(engine, _cut(record)[0], names, floor)
    start = first.fit(first.first_guess(resting_state(engine.plant, record)))
    run = engine.run(start, record.t, _inputs(engine.plant, record))
    values = engine.outputs(run.x, _inputs(engine.plant, record))
    failed = () if run.failed_at is None else (run.failed_at,)
    return Prediction(record, {n: values[:, engine.plant.output(n)] for n in names}, failed)


def resting_state(plant: Plant, record: Record) -> np.ndarray:
    """A plausible state [n] to begin with: at rest where the record begins."""
    x = equilibrium(plant).x
    if "position" in record.signals:
        x[plant.state("x")] = record.signals["position"][0] - plant.p[plant.parameters.index("xmid")]
    return x


def _cut(record: Record) -> list[Record]:
    """Windows of 0.5 s; what is left over at the end belongs to the last one."""
    first, last = record.t[0], record.t[-1]
    count = max(1, int((last - first + record.period) / WINDOW + 1e-6))
    edges = [None, *(first + WINDOW * np.arange(1, count)), None]
    return [record.slice(a, b) for a, b in pairwise(edges)]


def _inputs(plant: Plant, record: Record) -> np.ndarray:
    u = np.zeros((len(record.t), len(plant.inputs)))
    u[:, plant.input("command")] = record.signals["command"]
    return u


class _Window:
    """One window: its measurements over sigma, and the fit of its initial state by damped Gauss-Newton."""

    def __init__(self, engine: Engine, record: Record, names: list[str], floor: Floor) -> None:
        plant = self.plant = engine.plant
        self._engine, self._record, self.t = engine, record, record.t
        self._u = _inputs(plant, record)
        self._columns = [plant.output(name) for name in names]
        self._sigma = np.array([floor.sigma[name] for name in names])
        self._seen = np.column_stack([record.signals[name] for name in names])
        self._valid = np.column_stack([record.valid[name] for name in names])

    def first_guess(self, before: np.ndarray) -> np.ndarray:
        """The last window's end, corrected by what is measured directly here."""
        x = before.copy()
        early = self._record.slice(None, self.t[0] + 5.5 * self._record.period).signals
        middle = self.plant.p[self.plant.parameters.index("xmid")]
        direct = {"pa": ("P1", 0.0), "pb": ("P2", 0.0), "spool": ("z3", 0.0), "position": ("x", middle)}
        for signal, (state, offset) in direct.items():
            if signal in early:
                x[self.plant.state(state)] = np.mean(early[signal]) - offset
        return x

    def simulate(self, start: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """States at and one period after every row [k, n], and outputs [k, m]; outputs are None when it failed."""
        run = self._engine.run(start, np.append(self.t, self.t[-1] + self._record.period), self._u)
        return run.x, self._engine.outputs(run.x[:-1], self._u) if run.ok else None

    def fit(self, guess: np.ndarray) -> np.ndarray:
        """The initial state with the least squared error over sigma, held loosely (one scale) at the guess."""
        scale = self.plant.scale
        errors = self._errors(guess)
        if errors is None:
            return guess
        best, cost, damping, slopes = guess, float(errors @ errors), 1e-3, None
        for _ in range(_ROUNDS):
            fresh = slopes is None
            slopes = self._slopes(best, errors, scale) if slopes is None else slopes
            matrix = slopes.T @ slopes + np.eye(len(scale))
            gradient = slopes.T @ errors + (best - guess) / scale
            trial = best - np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), gradient) * scale
            found = self._errors(trial)
            total = np.inf if found is None else float(found @ found)
            if found is None or total >= cost:
                # old slopes are the first suspect, then the length of the step
                slopes, damping = (slopes, damping * 30) if fresh else (None, damping)
                continue
            fall, best, errors, cost, damping = 1 - total / cost, trial, found, total, damping / 10
            if fall < _ENOUGH:
                break
        return best

    def _errors(self, start: np.ndarray) -> np.ndarray | None:
        _, values = self.simulate(start)
        if values is None:
            return None
        return np.where(self._valid, (values[:, self._columns] - self._seen) / self._sigma, 0.0).ravel()

    def _slopes(self, start: np.ndarray, errors: np.ndarray, scale: np.ndarray) -> np.ndarray:
        """Sensitivity of the errors to the scaled initial state, by differences."""
        columns = np.zeros((len(errors), len(start)))
        for i in range(len(start)):
            moved = start.copy()
            moved[i] += _NUDGE * scale[i]
            shifted = self._errors(moved)
            if shifted is not None:
                columns[:, i] = (shifted - errors) / _NUDGE
        return columns
