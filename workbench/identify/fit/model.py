"""A plant as a model of windows: errors over sigma, and their exact slopes to initial states, inputs and numbers."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...base.signals import FURTHER_INPUTS
from ...engine import Engine
from ...engine.delay_line import HeldCommands, joined, stacked
from ...engine.engine import back_end_of
from ...engine.jobs import Stepping
from ...engine.tangent import paced, tangent_attempt, tangent_outputs
from ...linear import equilibrium
from ...plant import Plant
from ...records import Record
from .gap_guesses import across_gaps, read_on_the_load
from .rest_state import rest_state
from .session_numbers import SessionNumber, session_windows
from .windows import WindowGroup, Windows, delayed, first_guess, further_inputs, run_up

TOLERANCE = 1e-6  # of the errors: with 1e-5 a fitted leakage is 1 % off, six times its interval
COARSE_TOLERANCE = 1e-5  # where errors are far above that: 5 % of sigma, for half the time
_SLOPES = 1e-4  # of the tangents: with 1e-3 those of dry friction explode
_STEPPING = Stepping(_SLOPES, 2e-5, 20_000)
_MOST = 1e30  # a tangent beyond this, or NaN, says nothing
_LANES = 256  # directions times windows that are computed together, so that they stay in the cache


@dataclass(frozen=True, eq=False)
class HeldRecord:
    """What a record holds a plant at: its times and the end of the last row [rows + 1], its commands as they arrive,
    and further inputs by name [rows], 0 where it carries none."""

    t: np.ndarray
    late: HeldCommands
    further: Mapping[str, np.ndarray]


class Model:
    """A plant and the signals it is compared in. Errors are predicted less measured, over sigma.

    Initial states x0 [windows, n] count where windows do not begin at rest (see Windows.from_rest); there they follow
    from the numbers. `brief`: it will run a few times only, so that a long compilation does not pay (see Engine).
    Parameters p [k] are the plant's and behind them, one for each of `sessions`, what makes a number another one in a
    session's records; `p` are those to start from, `parameters` their names.
    """

    def __init__(
        self,
        plant: Plant,
        names: Sequence[str],
        brief: bool = False,
        sessions: Sequence[SessionNumber] = (),
        tolerance: float = TOLERANCE,
    ) -> None:
        self.plant, self.names, self.sessions = plant, tuple(names), tuple(sessions)
        self.parameters = (*plant.parameters, *(number.name for number in sessions))
        self.p = np.append(plant.p, [number.start for number in sessions])
        self.engine, self._brief = Engine(plant, tolerance, brief=brief, batches=True), brief
        self._inputs = {variable.name for variable in plant.inputs}
        self._columns = [plant.output(name) for name in names]

    @cached_property
    def _tangents(self) -> Any:
        """Either back end, for the tangents' graphs."""
        plant = paced(self.plant)
        graphs = (tangent_attempt(plant), tangent_outputs(plant, self.names))
        both = np.append(self.plant.p, 0 * self.plant.p)
        return back_end_of(*graphs, both, _STEPPING, "auto", self._brief, batches=True)[0]

    def parameters_of(self, windows: Windows, group: WindowGroup, p: np.ndarray) -> np.ndarray:
        """The plant's parameters [w, k] in each window of a group."""
        k = len(self.plant.parameters)
        values = np.tile(p[:k], (len(group.which), 1))
        weights = session_windows(self.sessions, self.plant.parameters, windows, group)
        for number, change, (column, weight) in zip(self.sessions, p[k:], weights, strict=True):
            values[:, column] = number.values(values[:, column], change, weight)
        return values

    def _directions_of(self, windows: Windows, group: WindowGroup, p: np.ndarray, along: np.ndarray) -> np.ndarray:
        """Changes of the plant's parameters [w, directions, k] in each window of a group along `along`."""
        k = len(self.plant.parameters)
        values, changes = np.tile(p[:k], (len(group.which), 1)), np.tile(along[:, :k], (len(group.which), 1, 1))
        weights = session_windows(self.sessions, self.plant.parameters, windows, group)
        for number, change, own, (column, weight) in zip(self.sessions, p[k:], along[:, k:].T, weights, strict=True):
            base = values[:, column]
            by_base, by_change = number.slopes(base, change, weight)
            changes[:, :, column] = by_base[:, None] * changes[:, :, column] + np.outer(by_change, own)
            values[:, column] = number.values(base, change, weight)
        return changes

    def starts(self, windows: Windows, p: np.ndarray, fitted: np.ndarray | None = None) -> np.ndarray:
        """Plausible initial states [windows, n]: what is measured, and for the rest where the window before ended.

        The window before starts where it was guessed to, or at its `fitted` state [windows, n].
        """
        x0, values = np.empty((windows.count, self.plant.n)), self._values(windows, p)
        if windows.from_rest:
            records = [windows.records[index] for index, *_ in windows.spans]
            return np.array([rest_state(self.engine, *at) for at in zip(records, values, strict=True)])
        before = np.tile(self._at_rest, (windows.count, 1))
        level = windows.levels if fitted is None else np.minimum(windows.levels, 1)
        for number in range(level.max() + 1):
            own = np.flatnonzero(level == number)
            if number:
                spans = [windows.spans[w - 1] for w in own]
                before[own] = self._ends(
                    windows.records, spans, (x0 if fitted is None else fitted)[own - 1], values[own]
                )
            x0[own] = self.as_measured(windows.records, [windows.spans[w] for w in own], before[own], values[own])
        return x0

    def as_measured(
        self, records: Sequence[Record], spans: Sequence[tuple[int, int, int]], before: np.ndarray, p: np.ndarray
    ) -> np.ndarray:
        """States [k, n] at the first of rows `spans` (record, first row, end row) of records that were `before` them,
        corrected by what is measured directly, with parameters p [k, parameters]."""
        guesses = [first_guess(self.plant, records[i], a, b, x) for (i, a, b), x in zip(spans, before, strict=True)]
        x, seen = np.array(guesses), [k for k, (i, *_) in enumerate(spans) if "position" in records[i].signals]
        if self.plant.gaps and seen:
            x[seen] = read_on_the_load(self.engine, x[seen], p[seen])
        return x

    def anywhere(self, windows: Windows, p: np.ndarray, before: np.ndarray) -> list[np.ndarray]:
        """Initial states [windows, n] that were `before` them, corrected by what is measured directly, with what
        rattles anywhere in its gap."""
        values = self._values(windows, p)
        return across_gaps(self.engine, self.as_measured(windows.records, windows.spans, before, values), values)

    def joined(self, windows: Windows, p: np.ndarray, fitted: np.ndarray) -> np.ndarray:
        """Initial states [windows, n] where the windows before end, from their `fitted` states [windows, n].

        What is measured corrects none of it: a play that holds is found by what went before, and by nothing else. A
        window with none before it is run up to from 20 ms earlier.
        """
        spans, guess = [], fitted[np.arange(windows.count) - 1]
        for w, (index, first, _) in enumerate(windows.spans):
            record = windows.records[index]
            if windows.levels[w]:
                spans.append(windows.spans[w - 1])
            else:
                start = run_up(record, first)
                guess[w] = first_guess(self.plant, record, start, max(first, start + 1), self._at_rest)
                spans.append((index, start, first))
        return self._ends(windows.records, spans, guess, self._values(windows, p))

    def _values(self, windows: Windows, p: np.ndarray) -> np.ndarray:
        """The plant's parameters [windows, k] in every window."""
        values = np.empty((windows.count, len(self.plant.parameters)))
        for group in windows.groups:
            values[group.which] = self.parameters_of(windows, group, p)
        return values

    def _ends(
        self, records: Sequence[Record], spans: Sequence[tuple[int, int, int]], x: np.ndarray, p: np.ndarray
    ) -> np.ndarray:
        """The states [k, n] after rows `spans` (record, first row, end row) of records, each from x [k, n] with
        parameters p [k, parameters]; x where there is no row, or the plant cannot be simulated."""
        after, lengths = x.copy(), np.array([end - first for _, first, end in spans])
        held = {index: self.held(records[index], p[0]) for index in {index for index, *_ in spans}}
        for rows in np.unique(lengths[lengths > 0]).tolist():
            own = np.flatnonzero(lengths == rows).tolist()
            parts = [(held[index], slice(first, end)) for index, first, end in (spans[k] for k in own)]
            late = stacked([each.late.some(part) for each, part in parts])
            t = np.array([each.t[part.start : part.stop + 1] for each, part in parts])
            further = {name: np.array([each.further[name][part] for each, part in parts]) for name in FURTHER_INPUTS}
            states = self._run(x[own], t, late, further, p[own], rows)[:, -1]
            after[own] = np.where(np.isfinite(states).all(axis=1, keepdims=True), states, x[own])
        return after

    def held(self, record: Record, p: np.ndarray) -> "HeldRecord":
        """What a record's rows hold the plant at, with parameters p."""
        late = delayed(record, self.plant.lateness(p), self.plant.interpolated)
        nothing = np.zeros(len(record.t))
        further = dict.fromkeys(FURTHER_INPUTS, nothing) | further_inputs(record)
        return HeldRecord(np.append(record.t, record.t[-1] + record.period), late, further)

    def run_through(self, record: Record, x0: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Outputs [rows, signals] of one run through a record from x0 [n]; NaN from where it failed."""
        held = self.held(record, p)
        late, further = stacked([held.late]), {name: values[None] for name, values in held.further.items()}
        x = self._run(x0[None], record.t[None], late, further, p[None])
        return self.engine.outputs(x, self._held(late.now, further), p[None, None])[0][..., self._columns]

    @cached_property
    def _at_rest(self) -> np.ndarray:
        """The state that a record begins at, where nothing is measured: slow to find, hardly another with other
        numbers."""
        try:
            return equilibrium(self.plant).x
        except InputError:  # shut valves and a leak: it rests nowhere
            return self.plant.start

    def _held(self, command: np.ndarray, further: Mapping[str, np.ndarray]) -> np.ndarray:
        """All inputs [..., m] of a command and of further ones, of one shape; what the plant has not is left out."""
        u = np.zeros((*command.shape, len(self.plant.inputs)))
        for name, values in {"command": command, **further}.items():
            if name in self._inputs:
                u[..., self.plant.input(name)] = values
        return u

    def predict(self, windows: Windows, x0: np.ndarray, p: np.ndarray) -> list[np.ndarray]:
        """Outputs [w, rows, signals] of each group's windows from x0 [windows, n]; NaN from where one failed."""
        return [
            self.engine.outputs(x, u, self.parameters_of(windows, group, p)[:, None])[..., self._columns]
            for group, (x, u) in zip(windows.groups, self.states(windows, x0, p), strict=True)
        ]

    def states(self, windows: Windows, x0: np.ndarray, p: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """States [w, rows, n] and the inputs that have arrived by then [w, rows, m], of each group's windows."""
        states = []
        x0 = self.starts(windows, p) if windows.from_rest else x0
        for group in windows.groups:
            late, further = self._late(windows, group, p), windows.inputs(group)
            x = self._run(x0[group.which], group.t[:, :-1], late, further, self.parameters_of(windows, group, p))
            states.append((x, self._held(late.now, further)))
        return states

    def _run(
        self,
        x0: np.ndarray,
        t: np.ndarray,
        late: HeldCommands,
        further: Mapping[str, np.ndarray],
        p: np.ndarray,
        every: int = 1,
    ) -> np.ndarray:
        """States [lanes, rows, n] from x0 [lanes, n] at every so manyth of times t [lanes, rows], with further inputs
        [lanes, rows]."""
        if not late.switches:
            return self.engine.run_batch(x0, t, self._held(late.mean, further), p, every).x
        split, command = late.parts(t)
        twice = {name: np.repeat(values, 2, axis=-1)[..., : command.shape[-1]] for name, values in further.items()}
        return self.engine.run_batch(x0, split, self._held(command, twice), p, 2 * every).x

    def changes_from_rest(self, windows: Windows, p: np.ndarray, moved: np.ndarray) -> list[np.ndarray]:
        """Changes of the errors, [w, rows * signals, d] a group, of free runs from rest when parameters p [k] become
        `moved` [d, k]; 0 where a run failed."""
        changes = []
        starts = np.array([self.starts(windows, each) for each in (p, *moved)])
        for g, group in enumerate(windows.groups):
            parts = _chunks(1 + len(moved), len(group.which))
            y = np.concatenate([self._runs(windows, g, starts[part], np.vstack((p, moved))[part]) for part in parts])
            change = np.nan_to_num((y[1:] - y[0]) * group.weight, nan=0.0, posinf=0.0, neginf=0.0)
            changes.append(change.reshape(*change.shape[:2], -1).transpose(1, 2, 0))
        return changes

    def _runs(self, windows: Windows, g: int, starts: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Outputs [d, w, rows, signals] of a group's windows from initial states [d, windows, n], parameters [d, k]."""
        group, n = windows.groups[g], self.plant.n
        late = joined([self._late(windows, group, each) for each in p])
        further = {name: np.tile(values, (len(p), 1)) for name, values in windows.inputs(group).items()}
        flat = np.concatenate([self.parameters_of(windows, group, each) for each in p])
        x = self._run(starts[:, group.which].reshape(-1, n), np.tile(group.t[:, :-1], (len(p), 1)), late, further, flat)
        y = self.engine.outputs(x, self._held(late.now, further), flat[:, None])[..., self._columns]
        return y.reshape(len(p), len(group.which), *y.shape[1:])

    def _late(self, windows: Windows, group: WindowGroup, p: np.ndarray) -> HeldCommands:
        return windows.commands(group, self.plant.lateness(p), self.plant.interpolated)

    def errors(self, windows: Windows, x0: np.ndarray, p: np.ndarray) -> list[np.ndarray]:
        """Errors over sigma [w, rows, signals] of each group; 0 where not compared, infinite where a window failed."""
        return [
            np.where(group.weight > 0, np.nan_to_num((y - group.measured) * group.weight, nan=np.inf), 0.0)
            for group, y in zip(windows.groups, self.predict(windows, x0, p), strict=True)
        ]

    def slopes(
        self,
        windows: Windows,
        x0: np.ndarray,
        p: np.ndarray,
        along: np.ndarray,
        inputs: Sequence[np.ndarray] | None = None,
    ) -> list[np.ndarray]:
        """Slopes of the errors, [w, rows * signals, n + directions] a group.

        The first n are to the initial state over the states' scales; then to the numbers along `along` [k, parameters],
        then to `inputs`, for each group [d, rows, m] of input changes.
        """
        n = self.plant.n
        slopes = []
        for g, group in enumerate(windows.groups):
            du = np.zeros((0, group.t.shape[1] - 1, len(self.plant.inputs))) if inputs is None else inputs[g]
            size = n + len(along) + len(du)
            whole = np.empty((len(group.which), group.weight[0].size, size))
            late, values = self._late(windows, group, p), self.parameters_of(windows, group, p)
            changes = self._directions_of(windows, group, p, along)
            held = self._held(np.zeros_like(late.mean), windows.inputs(group))
            for part in _chunks(len(group.which), size):
                x = x0[group.which[part]]
                dy = self._along(group.t[part], late.some(part), held[part], x, values[part], changes[part], du)
                dy *= group.weight[part][:, None]
                whole[part] = dy.reshape(*dy.shape[:2], -1).transpose(0, 2, 1)
            slopes.append(whole)
        return slopes

    def linear(
        self, windows: Windows, x0: np.ndarray, p: np.ndarray, inputs: Sequence[int]
    ) -> list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
        """For each group the errors e [w, rows, s] and the tangents a, b, c, d (see LinearTimeVaryingModel)."""
        errors = self.errors(windows, x0, p)
        tangents = []
        for group, e, (x, u) in zip(windows.groups, errors, self.states(windows, x0, p), strict=True):
            values, late = self.parameters_of(windows, group, p), self._late(windows, group, p)
            parts = [
                self._rows(x[w], u[w], group.t[w], late.some(slice(w, w + 1)), values[w], inputs) for w in range(len(x))
            ]
            ahead, outputs = (np.array(part) for part in zip(*parts, strict=True))
            outputs = outputs * group.weight[..., None]
            n = self.plant.n
            tangents.append((e, ahead[..., :n], ahead[..., n:], outputs[..., :n], outputs[..., n:]))
        return tangents

    def _rows(
        self, x: np.ndarray, now: np.ndarray, t: np.ndarray, late: HeldCommands, p: np.ndarray, inputs: Sequence[int]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Change of the next state [rows, n, n + m] and of the outputs [rows, s, n + m] with state and inputs; `now`
        [rows, m] are those that answer at the rows' times t [rows + 1]."""
        n, m, k, rows = self.plant.n, self._tangent_inputs, len(p), len(x)
        size = n + len(inputs)
        x_dx, u_du, q = np.zeros((rows, size, 2 * n)), np.zeros((rows, size, 1, 2 * m)), np.zeros(2 * k)
        x_dx[..., :n], u_du[..., 0, : now.shape[-1]], q[:k] = x[:, None], now[:, None], p
        x_dx[:, np.arange(n), n + np.arange(n)] = self.plant.scale
        for column, index in enumerate(inputs):
            u_du[:, n + column, 0, m + index] = self.plant.inputs[index].scale
        outputs = self._tangents.outputs(x_dx.reshape(-1, 1, 2 * n), u_du.reshape(-1, 1, 2 * m), q)
        split, command = late.parts(t[None]) if late.switches else (t[None], late.mean)
        parts = command.shape[1] // rows
        u_du = np.repeat(u_du, parts, axis=2)
        u_du[..., self.plant.input("command")] = command.reshape(rows, 1, parts)
        durations = np.concatenate((np.zeros((rows, 1)), np.cumsum(np.diff(split[0]).reshape(rows, parts), axis=1)), 1)
        times = np.repeat(durations, size, axis=0)
        ahead = self._tangents.run_batch(x_dx.reshape(-1, 2 * n), times, u_du.reshape(-1, parts, 2 * m), q).x[:, -1, n:]
        ahead = ahead.reshape(rows, size, n) / self.plant.scale
        return np.nan_to_num(np.swapaxes(ahead, 1, 2)), np.swapaxes(outputs.reshape(rows, size, -1), 1, 2)

    @property
    def _tangent_inputs(self) -> int:
        """Inputs of the plant as the tangents know it."""
        return len(paced(self.plant).inputs)

    def _along(
        self,
        t: np.ndarray,
        late: HeldCommands,
        held: np.ndarray,
        x0: np.ndarray,
        p: np.ndarray,
        along: np.ndarray,
        du: np.ndarray,
    ) -> np.ndarray:
        """Change of the outputs [w, directions, rows, signals] of windows with further inputs `held` [w, rows, m] and
        parameters p [w, k] along `along` [w, numbers, k] and `du`."""
        n, m, (w, numbers, k) = self.plant.n, self._tangent_inputs, along.shape
        rows, size, command = held.shape[1], n + numbers + len(du), self.plant.input("command")
        own = slice(n, n + numbers)
        x, u, q = np.zeros((w, size, 2 * n)), np.zeros((w, size, rows, 2 * m)), np.zeros((w, size, 2 * k))
        x[..., :n], q[..., :k] = x0[:, None], p[:, None]
        u[..., : held.shape[-1]] = held[:, None]
        x[:, np.arange(n), n + np.arange(n)] = self.plant.scale
        q[:, own, k:] = along
        u[:, n + numbers :, :, m : m + du.shape[-1]] = du
        by = along[..., [self.plant.parameters.index(self.plant.delay)]] if self.plant.delay else np.zeros((w, 0, 1))
        times, driven, every = t[:, :-1], u.copy(), 1
        driven[..., command] = late.mean[:, None]
        if late.interpolated:
            driven[:, own, :, m + command] = late.slope[:, None] * by
        elif late.switches or np.any(by):
            (times, commands), every = late.parts(t[:, :-1]), 2
            driven = np.repeat(u, 2, axis=2)[:, :, : commands.shape[1]]
            driven[..., command] = commands[:, None]
            if self.plant.delay:
                driven[:, own, :, -1] = late.paces(t[:, :-1])[:, None] * by
        x, q = x.reshape(-1, 2 * n), q.reshape(-1, 2 * k)
        driven = driven.reshape(-1, *driven.shape[2:])
        batch = self._tangents.run_batch(x, np.repeat(times, size, axis=0), driven, q, every)
        u[..., command] = late.now[:, None]
        if late.interpolated:  # else what has arrived by a row is one sample or another: it has no slope
            u[:, own, :, m + command] = late.slope[:, None] * by
        dy = self._tangents.outputs(batch.x, u.reshape(-1, rows, 2 * m), q[:, None])
        return np.where(np.abs(dy) < _MOST, dy, 0.0).reshape(w, size, rows, -1)


def _chunks(windows: int, directions: int) -> Iterator[slice]:
    step = max(1, _LANES // directions)
    return (slice(first, first + step) for first in range(0, windows, step))
