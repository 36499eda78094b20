"""A law in C99: its state, its start, a step once a period, and what the drive then did."""

from collections.abc import Mapping, Sequence
from textwrap import indent
from typing import ClassVar

import numpy as np

from ...engine.kernel import Kernel
from .kernel_text import KernelC
from .program import Program, identifier
from .statements import Expression, Language, Statements, assigned, statements, table_arrays

_HEAD = """\
/* {name}: command of a servo-hydraulic jack's controller, computed once every {period:g} ms. SI units.{left_out}
 *
 *     {name}_start(&state, command, {measured});      once: where the jack stands, and what the drive holds
 *     command = {name}_step(&state, {signals});       every period
 *     ... limit it, send it ...
 *     {name}_realised(&state, sent);                  every period: the command that the drive really got
 *
 * What the law does when its command is limited (anti-windup, observers) is in {name}_realised: leave no limit out.
 * Compile with -DCHECK_{upper} for a program that plays its test vector: status 0 means that commands at rest, moving,
 * saturated, slowed down, tripped and started anew are equal to 1e-9. */
"""
_HEADER = """\
#ifndef {upper}_H
#define {upper}_H

typedef struct {{
{fields}
}} {name}_state;

/* Without a bump from rest at these signals: with the reference there too, the next step gives this command. */
void {name}_start({name}_state *state, double command{measured_parameters});
/* The command of this sample, before any limit; signals in SI units.{preview} */
double {name}_step({name}_state *state{parameters});
/* The state after this sample, in which the drive got this command, -1..1. */
void {name}_realised({name}_state *state, double command);

#endif
"""
_BENT = """
/* The sum of bends, slope after slope, of what x is beyond each point: linear between the points. */
static double bent(const double *at, const double *bend, int points, double x)
{
    double y = 0.0;
    for (int k = 0; k < points && x > at[k]; k++)
        y += bend[k] * (x - at[k]);
    return y;
}
"""
_SIGN = """
static double sign(double x)
{
    return (x > 0.0) - (x < 0.0);
}
"""
_KERNEL = """
/* A filter of what is measured, a governor of the reference, and a plan that keeps the limits. Every loop is bounded:
 * by a size, or by {turns} turns of the search for the limits that hold the plan. */
static void {kernel}(const double *given, double *found)
{{
    enum {{ {sizes} }};
{variables}
{body}
}}
"""
_STEP = """
void {name}_start({name}_state *state, double command{measured_parameters})
{{
{start}
}}

double {name}_step({name}_state *state{parameters})
{{
{step}
}}

void {name}_realised({name}_state *state, double command)
{{
{realised}
}}
"""
_CHECK = """
#ifdef CHECK_{upper}
#include <stdio.h>

{vector}
int main(void)
{{
    double worst = 0.0, largest = 0.0;
    {name}_state state;
    for (int k = 0; k < {samples}; k++) {{
        if (vector_start[k] > 0.0)
            {name}_start(&state, vector_held[k]{started});
        worst = fmax(worst, fabs({name}_step(&state{inputs}) - vector_command[k]));
        largest = fmax(largest, fabs(vector_command[k]));
        {name}_realised(&state, vector_realised[k]);
    }}
    printf("{name}: %.1e of the largest command off\\n", worst / largest);
    return !(worst <= 1e-9 * largest);
}}
#endif
"""
_SAME = ("fmin", "fmax", "fabs", "sqrt", "exp", "log", "sin", "cos", "tan", "tanh", "atan2", "pow", "floor", "sign")


class C(Language):
    """C99."""

    compared: ClassVar[Mapping[str, str]] = {"lt": "<", "le": "<=", "eq": "==", "ne": "!="}
    joined: ClassVar[Mapping[str, str]] = {"and": "&&", "or": "||"}
    negated: ClassVar[str] = "!"

    def number(self, value: float) -> str:
        return repr(value)

    def call(self, op: str, arguments: Sequence[str]) -> str | None:
        return f"{op}({', '.join(arguments)})" if op in _SAME else None

    def chosen(self, condition: str, yes: str, no: str) -> Expression:
        return Expression(f"({condition} ? {yes} : {no})")

    def let(self, name: str, value: str) -> str:
        return f"const double {name} = {value};"

    def bent(self, name: str, table: str, points: int, x: str) -> list[str]:
        return [self.let(name, f"bent({table}_at, {table}_bend, {points}, {x})")]

    def called(self, kernel: str, given: Sequence[str]) -> list[str]:
        values = ",\n    ".join(", ".join(given[k : k + 4]) for k in range(0, len(given), 4))
        return [f"const double given[] = {{\n    {values},\n}};", f"{kernel}(given, state->found);"]

    def found(self, kernel: str, place: int) -> str:
        return f"state->found[{place}]"


def c_code(program: Program) -> dict[str, str]:
    """The text of NAME.h and NAME.c, by file name."""
    law, names, ahead = program.law, program.states, program.law.preview
    measured = list(law.measures)
    inside = [_field(name) for name in names], ["state->offset"], _signals("state->", ahead, measured), ["command"]
    given = *inside[:2], _signals("", ahead, measured), ["command"]
    language, tables = C(), {}
    start = statements(language, program.start, [measured, ["command"]], tables=tables)
    step = statements(language, program.sample, given, [0], tables=start.tables)
    after = statements(language, program.sample, inside, range(1, 1 + len(names)), True, step.tables)
    word = identifier(program.name)
    parameters = "".join(f", double {name}" for name in measured)
    reference = ", const double *reference" if ahead else ", double reference"
    kept = [f"for (int k = 0; k <= {ahead}; k++)\n    state->reference[k] = reference[k];"] if ahead else []
    kept += [f"state->{name} = {name};" for name in (measured if ahead else ["reference", *measured])]
    words = {
        "name": word,
        "upper": word.upper(),
        "period": law.period * 1e3,
        "left_out": f"\n * Without {program.left_out}." if program.left_out else "",
        "measured": ", ".join(measured),
        "signals": ", ".join(program.signals),
        "measured_parameters": parameters,
        "parameters": reference + parameters,
        "preview": f" reference[0] is the one now,\n * reference[k] that k periods ahead, up to {ahead}."
        if ahead
        else "",
        "fields": "\n".join(f"    {line}" for line in _fields(program)),
        "start": _body([*_used(measured, start), *start.lines], [*map(_field, names), "state->offset"], start.results),
        "step": indent("\n".join([*kept, *step.lines, f"return {step.results[0]};"]), "    "),
        "realised": _body(
            [*_used(["command"], after), *([] if names else ["(void)state;"]), *after.lines], inside[0], after.results
        ),
        **_of_vector(program),
    }
    parts = [_HEAD.format(**words), f'#include <math.h>\n#include "{word}.h"\n']
    parts += [f"\n{c_array(name, values)}" for name, values in table_arrays(after.tables).items()]
    text = words["start"] + words["step"] + words["realised"]
    parts += [_BENT] if after.tables else []
    parts += [_SIGN] if " sign(" in text or "(sign(" in text else []
    parts += [_kernel(name, program.kernel) for name in step.kernels if program.kernel is not None]
    parts += [_STEP.format(**words), _CHECK.format(**words)]
    return {f"{word}.h": _HEAD.format(**words) + _HEADER.format(**words), f"{word}.c": "".join(parts)}


def _field(name: str) -> str:
    return f"state->{name}"


def _signals(before: str, ahead: int, measured: Sequence[str]) -> list[str]:
    references = [f"{before}reference[{k}]" for k in range(1 + ahead)] if ahead else [f"{before}reference"]
    return [*references, *(before + name for name in measured)]


def _fields(program: Program) -> list[str]:
    law, ahead = program.law, program.law.preview
    names = program.states
    lines = [f"double {', '.join(names[k : k + 6])};" for k in range(0, len(names), 6)]
    lines += ["double offset; /* of the command, found at the start */"]
    references = [f"reference[{1 + ahead}]"] if ahead else ["reference"]
    lines += [f"double {', '.join((*references, *law.measures))}; /* of this sample */"]
    return lines + (
        [] if program.kernel is None else [f"double found[{program.kernel.shape.found}]; /* by the plan */"]
    )


def _used(names: Sequence[str], of: Statements) -> list[str]:
    """What keeps a compiler from complaining of parameters that nothing needs."""
    text = " ".join((*of.lines, *of.results))
    words = set(text.replace("(", " ").replace(")", " ").replace(",", " ").replace(";", " ").split())
    return [f"(void){name};" for name in names if name not in words and f"-{name}" not in words]


def _body(lines: Sequence[str], targets: Sequence[str], results: Sequence[str]) -> str:
    """Statements, then the targets set to the results, each before anything that it needs is overwritten."""
    return indent("\n".join([*lines, *assigned(targets, results, "const double {} = {};", "{} = {};")]), "    ")


def _of_vector(program: Program) -> dict[str, object]:
    vector, ahead = program.vector, program.law.preview
    arrays = {"start": vector.start, "held": vector.held, "command": vector.command, "realised": vector.realised}
    arrays |= {name: vector.signals[name] for name in program.law.measures}
    count = len(vector.command)
    asked = vector.signals["reference"]
    arrays["reference"] = np.append(asked[:, 0], asked[-1, 1:])  # each sample looks ahead from its own place
    inputs = [f"{'&' if ahead else ''}vector_reference[k]", *(f"vector_{name}[k]" for name in program.law.measures)]
    return {
        "samples": count,
        "vector": "\n".join(c_array(f"vector_{name}", values) for name, values in arrays.items()),
        "inputs": "".join(f", {name}" for name in inputs),
        "started": "".join(f", vector_{name}[k]" for name in program.law.measures),
    }


def _kernel(name: str, kernel: Kernel) -> str:
    text, shape = KernelC(kernel.shape), kernel.shape
    tables = "".join(f"\n{c_array(table, kernel.table(table))}" for table, _ in shape.tables)
    return tables + _KERNEL.format(
        kernel=name,
        turns=int(kernel.table("TURNS")[0]),
        sizes=", ".join(f"{word} = {value}" for word, value in shape.constants if isinstance(value, int)),
        variables=indent("\n".join(text.declared), "    "),
        body=text.block(shape.tree.body),
    )


def c_array(name: str, values: np.ndarray) -> str:
    """A table of numbers, every bit of them."""
    words = [repr(float(value)) for value in values]
    rows = [", ".join(words[k : k + 4]) for k in range(0, len(words), 4)]
    return f"static const double {name}[] = {{\n    " + ",\n    ".join(rows) + ",\n};\n"
