"""In which equation does a residual sit? A random disturbance is added to one equation at a time; evidence compares.

About the fitted trajectory the errors obey e_k = C x_k + D d_k + noise, x_(k+1) = A x_k + B d_k, with A to D the exact
tangents of every sampling interval and d an Ornstein-Uhlenbeck process in the inputs that the probes add to one
equation. A Kalman filter gives the likelihood of the errors for each amplitude and correlation time; the gain in
log-likelihood over no disturbance is the evidence of that equation (Kristensen, Madsen and Jorgensen, Automatica 40(2),
2004, section 2: noise in one equation at a time). Smoothing gives the missing force, flow or drive.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...plant.effects import Effect
from ...plant.probes import probes
from ...rigs.rig import Rig
from ..fit.free_parameters import extend_parameters, model_with
from ..fit.model import Model
from ..fit.windows import Windows
from .kalman import carried_back, predict, update
from .rule import SIGNIFICANT

AMPLITUDES = (0.1, 1.0, 10.0, 100.0, 1000.0)  # over the one that moves the most sensitive signal by sigma in 10 ms
TIMES = (1e-3, 2e-2)  # s: correlation time
_LENGTH = 10e-3  # s
_FOREVER = 1e9  # s: correlation time of a constant
_OFFSET, _GAIN = 1e5, 1e-2  # Pa and part: of a pressure sensor that is off, clearly visible

BROKEN = 1.2  # chi2 of a cut from which on its equation may be broken
_SURELY = (
    2.0  # and from which on it is, whatever the evidence says: numbers that follow a misfit elsewhere break it less
)
ALIKE = 0.01  # of the most evidence: so much may come of the model being linear about a fit that is off
BETWEEN = {"drive", "flow"}
"""Before and behind the spool."""
_UNSEEN_SPOOL = 0.1  # and so much between command and flow, where no spool is recorded: one follows the other
_NEAR = 0.9  # of the most evidence: what an equation must have that may be broken


@dataclass(frozen=True, eq=False)
class LinearTimeVaryingModel:
    """The linear model of a group's windows over sigma, states and inputs over their scales, row by row.

    e [w, rows, s]; a [w, rows, n, n]; b [w, rows, n, m]; c [w, rows, s, n]; d [w, rows, s, m].
    """

    e: np.ndarray
    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray

    def inputs(self, columns: Sequence[int]) -> "LinearTimeVaryingModel":
        """With some of the inputs only."""
        return LinearTimeVaryingModel(self.e, self.a, self.b[..., columns], self.c, self.d[..., columns])


@dataclass(frozen=True)
class Evidence:
    """Gain in log-likelihood by a disturbance in one equation, its correlation time [s] and amplitudes [windows]."""

    equation: str
    gain: float
    time: float
    amplitudes: np.ndarray


def localise(groups: Mapping[str, Sequence[LinearTimeVaryingModel]], period: float) -> list[Evidence]:
    """The evidence of every equation, most first. `groups` has the windows with the inputs of each equation alone.

    A disturbance's amplitude may differ from window to window: effects come in bursts.
    """
    plain = [part.inputs([]) for part in next(iter(groups.values()))]
    with np.errstate(over="ignore", invalid="ignore"):
        nothing = _likelihoods(plain, np.zeros(1), period, 1.0)[0]
    evidence = []
    for equation, parts in groups.items():
        sizes = np.array(AMPLITUDES) * _unit(parts, period)
        times = (_FOREVER,) if equation == "sensor" else TIMES
        gains = _gains(parts, nothing, sizes, period, times)
        over_all = np.maximum(gains.max(axis=1), 0.0).sum(axis=1)
        best = int(np.argmax(over_all))
        amplitudes = sizes[np.argmax(gains[best], axis=0)]
        evidence.append(Evidence(equation, float(over_all[best]), times[best], amplitudes))
    return sorted(evidence, key=lambda item: -item.gain)


def _likelihoods(
    parts: Sequence[LinearTimeVaryingModel], sizes: np.ndarray, period: float, time: float | np.ndarray
) -> np.ndarray:
    """`likelihood` of the windows of all groups."""
    return np.concatenate([likelihood(part, sizes, period, time) for part in parts], axis=-1)


def _gains(
    parts: Sequence[LinearTimeVaryingModel],
    nothing: np.ndarray,
    sizes: np.ndarray,
    period: float,
    times: Sequence[float],
) -> np.ndarray:
    """Gain of each window [times, sizes, w]; one along which the linear model explodes says nothing."""
    with np.errstate(over="ignore", invalid="ignore"):
        gains = _likelihoods(parts, sizes, period, np.reshape(times, (-1, 1, 1))) - nothing
    return np.nan_to_num(gains, posinf=0.0, neginf=0.0)


def _unit(parts: Sequence[LinearTimeVaryingModel], period: float) -> float:
    """The amplitude of a disturbance that moves the most sensitive signal by one sigma within 10 ms."""
    rows = max(2, round(_LENGTH / period))  # an input moves the states of the next row
    most = 0.0
    for part in parts:
        x = np.zeros((*part.b.shape[:1], part.b.shape[2], part.b.shape[3]))
        for k in range(min(rows, part.e.shape[1])):
            moved = part.c[:, k] @ x + part.d[:, k]
            most = max(most, float(np.abs(moved).max(initial=0.0)))
            x = part.a[:, k] @ x + part.b[:, k]
    return 1.0 / max(most, 1e-12)


def likelihood(
    windows: LinearTimeVaryingModel, sizes: np.ndarray, period: float, time: float | np.ndarray
) -> np.ndarray:
    """Log-likelihood [h, w] of the errors with disturbances of amplitudes `sizes` [h]; correlation `time` in s, or
    several [t, 1, 1] at once: [t, h, w]."""
    decay = np.exp(-period / np.asarray(time))
    n, m = windows.a.shape[-1], windows.b.shape[-1]
    lanes = np.broadcast_shapes(decay.shape, (len(sizes), windows.e.shape[0]))
    x, covariance, noise = _at_first(n, m, np.broadcast_to(sizes[:, None], lanes), decay)
    total = np.zeros(lanes)
    for k in range(windows.e.shape[1]):
        x, covariance, told = update(x, covariance, _output(windows, k), windows.e[:, k])
        total += sum(one.log_likelihood for one in told)
        x, covariance = predict(x, covariance, _step(windows, k, decay), noise)
    return total


def smoothed(windows: LinearTimeVaryingModel, size: np.ndarray, period: float, time: float) -> np.ndarray:
    """The disturbance [w, rows, m], over the inputs' scales, that the errors tell of; amplitudes `size` [w]."""
    decay = np.exp(-period / np.asarray(time))
    n, m = windows.a.shape[-1], windows.b.shape[-1]
    x, covariance, noise = _at_first(n, m, size, decay)
    rows = []
    for k in range(windows.e.shape[1]):
        ahead = x[:, n:], covariance[:, n:].copy()
        x, covariance, told = update(x, covariance, _output(windows, k), windows.e[:, k])
        x, covariance = predict(x, covariance, _step(windows, k, decay), noise)
        rows.append((*ahead, told))
    adjoint, disturbance = np.zeros_like(x), np.empty((*windows.e.shape[:2], m))
    for k, (ahead, spread, told) in reversed(list(enumerate(rows))):
        adjoint = (np.swapaxes(_step(windows, k, decay), -1, -2) @ adjoint[..., None])[..., 0]
        adjoint = carried_back(adjoint, told)
        disturbance[:, k] = ahead - (spread @ adjoint[..., None])[..., 0]
    return -disturbance


def _at_first(n: int, m: int, sizes: np.ndarray, decay: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """State and covariance of a model of n states and m disturbances of amplitudes `sizes` [...] at its first row, and
    the variances [..., n + m] that every row adds."""
    noise = np.zeros((*sizes.shape, n + m))
    noise[..., n:] = (sizes**2)[..., None]
    covariance = np.zeros((*noise.shape, n + m))
    covariance[..., range(n), range(n)] = 1.0
    covariance[..., range(n, n + m), range(n, n + m)] = noise[..., n:]
    return np.zeros_like(noise), covariance, noise * (1 - decay[..., None] ** 2)


def _output(windows: LinearTimeVaryingModel, k: int) -> np.ndarray:
    """[w, s, n + m]."""
    return np.concatenate((windows.c[:, k], windows.d[:, k]), axis=-1)


def _step(windows: LinearTimeVaryingModel, k: int, decay: np.ndarray) -> np.ndarray:
    """[..., w, n + m, n + m], the first of those of `decay`."""
    n, m = windows.a.shape[-1], windows.b.shape[-1]
    step = np.zeros((*np.broadcast_shapes(decay.shape, (windows.e.shape[0],)), n + m, n + m))
    step[..., :n, :n], step[..., :n, n:] = windows.a[:, k], windows.b[:, k]
    step[..., range(n, n + m), range(n, n + m)] = decay[..., None]
    return step


def linearise_windows(
    rig: Rig, known: Sequence[Effect], windows: Windows, x0: np.ndarray, p: np.ndarray, base: Model
) -> dict[str, list[LinearTimeVaryingModel]]:
    """The windows linearised with each equation's disturbance: x0 and p are those of the model `base`."""
    probed = probes(rig)
    model = model_with(rig, (*known, *probed), windows.names, sessions=base.sessions)
    first = len(base.plant.inputs)
    columns = list(range(first, len(model.plant.inputs)))
    values = extend_parameters(base.plant, p, model.plant)
    whole = [LinearTimeVaryingModel(*parts) for parts in model.linear(windows, x0, values, columns)]
    names = [variable.name for variable in model.plant.inputs[first:]]
    linearised = {}
    for probe in probed:
        own = [k for k, name in enumerate(names) if name.startswith(f"{probe.name}.")]
        linearised[probe.equation] = [group_model.inputs(own) for group_model in whole]
    outputs = model.predict(windows, x0, values)
    linearised["sensor"] = [
        _sensed(group_model, y, group.weight, windows.names)
        for group_model, y, group in zip(whole, outputs, windows.groups, strict=True)
    ]
    return linearised


def _sensed(
    group_model: LinearTimeVaryingModel, y: np.ndarray, weight: np.ndarray, names: Sequence[str]
) -> LinearTimeVaryingModel:
    """Offset, gain and lag of both pressure sensors, as constants: a free process would explain any pressure."""
    columns = []
    for k in (names.index(name) for name in ("pa", "pb") if name in names):
        value = y[..., k]
        for basis in (np.full_like(value, _OFFSET), value * _GAIN, np.gradient(value, axis=1)):
            column = np.zeros_like(y)
            column[..., k] = basis * weight[..., k]
            columns.append(column)
    d = np.stack(columns, axis=-1) if columns else np.zeros((*y.shape, 0))
    return LinearTimeVaryingModel(
        group_model.e, group_model.a, np.zeros((*group_model.a.shape[:3], d.shape[-1])), group_model.c, d
    )


def equation_of(evidence: Sequence[tuple[str, float]], parity: Mapping[str, float]) -> str:
    """The equation that lacks something: one that measured signals break by themselves, else that of most evidence.

    Pressures that are read late break the equation of motion too, so force and sensor stand or fall together. A fit
    lets mass and friction follow a misfit in the flows, which breaks that equation a little: then evidence decides.
    """
    return _possible(evidence, parity)[0]


def clear_evidence(evidence: Sequence[tuple[str, float]], kappa: float) -> float:
    """The evidence from which on an equation is told apart from another, in noise of autocorrelation factor kappa."""
    return max(SIGNIFICANT * kappa, ALIKE * max((gain for _, gain in evidence), default=0.0))


def likely_equations(evidence: Sequence[tuple[str, float]], parity: Mapping[str, float], clear: float) -> list[str]:
    """The equation that lacks something, and those whose evidence is less than `clear` behind; none without evidence.

    `evidence` is most first; what measured signals say by themselves counts as in `equation_of`. Where a spool is not
    recorded, what sits before it and what sits in the flows look alike.
    """
    if not evidence:
        return []
    first, *others = _possible(evidence, parity)
    gains, unseen = dict(evidence), "drive" not in parity

    def is_near(name: str) -> bool:
        between = unseen and {first, name} == BETWEEN
        return gains[first] - gains[name] < max(clear, _UNSEEN_SPOOL * gains[first] if between else 0.0)

    return [first, *filter(is_near, others)]


def _possible(evidence: Sequence[tuple[str, float]], parity: Mapping[str, float]) -> list[str]:
    """The equations that measured signals leave, most evidence first."""
    names = [name for name, _ in evidence]
    if parity.get("drive", 1.0) > BROKEN:
        return ["drive"]
    if "drive" in parity:
        names.remove("drive")
    if "force" in parity:
        pair = [name for name in names if name in ("force", "sensor")]
        if parity["force"] <= BROKEN:
            return [name for name in names if name not in pair]
        gains = dict(evidence)
        near = max(gains[name] for name in pair) >= _NEAR * max(gains[name] for name in names)
        return pair if near or parity["force"] > _SURELY else names
    return names
