"""A law in Structured Text of IEC 61131-3: a function block called once a period, and a program that checks it."""

from collections.abc import Mapping, Sequence
from textwrap import indent
from typing import ClassVar

import numpy as np

from ...engine.kernel import Kernel
from .kernel_text import KernelSt
from .program import Program, identifier
from .statements import Expression, Language, Statements, assigned, statements, table_arrays

_BLOCK = """\
(* {name}: command of a servo-hydraulic jack's controller, to be called every {period:g} ms. SI units.{left_out}
   start = TRUE, as in the first call: without a bump from rest at these signals; where the setpoint is there too, the
   command is `held`. In all other calls `realised` is the command that the drive really got in the last period: what
   the law does when its command is limited (anti-windup, observers) needs it. *)
FUNCTION_BLOCK {name}
VAR_INPUT
    start : BOOL;
    held : LREAL; (* -1..1 *)
    realised : LREAL; (* -1..1 *)
{inputs}
END_VAR
VAR_OUTPUT
    command : LREAL; (* before any limit *)
END_VAR
VAR
    running : BOOL;
    offset : LREAL;
    k : INT;
{variables}
END_VAR
{constants}IF start OR NOT running THEN
    running := TRUE;
{started}
ELSE
{after}
END_IF;
{kept}
{step}
END_FUNCTION_BLOCK
"""
_CHECK = """
(* One sample of the test vector a cycle: at rest, moving, saturated, slowed down, tripped and started anew; done and
   passed say how it ended. *)
PROGRAM {name}_check
VAR
    law : {name};
    sample : INT;
    last : LREAL;
    worst : LREAL;
    largest : LREAL;
    done : BOOL;
    passed : BOOL;
END_VAR
VAR CONSTANT
{vector}END_VAR
IF sample < {samples} THEN
    law(start := vector_start[sample] > 0.0, held := vector_held[sample], realised := last, {arguments});
    worst := MAX(worst, ABS(law.command - vector_command[sample]));
    largest := MAX(largest, ABS(vector_command[sample]));
    last := vector_realised[sample];
    sample := sample + 1;
ELSE
    done := TRUE;
    passed := worst <= 1.0E-9 * largest;
END_IF;
END_PROGRAM
"""
_BENT = """\
{name} := 0.0;
k := 0;
WHILE k < {points} AND {x} > {table}_at[MIN(k, {last})] DO
    {name} := {name} + {table}_bend[k] * ({x} - {table}_at[k]);
    k := k + 1;
END_WHILE;"""
_FUNCTIONS = {"fmin": "MIN", "fmax": "MAX", "fabs": "ABS", "sqrt": "SQRT", "exp": "EXP", "log": "LN"}
_FUNCTIONS |= {"sin": "SIN", "cos": "COS", "tan": "TAN", "pow": "EXPT"}
_NAMED = {"reference": "setpoint"}  # a word of the language
_FEW = 4  # samples of a preview in the vector's rows


class StructuredText(Language):
    """IEC 61131-3."""

    compared: ClassVar[Mapping[str, str]] = {"lt": "<", "le": "<=", "eq": "=", "ne": "<>"}
    joined: ClassVar[Mapping[str, str]] = {"and": "AND", "or": "OR"}
    negated: ClassVar[str] = "NOT "

    def __init__(self, kernel: Kernel | None) -> None:
        self._kernel = kernel

    def number(self, value: float) -> str:
        return _real(value)

    def call(self, op: str, arguments: Sequence[str]) -> str | None:
        if op in _FUNCTIONS:
            return f"{_FUNCTIONS[op]}({', '.join(arguments)})"
        x = arguments[0]
        if op == "tanh":
            return f"(1.0 - 2.0 / (EXP(2.0 * ({x})) + 1.0))"
        if op == "sign":
            return f"SEL({x} > 0.0, SEL({x} < 0.0, 0.0, -1.0), 1.0)"
        if op == "floor":
            whole = f"DINT_TO_LREAL(TRUNC({x}))"
            return f"({whole} - SEL({x} < {whole}, 0.0, 1.0))"
        return None

    def chosen(self, condition: str, yes: str, no: str) -> Expression:
        return Expression(f"SEL({condition}, {no}, {yes})")

    def let(self, name: str, value: str) -> str:
        return f"{name} := {value};"

    def bent(self, name: str, table: str, points: int, x: str) -> list[str]:
        return _BENT.format(name=name, table=table, points=points, last=points - 1, x=f"({x})").splitlines()

    def called(self, kernel: str, given: Sequence[str]) -> list[str]:
        assert self._kernel is not None
        shape = self._kernel.shape
        lines = [f"k_given[{i}] := {value};" for i, value in enumerate(given)]
        return [*lines, *"\n".join(KernelSt(shape).lines(shape.tree.body)).splitlines()]

    def found(self, kernel: str, place: int) -> str:
        return f"k_found[{place}]"


def structured_text(program: Program) -> dict[str, str]:
    """The text of NAME.st, by file name."""
    law, states, ahead, kernel = program.law, program.states, program.law.preview, program.kernel
    measured, language, word = list(law.measures), StructuredText(program.kernel), identifier(program.name)
    references = [f"setpoint[{k}]" for k in range(1 + ahead)] if ahead else ["setpoint"]
    now, before = [*references, *measured], [f"last_{name}" for name in (*references, *measured)]
    start = statements(language, program.start, [measured, ["held"]])
    step = statements(language, program.sample, [states, ["offset"], now, ["realised"]], [0], tables=start.tables)
    inside = [states, ["offset"], before, ["realised"]]
    after = statements(language, program.sample, inside, range(1, 1 + len(states)), True, step.tables)
    targets = [*states, "offset"]
    kept = [f"last_{name} := {name};" for name in (*measured, *([] if ahead else ["setpoint"]))]
    kept += [f"FOR k := 0 TO {ahead} DO\n    last_setpoint[k] := setpoint[k];\nEND_FOR;"] if ahead else []
    tables = table_arrays(after.tables)
    if kernel is not None:
        tables |= {f"table_{name.lower()}": kernel.table(name) for name, _ in kernel.shape.tables}
    declared = [f"{name} : LREAL;" for name in (*states, *(f"last_{name}" for name in measured))]
    declared += [f"last_{line}" for line in _setpoint(ahead)]
    declared += [
        f"{name} : LREAL;" for name in sorted({*start.names, *step.names, *after.names}, key=lambda t: int(t[1:]))
    ]
    declared += [f"next{k} : LREAL;" for k in range(1, 2 + len(states))] + ["moved : LREAL;"]
    declared += [] if kernel is None else KernelSt(kernel.shape).declared
    block = _BLOCK.format(
        name=word,
        period=law.period * 1e3,
        left_out=f"\n   Without {program.left_out}." if program.left_out else "",
        inputs=indent("\n".join([*_setpoint(ahead), *(f"{name} : LREAL;" for name in measured)]), "    "),
        variables=indent("\n".join(declared), "    "),
        constants=f"VAR CONSTANT\n{''.join(_array(*each) for each in tables.items())}END_VAR\n" if tables else "",
        started=_body(start, targets),
        after=_body(after, states) or "    ;",
        kept="\n".join(kept),
        step="\n".join([*step.lines, f"command := {step.results[0]};"]),
    )
    return {f"{word}.st": block + _check(program, word)}


def _setpoint(ahead: int) -> list[str]:
    return [
        f"setpoint : ARRAY[0..{ahead}] OF LREAL; (* now, and so many periods ahead *)" if ahead else "setpoint : LREAL;"
    ]


def _body(of: Statements, targets: Sequence[str]) -> str:
    lines = assigned(targets, of.results, "{} := {};", "{} := {};")
    return indent("\n".join([*of.lines, *lines]), "    ")


def _check(program: Program, word: str) -> str:
    vector, law = program.vector, program.law
    asked = vector.signals["reference"]
    arrays = {"start": vector.start, "held": vector.held, "command": vector.command, "realised": vector.realised}
    arrays |= {name: vector.signals[name] for name in law.measures}
    if law.preview:
        return ""  # a vector of arrays has no place in a call
    arrays["setpoint"] = asked[:, 0]
    names = ["setpoint", *law.measures]
    return _CHECK.format(
        name=word,
        samples=len(vector.command),
        vector="".join(_array(f"vector_{name}", values) for name, values in arrays.items()),
        arguments=", ".join(f"{name} := vector_{name}[sample]" for name in names),
    )


def _array(name: str, values: np.ndarray) -> str:
    words = [_real(float(value)) for value in values]
    rows = [", ".join(words[k : k + 4]) for k in range(0, len(words), 4)]
    return f"    {name} : ARRAY[0..{len(words) - 1}] OF LREAL := [\n        " + ",\n        ".join(rows) + "\n    ];\n"


def _real(value: float) -> str:
    """Every bit of a number, as the language has them."""
    digits, e, exponent = repr(float(value)).partition("e")
    return f"{digits}{'' if '.' in digits else '.0'}{e.upper()}{exponent.lstrip('+')}"
