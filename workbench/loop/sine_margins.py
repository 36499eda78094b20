"""Margins of a controller that has no linear view: small sines on the command of the simulated loop."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..control.protocol import Controller
from ..engine import Engine
from ..linear import Equilibrium
from ..rigs.rig import Rig
from .margins import LinearLoop, with_margins
from .open_loops import opened
from .sampled_loop import SampledLoop

_AMPLITUDE = 5e-6  # of full command: well inside of a lap
SINE_TOLERANCE = 1e-8  # of the simulation, for so small a motion
_BLOCK = 0.2  # s: blocks of whole cycles last at least about this
_CYCLES = 4.0  # of the lowest frequency in the longest time
_POINTS, _ROUNDS, _INSIDE = 40, 3, 3  # of the grid of frequencies; rounds that split intervals where something happens
_LINEAR = 0.03  # of the sensitivity's peak: as much may it change with a third of the amplitude
_PUSH, _GONE = 10, 1e-3  # samples of a push; what is left of its answer that is no oscillation
_LIMITED = 1e-12  # of the command: more is no rounding

WITHOUT_MARGINS = LinearLoop(None, np.zeros(0), np.zeros(0, complex), None, None, None, None, None, "none")


class _NoMargins(Exception):
    """A sine did not settle, met a limit, or was not answered in proportion."""


@dataclass(frozen=True)
class SineTest:
    """A loop on a plant without dry friction that is tried by sines, a new loop for each.

    The loop starts from an operating point and moves on with its `speed` [m/s]. A sine has settled when 1/(1 + L) of
    two blocks differs by less than `agree`; there are none where one has not within `longest` [s].
    """

    engine: Engine
    rig: Rig
    controller: Callable[[], Controller]
    start: Equilibrium
    speed: float
    longest: float
    agree: float

    def loop(self) -> LinearLoop:
        """The open loop L and its margins, up to the Nyquist frequency; without margins where a sine gives none."""
        f = np.geomspace(_CYCLES / self.longest, 0.5 / self.rig.period.value, _POINTS)
        try:
            if not self._decays():
                return replace(WITHOUT_MARGINS, stable=False)
            loops = opened(self._responses, f[None], self._responses(np.zeros(1, int), f[None]), _ROUNDS, _INSIDE)
            loop = with_margins(loops, stable=True, margins="sine")
            peak = int(np.argmin(np.abs(1 + loop.open)))
            smaller = self._response(*self._whole(loop.f[peak]), _AMPLITUDE / 3)
        except _NoMargins:
            return WITHOUT_MARGINS
        proportional = abs((1 + loop.open[peak]) / (1 + smaller) - 1) < _LINEAR
        return loop if proportional else WITHOUT_MARGINS

    def _decays(self) -> bool:
        """Whether a push of the command dies away, in the first half of the longest time."""
        block = slice(0, len(self._reference) // 2)
        pushed = np.zeros(block.stop)
        pushed[:_PUSH] = _AMPLITUDE
        answer = (self._commands(self._loop(), block, pushed) - self._at_rest[:, block])[0]
        _, second, _, last = (np.std(part) for part in np.array_split(answer, 4))
        return bool(last <= max(second, _GONE * np.abs(answer).max()))

    def _responses(self, _lanes: np.ndarray, f: np.ndarray) -> np.ndarray:
        """L at frequencies [n, k] in Hz, each measured once."""
        points = [self._whole(each) for each in f.ravel()]
        for point in points:
            if point not in self._measured:
                self._measured[point] = self._response(*point, _AMPLITUDE)
        return np.array([self._measured[point] for point in points]).reshape(f.shape)

    @cached_property
    def _measured(self) -> dict[tuple[int, int], complex]:
        return {}

    def _whole(self, f: float) -> tuple[int, int]:
        """Cycles and samples of a block, the nearest to f [Hz]."""
        cycles = max(1, round(_BLOCK * f))
        return cycles, max(2, round(cycles / (f * self.rig.period.value)))

    def _response(self, cycles: int, samples: int, amplitude: float) -> complex:
        """L at a frequency: what the controller answers to a sine on its command, over what the drive then gets."""
        turn = 2 * np.pi * cycles * np.arange(samples) / samples
        wave, added = np.exp(-1j * turn), amplitude * np.cos(turn)
        loop, before = self._loop(), None
        for first in range(0, len(self._reference) - samples + 1, samples):
            block = slice(first, first + samples)
            answered, got = self._commands(loop, block, added) - self._at_rest[:, block]
            sensitivity = complex(wave @ got / (wave @ (got - answered)))
            if before is not None and abs(sensitivity - before) < self.agree:
                return 1 / sensitivity - 1
            before = sensitivity
        raise _NoMargins

    def _loop(self) -> SampledLoop:
        return SampledLoop(self.engine, self.rig, self.controller(), self.start)

    def _commands(self, loop: SampledLoop, block: slice, added: np.ndarray) -> np.ndarray:
        """What the controller commands in a block, and what the drive gets [2, k]."""
        run = loop.run(self._reference[block], {name: course[block] for name, course in self._inputs.items()}, added)
        sent = run.record.signals["command"]
        if run.tripped or np.abs(sent - run.demanded).max() > _LIMITED:
            raise _NoMargins
        return np.stack((run.demanded - added, sent))

    @cached_property
    def _at_rest(self) -> np.ndarray:
        """The commands [2, k] without a sine, over the longest time."""
        return self._commands(self._loop(), slice(None), np.zeros_like(self._reference))

    @cached_property
    def _reference(self) -> np.ndarray:
        """The reference over the longest time: the level of the controlled signal, from which a position moves on."""
        signal = self.controller().measures[0]
        level = float(self.engine.observe(self.start.x, self.start.u)[self.engine.plant.output(signal)])
        return level + (self._travel if signal == "position" else np.zeros_like(self._travel))

    @cached_property
    def _inputs(self) -> dict[str, np.ndarray]:
        """A specimen's far end moves along."""
        inputs = [variable.name for variable in self.engine.plant.inputs]
        return {"specimen_position": self._travel} if "specimen_position" in inputs else {}

    @property
    def _travel(self) -> np.ndarray:
        period = self.rig.period.value
        return self.speed * np.arange(round(self.longest / period) + 1) * period
