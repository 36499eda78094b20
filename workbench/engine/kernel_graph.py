"""A kernel as a function of CasADi, as graphs that are interpreted call it."""

from collections.abc import Callable, Sequence

import casadi as ca
import numpy as np


class KernelGraph(ca.Callback):
    """[given] -> [found] by a function of arrays."""

    def __init__(self, name: str, given: int, found: int, function: Callable[[np.ndarray], np.ndarray]) -> None:
        ca.Callback.__init__(self)
        self._given, self._found, self._function = given, found, function
        self.construct(name, {"never_inline": True})

    def get_n_in(self) -> int:
        return 1

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self._given)

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self._found)

    def eval(self, arg: Sequence[ca.DM]) -> list[ca.DM]:
        return [ca.DM(self._function(np.array(arg[0]).ravel()))]
