"""A law's coefficients as JSON, and as text for people; linear models as .mat files of version 5, which MATLAB and
scipy read.
"""

from collections.abc import Iterable
from io import BytesIO
from typing import Any

import numpy as np

from ...linear.state_space import StateSpace
from .program import Program
from .sections import SAMPLES, Coefficients, PlannedPart, SectionChannel


def as_json(program: Program, sections: Coefficients | str) -> dict[str, Any]:
    """All of it for JSON; a section is [b0, b1, b2, 1, a1, a2]. Scale, map, dither, plan are there where it has any.

    `sections`: or why there are none. The samples under "code" are those that check C and Structured Text.
    """
    own = {"without_sections": sections} if isinstance(sections, str) else _sections_json(sections)
    vector = program.vector
    asked = vector.signals["reference"]
    code = {"start": vector.start, "held": vector.held, **vector.signals}
    code |= {"reference": asked if program.law.preview else asked[:, 0]}
    code |= {"command": vector.command, "realised": vector.realised}
    left = {"left_out": program.left_out} if program.left_out else {}
    return {"period_s": program.law.period, **own, **left, "code": {name: part.tolist() for name, part in code.items()}}


def _sections_json(coefficients: Coefficients) -> dict[str, Any]:
    command_map = coefficients.command_map
    mapped = {"command_map": {"at": command_map.at.tolist(), "to": command_map.to.tolist()}} if command_map else {}
    planned = {} if coefficients.planned is None else {"plan": _plan_json(coefficients.planned)}
    sine = coefficients.sine
    dithered = {"dither": {"amplitude": sine.amplitude, "frequency_hz": sine.frequency}} if sine else {}
    return {
        "channels": [_channel_json(channel) for channel in coefficients.channels],
        **mapped,
        **dithered,
        **planned,
        "vector": {name: values.tolist() for name, values in coefficients.vector.items()},
    }


def _plan_json(planned: PlannedPart) -> dict[str, Any]:
    """Its sizes and tables by their names in the code, row after row, how it starts, and what leads its reference."""
    tables, shape = planned.tables, planned.tables.kernel.shape
    leading = {} if planned.leading is None else {"leading": _channel_json(planned.leading)}
    return {
        "measures": list(tables.measures),
        "sizes": dict(shape.constants),
        "tables": {name: tables.kernel.table(name).tolist() for name, _ in shape.tables},
        "starting": tables.starting.tolist(),
        "entering": tables.entering.tolist(),
        "stroke": tables.stroke,
        **leading,
    }


def _channel_json(channel: SectionChannel) -> dict[str, Any]:
    numbers = {"signal": channel.signal, "sections": channel.sections.tolist()}
    if channel.scale is None:
        return numbers
    at, factor = channel.scale.at.tolist(), channel.scale.values.tolist()
    return {**numbers, "scale": {"signal": "position", "at": at, "factor": factor}}


def as_text(program: Program, coefficients: Coefficients | str) -> str:
    """The sections for people, every digit of them, schedules, map, and the first samples of the vector; or why there
    are none."""
    name = program.name
    if isinstance(coefficients, str):
        return f"{name}: {coefficients}; --out leaves it"
    command_map = coefficients.command_map
    total = "sum of the channels" if command_map is None else "sum of the channels, mapped"
    lines = [
        f"{name}: command = {total}, every {coefficients.period * 1e3:g} ms; SI; where the drive does what is demanded"
    ]
    for channel in coefficients.channels:
        lines.append(f"  {channel.signal}: {len(channel.sections)} sections in series: b0 b1 b2, a1 a2 (a0 = 1)")
        lines += ["    " + _digits([*row[:3], *row[4:]]) for row in channel.sections]
        if channel.scale is not None:
            lines.append("    its output times a factor over the measured position [m], linear between the points:")
            lines += _table(channel.scale.at, channel.scale.values)
    if command_map is not None:
        lines.append("  the sum goes through a map, linear between the points, unchanged beyond:")
        lines += _table(command_map.at, command_map.to)
    if coefficients.planned is not None:
        sizes = dict(coefficients.planned.tables.kernel.shape.constants)
        lines.append(
            f"  in the sum a plan of {', '.join(coefficients.planned.tables.measures)}: a filter of {sizes['STATES']} "
            f"states, a governor of the reference, {sizes['CHANGES']} changes; its tables are in --json and in the code"
        )
    if coefficients.sine is not None:
        sine = coefficients.sine
        lines.append(f"  on top a dither of {sine.amplitude:.9g} sin(2 pi {sine.frequency:.9g} Hz t), from 0")
    lines.append(f"  test vector, the first of {SAMPLES} samples (--json has all)")
    lines += [
        f"    {key}: " + " ".join(f"{value:.9g}" for value in values[:4]) for key, values in coefficients.vector.items()
    ]
    return "\n".join(lines)


def _table(at: np.ndarray, to: np.ndarray) -> list[str]:
    return ["      " + _digits(pair) for pair in zip(at, to, strict=True)]


def _digits(values: Iterable[float]) -> str:
    return " ".join(f"{value: .17g}" for value in values)


def mat_file(model: StateSpace) -> bytes:
    """A, B, C, D, Ts (0: continuous), InputName and OutputName (cells of text).

    In MATLAB: m = load(FILE); ss(m.A, m.B, m.C, m.D, m.Ts, 'InputName', m.InputName, 'OutputName', m.OutputName).
    In Python: m = scipy.io.loadmat(FILE); control.ss(m["A"], m["B"], m["C"], m["D"], m["Ts"].item()).
    """
    from scipy.io import savemat

    target = BytesIO()
    names = {"InputName": model.input_labels, "OutputName": model.output_labels}
    cells = {key: np.array([[label] for label in labels], dtype=object) for key, labels in names.items()}
    matrices = dict(zip("ABCD", model.matrices, strict=True))
    savemat(target, {**matrices, "Ts": float(model.dt), **cells})
    return target.getvalue()
