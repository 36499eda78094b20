"""LQG: the best that a linear controller makes of position and pressures, by its own measure: a yardstick."""

import numpy as np

from workbench.control.kalman_observer import JackObserver, ObservedJack, Observer, StateLaw
from workbench.control.law import LawController
from workbench.control.protocol import design_numbers, number


class Lqg(LawController):
    """u = K (r, 0, ...) - K x^ - d^: state feedback on what a Kalman filter sees in position and pa - pb.

    K minimises the sum of (e/error)^2 + u^2. The filter is a JackObserver: neither a load nor an offset of the drive
    leaves an error.
    """

    @design_numbers
    class Design(ObservedJack):
        """Design numbers: the jack as it is observed, and what an error costs."""

        error: float = number("m", 1e-6, 10.0, "the position error that costs as much as full command", 0.1)

    def __init__(self, design: Design, period: float) -> None:
        observer = JackObserver(design, period)
        feedback = lq_gain(observer, design.error)
        follow = float(feedback @ observer.signals["position"][: observer.n])
        super().__init__(observer.law(StateLaw(np.append(feedback, [1.0, 0.0]), follow), period))


def lq_gain(observer: Observer, error: float) -> np.ndarray:
    """K [n] of the least sum of (e/error [m])^2 + u^2 on the jack that is observed."""
    return _lq(observer, error)[0]


def preview_gains(observer: Observer, error: float, count: int) -> np.ndarray:
    """What the same optimum makes of the references to come: their shares [count] of the command, the next one first.

    g[i] = B' (A - B K)'^i C'/(error^2 (1 + B' P B)), P of the Riccati equation.
    """
    feedback, cost = _lq(observer, error)
    closed = observer.a - observer.b @ feedback[None]
    row = observer.b[:, 0] / (error**2 * (1 + float(observer.b[:, 0] @ cost @ observer.b[:, 0])))
    shares = []
    for _ in range(count):
        shares.append(row @ observer.signals["position"][: observer.n])
        row = closed @ row
    return np.array(shares)


def _lq(observer: Observer, error: float) -> tuple[np.ndarray, np.ndarray]:
    """K [n] and the Riccati equation's P [n, n]."""
    from scipy.linalg import solve_discrete_are

    position = observer.signals["position"][: observer.n]
    a, b, r = observer.a, observer.b, np.eye(1)
    cost = solve_discrete_are(a, b, np.outer(position, position) / error**2, r, s=np.zeros((len(a), 1)))
    return np.linalg.solve(b.T @ cost @ b + r, b.T @ cost @ a)[0], cost
