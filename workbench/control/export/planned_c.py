"""A predictive law in C99: its tables, its kernel, how it starts, and a sample of it."""

from collections.abc import Mapping
from textwrap import indent
from typing import Any

import numpy as np

from .kernel_text import KernelC
from .sections import PlannedPart

_PLANNED = """
{tables}
static const double starting[{states}][{columns}] = {{
    {starting},
}};
{entering}
/* A filter of what is measured, a governor of the reference, and a plan that keeps the limits. Every loop is bounded:
 * by a size, or by {turns} turns of the search for the limits that hold the plan. */
static void planned(const double *given, double *found)
{{
    enum {{ {sizes} }};
{variables}
{body}
}}

/* The reference as the plan has it. */
static double led({name}_state *state, double reference)
{{
    {unused}return {led};
}}

/* At rest at these signals, the command of the plan being `command`. */
static void planned_start({name}_state *state, double command{arguments})
{{
    const double led0 = led(state, reference);
    const double at[{columns}] = {{{given}, fmin(fmax(led0, -{stroke!r}), {stroke!r}), command}};
    for (int i = 0; i < {states}; i++) {{
        state->x[i] = 0.0;
        for (int k = 0; k < {columns}; k++)
            state->x[i] += starting[i][k] * at[k];
    }}
    state->asked = led0;
    state->sent = command;
}}

/* The command of the plan, which the drive is taken to do. */
static double planned_step({name}_state *state{arguments})
{{
    double given[{told}] = {{0.0}}, found[{found}];
    const double at[] = {{state->asked, state->sent, {given}, led(state, reference)}};
    for (int i = 0; i < {states}; i++)
        given[i] = state->x[i];
    for (int i = {states}; i < {told}; i++)
        given[i] = at[i - {states}];
    planned(given, found);
    for (int i = 0; i < {states}; i++)
        state->x[i] = found[3 + i] + entering[i] * found[0];
    state->asked = found[2];
    state->sent = found[0];
    return found[0];
}}
"""


def planned_c(part: PlannedPart, words: Mapping[str, Any]) -> str:
    """The plan's numbers and functions."""
    core, name = part.core, words["name"]
    kernel, shape = core.kernel, core.kernel.shape
    text, first = KernelC(shape), words["sections"]
    led = "reference"
    if part.leading is not None:
        count = len(part.leading.sections)
        first = words["sections"] - count
        filtered = f"filtered(&sections[{first}], &state->z[{first}], {count}, reference - state->reference0)"
        led = f"{filtered}\n        + {part.leading.at_rest!r} * state->reference0"
    return _PLANNED.format(
        name=name,
        arguments=words["arguments"],
        given=", ".join(core.measures),
        states=len(core.entering),
        columns=core.starting.shape[1],
        told=shape.given,
        found=shape.found,
        stroke=core.stroke,
        led=led,
        unused="(void)state;\n    " if part.leading is None else "",
        turns=int(kernel.table("TURNS")[0]),
        tables="".join(c_array(name, kernel.table(name)) for name, _ in shape.tables),
        starting=",\n    ".join("{" + c_numbers(row) + "}" for row in core.starting),
        entering=c_array("entering", core.entering),
        sizes=", ".join(f"{word} = {value}" for word, value in shape.constants if isinstance(value, int)),
        variables=indent("\n".join(text.declared), "    "),
        body=text.block(shape.tree.body),
    )


def c_array(name: str, values: np.ndarray) -> str:
    """A table of numbers."""
    rows = [c_numbers(values[k : k + 4]) for k in range(0, len(values), 4)]
    return f"static const double {name}[] = {{\n    " + ",\n    ".join(rows) + ",\n};\n"


def c_numbers(values: np.ndarray) -> str:
    """Every bit of them, as C has numbers with a point."""
    return ", ".join(repr(float(value)) for value in values)
