"""A picture of an episode so far: the jack where it is, and under it what was asked for, what came, and the command."""

import numpy as np

from workbench.base.signals import SIGNALS
from workbench.base.units import from_si
from workbench.report import Curve, Figure, Panel
from workbench.report.still import pixels
from workbench.rigs.rig import Rig

from .episodes import Present

_HEIGHT = 120
_STEEL, _BODY, _OIL = (90, 98, 110), (178, 186, 198), (222, 232, 244)


class Film:
    """Pictures of an episode, `step` [s] after step, of a rig's controlled signal, "position" or "force"."""

    def __init__(self, rig: Rig, signal: str, step: float) -> None:
        self._unit, self._step, self._half_stroke = SIGNALS[signal].unit, step, rig["S"] / 2
        self._scale = float(from_si(1.0, self._unit, SIGNALS[signal].si))
        self._past: list[Present] = []

    @property
    def begun(self) -> bool:
        """Whether there is an episode to draw."""
        return bool(self._past)

    def begin(self, present: Present) -> None:
        """A new episode."""
        self._past = [present]

    def add(self, present: Present) -> None:
        """A step later."""
        self._past.append(present)

    def picture(self) -> np.ndarray:
        """Red, green and blue [height, width, 3], uint8, of the episode so far."""
        t = np.arange(len(self._past)) * self._step
        reference, controlled, _, command = np.array(self._past).T
        loop = [Curve("reference", t, reference * self._scale, "dash"), Curve("true", t, controlled * self._scale)]
        panels = [Panel(f"controlled [{self._unit}]", loop), Panel("command [1]", [Curve("command", t, command)])]
        signals = pixels(Figure("", "time [s]", panels))
        return np.concatenate([_jack(self._past[-1].position / self._half_stroke, signals.shape[1]), signals])


def _jack(share: float, width: int) -> np.ndarray:
    """A double-rod cylinder [120, width, 3] whose piston is at a share of the half stroke, with its mass."""
    picture = np.full((_HEIGHT, width, 3), 255, np.uint8)
    middle, left, right, high = _HEIGHT // 2, width // 4, width * 3 // 5, _HEIGHT // 4
    reach = (right - left) * 2 // 5
    piston = (left + right) // 2 + round(float(np.clip(share, -1, 1)) * reach)
    end = piston + (right - left) // 2 + reach

    def block(x0: int, x1: int, half: int, colour: tuple[int, int, int]) -> None:
        picture[middle - half : middle + half, max(x0, 0) : max(x1, 0)] = colour

    block(left - 6, right + 6, high + 6, _BODY)
    block(left, right, high, _OIL)
    block(piston - (right - left) // 2 - reach, end, 6, _STEEL)
    block(piston - 6, piston + 6, high, _STEEL)
    block(end, end + width // 12, high + 10, _STEEL)
    return picture
