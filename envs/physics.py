"""The physics under the environments: N lanes advanced and observed. The only place that knows an engine.

Every control period is begun afresh, so that a lane's future depends on its state alone: not on the step lengths of
its past, its neighbours or how many they are.
"""

import numpy as np

from workbench.engine import Engine
from workbench.plant import Plant


class Physics:
    """Lanes with states x [N, n], inputs u [N, m] and parameters p [N, k], all SI."""

    def __init__(self, plant: Plant) -> None:
        self._engine = Engine(plant)

    def advance(
        self, x: np.ndarray, u: np.ndarray, p: np.ndarray, duration: float | np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """New states [N, n] after holding u for `duration` [s] or [N], and which lanes failed, bool [N] (theirs are
        NaN)."""
        if len(x) > 1:
            return self._engine.advance_batch(x, u, duration, p)
        after = self.advance_one(x[0], u[0], p[0], float(np.max(duration)))
        failed = after is None
        return np.full_like(x, np.nan) if after is None else after[None], np.array([failed])

    def observe(self, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Outputs [N, outputs]."""
        if len(x) > 1:
            return self._engine.outputs(x, u, p)
        return self.observe_one(x[0], u[0], p[0])[None]

    def advance_one(self, x: np.ndarray, u: np.ndarray, p: np.ndarray, duration: float) -> np.ndarray | None:
        """New state [n] of one lane, from x [n], u [m] and p [k]; None if it failed."""
        return self._engine.advance(x, u, duration, p)

    def advance_observe_one(
        self, x: np.ndarray, u: np.ndarray, p: np.ndarray, duration: float
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """`advance_one`, and `observe_one` of the state reached under the same inputs; None if it failed."""
        return self._engine.advance_observe(x, u, duration, p)

    def observe_one(self, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Outputs [outputs] of one lane."""
        return self._engine.observe(x, u, p)
