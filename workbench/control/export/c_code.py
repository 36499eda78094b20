"""A law in C99: a state, a step of it once a period, and a check against the test vector."""

from collections.abc import Iterable, Mapping
from typing import Any

from .planned_c import c_array, c_numbers, planned_c
from .sections import Coefficients, SectionChannel, identifier

_HEAD = """\
/* {name}: command of a servo-hydraulic jack's controller, computed once every {period:g} ms. SI units.
 * Compile with -DCHECK_{upper} for a program that compares it with its test vector: status 0 means equal. */
"""
_HEADER = """\
#ifndef {upper}_H
#define {upper}_H

typedef struct {{
    double z[{sections}][2];
    double {fields}; /* the signals at the start */
    double offset;{planned_field}{sine_field}
}} {name}_state;

/* From rest at 0: all states are 0. */
void {name}_reset({name}_state *state);
/* Without a bump from rest at these signals: with the reference there too, the next step gives this command. */
void {name}_start({name}_state *state, double command{measured});
/* The command of this sample, -1..1; signals in SI units. */
double {name}_step({name}_state *state{arguments});

#endif
"""
_HELPERS = """\
/* Second-order sections in series: direct form II, transposed; rows are b0 b1 b2 a1 a2. */
static double filtered(const double (*c)[5], double (*z)[2], int sections, double x)
{
    for (int k = 0; k < sections; k++) {
        const double y = c[k][0] * x + z[k][0];
        z[k][0] = c[k][1] * x - c[k][3] * y + z[k][1];
        z[k][1] = c[k][2] * x - c[k][4] * y;
        x = y;
    }
    return x;
}
"""
_TABLE = """
/* Linear between the points, held beyond. */
static double interpolated(const double *at, const double *to, int points, double x)
{
    int k = 0;
    if (x <= at[0])
        return to[0];
    if (x >= at[points - 1])
        return to[points - 1];
    while (x > at[k + 1])
        k++;
    return to[k] + (to[k + 1] - to[k]) * (x - at[k]) / (at[k + 1] - at[k]);
}
"""
_MAP = """
/* Linear between the points, unchanged beyond. */
static double mapped(const double *at, const double *to, int points, double x)
{
    return x >= at[0] && x <= at[points - 1] ? interpolated(at, to, points, x) : x;
}
"""
_STEP = """
void {name}_reset({name}_state *state)
{{
    static const {name}_state rest;
    *state = rest;{sine_rest}
}}

/* The sum of the channels, each filtering what its signal is off its start. */
static double summed({name}_state *state{arguments})
{{
    double command = state->offset;
{body}
    return command;
}}

void {name}_start({name}_state *state, double command{measured})
{{
    const double reference = {controlled};
    {name}_reset(state);
{kept}
    state->offset = {back} - summed(state{given});
{planned_start}}}

double {name}_step({name}_state *state{arguments})
{{
    const double command = summed(state{given}){planned_step};
{sine_step}    return {forth};
}}
"""
_CHECK = """
#ifdef CHECK_{upper}
#include <math.h>
#include <stdio.h>

{vector}
int main(void)
{{
    double worst = 0.0, largest = 0.0;
    {name}_state state;
    {name}_reset(&state);
    for (int k = 0; k < {samples}; k++) {{
        worst = fmax(worst, fabs({name}_step(&state, {inputs}) - vector_command[k]));
        largest = fmax(largest, fabs(vector_command[k]));
    }}
    printf("{name}: %.1e of the largest command off\\n", worst / largest);
    return !(worst <= 1e-9 * largest);
}}
#endif
"""


def c_code(name: str, law: Coefficients) -> dict[str, str]:
    """The text of NAME.h and NAME.c, by file name."""
    name, mapped = identifier(name), law.command_map is not None
    words = {
        "name": name,
        "upper": name.upper(),
        "period": law.period * 1e3,
        "sections": max(1, sum(len(channel.sections) for channel in law.all_channels)),
        "samples": len(law.vector["command"]),
        "body": "\n".join("    " + line for line in _body(law)),
        "vector": "\n".join(c_array(f"vector_{signal}", values) for signal, values in law.vector.items()),
        **_of_signals(law.signals),
        **_of_map(law),
        **_of_sine(law),
    }
    words |= _of_plan(law, words)
    head = _HEAD.format(**words)
    helpers = _HELPERS if law.all_channels else ""
    helpers += _TABLE if mapped or any(channel.scale for channel in law.channels) else ""
    helpers += _MAP if mapped else ""
    plan = "" if law.planned is None else planned_c(law.planned, words)
    rooted = "" if law.planned is None else "#include <math.h>\n"
    step = plan + _STEP.format(**words)
    code = f'{head}{rooted}#include "{name}.h"\n\n{_tables(law)}\n{helpers}{step}{_CHECK.format(**words)}'
    return {f"{name}.h": head + _HEADER.format(**words), f"{name}.c": code}


def _of_signals(signals: list[str]) -> dict[str, str]:
    """What is written for each signal, the reference first."""
    return {
        "arguments": "".join(f", double {signal}" for signal in signals),
        "measured": "".join(f", double {signal}" for signal in signals[1:]),
        "given": "".join(f", {signal}" for signal in signals),
        "inputs": ", ".join(f"vector_{signal}[k]" for signal in signals),
        "controlled": signals[1],
        "fields": ", ".join(f"{signal}0" for signal in signals),
        "kept": "\n".join(f"    state->{signal}0 = {signal};" for signal in signals),
    }


def _of_map(law: Coefficients) -> dict[str, str]:
    """The command through the map, and back."""
    if law.command_map is None:
        return {"forth": _on_top(law, "command"), "back": "command"}
    points = len(law.command_map.at)
    return {
        "forth": _on_top(law, f"mapped(map_at, map_to, {points}, command)"),
        "back": f"mapped(map_to, map_at, {points}, command)",
    }


def _on_top(law: Coefficients, command: str) -> str:
    return command if law.sine is None else f"{command} + sine"


def _of_plan(law: Coefficients, words: Mapping[str, Any]) -> dict[str, str]:
    """What a plan adds to state, start and step."""
    if law.planned is None:
        return dict.fromkeys(("planned_field", "planned_start", "planned_step"), "")
    states = len(law.planned.core.entering)
    start = f"    planned_start(state, state->offset{words['given']});\n    state->offset = 0.0;\n"
    return {
        "planned_field": f"\n    double x[{states}], asked, sent; /* of the plan */",
        "planned_start": start,
        "planned_step": f" + planned_step(state{words['given']})",
    }


def _of_sine(law: Coefficients) -> dict[str, str]:
    """A dither's two states, turned once a sample."""
    if law.sine is None:
        return dict.fromkeys(("sine_field", "sine_rest", "sine_step"), "")
    (c, s), _ = law.sine.turn.tolist()
    step = [
        "const double sine = state->sine, cosine = state->cosine;",
        f"state->sine = {c!r} * sine + {s!r} * cosine;",
        f"state->cosine = {c!r} * cosine - {s!r} * sine;",
    ]
    return {
        "sine_field": "\n    double sine, cosine; /* of the dither */",
        "sine_rest": f"\n    state->cosine = {law.sine.amplitude!r};",
        "sine_step": "".join(f"    {line}\n" for line in step),
    }


def _body(law: Coefficients) -> Iterable[str]:
    read = {name for channel in law.channels for name in _read(law, channel)}
    yield from (f"(void){signal};" for signal in law.signals if signal not in read)
    first = 0
    for i, channel in enumerate(law.channels):
        error = f"{_off('reference')} - ({_off(law.signals[1])})"
        signal = error if channel.signal == "error" else _off(channel.signal)
        part = f"filtered(&sections[{first}], &state->z[{first}], {len(channel.sections)}, {signal})"
        if channel.scale is not None:
            part = f"({part} + {channel.at_rest!r} * state->{channel.signal}0)"
            part += f"\n        * interpolated(scale{i}_at, scale{i}_factor, {len(channel.scale.at)}, position)"
        yield f"command += {part};"
        first += len(channel.sections)


def _read(law: Coefficients, channel: SectionChannel) -> list[str]:
    """The signals that a channel needs now."""
    own = law.signals[:2] if channel.signal == "error" else [channel.signal]
    return own if channel.scale is None else [*own, "position"]


def _off(signal: str) -> str:
    return f"{signal} - state->{signal}0"


def _tables(law: Coefficients) -> str:
    rows = [
        ",\n    ".join("{" + c_numbers(row[[0, 1, 2, 4, 5]]) + "}" for row in channel.sections)
        for channel in law.all_channels
    ]
    parts = ["static const double sections[][5] = {\n    " + ",\n    ".join(rows) + ",\n};\n"] if rows else []
    for i, channel in enumerate(law.channels):
        if channel.scale is not None:
            parts += [c_array(f"scale{i}_at", channel.scale.at), c_array(f"scale{i}_factor", channel.scale.values)]
    if law.command_map is not None:
        parts += [c_array("map_at", law.command_map.at), c_array("map_to", law.command_map.to)]
    return "".join(parts)
