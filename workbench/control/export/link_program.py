"""A program in C99 that runs exported laws at the link: link_main.c, which is the same for all, and a table of them."""

from collections.abc import Mapping
from importlib.resources import files

from .sections import Coefficients, identifier

_TABLE = """\
/* The exported laws by name, as link_main.c runs them: one at a time, measured signals y in the order of `signal`. */
{includes}

enum {{ MOST_SIGNALS = {most} }};

struct law {{
    const char *name;
    double period; /* s */
    int signals;
    const char *signal[MOST_SIGNALS]; /* the controlled one first */
    void (*start)(double command, const double *y);
    double (*step)(double reference, const double *y);
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

static double step_{name}(double reference, const double *y)
{{
    return {name}_step(&state_of_{name}, reference, {inputs});
}}
"""
_ROW = '    {{"{name}", {period!r}, {count}, {{{signals}}}, start_{name}, step_{name}}},'


def link_program(laws: Mapping[str, Coefficients]) -> dict[str, str]:
    """The text of link_main.c and link_laws.h, by file name, for laws by name whose C stands beside them."""
    words = [_words(identifier(name), law) for name, law in laws.items()]
    table = _TABLE.format(
        includes="\n".join(f'#include "{each["name"]}.h"' for each in words),
        most=max(each["count"] for each in words),
        functions="\n".join(_FUNCTIONS.format(**each) for each in words),
        rows="\n".join(_ROW.format(**each) for each in words),
    )
    main = files("workbench") / "control" / "export" / "link_main.c"
    return {"link_main.c": main.read_text("utf-8"), "link_laws.h": table}


def _words(name: str, law: Coefficients) -> dict[str, str | int | float]:
    measured = law.signals[1:]
    return {
        "name": name,
        "period": law.period,
        "count": len(measured),
        "signals": ", ".join(f'"{signal}"' for signal in measured),
        "inputs": ", ".join(f"y[{i}]" for i in range(len(measured))),
    }
