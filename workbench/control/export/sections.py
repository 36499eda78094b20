"""What a rig's own digital controller needs of a law: second-order sections by input, schedules, and a test vector."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...base.signals import SIGNALS
from ...linear.interconnect import select
from ...linear.state_space import StateSpace
from ..dither import Sine
from ..piecewise_linear import CommandMap, PiecewiseLinear
from ..planned_core import PlannedCore
from ..protocol import Controller, NeedsOperatingPoint, scheduled_law
from ..scheduled_law import ScheduledLaw

SAMPLES = 200
AGREE = 1e-9  # of the largest command: how near the sections come to the controller
SIZE = {
    "m": 1e-3,
    "m/s": 0.1,
    "m/s^2": 1.0,
    "Pa": 1e5,
    "N": 1e3,
    "A": 1e-3,
    "1": 0.1,
}  # of inputs in the vector, by unit
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

    @property
    def at_rest(self) -> float:
        """What the sections of a stable filter make of a constant 1."""
        return float(np.prod(self.sections[:, :3].sum(axis=1) / self.sections[:, 3:].sum(axis=1)))


@dataclass(frozen=True)
class PlannedPart:
    """A predictive law, its command added to those of the channels; sections [k, 6] lead its reference, None: none."""

    core: PlannedCore
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
    sine: Sine | None
    vector: Mapping[str, np.ndarray]
    planned: PlannedPart | None = None

    @property
    def all_channels(self) -> list[SectionChannel]:
        """Those of the sum, then the one that leads a plan's reference."""
        leading = None if self.planned is None else self.planned.leading
        return [*self.channels, *([] if leading is None else [leading])]

    @property
    def signals(self) -> list[str]:
        """What the law reads: the reference, then the measured signals, the controlled one first."""
        return [name for name in self.vector if name != "command"]


def identifier(name: str) -> str:
    """A controller's name as C and Structured Text take it."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return plain if re.match(r"[A-Za-z]", plain) else f"law_{plain}"


def coefficients(controller: Controller, period: float) -> Coefficients:
    """Sections, schedules and map of a controller, and its own answer to `SAMPLES` random samples, unlimited.

    Raises InputError for a law that is not of this form, and where the sections do not give the same within AGREE.
    """
    try:
        law = scheduled_law(controller)
    except NeedsOperatingPoint:
        raise InputError(
            f"{type(controller).__name__} is no linear law with scheduled compensators; it cannot be exported"
        ) from None
    channels = _linear_channels(law.linear, controller.measures)
    if law.core is not None:  # whose place in the linear law is empty
        channels = [channel for channel in channels if channel.sections[:, :3].any(axis=1).all()]
    channels += [
        SectionChannel(name, _sections(part.filter, i), part.factor)
        for part in law.filters
        for i, name in enumerate(part.filter.input_labels)
    ]
    vector = _vector(controller, law)
    planned = law.core and PlannedPart(law.core, _leading(law.core))
    coefficients = Coefficients(period, tuple(channels), law.command_map, law.sine, vector, planned)
    worst, most = (np.abs(part).max() for part in (replay(coefficients) - vector["command"], vector["command"]))
    if not worst <= AGREE * most:
        raise InputError(
            f"second-order sections of this law are {worst / most:.1e} off: its poles are too close, or it has limits "
            "that its linear view has not; it cannot be exported"
        )
    return coefficients


def _leading(core: PlannedCore) -> SectionChannel | None:
    return None if core.leading is None else SectionChannel("reference", _sections(core.leading, 0))


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
        command = command + planned.core.commands(
            led, np.column_stack([inputs[name] for name in planned.core.measures])
        )
    if coefficients.command_map is not None:
        command = command + _interpolated(coefficients.command_map.shift, command)
    return command if coefficients.sine is None else command + coefficients.sine.samples(len(command))


def _interpolated(table: PiecewiseLinear, x: np.ndarray) -> np.ndarray:
    return np.interp(x, table.at, table.values)


def _linear_channels(law: StateSpace, measures: tuple[str, ...]) -> list[SectionChannel]:
    """Of the linear part: from "error" where reference and controlled signal are one difference."""
    names = ["reference", *(name for name in measures if name in law.input_labels)]
    law = select(law, names, ["command"])
    b, d = law.B, law.D
    difference = np.allclose(b[:, 0], -b[:, 1], _SAME, 0) and np.allclose(d[:, 0], -d[:, 1], _SAME, 0)
    inputs = {"error": 0} if difference else {"reference": 0, names[1]: 1}
    inputs |= {name: i for i, name in enumerate(names) if i > 1}
    return [SectionChannel(name, _sections(law, i)) for name, i in inputs.items()]


def _vector(controller: Controller, law: ScheduledLaw) -> dict[str, np.ndarray]:
    """Random inputs, from a standstill over all of the schedules where there are any, and the controller's commands."""
    random, names = np.random.default_rng(0), ["reference", *controller.measures]
    units = [SIGNALS[name].si for name in [names[1], *names[1:]]]
    vector = {name: SIZE[unit] * random.uniform(-1, 1, SAMPLES) for name, unit in zip(names, units, strict=True)}
    if law.filters:
        path = _path([part.factor for part in law.filters])
        for name in ["position", "reference"] if names[1] == "position" else ["position"]:
            vector[name] = vector[name] + path
    if law.core is not None:  # and so far that the plan has work
        vector["reference"] = vector["reference"] + _FAR * law.core.reach * (np.arange(SAMPLES) >= SAMPLES // 4)
    command_map = law.command_map
    controller.reset(0.0, dict.fromkeys(names[1:], 0.0), 0.0 if command_map is None else command_map.shift(0.0))
    command = np.empty(SAMPLES)
    for k in range(SAMPLES):
        measured = {name: float(vector[name][k]) for name in names[1:]}
        command[k] = controller.compute(float(vector["reference"][k]), measured)
        controller.update(float(command[k]))
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
