"""A kernel in C99 and in Structured Text: the same loops, statement by statement."""

import ast
from collections.abc import Iterator
from textwrap import indent
from typing import Any, ClassVar

from ...engine.kernel import KernelShape

_PRECEDENCE = {"Add": 1, "Sub": 1, "Mult": 2, "Div": 2}
_SIGNS = {"Add": "+", "Sub": "-", "Mult": "*", "Div": "/"}


def _word(name: Any) -> str:
    """The word of a node that is a name."""
    return name.id


class _Text:
    """What both languages share: expressions, and how a statement is taken apart."""

    compared: ClassVar[dict[str, str]]
    functions: ClassVar[dict[str, str]]
    both: str
    neither: str

    def __init__(self, shape: KernelShape) -> None:
        self.shape, self.constants = shape, dict(shape.constants)
        self.whole: list[str] = []  # scalar variables that are whole numbers
        self.numbers: list[str] = []
        self.arrays: dict[str, tuple[str, int]] = {}  # kind and size
        self._declare(shape.tree.body)

    def name(self, word: str) -> str:
        """A variable's name."""
        return word

    def table(self, word: str) -> str:
        """A table's name."""
        return word

    def constant(self, word: str) -> str:
        """A constant."""
        value = self.constants[word]
        return self.number(value)

    def number(self, value: float) -> str:
        """A literal."""
        return repr(value)

    def expression(self, node: Any, above: int = 0) -> str:
        """An expression; `above` binds closer than what is around it."""
        if isinstance(node, ast.Constant):
            value: Any = node.value
            return self.number(value)
        if isinstance(node, ast.Name):
            return self.constant(node.id) if node.id in self.constants else self.name(node.id)
        if isinstance(node, ast.Subscript):
            word = _word(node.value)
            return f"{self.table(word) if word in self.shape.first else self.name(word)}[{self.expression(node.slice)}]"
        if isinstance(node, ast.UnaryOp):
            return f"-{self.expression(node.operand, 3)}"
        if isinstance(node, ast.BinOp):
            kind = type(node.op).__name__
            bound = _PRECEDENCE[kind]
            text = f"{self.expression(node.left, bound)} {_SIGNS[kind]} {self.expression(node.right, bound + 1)}"
            return f"({text})" if bound < above else text
        return f"{self.functions[node.func.id]}({self.expression(node.args[0])})"

    def condition(self, node: Any) -> str:
        """What a branch or a loop goes by."""
        if isinstance(node, ast.BoolOp):
            return f" {self.both} ".join(self.condition(value) for value in node.values)
        if isinstance(node, ast.UnaryOp):
            return f"{self.neither}({self.condition(node.operand)})"
        (op,), (right,) = node.ops, node.comparators
        word = self.compared[type(op).__name__]
        return f"{self.expression(node.left)} {word} {self.expression(right)}"

    def lines(self, body: list[Any]) -> Iterator[str]:
        """The statements."""
        for node in body:
            kind = type(node).__name__
            if kind == "Assign" and not self.shape.array(node.value):
                yield self.assigned(node.targets[0], self.expression(node.value))
            elif kind == "AugAssign":
                sign, bound = _SIGNS[type(node.op).__name__], _PRECEDENCE[type(node.op).__name__]
                target = self.expression(node.target)
                yield self.assigned(node.target, f"{target} {sign} {self.expression(node.value, bound + 1)}")
            elif kind == "For":
                arguments = [self.expression(argument) for argument in node.iter.args]
                low, high = arguments if len(arguments) > 1 else ["0", *arguments]
                yield self.counted(self.name(node.target.id), low, high, self.block(node.body))
            elif kind == "While":
                yield self.repeated(self.condition(node.test), self.block(node.body))
            elif kind == "If":
                yield self.branched(self.condition(node.test), self.block(node.body), self.block(node.orelse))

    def block(self, body: list[Any]) -> str:
        """Statements, indented."""
        return indent("\n".join(self.lines(body)), "    ")

    def assigned(self, target: Any, value: str) -> str:
        raise NotImplementedError

    def counted(self, name: str, low: str, high: str, body: str) -> str:
        raise NotImplementedError

    def repeated(self, condition: str, body: str) -> str:
        raise NotImplementedError

    def branched(self, condition: str, body: str, other: str) -> str:
        raise NotImplementedError

    def _declare(self, body: list[Any]) -> None:
        for node in body:
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                if made := self.shape.array(node.value):
                    self.arrays[node.targets[0].id] = made
                    continue
                self._scalar(node.targets[0].id, self._is_whole(node.value))
            elif isinstance(node, ast.For) and isinstance(node.target, ast.Name):
                self._scalar(node.target.id, True)
            for inside in ("body", "orelse"):
                self._declare(getattr(node, inside, []))

    def _scalar(self, name: str, whole: bool) -> None:
        if name not in (*self.whole, *self.numbers):
            (self.whole if whole else self.numbers).append(name)

    def _is_whole(self, node: Any) -> bool:
        if isinstance(node, ast.Constant):
            return isinstance(node.value, int)
        if isinstance(node, ast.Name):
            return node.id in self.whole or isinstance(self.constants.get(node.id), int)
        if isinstance(node, ast.Subscript):
            return self.arrays.get(_word(node.value), ("", 0))[0] == "places"
        if isinstance(node, ast.BinOp):
            return self._is_whole(node.left)
        return isinstance(node, ast.UnaryOp) and self._is_whole(node.operand)


class KernelC(_Text):
    """The body of a function of `given` and `found` in C."""

    compared: ClassVar = {"Lt": "<", "LtE": "<=", "Gt": ">", "GtE": ">=", "Eq": "==", "NotEq": "!="}
    functions: ClassVar = {"abs": "fabs", "sqrt": "sqrt"}
    both, neither = "&&", "!"

    def constant(self, word: str) -> str:
        return word if isinstance(self.constants[word], int) else self.number(self.constants[word])

    def assigned(self, target: Any, value: str) -> str:
        return f"{self.expression(target)} = {value};"

    def counted(self, name: str, low: str, high: str, body: str) -> str:
        return f"for ({name} = {low}; {name} < {high}; {name}++) {{\n{body}\n}}"

    def repeated(self, condition: str, body: str) -> str:
        return f"while ({condition}) {{\n{body}\n}}"

    def branched(self, condition: str, body: str, other: str) -> str:
        return f"if ({condition}) {{\n{body}\n}}" + (f" else {{\n{other}\n}}" if other else "")

    @property
    def declared(self) -> list[str]:
        """Its variables."""
        kinds = {"space": "double", "places": "int"}
        lines = [f"{kinds[kind]} {name}[{size}];" for name, (kind, size) in self.arrays.items()]
        return [*lines, f"double {', '.join(self.numbers)};", f"int {', '.join(self.whole)};"]


class KernelSt(_Text):
    """The statements of a function block in Structured Text, whose variables begin with k_ and tables with table_."""

    compared: ClassVar = {"Lt": "<", "LtE": "<=", "Gt": ">", "GtE": ">=", "Eq": "=", "NotEq": "<>"}
    functions: ClassVar = {"abs": "ABS", "sqrt": "SQRT"}
    both, neither = "AND", "NOT "

    def name(self, word: str) -> str:
        return f"k_{word}"

    def table(self, word: str) -> str:
        return f"table_{word.lower()}"

    def number(self, value: float) -> str:
        digits, e, exponent = repr(value).partition("e")
        point = "" if isinstance(value, int) or "." in digits else ".0"
        return f"{digits}{point}{e.upper()}{exponent.lstrip('+')}"

    def assigned(self, target: Any, value: str) -> str:
        return f"{self.expression(target)} := {value};"

    def counted(self, name: str, low: str, high: str, body: str) -> str:
        return f"FOR {name} := {low} TO {high} - 1 DO\n{body}\nEND_FOR;"

    def repeated(self, condition: str, body: str) -> str:
        return f"WHILE {condition} DO\n{body}\nEND_WHILE;"

    def branched(self, condition: str, body: str, other: str) -> str:
        return f"IF {condition} THEN\n{body}\n" + (f"ELSE\n{other}\n" if other else "") + "END_IF;"

    @property
    def declared(self) -> list[str]:
        """Its variables."""
        kinds = {"space": "LREAL", "places": "INT"}
        arrays = {**self.arrays, "given": ("space", self.shape.given), "found": ("space", self.shape.found)}
        lines = [f"{self.name(name)} : ARRAY[0..{size - 1}] OF {kinds[kind]};" for name, (kind, size) in arrays.items()]
        lines += [f"{self.name(name)} : LREAL;" for name in self.numbers]
        return lines + [f"{self.name(name)} : INT;" for name in self.whole]
