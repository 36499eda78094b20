"""The graph of a law as statements of a language: named inputs and results, and tables where it interpolates."""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import casadi as ca
import numpy as np

from ...base.errors import InputError
from ...engine.tape import Tape, read

_WIDE = 88  # characters of an expression that still stands within another one
_POINTS = 4  # bends of a sum that make a table of it
_ATOM, _UNARY, _PRODUCT, _SUM, _COMPARED, _LOOSE = 6, 5, 4, 3, 2, 0  # how closely an expression binds
_BINARY = {"add": ("+", _SUM), "sub": ("-", _SUM), "mul": ("*", _PRODUCT), "div": ("/", _PRODUCT)}


@dataclass(frozen=True)
class Expression:
    """A text, and how closely it binds."""

    text: str
    level: int = _ATOM

    def within(self, level: int) -> str:
        """The text, in brackets where what is around it binds closer."""
        return self.text if self.level >= level else f"({self.text})"


@dataclass(frozen=True)
class Bent:
    """A sum of bends: at an x, sum over k of bend[k] times what x is beyond at[k]."""

    x: int
    at: tuple[float, ...]
    bend: tuple[float, ...]


class Language(ABC):
    """How a language writes what a graph consists of."""

    compared: ClassVar[Mapping[str, str]]
    joined: ClassVar[Mapping[str, str]]  # and, or
    negated: ClassVar[str]

    @abstractmethod
    def number(self, value: float) -> str:
        """A literal."""

    @abstractmethod
    def call(self, op: str, arguments: Sequence[str]) -> str | None:
        """A function of numbers; None for one that this language does not have."""

    @abstractmethod
    def chosen(self, condition: str, yes: str, no: str) -> Expression:
        """One of two numbers."""

    @abstractmethod
    def let(self, name: str, value: str) -> str:
        """A further name for a number."""

    @abstractmethod
    def bent(self, name: str, table: str, points: int, x: str) -> list[str]:
        """`name` for what a table of bends makes of x."""

    @abstractmethod
    def called(self, kernel: str, given: Sequence[str]) -> list[str]:
        """A call of a kernel."""

    @abstractmethod
    def found(self, kernel: str, place: int) -> str:
        """What a kernel has found."""


@dataclass
class Statements:
    """What a graph makes: `lines` that give names to parts of it, and the `results` as expressions, in their order.

    `tables` are those of bends, `kernels` are called, `names` were given.
    """

    language: Language
    lines: list[str] = field(default_factory=list)
    results: list[str] = field(default_factory=list)
    tables: dict[str, Bent] = field(default_factory=dict)
    kernels: dict[str, float] = field(default_factory=dict)  # with the handle of its tables
    names: list[str] = field(default_factory=list)


def statements(
    language: Language,
    function: ca.Function,
    inputs: Sequence[Sequence[str]],
    results: Sequence[int] | None = None,
    known: bool = False,
    tables: dict[str, Bent] | None = None,
) -> Statements:
    """A function of one output, its inputs named element by element, some of its `results` or all of them.

    `known`: kernels have been called before; else those that any result needs are called. `tables` that there are.
    """
    return _Written(language, read(function), inputs, results, known, tables or {}).done


class _Written:
    def __init__(
        self,
        language: Language,
        tape: Tape,
        inputs: Sequence[Sequence[str]],
        results: Sequence[int] | None,
        known: bool,
        tables: dict[str, Bent],
    ) -> None:
        self._language, self._tape, self._inputs, self._known = language, tape, inputs, known
        self.done = Statements(language, tables=tables)
        every = dict(tape.results)
        wanted = [every[i] for i in (sorted(every) if results is None else results)]
        more = [] if known else [i for i, node in enumerate(tape.nodes) if node.op == "call"]
        self._sums = self._bent_sums()
        self._uses = self._counted([*wanted, *more])
        self._texts: dict[int, Expression] = {}
        for i in range(len(tape.nodes)):
            if self._uses[i]:
                self._write(i)
        self.done.results = [self._texts[i].text for i in wanted]

    def _arguments(self, i: int) -> tuple[int, ...]:
        if i in self._sums:
            rest, bent = self._sums[i]
            return (*(abs(term) - 1 for term in rest), *(table.x for table in bent))
        node = self._tape.nodes[i]
        return () if self._known and node.op in ("call", "part") else node.args

    def _counted(self, wanted: Sequence[int]) -> Counter[int]:
        counts = Counter(wanted)
        for i in reversed(range(len(self._tape.nodes))):
            if counts[i]:
                counts.update(self._arguments(i))
        return counts

    def _write(self, i: int) -> None:
        expression = self._sum(i) if i in self._sums else self._expression(i)
        node, language = self._tape.nodes[i], self._language
        plain = node.op in ("input", "const", "part", "call") or self._is_truth(i)
        if not plain and (self._uses[i] > 1 or len(expression.text) > _WIDE):
            name = self._named()
            self.done.lines.append(language.let(name, expression.text))
            expression = Expression(name)
        self._texts[i] = expression

    def _named(self) -> str:
        self.done.names.append(f"t{len(self.done.names) + 1}")
        return self.done.names[-1]

    def _is_truth(self, i: int) -> bool:
        return self._tape.nodes[i].op in ("lt", "le", "eq", "ne", "and", "or", "not")

    def _expression(self, i: int) -> Expression:
        node, language = self._tape.nodes[i], self._language
        op, texts = node.op, [self._texts.get(a, Expression("")) for a in node.args]
        if op == "input":
            assert isinstance(node.value, tuple)
            return Expression(self._inputs[node.value[0]][node.value[1]])
        if op == "const":
            value = self._tape.number(i)
            assert value is not None
            return Expression(language.number(value), _ATOM if value >= 0 else _UNARY)
        if op == "call":
            return self._call(i)
        if op == "part":
            call = self._tape.nodes[node.args[0]]
            return Expression(language.found(_kernel_name(call.value), int(str(node.value))))
        if op in _BINARY:
            sign, level = _BINARY[op]
            right, negative = texts[1].within(level + (op in ("sub", "div"))), texts[1].text.startswith("-")
            if negative and level == _SUM and texts[1].level > _SUM:
                sign, right = ("-" if op == "add" else "+"), right.removeprefix("-")
            elif negative:
                right = f"({texts[1].text})"
            return Expression(f"{texts[0].within(level)} {sign} {right}", level)
        if op == "neg":
            return Expression(f"-{texts[0].within(_UNARY + 1)}", _UNARY)
        if op in language.compared:
            left, right = (text.within(_SUM) for text in texts)
            return Expression(f"{left} {language.compared[op]} {right}", _COMPARED)
        if op in language.joined:
            return Expression(f" {language.joined[op]} ".join(text.within(_ATOM) for text in texts), _LOOSE)
        if op == "not":
            return Expression(f"{language.negated}({texts[0].text})", _UNARY)
        if op == "real":
            return language.chosen(texts[0].text, language.number(1.0), language.number(0.0))
        if op == "select":
            return language.chosen(*(text.text for text in texts))
        text = language.call(op, [text.text for text in texts])
        if text is None:
            what = f"the law has the function {op}, which {type(language).__name__} does not"
            raise InputError(f"{what}; write it with others, such as sqrt, exp, sin, cos, fmin and fmax")
        return Expression(text)

    def _call(self, i: int) -> Expression:
        node = self._tape.nodes[i]
        if not self._known:
            handle = self._tape.number(node.args[-1])
            assert handle is not None  # the tables' place in memory
            name = _kernel_name(node.value)
            self.done.kernels[name] = handle
            self.done.lines += self._language.called(name, [self._texts[a].text for a in node.args[:-1]])
        return Expression("")

    def _sum(self, i: int) -> Expression:
        rest, bent = self._sums[i]
        text = ""
        for term in rest:
            part = self._texts[abs(term) - 1].within(_PRODUCT)
            negative = (term < 0) != part.startswith("-")
            part = part.removeprefix("-")
            text += f" {'-' if negative else '+'} {part}" if text else f"{'-' * negative}{part}"
        for table in bent:
            known = next((name for name, other in self.done.tables.items() if other == table), None)
            name = known or f"bends{len(self.done.tables) + 1}"
            self.done.tables[name] = table
            made = self._named()
            self.done.lines += self._language.bent(made, name, len(table.at), self._texts[table.x].text)
            text += f" + {made}" if text else made
        return Expression(text, _SUM)

    def _bent_sums(self) -> dict[int, tuple[list[int], list[Bent]]]:
        """Sums with tables in them: their other terms, signed and counted from 1, and the tables."""
        nodes, uses, found = self._tape.nodes, self._tape.used(), {}
        within = {a for i, node in enumerate(nodes) if uses[i] and node.op in ("add", "sub") for a in node.args}
        for i, node in enumerate(nodes):
            if not uses[i] or node.op not in ("add", "sub") or (i in within and uses[i] == 1):
                continue
            rest, bends = [], {}
            for term in self._terms(i, uses):
                bend = self._bend(abs(term) - 1)
                if bend is None:
                    rest.append(term)
                else:
                    x, at, slope = bend
                    bends.setdefault(x, []).append((at, slope if term > 0 else -slope))
                    bends[x, "terms"] = [*bends.get((x, "terms"), []), term]
            tables = []
            for x in [key for key in bends if isinstance(key, int)]:
                if len(bends[x]) < _POINTS:
                    rest += bends[x, "terms"]
                    continue
                at, slope = zip(*sorted(bends[x]), strict=True)
                tables.append(Bent(x, at, slope))
            if tables:
                found[i] = rest, tables
        return found

    def _terms(self, root: int, uses: Counter[int]) -> list[int]:
        """The terms of a sum, signed and counted from 1."""
        terms, waiting = [], [(root, 1)]
        while waiting:
            i, sign = waiting.pop()
            node = self._tape.nodes[i]
            if node.op in ("add", "sub") and (i == root or uses[i] == 1):
                right = -sign if node.op == "sub" else sign
                waiting += [(node.args[1], right), (node.args[0], sign)]
            else:
                terms.append(sign * (i + 1))
        return terms

    def _bend(self, i: int) -> tuple[int, float, float] | None:
        """x, at and slope of a term slope max(x - at, 0); None of any other."""
        node, tape = self._tape.nodes[i], self._tape
        slope = 1.0
        if node.op == "mul":
            slope, other = next(
                ((value, b) for a, b in (node.args, node.args[::-1]) if (value := tape.number(a)) is not None),
                (None, None),
            )
            if slope is None or other is None:
                return None
            node = tape.nodes[other]
        if node.op != "fmax":
            return None
        beyond = next((b for a, b in (node.args, node.args[::-1]) if tape.number(a) == 0.0), None)
        if beyond is None:
            return None
        inner = tape.nodes[beyond]
        if inner.op == "sub" and (at := tape.number(inner.args[1])) is not None:
            return inner.args[0], at, slope
        if inner.op == "add":
            for a, b in (inner.args, inner.args[::-1]):
                if (at := tape.number(a)) is not None:
                    return b, -at, slope
        return beyond, 0.0, slope


def _kernel_name(value: object) -> str:
    """Without the digest that tells kernels apart in machine code."""
    return str(value).rpartition("_")[0]


def table_arrays(tables: Mapping[str, Bent]) -> dict[str, np.ndarray]:
    """The numbers of tables by the names of arrays."""
    return {
        f"{name}_{part}": np.array(values)
        for name, table in tables.items()
        for part, values in (("at", table.at), ("bend", table.bend))
    }


def assigned(targets: Sequence[str], results: Sequence[str], let: str, assign: str) -> list[str]:
    """Lines that set targets to results at once, by the forms `let` a further name be and `assign`: what is computed of
    targets is kept first, and what is copied from one to another is copied before that is overwritten."""
    lines, later, plain = [], [], set(targets)
    for number, (target, result) in enumerate(zip(targets, results, strict=True), 1):
        if result == target:
            continue
        if result not in plain and any(name in result for name in plain):
            lines.append(let.format(f"next{number}", result))
            result = f"next{number}"
        later.append((target, result))
    while later:
        needed = {result for _, result in later}
        free = next((pair for pair in later if pair[0] not in needed), None)
        if free is None:  # they go round
            lines.append(let.format("moved", later[0][1]))
            later[0] = later[0][0], "moved"
            continue
        later.remove(free)
        lines.append(assign.format(*free))
    return lines
