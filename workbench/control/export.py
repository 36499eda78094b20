"""What a rig's own digital controller needs of a linear law: second-order sections by input, and a test vector."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.errors import InputError
from ..base.signals import SIGNALS
from .protocol import Controller, linear_view

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
_SAME = 1e-9  # of a coefficient: two inputs that are one difference
_NONE = 1e-14  # of the largest of a law's first answers: less is rounding


@dataclass(frozen=True)
class SectionChannel:
    """Sections [k, 6], as scipy.signal has them, from a signal (SI) or from "error" to a part of the command [1]."""

    signal: str
    sections: np.ndarray


@dataclass(frozen=True)
class Coefficients:
    """command = sum over the channels, from rest, every `period` [s]; `vector`: inputs [n] and the command to expect.

    "error" is the reference less the controlled signal, which is the first after the reference in `vector`.
    """

    period: float
    channels: tuple[SectionChannel, ...]
    vector: Mapping[str, np.ndarray]


def coefficients(controller: Controller, period: float) -> Coefficients:
    """The sections of a controller's linear view, and its own answer to `SAMPLES` random samples, unlimited.

    Raises InputError where the sections do not give the same within AGREE.
    """
    law = linear_view(controller)
    names, (a, b, c, d) = law.input_labels, law.matrices
    difference = np.allclose(b[:, 0], -b[:, 1], _SAME, 0) and np.allclose(d[:, 0], -d[:, 1], _SAME, 0)
    taken = {"error": 0} if difference else {"reference": 0, names[1]: 1}
    taken |= {name: i for i, name in enumerate(names) if i > 1}
    channels = tuple(SectionChannel(name, _sections(a, b[:, i], c[0], d[0, i])) for name, i in taken.items())
    coefficients = Coefficients(period, channels, _vector(controller, names))
    worst, most = (
        np.abs(part).max()
        for part in (replay(coefficients) - coefficients.vector["command"], coefficients.vector["command"])
    )
    if not worst <= AGREE * most:
        raise InputError(f"second-order sections of this law are {worst / most:.1e} off: its poles are too close")
    return coefficients


def replay(coefficients: Coefficients) -> np.ndarray:
    """The command [n] that the sections make of the vector's inputs."""
    from scipy.signal import sosfilt  # here, as it takes a second

    inputs = dict(coefficients.vector)
    inputs["error"] = inputs["reference"] - inputs[list(inputs)[1]]
    return np.sum([sosfilt(channel.sections, inputs[channel.signal]) for channel in coefficients.channels], axis=0)


def _vector(controller: Controller, names: list[str]) -> dict[str, np.ndarray]:
    random = np.random.default_rng(0)
    units = [SIGNALS[name].si for name in [names[1], *names[1:]]]
    vector = {name: SIZE[unit] * random.uniform(-1, 1, SAMPLES) for name, unit in zip(names, units, strict=True)}
    controller.reset(0.0, dict.fromkeys(names[1:], 0.0), 0.0)
    command = np.empty(SAMPLES)
    for k in range(SAMPLES):
        measured = {name: float(vector[name][k]) for name in names[1:]}
        command[k] = controller.compute(float(vector["reference"][k]), measured)
        controller.update(float(command[k]))
    return {**vector, "command": command}


def _sections(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: float) -> np.ndarray:
    """Sections [k, 6] of c (z - a)^-1 b + d by its zeros and poles; a delay is a section of its own."""
    from scipy.signal import zpk2sos

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


def as_json(coefficients: Coefficients) -> dict[str, Any]:
    """All of it for JSON; a section is [b0, b1, b2, 1, a1, a2]."""
    return {
        "period_s": coefficients.period,
        "channels": [{"signal": part.signal, "sections": part.sections.tolist()} for part in coefficients.channels],
        "vector": {name: values.tolist() for name, values in coefficients.vector.items()},
    }


def as_text(name: str, coefficients: Coefficients) -> str:
    """The sections for people, every digit of them, and the first samples of the vector."""
    lines = [f"{name}: command = sum of the channels, every {coefficients.period * 1e3:g} ms; SI"]
    for channel in coefficients.channels:
        lines.append(f"  {channel.signal}: {len(channel.sections)} sections in series: b0 b1 b2, a1 a2 (a0 = 1)")
        lines += ["    " + " ".join(f"{value: .17g}" for value in (*row[:3], *row[4:])) for row in channel.sections]
    lines.append(f"  test vector, the first of {SAMPLES} samples (--json has all)")
    lines += [
        f"    {key}: " + " ".join(f"{value:.9g}" for value in values[:4]) for key, values in coefficients.vector.items()
    ]
    return "\n".join(lines)
