"""A law with its guard as machine code, asked once a sample with readings from outside: at a rig on the wire."""

import ctypes
from collections.abc import Mapping

import numpy as np

from ..control.law import Law
from ..control.protocol import Controller, graph_law
from ..engine import LaneDelays
from ..engine.engine import NotCompiled
from ..engine.guard_shape import length, packed
from ..engine.sampled_code import compile_controller
from ..engine.sampled_law import LawShape
from ..rigs.rig import Rig
from .compiled_loop import CompiledLaw
from .guard_numbers import guard_numbers, guard_shape, trip_reason
from .guarded_controller import GuardedController

_OUT = 3  # what an instant gives: sent, demanded, trip


class CompiledController:
    """A law behind its guard, used like a GuardedController, on a rig whose readings have `signals`."""

    def __init__(self, rig: Rig, law: Law, signals: tuple[str, ...], noisy: bool) -> None:
        shape = guard_shape(rig, signals, law.measures)
        none = LaneDelays(np.zeros(1, int), np.zeros(1))
        nothing = np.zeros(len(shape.read))
        limits = packed(shape.numbers, **guard_numbers(rig, shape, law.measures, noisy))
        law_shape = LawShape(law.dense().graphs, law.measures, signals, shape, law.preview)
        self._whole = CompiledLaw(law_shape, np.array([rig.period.value]), limits, none, nothing, nothing)
        self._rig, self._law, self._read = rig, law, law_shape.read
        self._ahead = 1 + law.preview
        self._row, self._out = np.zeros(self._ahead + 1 + len(self._read)), np.zeros(_OUT)
        self._state = np.zeros((1, length(law_shape.state)))
        self._library = compile_controller(law_shape)
        self._code = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 4)(self._library["controller"])
        self._numbers = np.zeros((1, length(law_shape.numbers)))
        self._addresses: tuple[int, ...] = ()

    @property
    def tripped(self) -> str | None:
        """Why the guard tripped, if it did."""
        return trip_reason(self._rig, int(self._out[2])) if self._out[2] else None

    def reset(self, measured: Mapping[str, float], command: float) -> None:
        """Start from readings, where the drive holds a command."""
        law = self._law
        x, offset = law.starts(law.picked(measured[law.measures[0]], measured)[None], np.array([command]))
        self._numbers = np.ascontiguousarray(self._whole.numbers([law], offset))
        self._state = np.ascontiguousarray(self._whole.start(x, np.array([[command]])))
        self._out[:] = 0.0
        arrays = (self._state, self._row, self._numbers, self._out)
        self._addresses = tuple(array.ctypes.data for array in arrays)

    def sample(
        self, measured: Mapping[str, float], reference: float, added: float = 0.0, future: np.ndarray | None = None
    ) -> tuple[float, float, float]:
        """One sampling instant: the command to send, the one that was demanded, and 0 for the time that it took."""
        self._row[: self._ahead] = reference if future is None else future
        self._row[self._ahead] = added
        self._row[self._ahead + 1 :] = [measured[name] for name in self._read]
        self._code(*self._addresses)
        sent, demanded, _ = self._out.tolist()
        return sent, demanded, 0.0

    def stop(self, measured: Mapping[str, float]) -> float:
        """Trip the guard by a demand that is no number; the command to send."""
        return self.sample(measured, measured[self._law.measures[0]], np.nan)[0]


def controller_on(
    rig: Rig, controller: Controller, signals: tuple[str, ...], noisy: bool
) -> CompiledController | GuardedController:
    """A controller with its guard on a rig whose readings have `signals`, compiled where its law can be."""
    law = graph_law(controller)
    if law is not None:
        try:
            return CompiledController(rig, law, signals, noisy)
        except (NotCompiled, ImportError, OSError, RuntimeError):
            pass
    return GuardedController(rig, controller, noisy)
