"""A reference governor: moves the reference of a law no further than the stroke of its jack demands."""

from dataclasses import dataclass

import numpy as np

from .kalman_observer import Observer

_EVERY = 5  # samples between those at which the prediction is looked at
_ANSWER = 0.1  # of a shift, that position and lead times speed must show for a predicted sample to count
_TANGENTS = 8  # of the braking parabola


@dataclass(frozen=True)
class Braking:
    """What a jack stops within: its stroke, either way [m], its top speed [m/s] and the deceleration [m/s^2] that is
    counted on, on the worst rig."""

    stroke: float
    speed: float
    deceleration: float


class ReferenceGovernor:
    """The least shift of the reference for which the predicted motion stays where the jack can still stop.

    A jack that brakes with a stops within its stroke where x + v^2/(2 a) <= stroke. That set is convex: its tangents
    x + t v <= stroke + a t^2/2 keep it, and each at each predicted sample leaves an interval of shifts, so that the
    least shift in all of them needs no solver. It is a command governor of one number (Garone, Di Cairano, Kolmanovsky,
    Reference and command governors for systems with constraints, Automatica 75, 2017), without a memory, so that a
    prediction that was wrong is made good a sample later.
    """

    def __init__(self, observer: Observer, feedback: np.ndarray, feedforward: np.ndarray, braking: Braking) -> None:
        """Of the law u = feedforward r - feedback x^ over a horizon: feedback [n + 2], feedforward [samples, k]."""
        self.stroke = braking.stroke
        order, references = len(feedback), feedforward.shape[1]
        closed = observer.ahead - np.outer(observer.entering, feedback)
        position, speed = observer.signals["position"], observer.signals["speed"]
        leads = np.linspace(0.0, braking.speed / braking.deceleration, _TANGENTS)
        state, rows = np.hstack((np.eye(order), np.zeros((order, references)))), []
        for i, share in enumerate(feedforward, start=1):
            state = closed @ state
            state[:, order:] += np.outer(observer.entering, share)
            if i % _EVERY == 0:
                rows += [(position + lead * speed) @ state for lead in leads]
        rows = np.array(rows).reshape(-1, order + references)
        room = np.resize(braking.stroke + braking.deceleration * leads**2 / 2, len(rows))
        answers = rows[:, order:].sum(axis=1)
        kept = answers > _ANSWER
        self._rows, self._room, self._answers = rows[kept], room[kept], answers[kept]

    @property
    def tables(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Predictions [m, n + k] of the state and the references, their room [m] either way, and what a shift of all
        references adds to each [m]."""
        return self._rows, self._room, self._answers
