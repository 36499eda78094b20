"""The quadratic programme of a linear model predictive controller: limits over a horizon, condensed."""

from dataclasses import dataclass

import numpy as np

from .kalman_observer import Observer

PRICE = 100.0  # of the square of what is beyond a limit of the jack, over that limit; that of a command's change is 1
_EVERY = 5  # samples between those at which limits are kept; rows closer than that slow the solver down


@dataclass(frozen=True)
class Limits:
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


def build_horizon(observer: Observer, feedback: np.ndarray, limits: Limits, samples: int, moves: int) -> Horizon:
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
