"""Records cut into windows whose initial states are free, and what a plant leaves unexplained in them.

The recorded command is the only input. A jack integrates: a run through a whole record drifts away from any rig; errors
are therefore those of windows of 0.5 s (the last one of a record takes the remainder), each from the initial state that
fits it best. A window ends where samples were dropped.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby, pairwise
from weakref import WeakKeyDictionary

import numpy as np

from ...base.errors import InputError
from ...base.signals import FURTHER_INPUTS, MEASURED
from ...engine.delay_line import HeldCommands, held_commands, stacked
from ...plant import Plant
from ...plant.effects.slots import ORIGINS, READS
from ...records import Record
from ...records.repair import longest_interval
from ...rigs.oil import saturation
from ..data.noise_floor import NoiseFloor

WINDOW = 0.5  # s
BLOCKS = 4  # into which a record falls where parts of it are left out in turn
_MOST_MISFIT = 1e8
_FEWEST = 50  # rows between two gaps, to be a window
_BEFORE = 0.02  # s: the longest delay that is searched
FIRST_ROWS = 50  # which tell the state that a free run starts from
_STILL = 0.01  # of a record's travel: a jack that moves less in its first rows rests
_UNSURE = 5e4  # Pa: what a pressure's reading may be off
_EARLY = 5.5  # periods: over which a measured state's first value is averaged
_HELD: WeakKeyDictionary[Record, tuple[tuple[float, bool], HeldCommands]] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class WindowGroup:
    """Windows of one length: which of all windows [w], their times [w, rows + 1] (s), the measured values and their
    weights, one over sigma or 0 where not compared [w, rows, signals]."""

    which: np.ndarray
    t: np.ndarray
    measured: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True, eq=False)
class Windows:
    """Windows of records, in order: `names` are the signals compared, `spans` (record, first row, end row) of each.

    `free_run`: each is a run through a record, of which parts are left out in turn, where else whole windows are; see
    `from_rest`. `misfit` is the chi2 that a free run leaves: for initial states its errors count as noise, else a state
    that hardly shows, as where a jack stands that no position was recorded of, would go anywhere for a little less of
    them.
    """

    records: tuple[Record, ...]
    names: tuple[str, ...]
    spans: tuple[tuple[int, int, int], ...]
    groups: tuple[WindowGroup, ...]
    free_run: bool = False
    misfit: float = 1.0

    @property
    def count(self) -> int:
        """Number of windows."""
        return len(self.spans)

    @cached_property
    def levels(self) -> np.ndarray:
        """How many windows that follow one another without a gap come right before each [windows]."""
        levels = [0]
        for (index, _, end), (following, first, _) in pairwise(self.spans):
            levels.append(levels[-1] + 1 if (index, end) == (following, first) else 0)
        return np.array(levels)

    @cached_property
    def samples(self) -> int:
        """Number of compared samples, over all signals."""
        return sum(int(np.count_nonzero(group.weight)) for group in self.groups)

    @cached_property
    def samples_by_signal(self) -> dict[str, int]:
        """Number of compared samples of each signal."""
        counts = np.sum([np.count_nonzero(group.weight, axis=(0, 1)) for group in self.groups], axis=0)
        return dict(zip(self.names, counts.tolist(), strict=True))

    @cached_property
    def from_rest(self) -> bool:
        """Whether all are free runs of records that rest in their first rows: their initial states are no unknowns,
        since a jack at rest is where it is measured to be."""
        return self.free_run and all(first == 0 and _rests(self.records[index]) for index, first, _ in self.spans)

    def commands(self, group: WindowGroup, delay: float = 0.0, interpolated: bool = False) -> HeldCommands:
        """What arrives in each row of a group [w, rows] of commands that are `delay` s late."""
        spans = [self.spans[w] for w in group.which]
        late = {index: delayed(self.records[index], delay, interpolated) for index in {index for index, _, _ in spans}}
        rows = [late[index].some(slice(first, end)) for index, first, end in spans]
        return stacked(rows)

    def inputs(self, group: WindowGroup) -> dict[str, np.ndarray]:
        """The further inputs that the records carry, held in each row of a group [w, rows]; 0 where one has none."""
        spans = [self.spans[w] for w in group.which]
        carried = {index: further_inputs(self.records[index]) for index in {index for index, _, _ in spans}}
        names = [name for name in FURTHER_INPUTS if any(name in own for own in carried.values())]
        rows = [(carried[index], slice(first, end)) for index, first, end in spans]
        return {name: np.array([own.get(name, np.zeros(end.stop))[end] for own, end in rows]) for name in names}

    def by_record(self, parts: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Values of the groups [w, rows, k] put together as those of the records [n, k]."""
        whole = [np.full((len(record.t), parts[0].shape[-1]), np.nan) for record in self.records]
        for group, values in zip(self.groups, parts, strict=True):
            for w, value in zip(group.which, values, strict=True):
                index, first, end = self.spans[w]
                whole[index][first:end] = value
        return whole

    def comparing(self, name: str) -> "Windows":
        """The windows with one signal alone compared."""
        kept = np.array([each == name for each in self.names])
        return replace(self, groups=tuple(replace(group, weight=group.weight * kept) for group in self.groups))

    def some(self, keep: Sequence[int]) -> "Windows":
        """The windows of these numbers."""
        return self._of(tuple(self.spans[w] for w in keep))

    def and_those_of(self, other: "Windows") -> "Windows":
        """These windows, then those of others in which the same signals are compared."""
        records, names = (*self.records, *other.records), self.names
        spans = (*self.spans, *((index + len(self.records), first, end) for index, first, end in other.spans))
        weights = {name: max(self._weights[name], other._weights[name]) for name in names}
        return Windows(records, names, spans, _groups(records, names, spans, weights), self.free_run)

    def beginnings(self, rows: int) -> "Windows":
        """The first rows of each."""
        spans = tuple((index, first, min(first + rows, end)) for index, first, end in self.spans)
        return self._of(spans)

    def without_rows(self, block: int) -> "Windows":
        """These free runs without one block of the compared rows."""
        compared = [row_blocks(group.weight.shape[1])[:, None] != block for group in self.groups]
        groups = zip(self.groups, compared, strict=True)
        return replace(self, groups=tuple(replace(group, weight=group.weight * rows) for group, rows in groups))

    def missed(self, squares: np.ndarray) -> "Windows":
        """These free runs with the misfit that squared errors [w] leave; windows as they are."""
        if not self.free_run:
            return self
        return replace(self, misfit=float(np.clip(np.median(squares) * self.count / self.samples, 1.0, _MOST_MISFIT)))

    def cut(self, parts: int) -> "Windows":
        """Each in parts of equal length."""
        edges = [(i, np.linspace(a, b, parts + 1).round().astype(int).tolist()) for i, a, b in self.spans]
        spans = tuple((i, a, b) for i, places in edges for a, b in pairwise(places))
        return replace(self._of(spans), free_run=False)

    def _of(self, spans: tuple[tuple[int, int, int], ...]) -> "Windows":
        """Other windows of these records."""
        return replace(self, spans=spans, groups=_groups(self.records, self.names, spans, self._weights))

    @cached_property
    def _weights(self) -> dict[str, float]:
        peak = np.max([group.weight.max(axis=(0, 1)) for group in self.groups], axis=0)
        return dict(zip(self.names, peak.tolist(), strict=True))


def predicted(plant: Plant) -> list[str]:
    """The measured signals that a plant predicts: not the speed of a pump that turns as the command says."""
    turns = any(state.name == "w" for state in plant.states)
    return [name for name in MEASURED if name in plant.outputs and (turns or name != "pump_speed")]


def compared(plant: Plant, record: Record, floor: NoiseFloor) -> list[str]:
    """The signals that plant, record and noise floor share. Raises InputError when there are none."""
    names = [n for n in predicted(plant) if n in record.signals and n in floor.sigma]
    if not names:
        raise InputError(f"record {record.name}: no signal that rig {plant.name} predicts; check names and rig")
    if "command" not in record.signals:
        raise InputError(f"record {record.name}: no command, the input of every prediction; map its column")
    return names


def cut_windows(
    plant: Plant,
    records: Sequence[Record],
    floor: NoiseFloor,
    beside: Sequence[Record] = (),
    late: float = _BEFORE,
    length: float = WINDOW,
) -> Windows:
    """Windows of `length` [s] of all records, or of infinite length one free run through each; what is left over at the
    end, or before a gap, belongs to the one before.

    What they carry is compared; names are also those of the records `beside`, which the same model has to predict. The
    first `late` [s] of a record and after a gap are left out: a late command may be one that was not recorded.
    """
    shared = {name for record in (*records, *beside) for name in compared(plant, record, floor)}
    names = tuple(name for name in MEASURED if name in shared)
    spans = tuple((i, first, end) for i, record in enumerate(records) for first, end in _spans(record, late, length))
    if not spans:
        listed = ", ".join(record.name for record in records)
        raise InputError(
            f"record {listed}: nowhere {_FEWEST} rows without a gap; log faster, or without losing samples"
        )
    weights = {name: 1 / floor.sigma[name] for name in names}
    groups = _groups(tuple(records), names, spans, weights)
    return Windows(tuple(records), names, spans, groups, free_run=math.isinf(length))


def row_blocks(rows: int) -> np.ndarray:
    """The block [rows] that each row of a free run is in."""
    return BLOCKS * np.arange(rows) // rows


def delayed(record: Record, delay: float, interpolated: bool = False) -> HeldCommands:
    """What a plant holds in the rows [n] of a record whose commands arrive `delay` s late, and later yet where the
    record says that they act after their rows."""
    asked, known = (delay, interpolated), _HELD.get(record)
    if known is None or known[0] != asked:  # the last answer, which runs at one delay ask for again and again
        edges = np.append(record.t, record.t[-1] + record.period)
        held = held_commands(edges, record.signals["command"], delay + record.late, interpolated)
        known = _HELD[record] = asked, held
    return known[1]


def further_inputs(record: Record) -> dict[str, np.ndarray]:
    """What a record carries of a plant's inputs besides the command, by name [n]."""
    return {name: record.signals[name] for name in FURTHER_INPUTS if name in record.signals}


def first_guess(plant: Plant, record: Record, first: int, end: int, before: np.ndarray) -> np.ndarray:
    """The state [n] at row `first` of rows up to `end`: that `before` them, corrected by what is measured directly."""
    x = before.copy()
    early = slice(first, min(end, first + int(_EARLY) + 1))
    known = {variable.name for variable in plant.states}
    for signal in ("pa", "pb", "spool", "position"):
        if signal in record.signals and READS[signal] in known:
            origin = plant.p[plant.parameters.index(ORIGINS[signal])] if signal in ORIGINS else 0.0
            state, read = plant.state(READS[signal]), np.mean(record.signals[signal][early]) - origin
            if signal not in ("pa", "pb") or not _has_gas(plant, min(x[state], read), max(x[state], read)):
                x[state] = read
    if "load_pressure" in record.signals and not {"pa", "pb"} & set(record.signals):
        a, b = plant.state("P1"), plant.state("P2")
        half = (np.mean(record.signals["load_pressure"][early]) - x[a] + x[b]) / 2
        x[a], x[b] = x[a] + half, x[b] - half
    return x


def _has_gas(plant: Plant, low: float, high: float) -> bool:
    """Whether a chamber's state and its pressure [Pa] are both those of oil with gas: how much it lacks is not read."""
    gas = saturation(plant.p[plant.parameters.index("Pr")])
    return low < gas and high < gas + _UNSURE


def _rests(record: Record) -> bool:
    """Whether the position stays in the first rows, by its travel, of a record that has both pressures too."""
    if not {"pa", "pb", "position"} <= set(record.signals):
        return False
    position = record.signals["position"]
    return bool(np.ptp(position[:FIRST_ROWS]) < _STILL * np.ptp(position))


def run_up(record: Record, first: int) -> int:
    """The row up to 20 ms before row `first`, with no gap between them."""
    start = max(0, first - round(_BEFORE / record.period))
    gaps = np.flatnonzero(np.diff(record.t[start : first + 1]) > longest_interval(record.t))
    return start + int(gaps[-1]) + 1 if gaps.size else start


def _spans(record: Record, late: float, length: float) -> list[tuple[int, int]]:
    """First and end rows of the windows; none reaches over a gap, in which the drive may have received anything."""
    gaps = np.flatnonzero(np.diff(record.t) > longest_interval(record.t)) + 1  # with its sample a command was dropped
    rows = round(late / record.period)
    pieces = [(first + rows, end) for first, end in pairwise([0, *gaps.tolist(), len(record.t)])]
    return [
        span for first, end in pieces if end - first >= _FEWEST for span in pairwise(_edges(record, first, end, length))
    ]


def _edges(record: Record, start: int, stop: int, length: float) -> list[int]:
    first, last = record.t[start], record.t[stop - 1]
    count = max(1, int((last - first + record.period) / length + 1e-6))
    slack = 1e-3 * record.period  # 0.5 s must find the row that was logged as 0.49999999
    inner = np.searchsorted(record.t, first + length * np.arange(1, count) - slack)
    return [start, *inner.tolist(), stop]


def _groups(
    records: tuple[Record, ...],
    names: tuple[str, ...],
    spans: tuple[tuple[int, int, int], ...],
    weights: dict[str, float],
) -> tuple[WindowGroup, ...]:
    tables = [_table(record, names, weights) for record in records]
    order = sorted(range(len(spans)), key=lambda w: spans[w][2] - spans[w][1])
    groups = []
    for _, members in groupby(order, key=lambda w: spans[w][2] - spans[w][1]):
        which = list(members)
        parts = [tuple(table[spans[w][1] : spans[w][2]] for table in tables[spans[w][0]]) for w in which]
        measured, weight, start, length = (np.array(column) for column in zip(*parts, strict=True))
        groups.append(WindowGroup(np.array(which), np.hstack((start, (start + length)[:, -1:])), measured, weight))
    return tuple(groups)


def _table(
    record: Record, names: tuple[str, ...], weights: dict[str, float]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Measured values and weights [n, signals], start and length of each row's interval [n]."""
    nothing = np.zeros(len(record.t))
    measured = np.column_stack([record.signals.get(name, nothing) for name in names])
    weight = np.column_stack([record.valid.get(name, nothing) * weights[name] for name in names])
    return measured, weight, record.t, np.diff(np.append(record.t, record.t[-1] + record.period))
