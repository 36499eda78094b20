"""A law's linear view as coefficients: second-order sections by input, schedules, a map, and a test vector.

command = map(sum over the channels of sections(signal) x scale(position) + plan) + sine

where the drive does what is demanded. What a law does when its command is limited has no place in sections: it is in
the code.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ...base.errors import InputError
from ...base.signals import SIGNALS
from ...engine.buffered import BufferedFunction
from ...engine.kernel import Kernel
from ...linear.interconnect import parallel, select, series
from ...linear.state_space import StateSpace, state_space
from ..law import Law
from ..piecewise_linear import CommandMap, PiecewiseLinear
from ..planned_law import PlannedLaw
from ..shell import Shell
from ..shells import FilterShell, LoadCellShell, MapShell, SineShell

SAMPLES = 200
AGREE = 1e-9  # of the largest command: how near the sections come to the law
SIZE = {"m": 1e-3, "m/s": 0.1, "m/s^2": 1.0, "Pa": 1e5, "N": 1e3, "A": 1e-3, "1": 0.1}  # of inputs, by unit
_FAR = 0.3  # of a predictive law's stroke: a jump of the reference in its vector
_SAME = 1e-9  # of a coefficient: two inputs that are one difference
_NONE = 1e-14  # of the largest of a law's first answers: less is rounding


@dataclass(frozen=True)
class SectionChannel:
    """Sections [k, 6], as scipy.signal has them, from a signal (SI) or from "error" to a part of the command [1].

    `scale`: a factor of the output over the measured position [m], that of the same sample; None for 1.
    """

    signal: str
    sections: np.ndarray
    scale: PiecewiseLinear | None = None


@dataclass(frozen=True, eq=False)
class PlanTables:
    """A predictive law where the drive does what is demanded. starting [n, m + 2] makes the filter's state of what is
    measured, the reference within the stroke and the command; entering [n] is what a command adds to it."""

    kernel: Kernel
    starting: np.ndarray
    entering: np.ndarray
    stroke: float
    measures: tuple[str, ...]

    @classmethod
    def of(cls, planned: PlannedLaw) -> "PlanTables":
        """Those of a law."""
        o = planned.observer
        return cls(planned.kernel, o.starting(planned.law), o.entering, planned.governor.stroke, o.measures)

    @property
    def reach(self) -> float:
        """The largest reference, in the unit of the controlled signal."""
        m = len(self.measures)
        return self.stroke / float(np.abs(self.kernel.table("PICK").reshape(-1, m)[:, 0]).max())

    def on(self, signal: str, factor: float) -> "PlanTables":
        """With another signal, times a factor, as the controlled one."""
        m = len(self.measures)
        scale = np.append(factor, np.ones(m - 1))
        kernel = Kernel(self.kernel.shape, self.kernel.numbers.copy())
        kernel.table("PICK")[:] = (kernel.table("PICK").reshape(-1, m) * scale).ravel()
        starting = self.starting * np.append(scale, [1.0, 1.0])
        return replace(self, kernel=kernel, starting=starting, measures=(signal, *self.measures[1:]))

    def commands(self, references: np.ndarray, measured: np.ndarray) -> np.ndarray:
        """The commands [k] along references [k], led already, and what is measured [k, m], from rest at 0."""
        state, asked, sent = np.zeros(len(self.entering)), 0.0, 0.0
        commands = np.empty(len(references))
        for i, (reference, signals) in enumerate(zip(references, measured, strict=True)):
            found = self.kernel(np.concatenate((state, [asked, sent], signals, [reference])))
            commands[i] = sent = float(found[0])
            asked, state = float(found[2]), found[3:] + self.entering * sent
        return commands


@dataclass(frozen=True)
class PlannedPart:
    """A predictive law, its command added to those of the channels; sections [k, 6] lead its reference, None: none."""

    tables: PlanTables
    leading: SectionChannel | None


@dataclass(frozen=True)
class Coefficients:
    """command = map(sum over the channels) + sine, from rest, every `period` [s]; `vector`: inputs [n] and the command.

    "error" is the reference less the controlled signal, which is the first after the reference in `vector`. Without
    a `command_map` the command is the sum; a `sine` begins at 0 with the first sample. A `planned` law adds to the sum.
    """

    period: float
    channels: tuple[SectionChannel, ...]
    command_map: CommandMap | None
    sine: SineShell | None
    vector: Mapping[str, np.ndarray]
    planned: PlannedPart | None = None


@dataclass
class _Parts:
    """What sections are made of: systems from signals by name to "command"."""

    linear: StateSpace
    tables: PlanTables | None = None
    leading: StateSpace | None = None
    filters: list[tuple[StateSpace, PiecewiseLinear]] = field(default_factory=list)
    command_map: CommandMap | None = None
    sine: SineShell | None = None

    def surround(self, shell: Shell) -> None:
        """Take in what stands around them. Raises InputError for what sections cannot give."""
        if isinstance(shell, LoadCellShell):
            self._on_load_cell(float(shell.numbers[0]))
        elif isinstance(shell, SineShell):
            self._before(self.sine, "a dither", "the dither")
            self.sine = shell
        elif isinstance(shell, MapShell):
            self._before(self.sine, "a dither", "the dither")
            self._before(self.command_map, "a map of the command", "the map")
            self.command_map = shell.command_map
        elif isinstance(shell, FilterShell) and shell.leads:
            self._lead(shell)
        elif isinstance(shell, FilterShell):
            self._before(self.sine, "a dither", "the dither")
            self._before(self.command_map, "a map of the command", "the map")
            beside = shell.filter.relabelled(shell.filter.input_labels, ["command"])
            if shell.schedule is None:
                self.linear = parallel(self.linear, beside)
            else:
                self.filters.append((beside, shell.schedule))
        else:
            raise InputError(
                "this law is no sum of filters with schedules: it has no coefficients but those in its code"
            )

    def _before(self, there: object, what: str, name: str) -> None:
        if there is not None:
            raise InputError(f"compensators behind {what} have no coefficients; name {name} last, or take the code")

    def _lead(self, shell: FilterShell) -> None:
        leading = shell.filter.relabelled(shell.filter.input_labels, ["reference"])
        if shell.schedule is not None:
            raise InputError("a reference filter with a schedule has no coefficients; take the code")
        if self.tables is not None and leading.input_labels != ["reference"]:
            raise InputError("a reference filter that takes a measured signal has no coefficients; take the code")

        def led(law: StateSpace) -> StateSpace:
            return series(leading, law) if "reference" in law.input_labels else law

        self.linear, self.filters = led(self.linear), [(led(part), factor) for part, factor in self.filters]
        if self.tables is not None:
            self.leading = leading if self.leading is None else series(leading, self.leading)

    def _on_load_cell(self, factor: float) -> None:
        names = ["force" if name == "position" else name for name in self.linear.input_labels]
        scale = np.array([factor if name == "force" else 1.0 for name in names])
        self.linear = replace(self.linear, B=self.linear.B * scale, D=self.linear.D * scale, input_labels=names)
        self.tables = self.tables and self.tables.on("force", factor)


def _parts(law: Law) -> _Parts:
    if law.inner is not None and law.shell is not None:
        parts = _parts(law.inner)
        parts.surround(law.shell)
        return parts
    if law.planned is not None:
        if law.preview:
            raise InputError("a law that knows its reference ahead has no coefficients; take the code")
        names, none = ["reference", *law.measures], np.zeros((1, 1 + len(law.measures)))
        silent = state_space(np.zeros((0, 0)), none[:0], none[:, :0], none, law.period, names, ["command"])
        return _Parts(silent, PlanTables.of(law.planned))
    if law.matrices is None:
        raise InputError("this law is no sum of filters with schedules: it has no coefficients but those in its code")
    return _Parts(law.matrices.view(law.measures, law.period))


def coefficients(law: Law) -> Coefficients:
    """Sections, schedules and map of a law, and its own answer to `SAMPLES` random samples, unlimited.

    Raises InputError for a law that is not of this form, and where the sections do not give the same within AGREE.
    """
    parts = _parts(law)
    channels = _linear_channels(parts.linear, law.measures)
    if parts.tables is not None:  # whose place in the linear law is empty
        channels = [channel for channel in channels if channel.sections[:, :3].any(axis=1).all()]
    channels += [
        SectionChannel(name, _sections(part, i), factor)
        for part, factor in parts.filters
        for i, name in enumerate(part.input_labels)
    ]
    leading = None if parts.leading is None else SectionChannel("reference", _sections(parts.leading, 0))
    planned = parts.tables and PlannedPart(parts.tables, leading)
    vector = _vector(law, parts)
    coefficients = Coefficients(law.period, tuple(channels), parts.command_map, parts.sine, vector, planned)
    worst, most = (np.abs(part).max() for part in (replay(coefficients) - vector["command"], vector["command"]))
    if not worst <= AGREE * most:
        raise InputError(
            f"second-order sections of this law are {worst / most:.1e} off: its poles are too close; take the code"
        )
    return coefficients


def replay(coefficients: Coefficients) -> np.ndarray:
    """The command [n] that sections, schedules, map and sine make of the vector's inputs."""
    from scipy.signal import sosfilt  # here, as it takes a second

    inputs = dict(coefficients.vector)
    inputs["error"] = inputs["reference"] - inputs[list(inputs)[1]]

    def part(channel: SectionChannel) -> np.ndarray:
        output = np.asarray(sosfilt(channel.sections, inputs[channel.signal]))
        return output if channel.scale is None else output * _interpolated(channel.scale, inputs["position"])

    command = np.sum([part(channel) for channel in coefficients.channels], axis=0)
    if (planned := coefficients.planned) is not None:
        led = inputs["reference"] if planned.leading is None else part(planned.leading)
        measured = np.column_stack([inputs[name] for name in planned.tables.measures])
        command = command + planned.tables.commands(led, measured)
    if coefficients.command_map is not None:
        command = command + _interpolated(coefficients.command_map.shift, command)
    sine = coefficients.sine
    if sine is None:
        return command
    turn = 2 * np.pi * sine.frequency * sine.period
    return command + sine.amplitude * np.sin(turn * np.arange(len(command)))


def _interpolated(table: PiecewiseLinear, x: np.ndarray) -> np.ndarray:
    return np.interp(x, table.at, table.values)


def _linear_channels(law: StateSpace, measures: tuple[str, ...]) -> list[SectionChannel]:
    """The channels of the linear part: from "error" where reference and controlled signal are one difference."""
    names = ["reference", *(name for name in measures if name in law.input_labels)]
    law = select(law, names, ["command"])
    b, d = law.B, law.D
    difference = np.allclose(b[:, 0], -b[:, 1], _SAME, 0) and np.allclose(d[:, 0], -d[:, 1], _SAME, 0)
    inputs = {"error": 0} if difference else {"reference": 0, names[1]: 1}
    inputs |= {name: i for i, name in enumerate(names) if i > 1}
    return [SectionChannel(name, _sections(law, i)) for name, i in inputs.items()]


def _vector(law: Law, parts: _Parts) -> dict[str, np.ndarray]:
    """Random inputs, from a standstill over all of the schedules where there are any, and the law's commands."""
    random, names = np.random.default_rng(0), ["reference", *law.measures]
    units = [SIGNALS[name].si for name in [names[1], *names[1:]]]
    vector = {name: SIZE[unit] * random.uniform(-1, 1, SAMPLES) for name, unit in zip(names, units, strict=True)}
    if parts.filters:
        path = _path([factor for _, factor in parts.filters])
        for name in ["position", "reference"] if names[1] == "position" else ["position"]:
            vector[name] = vector[name] + path
    if parts.tables is not None:  # and so far that the plan has work
        vector["reference"] = vector["reference"] + _FAR * parts.tables.reach * (np.arange(SAMPLES) >= SAMPLES // 4)
    rest = 0.0 if parts.command_map is None else parts.command_map.shift(0.0)
    x, offset = law.starts(np.zeros((1, len(names))), np.array([rest]))
    x, command = x[0], np.empty(SAMPLES)
    output, advance = BufferedFunction(law.graphs.output), BufferedFunction(law.graphs.advance)
    for k in range(SAMPLES):
        s = np.array([vector[name][k] for name in names])
        (command[k],) = output(x, s, offset, law.numbers)
        x = advance(x, s, command[k], offset, law.numbers).copy()
    return {**vector, "command": command}


def _path(schedules: list[PiecewiseLinear]) -> np.ndarray:
    """Positions [SAMPLES]: a standstill, then all that the schedules cover, but for what the random inputs add."""
    low = min(schedule.at[0] for schedule in schedules) + SIZE["m"]
    high = max(schedule.at[-1] for schedule in schedules) - SIZE["m"]
    corners = np.array([0, 0.25, 0.5, 1]) * SAMPLES
    return np.interp(np.arange(SAMPLES), corners, [0.0, 0.0, low, high])


def _sections(law: StateSpace, i: int) -> np.ndarray:
    """Sections [k, 6] from input i, c (z - a)^-1 b + d by its zeros and poles; a delay is a section of its own."""
    from scipy.signal import zpk2sos

    a, b, c, d = law.A, law.B[:, i], law.C[0], float(law.D[0, i])

    minimal = _reached(a, b) & _reached(a.T, c)
    a, b, c = a[minimal][:, minimal], b[minimal], c[minimal]
    first, state = [d], b
    for _ in range(len(a)):
        first.append(float(c @ state))
        state = a @ state
    late = int(np.argmax(np.abs(first) > _NONE * np.abs(first).max()))
    if not first[late]:
        return np.array([[0.0, 0, 0, 1, 0, 0]])
    zeros = _zeros(a, b, c, first[late], late)
    sections = zpk2sos(np.append(zeros, np.zeros(late)), np.linalg.eigvals(a), first[late])
    return np.vstack((sections, np.tile([0.0, 1, 0, 1, 0, 0], (late, 1))))


def _zeros(a: np.ndarray, b: np.ndarray, c: np.ndarray, gain: float, late: int) -> np.ndarray:
    """The zeros of a law whose first answer, `gain`, comes `late` samples after an input.

    They are the poles of the law that keeps the output at 0, b taking out what c a^late sees, but for `late` at 0.
    """
    ahead = c @ np.linalg.matrix_power(a, late)
    zeros = np.linalg.eigvals(a - np.outer(b, ahead) / gain)
    return zeros[np.argsort(np.abs(zeros))[late:]]


def _reached(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Which states an input gets to at all, by the pattern of a and b."""
    reached = b != 0
    for _ in range(len(a)):
        reached = reached | ((a != 0) @ reached)
    return reached
