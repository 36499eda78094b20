"""Runs Structured Text of IEC 61131-3: parsed by blark's grammar and evaluated statement by statement, which takes its
time, or line by line as Python, for text that writes a statement a line."""

import math
import operator
import re
from collections.abc import Mapping
from itertools import product
from typing import Any

from blark.parse import parse_source_code

_BINARY = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "=": operator.eq,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "<>": operator.ne,
    "AND": lambda a, b: a and b,
    "OR": lambda a, b: a or b,
}
_FUNCTIONS = {
    "MAX": max,
    "MIN": min,
    "ABS": abs,
    "SQRT": math.sqrt,
    "EXP": math.exp,
    "EXPT": pow,
    "SIN": math.sin,
    "COS": math.cos,
    "SEL": lambda chosen, no, yes: yes if chosen else no,
    "TRUNC": math.trunc,
    "DINT_TO_LREAL": float,
}
_START = {"BOOL": False, "INT": 0, "LREAL": 0.0}


def units_of(text: str) -> dict[str, Any]:
    """The function blocks and programs of a source, by name. Raises where the grammar does not know it."""
    return {str(item.name): item for item in parse_source_code(text).transform().items}


class Instance:
    """A function block or program with its variables; a name that is not declared is a KeyError."""

    def __init__(self, unit: Any, others: Mapping[str, Any]) -> None:
        self._unit, self.values = unit, {}
        for block in unit.declarations:
            for item in block.items:
                for variable in item.variables:
                    self.values[str(variable.variable.name)] = _start(item.init, others)

    def __call__(self, **inputs: Any) -> None:
        """One cycle."""
        for name, value in inputs.items():
            self.values[name] = _as(self.values[name], value)
        self._run(self._unit.body)

    def _run(self, body: Any) -> None:
        for statement in body.statements if body is not None else ():
            getattr(self, type(statement).__name__)(statement)

    def AssignmentStatement(self, statement: Any) -> None:
        (target,) = statement.variables
        value = self._value(statement.expression)
        if type(target).__name__ == "SimpleVariable":
            self.values[str(target.name)] = _as(self.values[str(target.name)], value)
        else:
            self.values[str(target.name.name)][self._index(target)] = value

    def IfStatement(self, statement: Any) -> None:
        branches = [(statement.if_expression, statement.statements)]
        branches += [(branch.if_expression, branch.statements) for branch in statement.else_ifs]
        for condition, body in branches:
            if self._value(condition):
                return self._run(body)
        return self._run(statement.else_clause.statements) if statement.else_clause else None

    def ForStatement(self, statement: Any) -> None:
        for k in range(self._value(statement.from_), self._value(statement.to) + 1):
            self.values[str(statement.control.name)] = k
            self._run(statement.statements)

    def WhileStatement(self, statement: Any) -> None:
        while self._value(statement.expression):
            self._run(statement.statements)

    def FunctionCallStatement(self, statement: Any) -> None:
        inputs = {str(given.name.name): self._value(given.value) for given in statement.parameters}
        self.values[str(statement.name.name)](**inputs)

    def _value(self, expression: Any) -> Any:
        kind = type(expression).__name__
        if kind in ("Real", "Integer"):
            return float(str(expression.value)) if kind == "Real" else int(str(expression.value))
        if kind == "SimpleVariable":
            word = str(expression.name)
            return {"TRUE": True, "FALSE": False}[word] if word in ("TRUE", "FALSE") else self.values[word]
        if kind == "BinaryOperation":
            return _BINARY[str(expression.op)](self._value(expression.left), self._value(expression.right))
        if kind == "UnaryOperation":
            value = self._value(expression.expr)
            return not value if str(expression.op).upper() == "NOT" else -value
        if kind == "ParenthesizedExpression":
            return self._value(expression.expr)
        if kind == "FunctionCall":
            return _FUNCTIONS[str(expression.name.name)](*(self._value(given.value) for given in expression.parameters))
        if kind == "MultiElementVariable":
            owner = self.values[str(expression.name.name)]
            if isinstance(owner, Instance):
                return owner.values[str(expression.elements[0].field.name)]
            return owner[self._index(expression)]
        return {"TRUE": True, "FALSE": False}[str(getattr(expression, "value", expression)).upper()]

    def _index(self, variable: Any) -> tuple[int, ...]:
        (subscripts,) = variable.elements
        return tuple(self._value(subscript) for subscript in subscripts.subscripts)


def _as(old: Any, new: Any) -> Any:
    """The new value of a variable, which keeps its type."""
    assert isinstance(new, type(old)), f"{new} assigned to a variable of {type(old)}"
    return new


def _start(init: Any, others: Mapping[str, Any]) -> Any:
    if type(init).__name__ != "ArrayTypeInitialization":
        word = str(init.spec.type)
        return _START[word] if word in _START else Instance(others[word], others)
    ends = [(int(str(part.start.value)), int(str(part.stop.value))) for part in init.spec.subranges]
    places = list(product(*(range(low, high + 1) for low, high in ends)))
    values = [0.0] * len(places) if init.value is None else list(_numbers(init.value))
    return dict(zip(places, values, strict=True))


def _numbers(value: Any) -> Any:
    kind = type(value).__name__
    if kind == "ArrayInitialization":
        for element in value.elements:
            yield from _numbers(element.element)
    elif kind == "UnaryOperation":
        yield from (-number for number in _numbers(value.expr))
    else:
        yield float(str(value.value))


class Block:
    """A function block as Python: its variables are `values`."""

    def __init__(self, text: str, name: str) -> None:
        text = re.sub(r"\(\*.*?\*\)", "", text, flags=re.DOTALL)
        whole = text.partition(f"FUNCTION_BLOCK {name}\n")[2].partition("END_FUNCTION_BLOCK")[0]
        declared, _, body = whole.rpartition("END_VAR")
        self.values: dict[str, Any] = dict(_declared(declared))
        self._code = compile("\n".join(_as_python(body)), name, "exec")

    def __call__(self, **inputs: Any) -> float:
        """One cycle; its output `command`."""
        self.values |= inputs
        exec(self._code, _FUNCTIONS, self.values)
        return self.values["command"]


def _declared(text: str) -> Any:
    pattern = r"(\w+) : (?:ARRAY\[0\.\.(\d+)\] OF )?(LREAL|INT|BOOL)(?: := \[([^\]]*)\])?;"
    for name, last, kind, values in re.findall(pattern, text):
        if values:
            yield name, [float(word) for word in values.split(",")]
        else:
            yield name, [_START[kind]] * (int(last) + 1) if last else _START[kind]


def _as_python(body: str) -> Any:
    """Lines of Python; one that is no statement of the few forms that are written is a SyntaxError."""
    depth = 0
    for line in filter(None, map(str.strip, body.splitlines())):
        if line.startswith(("END_", "ELSE", "ELSIF")):
            depth -= 1
        if line.startswith("END_"):
            continue
        head = re.match(r"(IF|ELSIF|WHILE) (.*) (?:THEN|DO)$", line)
        loop = re.match(r"FOR (\w+) := (.*) TO (.*) DO$", line)
        if head:
            word = {"IF": "if", "ELSIF": "elif", "WHILE": "while"}[head[1]]
            text = f"{word} {_expression(head[2])}:"
        elif loop:
            text = f"for {loop[1]} in range({_expression(loop[2])}, {_expression(loop[3])} + 1):"
        elif line in ("ELSE", ";"):
            text = {"ELSE": "else:", ";": "pass"}[line]
        else:
            target, value = line.removesuffix(";").split(" := ")
            text = f"{target} = {_expression(value)}"
        yield "    " * depth + text
        depth += text.endswith(":")


def _expression(text: str) -> str:
    """In Python's words."""
    text = re.sub(r"(?<![<>=])=(?!=)", "==", text).replace("<>", "!=").replace("<==", "<=").replace(">==", ">=")
    for word, other in (("AND", "and"), ("OR", "or"), ("NOT", "not"), ("TRUE", "True"), ("FALSE", "False")):
        text = re.sub(rf"\b{word}\b", other, text)
    return text
