"""The linear views of a controller in lanes: one for all plants, or each at its own operating point."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..control.protocol import Controller, NeedsOperatingPoint, graph_law, linear_view
from ..linear.state_space import StateSpace, state_space
from .sampled_lanes import LaneResponse

_SAME = 1e-9  # of the largest entry: dynamics that differ by rounding only are the same in all lanes

_STABLE = 1 - 1e-9  # radius of poles


@dataclass(frozen=True)
class LawLanes:
    """Laws from (reference, *measures) to the command: A [lanes, n, n], B [lanes, n, 1 + m], C [lanes, n], D [lanes,
    1 + m], where the drive does what is demanded. `lanes` is 1 for what all lanes share. `everywhere`: the law does
    not depend on the operating point."""

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray
    measures: tuple[str, ...]
    everywhere: bool = False

    @classmethod
    def shared(cls, view: StateSpace) -> "LawLanes":
        """One linear view for all lanes."""
        a, b, c, d = view.matrices
        return cls(a[None], b[None], c, d, tuple(view.input_labels[1:]), True)

    def of_loop(self) -> "LawLanes":
        """Without states that are no part of a loop, and with dynamics that are alike only once."""
        if self.everywhere:
            return self
        a, b, c, d = _heard(*_telling(self.a, self.b, self.c, self.d))
        if _same(a) and _same(b):
            a, b = a[:1], b[:1]
        return LawLanes(a, b, c, d, self.measures)

    def view(self, lane: int, period: float) -> StateSpace:
        """That of one lane, sampled every `period` [s]."""
        a, b, c, d = (part[lane if len(part) > 1 else 0] for part in (self.a, self.b, self.c, self.d))
        return state_space(a, b, c[None], d, period, ["reference", *self.measures], ["command"])

    @cached_property
    def response(self) -> LaneResponse:
        """From what is measured to the command: [lanes, m, k] at z [lanes, k]."""
        return LaneResponse.of(self.a.swapaxes(1, 2), self.c, self.b[:, :, 1:].swapaxes(1, 2), self.d[:, 1:])


def lane_laws(
    controller: Controller | Sequence[Controller],
    points: Mapping[str, np.ndarray],
    remembered: np.ndarray | None = None,
) -> LawLanes:
    """A controller's linear views at operating points [lanes] by name, SI: what `linear_view` needs of each. Or those
    of controllers of one form, one for each lane. `remembered` [lanes, k]: what a law with a `memory` has in it.

    Raises InputError for a controller without a linear view.
    """
    if not isinstance(controller, Sequence):
        return lane_views(controller, points, remembered).of_loop()
    each = [
        lane_views(own, {name: values[lane : lane + 1] for name, values in points.items()})
        for lane, own in enumerate(controller)
    ]
    a, b, c, d = (np.concatenate([getattr(view, part) for view in each]) for part in "abcd")
    return LawLanes(a, b, c, d, each[0].measures).of_loop()


def lane_views(
    controller: Controller, points: Mapping[str, np.ndarray], remembered: np.ndarray | None = None
) -> LawLanes:
    """One controller's linear views at operating points, with those of its states that only filter the reference."""
    try:
        return LawLanes.shared(linear_view(controller))
    except NeedsOperatingPoint:
        law = graph_law(controller)
    if law is not None:
        a, b, c, d = law.linearised_lanes(points, remembered)
    else:
        a, b, c, d = _one_by_one(controller, points)
    return LawLanes(a, b, c, d, tuple(controller.measures))


def _one_by_one(controller: Controller, points: Mapping[str, np.ndarray]) -> list[np.ndarray]:
    """A [lanes, n, n], B, C [lanes, n] and D [lanes, 1 + m] of a class that has a linear view at a point."""
    every = np.stack(list(points.values()), axis=1).tolist()
    views = [linear_view(controller, dict(zip(points, at, strict=True))) for at in every]
    a, b, c, d = (np.array([view.matrices[i] for view in views]) for i in range(4))
    return [a, b, c[:, 0], d[:, 0]]


def _telling(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> list[np.ndarray]:
    """Without states that do not move the command, such as the filters of a meter: no part of a loop. Those that move
    it by rounding only, such as what is learned of sines at rest, stay where they are stable."""
    some = _reaching(a, (c != 0).any(axis=0))
    a, b, c = a[:, some][:, :, some], b[:, some], c[:, some]
    telling = _reaching(a, (np.abs(c) > _SAME * np.abs(c).max(initial=0.0)).any(axis=0))
    silent = a[:, ~telling][:, :, ~telling]
    if telling.all() or np.abs(np.linalg.eigvals(silent)).max() <= _STABLE:
        return [a, b, c, d]
    return [a[:, telling][:, :, telling], b[:, telling], c[:, telling], d]


def _reaching(a: np.ndarray, reached: np.ndarray) -> np.ndarray:
    """The states [n] that are `reached`, or move one that is; of A transposed, those that one of them moves."""
    moved = (a != 0).any(axis=0)
    for _ in range(len(reached)):
        reached = reached | reached @ moved
    return reached


def _heard(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> list[np.ndarray]:
    """Without the states that nothing measured moves, such as those of a planned reference: no part of a loop.

    They stay where they are not stable by themselves.
    """
    heard = _reaching(a.swapaxes(1, 2), (b[:, :, 1:] != 0).any(axis=(0, 2)))
    alone = a[:, ~heard][:, :, ~heard]
    alone = alone[:1] if _same(alone) else alone
    if heard.all() or np.abs(np.linalg.eigvals(alone)).max() > _STABLE:
        return [a, b, c, d]
    return [a[:, heard][:, :, heard], b[:, heard], c[:, heard], d]


def _same(part: np.ndarray) -> bool:
    """Whether it is the same in all lanes, but for rounding."""
    return bool(np.ptp(part, axis=0).max(initial=0.0) <= _SAME * np.abs(part).max(initial=0.0))
