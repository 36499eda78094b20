"""Limits of a linear predictive law: its quadratic programme, condensed over a horizon, and a governor that moves the
reference no further than the stroke of the jack demands.
"""

from dataclasses import dataclass

import numpy as np

from .kalman_observer import Observer

PRICE = 100.0  # of the square of what is beyond a limit of the jack, over that limit; that of a command's change is 1
_EVERY = 5  # samples between those at which limits are kept; rows closer than that slow the solver down
_LOOKED_AT = 5  # samples between those at which the prediction is looked at
_ANSWER = 0.1  # of a shift, that position and lead times speed must show for a predicted sample to count
_TANGENTS = 8  # of the braking parabola


@dataclass(frozen=True)
class MpcConstraints:
    """On the command [1] and its change in a period [1]; on position [m], speed [m/s] and |pa - pb| [Pa]."""

    command: float
    change: float
    position: float
    speed: float
    pressure: float


@dataclass(frozen=True)
class Horizon:
    """The limited signals of a plan, each over its limit: gains c + free q, m of them, `soft` where the jack's.

    c [k] are changes of the command, sample i of the horizon has that of blocks[i]. q is the observed state [n + 2],
    what is wanted in each sample [samples], and the command before.
    """

    blocks: np.ndarray
    gains: np.ndarray
    free: np.ndarray
    soft: np.ndarray


def build_horizon(
    observer: Observer, feedback: np.ndarray, limits: MpcConstraints, samples: int, moves: int
) -> Horizon:
    """The horizon of the law u = feedforward - feedback x + c, feedback [n + 2], on an observed jack.

    The changes c last the longer the later they are. The command is limited where a change begins, and like the jack at
    every fifth sample; its rate where a change begins.
    """
    edges = np.unique(np.round(np.geomspace(1, samples + 1, moves + 1)).astype(int)) - 1
    blocks = np.repeat(np.arange(len(edges) - 1), np.diff(edges))
    k, order = len(edges) - 1, len(feedback)
    changes, asked = np.eye(k), np.eye(samples)
    state = np.hstack((np.zeros((order, k)), np.eye(order), np.zeros((order, samples + 1))))
    before = np.eye(1, state.shape[1], state.shape[1] - 1)[0]
    hard, soft = [], []
    for i in range(samples):
        command = np.concatenate((changes[blocks[i]], np.zeros(order), asked[i], [0.0])) - feedback @ state
        begins = i in edges
        if begins or i % _EVERY == 0:
            hard.append(command / limits.command)
        if begins:
            hard.append((command - before) / limits.change)
        state, before = observer.ahead @ state + np.outer(observer.entering, command), command
        if (i + 1) % _EVERY == 0:
            soft += [row @ state / getattr(limits, name) for name, row in observer.signals.items()]
    whole = np.array(hard + soft)
    return Horizon(blocks, whole[:, :k], whole[:, k:], np.arange(len(whole)) >= len(hard))


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
        """For the law u = feedforward r - feedback x^ over a horizon: feedback [n + 2], feedforward [samples, k]."""
        self.stroke = braking.stroke
        order, references = len(feedback), feedforward.shape[1]
        closed = observer.ahead - np.outer(observer.entering, feedback)
        position, speed = observer.signals["position"], observer.signals["speed"]
        leads = np.linspace(0.0, braking.speed / braking.deceleration, _TANGENTS)
        state, rows = np.hstack((np.eye(order), np.zeros((order, references)))), []
        for i, share in enumerate(feedforward, start=1):
            state = closed @ state
            state[:, order:] += np.outer(observer.entering, share)
            if i % _LOOKED_AT == 0:
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
