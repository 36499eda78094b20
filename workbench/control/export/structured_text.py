"""A law in Structured Text of IEC 61131-3: a function block called once a period, and a program that checks it."""

from collections.abc import Iterable
from textwrap import indent

import numpy as np

from .kernel_text import KernelSt
from .sections import Coefficients, PlannedPart, SectionChannel, identifier

_BLOCK = """\
(* {name}: command of a servo-hydraulic jack's controller, to be called every {period:g} ms. SI units.
   restart = TRUE: from rest at 0. start = TRUE: without a bump from rest at these signals; where the setpoint is there
   too, the command is `held`. *)
FUNCTION_BLOCK {name}
VAR_INPUT
    restart : BOOL;
    start : BOOL;
    held : LREAL; (* -1..1 *)
{inputs}
END_VAR
VAR_OUTPUT
    command : LREAL; (* -1..1 *)
END_VAR
VAR
    z : ARRAY[0..{last}, 0..1] OF LREAL;
    k : INT;
    x : LREAL;
    y : LREAL;
    part : LREAL;
{kept}
    offset : LREAL;
{planned_kept}{sine_kept}END_VAR
VAR CONSTANT
    sections : ARRAY[0..{last}, 0..4] OF LREAL := [
        {sections}
    ]; (* second-order sections, rows of b0 b1 b2 a1 a2 *)
{tables}END_VAR
IF restart OR start THEN
    FOR k := 0 TO {last} DO
        z[k, 0] := 0.0;
        z[k, 1] := 0.0;
    END_FOR;
{zeroed}
    offset := 0.0;
{planned_rest}{sine_rest}END_IF;
IF start THEN
{started}
END_IF;
command := offset;
{body}
END_FUNCTION_BLOCK
"""
_FILTER = """\
x := {signal};
FOR k := {first} TO {last} DO
    y := sections[k, 0] * x + z[k, 0];
    z[k, 0] := sections[k, 1] * x - sections[k, 3] * y + z[k, 1];
    z[k, 1] := sections[k, 2] * x - sections[k, 4] * y;
    x := y;
END_FOR;
part := x;"""
_INTERPOLATE = """\
IF {x} <= {at}[0] THEN
    y := {to}[0];
ELSIF {x} >= {at}[{last}] THEN
    y := {to}[{last}];
ELSE
    k := 0;
    WHILE {x} > {at}[k + 1] DO
        k := k + 1;
    END_WHILE;
    y := {to}[k] + ({to}[k + 1] - {to}[k]) * ({x} - {at}[k]) / ({at}[k + 1] - {at}[k]);
END_IF;"""
_PLANNED_REST = """\
    FOR k := 0 TO {last} DO
        plan_x[k] := 0.0;
    END_FOR;
    plan_asked := 0.0;
    plan_sent := 0.0;
"""
_PLANNED_START = """\
plan_asked := {still} * setpoint0;
plan_sent := offset;
x := MIN(MAX(plan_asked, -{stroke}), {stroke});
FOR k := 0 TO {last} DO
    plan_x[k] := {started};
END_FOR;
offset := 0.0;"""
_CHECK = """
(* One sample of the test vector a cycle; done and passed say how it ended. *)
PROGRAM {name}_check
VAR
    law : {name};
    sample : INT;
    worst : LREAL;
    largest : LREAL;
    done : BOOL;
    passed : BOOL;
END_VAR
VAR CONSTANT
{vector}END_VAR
IF sample < {samples} THEN
    law(restart := sample = 0, {arguments});
    worst := MAX(worst, ABS(law.command - vector_command[sample]));
    largest := MAX(largest, ABS(vector_command[sample]));
    sample := sample + 1;
ELSE
    done := TRUE;
    passed := worst <= 1.0E-9 * largest;
END_IF;
END_PROGRAM
"""


def structured_text(name: str, law: Coefficients) -> dict[str, str]:
    """The text of NAME.st, by file name."""
    name = identifier(name)
    rows = [_numbers(row[[0, 1, 2, 4, 5]]) for channel in law.all_channels for row in channel.sections]
    rows = rows or [_numbers(np.array([1.0, 0, 0, 0, 0]))]
    signals = law.signals
    block = _BLOCK.format(
        name=name,
        period=law.period * 1e3,
        inputs="\n".join(f"    {_word(signal)} : LREAL;" for signal in signals),
        kept="\n".join(f"    {_word(signal)}0 : LREAL;" for signal in signals),
        zeroed="\n".join(f"    {_word(signal)}0 := 0.0;" for signal in signals),
        started=indent("\n".join(_start(law)), "    "),
        last=len(rows) - 1,
        sections=",\n        ".join(rows),
        tables="".join(_tables(law)) + ("" if law.planned is None else "".join(_planned_tables(law.planned))),
        planned_kept="" if law.planned is None else "".join(f"    {line}\n" for line in _planned_kept(law.planned)),
        planned_rest="" if law.planned is None else _PLANNED_REST.format(last=len(law.planned.core.entering) - 1),
        body="\n".join(_body(law)),
        sine_kept="" if law.sine is None else "    sine : LREAL; (* of the dither *)\n    cosine : LREAL;\n",
        sine_rest="" if law.sine is None else f"    sine := 0.0;\n    cosine := {_real(law.sine.amplitude)};\n",
    )
    check = _CHECK.format(
        name=name,
        samples=len(law.vector["command"]),
        arguments=", ".join(f"{_word(signal)} := vector_{signal}[sample]" for signal in signals),
        vector="".join(_array(f"vector_{signal}", law.vector[signal]) for signal in (*signals, "command")),
    )
    return {f"{name}.st": block + check}


def _start(law: Coefficients) -> Iterable[str]:
    """The signals where the law starts, and the offset that makes up the command there."""
    controlled = _word(law.signals[1])
    yield f"{_word('reference')}0 := {controlled};"
    yield from (f"{signal}0 := {signal};" for signal in map(_word, law.signals[1:]))
    yield "offset := held;"
    if law.command_map is not None:
        yield _mapped("offset", "map_to", "map_points", law.command_map.to)
    for i, channel in enumerate(law.channels):
        if channel.scale is not None:
            yield _interpolate("position", f"scale{i}_points", f"scale{i}_factor", channel.scale.at)
            yield f"offset := offset - {_still(channel)} * y;"
    if law.planned is not None:
        yield _PLANNED_START.format(**_planned_words(law.planned))


def _body(law: Coefficients) -> Iterable[str]:
    first = 0
    for i, channel in enumerate(law.channels):
        error = f"{_off('reference')} - ({_off(law.signals[1])})"
        signal = error if channel.signal == "error" else _off(channel.signal)
        yield _FILTER.format(signal=signal, first=first, last=first + len(channel.sections) - 1)
        if channel.scale is not None:
            yield _interpolate("position", f"scale{i}_points", f"scale{i}_factor", channel.scale.at)
            yield f"part := (part + {_still(channel)}) * y;"
        yield "command := command + part;"
        first += len(channel.sections)
    if law.planned is not None:
        yield from _planned_step(law.planned, first)
    if law.command_map is not None:
        yield _mapped("command", "map_points", "map_to", law.command_map.at)
    if law.sine is not None:
        (c, s), _ = law.sine.turn.tolist()
        yield "command := command + sine;\nx := sine;"
        yield f"sine := {_real(c)} * x + {_real(s)} * cosine;\ncosine := {_real(c)} * cosine - {_real(s)} * x;"


def _planned_words(part: PlannedPart) -> dict[str, str | int]:
    """Of the start: the reference as it is led there, and what is measured."""
    still = 1.0 if part.leading is None else part.leading.at_rest
    core = part.core
    at = [f"{_word(signal)}" for signal in core.measures]
    columns = core.starting.shape[1]
    terms = [f"plan_starting[k, {i}] * {signal}" for i, signal in enumerate(at)]
    terms += [f"plan_starting[k, {columns - 2}] * x", f"plan_starting[k, {columns - 1}] * offset"]
    stroke, last = _real(core.stroke), len(core.entering) - 1
    return {"still": _real(still), "stroke": stroke, "last": last, "started": "\n            + ".join(terms)}


def _planned_step(part: PlannedPart, first: int) -> Iterable[str]:
    """The plan at a sample, and what it takes the drive to have done."""
    core = part.core
    last, shape = len(core.entering) - 1, core.kernel.shape
    if part.leading is None:
        yield "part := setpoint;"
    else:
        yield _FILTER.format(signal=_off("reference"), first=first, last=first + len(part.leading.sections) - 1)
        yield f"part := part + {_real(part.leading.at_rest)} * setpoint0;"
    yield f"FOR k := 0 TO {last} DO\n    k_given[k] := plan_x[k];\nEND_FOR;"
    given = ["plan_asked", "plan_sent", *map(_word, core.measures), "part"]
    yield from (f"k_given[{last + 1 + i}] := {value};" for i, value in enumerate(given))
    yield from KernelSt(shape).lines(shape.tree.body)
    yield f"FOR k := 0 TO {last} DO\n    plan_x[k] := k_found[3 + k] + plan_entering[k] * k_found[0];\nEND_FOR;"
    yield "plan_asked := k_found[2];\nplan_sent := k_found[0];\ncommand := command + plan_sent;"


def _planned_kept(part: PlannedPart) -> Iterable[str]:
    yield f"plan_x : ARRAY[0..{len(part.core.entering) - 1}] OF LREAL;"
    yield from ("plan_asked : LREAL;", "plan_sent : LREAL;")
    yield from KernelSt(part.core.kernel.shape).declared


def _planned_tables(part: PlannedPart) -> Iterable[str]:
    core = part.core
    rows, columns = core.starting.shape
    starting = ",\n        ".join(_numbers(row) for row in core.starting)
    yield f"    plan_starting : ARRAY[0..{rows - 1}, 0..{columns - 1}] OF LREAL := [\n        {starting}\n    ];\n"
    yield _array("plan_entering", core.entering)
    yield from (_array(f"table_{name.lower()}", core.kernel.table(name)) for name, _ in core.kernel.shape.tables)


def _off(signal: str) -> str:
    return f"{_word(signal)} - {_word(signal)}0"


def _still(channel: SectionChannel) -> str:
    """What a channel's sections would give at the start's signal for ever."""
    return f"{_real(channel.at_rest)} * {_word(channel.signal)}0"


def _mapped(x: str, at: str, to: str, points: np.ndarray) -> str:
    inside = indent(f"{_interpolate(x, at, to, points)}\n{x} := y;", "    ")
    return f"IF {x} >= {at}[0] AND {x} <= {at}[{len(points) - 1}] THEN\n{inside}\nEND_IF;"


def _word(signal: str) -> str:
    """A signal's name; REFERENCE is a word of the language."""
    return {"reference": "setpoint"}.get(signal, signal)


def _interpolate(x: str, at: str, to: str, points: np.ndarray) -> str:
    return _INTERPOLATE.format(x=x, at=at, to=to, last=len(points) - 1)


def _tables(law: Coefficients) -> Iterable[str]:
    for i, channel in enumerate(law.channels):
        if channel.scale is not None:
            yield _array(f"scale{i}_points", channel.scale.at)
            yield _array(f"scale{i}_factor", channel.scale.values)
    if law.command_map is not None:
        yield _array("map_points", law.command_map.at)
        yield _array("map_to", law.command_map.to)


def _array(name: str, values: np.ndarray) -> str:
    rows = [_numbers(values[k : k + 4]) for k in range(0, len(values), 4)]
    return f"    {name} : ARRAY[0..{len(values) - 1}] OF LREAL := [\n        " + ",\n        ".join(rows) + "\n    ];\n"


def _numbers(values: np.ndarray) -> str:
    """Every bit of them, as IEC 61131-3 writes real numbers: with a point before the exponent."""
    return ", ".join(_real(float(value)) for value in values)


def _real(value: float) -> str:
    digits, e, exponent = repr(value + 0.0).partition("e")  # no -0.0
    return f"{digits}{'' if '.' in digits else '.0'}{e.upper()}{exponent}"
