"""Plants linearised and sampled in lanes, as the loops of all laws on them share them; a single plant is one lane."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..engine import LaneDelays
from ..linear import Equilibrium
from ..linear.equilibria import Equilibria, slopes
from ..linear.sampling import hold_matrices
from ..linear.state_space import StateSpace, state_space
from ..plant import Plant
from .open_loops import grid, unit_circle

_DEPENDENT = 1e7  # condition of eigenvectors that would lose seven digits of a response

_PROMPT = np.zeros((1, 1, 1), int)


@dataclass(frozen=True)
class LaneResponse:
    """Responses of one input to m outputs, C (z - A)^-1 B + D, in lanes: by modes, residues [lanes, m, n] / (z - modes
    [lanes, n]), or where these are nearly dependent, such as a delay's, by an upper triangular A [lanes, n, n] with
    entering [lanes, n] and leaving [lanes, m, n]. `late` [lanes, 1, 1] whole periods later.

    One lane of anything stands for what all lanes share.
    """

    upper: np.ndarray | None
    modes: np.ndarray
    entering: np.ndarray
    leaving: np.ndarray
    direct: np.ndarray
    late: np.ndarray

    @classmethod
    def of(
        cls, a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, late: np.ndarray = _PROMPT
    ) -> "LaneResponse":
        """The response of A [lanes, n, n], B [lanes, n], C [lanes, m, n] and D [lanes, m]."""
        from scipy.linalg import matrix_balance, schur

        if not a.shape[1]:
            return cls(None, np.zeros(a.shape[:2]), b, c, d[..., None], late)
        scale = matrix_balance(np.abs(a).max(axis=0), permute=False, separate=True)[1][0]
        a, b, c = a * (scale / scale[:, None]), b / scale, c * scale
        modes, right = np.linalg.eig(a)
        if (np.linalg.cond(right) < _DEPENDENT).all():
            entering = np.linalg.solve(right, b[..., None].astype(complex))[..., 0]
            return cls(None, modes, np.ones(1), (c @ right) * entering[:, None], d[..., None], late)
        upper, turn = (np.array(part) for part in zip(*(schur(each, "complex") for each in a), strict=True))
        entering = (turn.conj().swapaxes(1, 2) @ b[..., None])[..., 0]
        return cls(upper, np.diagonal(upper, axis1=1, axis2=2), entering, c @ turn, d[..., None], late)

    def at(self, z: np.ndarray) -> np.ndarray:
        """The response at z [1, k] of all lanes, or at those of each [lanes, k]: complex [lanes, m, k]."""
        if len(z) > 1 and max(map(len, (self.modes, self.entering, self.leaving, self.direct, self.late))) == 1:
            shared = self.at(z.reshape(1, -1))[0]  # all z of what lanes share at once
            return shared.reshape(len(shared), *z.shape).swapaxes(0, 1)
        apart = z[:, None] - self.modes[..., None]
        with np.errstate(divide="ignore", invalid="ignore"):  # a mode on the unit circle has no response there
            prompt = self.leaving @ (1 / apart if self.upper is None else self._states(self.upper, apart)) + self.direct
        return prompt * z[:, None] ** -self.late if self.late.any() else prompt

    def _states(self, upper: np.ndarray, apart: np.ndarray) -> np.ndarray:
        lanes = np.broadcast_shapes((len(apart),), (len(self.entering),), (len(upper),))
        x = np.empty((*lanes, apart.shape[1], apart.shape[2]), complex)
        for i in reversed(range(x.shape[1])):
            known = (upper[:, i, None, i + 1 :] @ x[:, i + 1 :])[:, 0]
            x[:, i] = (self.entering[:, i, None] + known) / apart[:, i]
        return x

    def some(self, lanes: np.ndarray) -> "LaneResponse":
        """That of some lanes, as often as they are named."""
        parts = (self.modes, self.entering, self.leaving, self.direct, self.late)
        upper = None if self.upper is None else _of(self.upper, lanes)
        return LaneResponse(upper, *(_of(part, lanes) for part in parts))

    def of_outputs(self, rows: Sequence[int]) -> "LaneResponse":
        """That of some of the m outputs."""
        return replace(self, leaving=self.leaving[:, rows], direct=self.direct[:, rows])


def _of(part: np.ndarray, lanes: np.ndarray) -> np.ndarray:
    return part if len(part) == 1 else part[lanes]


@dataclass(frozen=True)
class SampledLanes:
    """Plants linearised and sampled in lanes: A [lanes, n, n], B [lanes, n, 1], C [lanes, m, n], from the held command
    to `measures`; commands on their way are further states.

    `signals`: those of the operating points [lanes] by name, as `linear_view` needs them. `response`: the same as A, B
    and C; `on_grid`: at frequencies f [k] in Hz, complex [lanes, m, k].
    """

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    measures: tuple[str, ...]
    period: float
    signals: Mapping[str, np.ndarray]
    response: LaneResponse
    f: np.ndarray
    on_grid: np.ndarray

    @property
    def model(self) -> StateSpace:
        """The first lane."""
        direct = np.zeros((len(self.measures), 1))
        return state_space(self.a[0], self.b[0], self.c[0], direct, self.period, ["command"], self.measures)

    @property
    def point(self) -> dict[str, float]:
        """The signals of the first lane."""
        return {name: float(values[0]) for name, values in self.signals.items()}

    def rows(self, measures: Sequence[str]) -> list[int]:
        """The rows of C that are these signals. Raises ValueError for one that the plants do not have."""
        return [self.measures.index(name) for name in measures]


def sampled_lanes(
    plant: Plant, points: Equilibria, p: np.ndarray, measures: tuple[str, ...], period: float
) -> SampledLanes:
    """Plants with parameters p [lanes, k] about `points`, the command held for a `period` [s], late as each says."""
    delays = LaneDelays.of(plant.lane_lateness(p), period)
    late = (delays.whole if delays.differ else delays.whole[:1])[:, None, None]
    part = delays.part[:, None, None] if delays.differ else delays.part[:1]
    prompt = _sampled(plant, measures, points, p, period, part)
    a, b, c = prompt
    response = LaneResponse.of(a, b[..., 0], c, np.zeros(c.shape[:2]), late)
    f = grid(period)
    behind = _behind(*prompt, delays.taps(delays.whole.max()))
    return SampledLanes(
        *behind, measures, period, signals_at(plant, points, p), response, f, response.at(unit_circle(f, period)[None])
    )


def sampled_lane(plant: Plant, about: Equilibrium, period: float, p: np.ndarray | None = None) -> SampledLanes:
    """One plant about an operating point, with parameters p where they are not its own, to all its outputs."""
    points = Equilibria(about.x[None], about.u[None], np.ones(1, bool))
    return sampled_lanes(plant, points, (plant.p if p is None else p)[None], tuple(plant.outputs), period)


def signals_at(plant: Plant, points: Equilibria, p: np.ndarray) -> dict[str, np.ndarray]:
    """The outputs, the command and the specimen's stiffness [lanes] of plants p [lanes, k], SI, by name: what a
    controller's linear view needs."""
    outputs = np.array(plant.h(points.x.T, points.u.T, p.T))
    stiffness = p[:, plant.parameters.index("ks")] if "ks" in plant.parameters else np.zeros(len(p))
    return {**dict(zip(plant.outputs, outputs, strict=True)), "command": points.u[:, 0], "stiffness": stiffness}


def _sampled(
    plant: Plant, measures: tuple[str, ...], points: Equilibria, p: np.ndarray, period: float, part: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A, B, C in lanes of `measures` of a command, held over each period, that arrives a `part` of one late.

    The part is [1] or [lanes, 1, 1]. What the command moves at once is measured a sample later: a law has measured when
    it commands.
    """
    a, b, c, d = slopes(plant, points.x, points.u, p)
    rows = [plant.output(name) for name in measures]
    b, c, d = b[:, :, :1], c[:, rows], d[:, rows, :1]
    after, newer = hold_matrices(a, b, (1 - part) * period)
    if not (part.any() or d.any()):
        return after, newer, c
    before, older = hold_matrices(a, b, part * period)
    ahead = np.concatenate((after @ before, after @ older), axis=2)  # the command before is a further state
    ahead = np.pad(ahead, ((0, 0), (0, 1), (0, 0)))
    newer = np.pad(newer, ((0, 0), (0, 1), (0, 0)))
    newer[:, -1] = 1.0
    return ahead, newer, np.concatenate((c, d), axis=2)


def _behind(a: np.ndarray, b: np.ndarray, c: np.ndarray, taps: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A sampled plant whose command is late by the whole periods at which `taps` [lanes, periods + 1] are 1: commands
    on their way are further states, newest first."""
    lanes, n, whole = len(a), a.shape[1], taps.shape[1] - 1
    if not whole:
        return a, b, c
    arriving = taps[:, None]
    ahead = np.zeros((lanes, n + whole, n + whole))
    ahead[:, :n, :n], ahead[:, :n, n:] = a, b @ arriving[..., 1:]
    ahead[:, n + 1 :, n:-1] = np.eye(whole - 1)
    entering = np.zeros((lanes, n + whole, 1))
    entering[:, :n], entering[:, n] = b @ arriving[..., :1], 1.0
    return ahead, entering, np.pad(c, ((0, 0), (0, 0), (0, whole)))
