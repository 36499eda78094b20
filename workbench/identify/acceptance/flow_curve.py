"""Flow over command at constant valve pressure drop, from records with a flow meter, or from the piston's speed.

The curve is straight between nodes. A land gives a flow that goes with the root of its pressure drop (Merritt,
Hydraulic Control Systems, 1967, section 3.2), so that each sample says its flow at 35 bar a land: a valve drop of 70
bar, at which servo-valves are rated.

From the piston: what it sweeps is what both lands let through, less what compresses the oil and leaks past the piston.
Half of what flows into A and out of B, over the areas:

    x' = (Qa/Aa + Qb/Ab)/2 - (Va pa'/Aa - Vb pb'/Ab)/(2 beta) - Cl (pa - pb) (1/Aa + 1/Ab)/2

Both flows are a curve of the valve's opening times the root of a measured drop. Summed over time that is linear in the
nodes of the curve, in 1/beta and in Cl; the last two, and supply and return pressure where none was recorded, are known
within the rig file's bounds, which the interval of the curve contains.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...records import Record
from ...rigs.rig import Rig
from .opening import Opening
from .regression import Regression, Series, regress
from .row import Estimate

RATED = 35e5  # Pa, over one land
GROUP = 0.5  # s: what is disturbed alike; scores within it are summed before they are squared
BLOCK = 0.02  # s, over which positions are averaged
NODES = (0.001, 0.002, 0.004, 0.008, 0.015, 0.03, 0.06, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0)
FEWEST = 0.02  # s within half a cell of a node, below which it is left out
_TRAVEL, _BALANCE = (0.5, 0.5), (1.0, -1.0)  # of the two chambers: what moves the piston, and what cancels
_QUIET = 1e3  # Pa: where a land's drop is no longer told from noise
_TOLD, _ROUNDS = 0.2, 3
_RECORDED = 1e-3  # of a supply that was recorded: how well that is known


@dataclass(frozen=True, eq=False)
class FlowCurve:
    """Flow of one valve [k] m^3/s at 35 bar a land over command [k], 0 among them; `fit` has them first."""

    command: np.ndarray
    flow: np.ndarray
    fit: Regression
    source: str

    def estimate(self, weights: np.ndarray, value: float | None = None) -> Estimate:
        """The estimate of a linear combination [k] of the flows; `value` where it is the slope of something else."""
        direction = np.concatenate((weights, np.zeros(self.fit.coefficients.size - weights.size)))
        own = float(weights @ self.flow) if value is None else value
        return Estimate(own, self.fit.deviation(direction), self.fit.freedom)

    def band(self) -> tuple[np.ndarray, np.ndarray]:
        """Low and high [k], 95 %."""
        ends = [self.estimate(unit).interval() for unit in np.eye(self.command.size)]
        low, high = np.array(ends).T
        return low, high


def metered_curve(records: Sequence[Record], rig: Rig, opening: Opening | None) -> FlowCurve:
    """From records with `flow`, port pressures where they have them, else at the rated drop throughout."""
    parts = [(r, r.signals["command"] if opening is None else opening.of(r)) for r in records]
    nodes = _nodes([o for _, o in parts], [r.period for r, _ in parts])
    series = []
    for record, at in parts:
        into = _drops(record, rig, at)[0] / np.sqrt(RATED) if "pa" in record.signals else np.ones_like(at)
        rows = record.valid["flow"]
        x = (_hats(at, nodes) * into[:, None])[rows]
        series.append(Series(record.signals["flow"][rows], x, max(1, round(GROUP / record.period))))
    loose = np.full(nodes.size, np.inf)
    fit = regress(series, np.zeros(nodes.size), loose, summed=False)
    return FlowCurve(nodes, fit.coefficients, fit, "flow meter")


def piston_curve(records: Sequence[Record], rig: Rig, opening: Opening) -> FlowCurve:
    """From the piston's travel and the chamber pressures of records with `position`, and `pa` or `pb` or both.

    Nodes that the records do not tell, to a fifth of what is believed before, are left out, and the rest found again.
    """
    parts = [(record, opening.of(record)) for record in records]
    nodes = _nodes([at for _, at in parts], [record.period for record, _ in parts])
    curve, fit = _fitted(parts, nodes, rig)
    told = np.array([fit.deviation(unit) for unit in np.eye(fit.coefficients.size)[: nodes.size]])
    kept = (told < _TOLD * _believed(rig, nodes)[1]) | (nodes == 0)
    if not kept.all():
        nodes = nodes[kept]
        curve, fit = _fitted(parts, nodes, rig)
    shifted, scaled = opening.spread
    beside = np.zeros(fit.coefficients.size - nodes.size)
    causes = [np.append(shifted * np.gradient(curve, nodes), beside), np.append(scaled * curve, beside)]
    return FlowCurve(nodes, curve, fit.widened(*causes), "piston speed, less compressibility and leakage")


def _fitted(parts: Sequence[tuple[Record, np.ndarray]], nodes: np.ndarray, rig: Rig) -> tuple[np.ndarray, Regression]:
    unknown = any("supply" not in record.signals for record, _ in parts)
    known, prior = _declared(rig, nodes, unknown)
    balanced = any("supply" not in record.signals and _has_both(record) for record, _ in parts)
    fit, curve = None, known[: nodes.size]
    for _ in range(_ROUNDS):  # what an unknown supply pressure does depends on the curve
        if balanced:
            known, prior = _balanced(parts, nodes, rig, curve)
        travel = [s for part in parts for s in _series(*part, nodes, rig, curve, _TRAVEL)]
        fit = regress(travel, known, prior)
        curve = fit.coefficients[: nodes.size]
    assert fit is not None
    return curve, fit


def _balanced(
    parts: Sequence[tuple[Record, np.ndarray]], nodes: np.ndarray, rig: Rig, curve: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The supply pressure by which as much flows into A as out of B, where it was not recorded; lands that match."""
    known, prior = _declared(rig, nodes, True)
    beside = slice(nodes.size, None)
    series = [s for part in parts if _has_both(part[0]) for s in _series(*part, nodes, rig, curve, _BALANCE)]
    own = [Series(s.y - s.x[:, : nodes.size] @ curve, s.x[:, beside], s.group) for s in series]
    fit = regress(own, known[beside], prior[beside])
    known[-1] = fit.coefficients[-1]
    prior[-1] = fit.deviation(np.array([0.0, 0.0, 1.0]))
    return known, prior


def _declared(rig: Rig, nodes: np.ndarray, unknown: bool) -> tuple[np.ndarray, np.ndarray]:
    """Known values and deviations of the nodes, and beside them 1/beta, Cl, and a shift of the supply [share], which
    is one where it is `unknown` alone: else it would take up what a lag that is not quite the valve's leaves."""
    beta, leak = rig.numbers["beta"].value, rig.numbers["Cl"].value
    flows, loose = _believed(rig, nodes)
    deviations = [_share(rig, "beta") / beta, _share(rig, "Cl") * leak, _share(rig, "Ps") if unknown else _RECORDED]
    return np.append(flows, [1 / beta, leak, 0.0]), np.append(loose, np.maximum(deviations, 1e-30))


def _believed(rig: Rig, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Flows of a straight valve of the rated flow, and how little that is worth: as much again, and 2 % of full."""
    rated = rig["K3"] * rig["z3max"] * np.sqrt(RATED)
    return rated * nodes, rated * (np.abs(nodes) + 0.02)


def _share(rig: Rig, name: str) -> float:
    """A declared number's deviation over its value: bounds taken as a uniform spread, 0.1 % where there are none."""
    number = rig.numbers[name]
    if number.low is None or number.high is None or not number.value:
        return 1e-3
    return max(1e-3, (number.high - number.low) / np.sqrt(12) / number.value)


def _nodes(openings: Sequence[np.ndarray], periods: Sequence[float]) -> np.ndarray:
    """Nodes that the openings reach and stay near long enough for, with the ends of what they cover."""
    kept = [0.0]
    for side in (1.0, -1.0):
        reached = max(float((side * opening).max()) for opening in openings)
        last = 0.0
        for index, size in enumerate(NODES):
            upper = NODES[index + 1] if index + 1 < len(NODES) else 1.0
            size = min(size, reached)
            near = [
                ((side * o > (last + size) / 2) & (side * o < (size + upper) / 2 + 1e-9)).sum() * period
                for o, period in zip(openings, periods, strict=True)
            ]
            if sum(near) >= FEWEST and size > last:
                kept.append(side * size)
                last = size
            if size >= reached:
                break
    return np.array(sorted(kept))


def _hats(opening: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Shares [k, n] of each node in a line through them; beyond the last one its neighbour's slope goes on."""
    cell = np.clip(np.searchsorted(nodes, opening) - 1, 0, nodes.size - 2)
    part = (opening - nodes[cell]) / (nodes[cell + 1] - nodes[cell])
    shares = np.zeros((opening.size, nodes.size))
    rows = np.arange(opening.size)
    shares[rows, cell] = 1 - part
    shares[rows, cell + 1] += part
    return shares


def _supply(record: Record, rig: Rig) -> np.ndarray:
    return record.signals.get("supply", np.full(record.t.size, rig["Ps"]))


def _drops(record: Record, rig: Rig, opening: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Signed roots [k] of the drops of the lands at A and at B, towards the sign of the opening."""
    supply, drain, forward = _supply(record, rig), rig["Pr"], opening >= 0
    pa, pb = _ports(record)
    at_a = np.where(forward, supply - pa, pa - drain)
    at_b = np.where(forward, pb - drain, supply - pb)
    return _root(at_a), _root(at_b)


def _has_both(record: Record) -> bool:
    return "pa" in record.signals and "pb" in record.signals


def _ports(record: Record) -> tuple[np.ndarray, np.ndarray]:
    """Both chamber pressures [k]; 0 for one that was not recorded, whose chamber then counts for nothing."""
    pa, pb = (record.signals.get(name, np.zeros(record.t.size)) for name in ("pa", "pb"))
    return pa, pb


def _root(drop: np.ndarray) -> np.ndarray:
    return np.sign(drop) * np.sqrt(np.maximum(np.abs(drop) - _QUIET, 0.0))


def _series(
    record: Record, opening: np.ndarray, nodes: np.ndarray, rig: Rig, curve: np.ndarray, sides: tuple[float, float]
) -> list[Series]:
    """A record as increments over blocks, in stretches without end stops: the flow balance of chamber A times the
    first of `sides`, added to that of chamber B times the second, each over its area."""
    area = rig.areas
    at_a, at_b = _drops(record, rig, opening)
    (pa, pb), x = _ports(record), record.signals["position"] - rig.middle
    if not _has_both(record):
        sides = (1.0, 0.0) if "pa" in record.signals else (0.0, 1.0)
    by_a, by_b = sides[0] / area[0], sides[1] / area[1]
    leaks = -(pa - pb) * (by_a + by_b) * _has_both(record)
    per, hats = rig["n"] / np.sqrt(RATED), _hats(opening, nodes)
    forward, supply = opening >= 0, _supply(record, rig)
    slope = 0.5 * supply / np.maximum(np.abs(np.where(forward, at_a, at_b)), np.sqrt(_QUIET))  # of a root, by a share
    by_supply = per * (hats @ curve) * slope * np.where(forward, by_a, by_b)
    rates = np.column_stack((hats * (per * (at_a * by_a + at_b * by_b))[:, None], leaks, by_supply))
    steps = 0.5 * (rates[1:] + rates[:-1]) * np.diff(record.t)[:, None]
    volume_a, volume_b = (
        dead + size * (rig["S"] / 2 + side * x)
        for dead, size, side in zip(rig.dead_volumes, area, (1, -1), strict=True)
    )
    squeezed = -by_a * _middle(volume_a) * np.diff(pa) + by_b * _middle(volume_b) * np.diff(pb)
    columns = np.column_stack((steps[:, : nodes.size], squeezed, steps[:, nodes.size :]))
    total = np.vstack((np.zeros(columns.shape[1]), np.cumsum(columns, axis=0)))
    rows = max(1, round(BLOCK / record.period))
    good = np.all([record.valid[name] for name in ("position", "pa", "pb") if name in record.signals], axis=0)
    group = max(1, round(GROUP / (rows * record.period)))
    moved = x * sum(sides)
    return [
        Series(np.diff(_means(moved[a:b], rows)), np.diff(_means(total[a:b], rows), axis=0), group)
        for a, b in _stretches(good)
        if (b - a) // rows >= 10
    ]


def _middle(values: np.ndarray) -> np.ndarray:
    return 0.5 * (values[1:] + values[:-1])


def _means(values: np.ndarray, rows: int) -> np.ndarray:
    count = values.shape[0] // rows
    return values[: count * rows].reshape(count, rows, *values.shape[1:]).mean(axis=1)


def _stretches(good: np.ndarray) -> list[tuple[int, int]]:
    """First and last (exclusive) rows of what is good without a gap."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], good.astype(int), [0]))))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
