"""What a policy is shown: the error, and how far the measured signals have moved since its last decisions."""

import numpy as np

from workbench.control.network import Network

BOUND = 10.0  # of full scale: what is beyond is cut


def silent_policy(error: float, pressure: float, past: int, limit: float, decision: float) -> Network:
    """A policy that adds nothing, with the inputs of one that does: [e/error, (y - y_j)/error, (p - p_j)/pressure],
    e the reference less the position y, p = pa - pb, y_j and p_j those of j = 1 .. `past` decisions ago.

    error [m] and pressure [Pa] are full scales; `limit` [1] of what is added to a command, held for `decision` [s].
    """
    moved = np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0]]) / [[error], [pressure]]
    register = np.eye(past, k=-1)
    first = np.eye(past, 1)
    return Network(
        signals=("position", "pa", "pb"),
        A=np.kron(np.eye(2), register),
        B=np.pad(np.kron(moved, first), ((0, 0), (0, 1))),
        C=np.vstack((np.zeros(2 * past), -np.eye(2 * past))),
        D=np.vstack((np.array([1.0, -1.0, 0.0, 0.0]) / error, np.repeat(moved, past, axis=0))),
        shift=np.zeros(1 + 2 * past),
        bound=BOUND,
        layers=((np.zeros((1, 1 + 2 * past)), np.zeros(1)),),
        squash="clip",
        limit=limit,
        decision=decision,
    )


class LanePasts:
    """The pasts [lanes, n] of a policy on many plants at once, s = (r, y) [.., 1 + m] being SI."""

    def __init__(self, policy: Network, lanes: int) -> None:
        self._policy, self._x = policy, np.zeros((lanes, len(policy.A)))
        self._rest = np.linalg.solve(np.eye(len(policy.A)) - policy.A, policy.B)

    def reset(self, rows: np.ndarray, s: np.ndarray, command: np.ndarray) -> None:
        """Some lanes have been at rest at s [rows, 1 + m], with commands [rows]."""
        self._x[rows] = _times(np.column_stack((s, command)), self._rest)

    def shown(self, s: np.ndarray) -> np.ndarray:
        """What the policy is shown at s [lanes, 1 + m], in float32; a number that is none is shown as the bound."""
        policy = self._policy
        z = _times(self._x, policy.C) + _times(s, policy.D) + policy.shift
        return np.fmax(np.fmin(z, policy.bound), -policy.bound).astype(np.float32)

    def advance(self, rows: np.ndarray, s: np.ndarray, command: np.ndarray) -> None:
        """Some lanes go on by one decision that was made on s [rows, 1 + m], the drive having got commands [rows]."""
        policy = self._policy
        self._x[rows] = _times(self._x[rows], policy.A) + _times(np.column_stack((s, command)), policy.B)


def _times(lanes: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Products [lanes, k] of a matrix [k, n] and each of the lanes [lanes, n], to the bit whatever their number."""
    return np.einsum("ln,kn->lk", lanes, matrix)
