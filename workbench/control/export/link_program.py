"""A program in C99 that runs exported laws at the link: link_main.c, which is the same for all, and a table of them."""

from collections.abc import Sequence
from importlib.resources import files
from typing import Any

from .program import Program, identifier

_TABLE = """\
/* The exported laws by name, as link_main.c runs them: one at a time, measured signals y in the order of `signal`. */
{includes}

enum {{ MOST_SIGNALS = {most}, FURTHEST = {furthest} }};

struct law {{
    const char *name;
    double period; /* s */
    int signals;
    const char *signal[MOST_SIGNALS]; /* the controlled one first */
    double fastest; /* change of the command in a period that the rig's drive does */
    int ahead; /* references that are known ahead */
    void (*start)(double command, const double *y);
    double (*step)(const double *reference, const double *y);
    void (*realised)(double command);
}};

{functions}
static const struct law laws[] = {{
{rows}
}};
"""
_FUNCTIONS = """\
static {name}_state state_of_{name};

static void start_{name}(double command, const double *y)
{{
    {name}_start(&state_of_{name}, command, {inputs});
}}

static double step_{name}(const double *reference, const double *y)
{{
    return {name}_step(&state_of_{name}, {reference}, {inputs});
}}

static void realised_{name}(double command)
{{
    {name}_realised(&state_of_{name}, command);
}}
"""
_ROW = """\
    {{"{name}", {period!r}, {count}, {{{signals}}}, {fastest!r}, {ahead},
     start_{name}, step_{name}, realised_{name}}},"""


def link_program(programs: Sequence[Program], command_rate: float) -> dict[str, str]:
    """The text of link_main.c and link_laws.h, by file name, for laws whose C stands beside them.

    The rig's command changes by `command_rate` [1/s] at most."""
    words = [_words(program, command_rate) for program in programs]
    table = _TABLE.format(
        includes="\n".join(f'#include "{each["name"]}.h"' for each in words),
        most=max(each["count"] for each in words),
        furthest=max(each["ahead"] for each in words),
        functions="\n".join(_FUNCTIONS.format(**each) for each in words),
        rows="\n".join(_ROW.format(**each) for each in words),
    )
    main = files("workbench") / "control" / "export" / "link_main.c"
    return {"link_main.c": main.read_text("utf-8"), "link_laws.h": table}


def _words(program: Program, command_rate: float) -> dict[str, Any]:
    law, measured = program.law, program.law.measures
    return {
        "name": identifier(program.name),
        "period": law.period,
        "count": len(measured),
        "signals": ", ".join(f'"{signal}"' for signal in measured),
        "inputs": ", ".join(f"y[{i}]" for i in range(len(measured))),
        "reference": "reference" if law.preview else "reference[0]",
        "fastest": command_rate * law.period,
        "ahead": law.preview,
    }
