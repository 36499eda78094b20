"""A CasADi function as a list of operations, rewritten so that few divisions and roots are left.

A graph full of orifices and their derivatives divides by the same roots and volumes again and again: every divisor
that is shared or constant is inverted once.
"""

import math
from collections import Counter
from dataclasses import dataclass, field
from typing import NamedTuple

import casadi as ca

_NAMES = {getattr(ca, name): name[3:].lower() for name in dir(ca) if name.startswith("OP_")}
_COMPARISONS = {"lt", "le", "eq", "ne"}


class Node(NamedTuple):
    """One operation on earlier nodes; `value` is the number of a const, or (argument, element) of an input."""

    op: str
    args: tuple[int, ...] = ()
    value: float | tuple[int, int] | str = 0.0


@dataclass
class Tape:
    """Operations in order, each one once, and the results as (element, node)."""

    nodes: list[Node] = field(default_factory=list)
    results: list[tuple[int, int]] = field(default_factory=list)
    _known: dict[Node, int] = field(default_factory=dict)

    def add(self, op: str, *args: int, value: float | tuple[int, int] | str = 0.0) -> int:
        """The node of this operation, which may exist already."""
        node = Node(op, args, value)
        if node not in self._known:
            self._known[node] = len(self.nodes)
            self.nodes.append(node)
        return self._known[node]

    def const(self, value: float) -> int:
        """A number; it is told apart by its digits, so that -0 is not 0 and NaN is found again."""
        return self.add("const", value=value.hex())

    def number(self, index: int) -> float | None:
        """The value of a const, None for anything else."""
        node = self.nodes[index]
        return float.fromhex(node.value) if node.op == "const" and isinstance(node.value, str) else None

    def used(self) -> Counter[int]:
        """How often each node is an argument or a result, counting only what the results need."""
        counts = Counter(node for _, node in self.results)
        for index in reversed(range(len(self.nodes))):
            if counts[index]:
                counts.update(self.nodes[index].args)
        return counts


def opcodes(function: ca.Function) -> set[str]:
    """Names of the operations of an SX function, such as `if_else_zero`."""
    return {_NAMES.get(function.instruction_id(i), "?") for i in range(function.n_instructions())}


def read(function: ca.Function) -> Tape:
    """The operations of an SX function; comparisons give truth values, which `real` turns into 0 or 1."""
    tape, work = Tape(), {}
    for i in range(function.n_instructions()):
        op, to = _NAMES[function.instruction_id(i)], function.instruction_output(i)
        source = function.instruction_input(i)
        if op == "output":
            tape.results.append((to[1], work[source[0]]))
        elif op == "input":
            work[to[0]] = tape.add("input", value=(source[0], source[1]))
        elif op == "const":
            work[to[0]] = tape.const(float(function.instruction_constant(i)))
        elif op == "call":
            call = tape.add("call", *(work[k] for k in source), value=_called(function, len(source), len(to)))
            work |= {place: tape.add("part", call, value=str(k)) for k, place in enumerate(to)}
        else:
            work[to[0]] = _operation(tape, op, [work[k] for k in source])
    return tape


def _called(function: ca.Function, given: int, found: int) -> str:
    """The name of the kernel that a graph calls, which is given and finds so many numbers."""
    kernels = (function.get_function(name) for name in function.get_function())
    (name,) = {kernel.name() for kernel in kernels if (kernel.nnz_in(), kernel.nnz_out()) == (given, found)}
    return name


def _operation(tape: Tape, op: str, args: list[int]) -> int:
    if op in _COMPARISONS:
        return tape.add("real", tape.add(op, *args))
    if op == "not":
        return tape.add("real", tape.add("not", _truth(tape, args[0])))
    if op in ("and", "or"):
        return tape.add("real", tape.add(op, _truth(tape, args[0]), _truth(tape, args[1])))
    if op == "if_else_zero":
        return tape.add("select", _truth(tape, args[0]), args[1], tape.const(0.0))
    if op == "sq":
        return tape.add("mul", args[0], args[0])
    if op == "twice":
        return tape.add("add", args[0], args[0])
    if op == "inv":
        return tape.add("div", tape.const(1.0), args[0])
    if op == "add":
        return _branches(tape, *args)
    if op == "assign":
        return args[0]
    return tape.add("pow" if op == "constpow" else op, *args)


def _truth(tape: Tape, index: int) -> int:
    node = tape.nodes[index]
    return node.args[0] if node.op == "real" else tape.add("ne", index, tape.const(0.0))


def _branches(tape: Tape, a: int, b: int) -> int:
    """A sum, unless it is how CasADi writes if_else: (c ? x : 0) + (not c ? y : 0)."""
    zero = tape.const(0.0)
    first, second = tape.nodes[a], tape.nodes[b]
    if first.op == second.op == "select" and first.args[2] == second.args[2] == zero:
        negated = tape.nodes[second.args[0]]
        if negated.op == "not" and negated.args[0] == first.args[0]:
            return tape.add("select", first.args[0], first.args[1], second.args[1])
    return tape.add("add", a, b)


def fixed(tape: Tape, arguments: set[int]) -> list[bool]:
    """For each node, whether it depends on nothing but constants and these arguments."""
    flags: list[bool] = []
    for node in tape.nodes:
        if node.op == "input":
            flags.append(isinstance(node.value, tuple) and node.value[0] in arguments)
        else:
            flags.append(all(flags[a] for a in node.args))
    return flags


def divide_less(tape: Tape, arguments: set[int]) -> Tape:
    """A tape of the same results with fewer divisions; `arguments` are the inputs that are constant during a run."""
    return _Rewriting(tape, arguments).target


class _Rewriting:
    """Copies a tape, turning a / b into a times the inverse of b where that inverse is constant, shared or at hand."""

    def __init__(self, source: Tape, arguments: set[int]) -> None:
        self._source, self.target = source, Tape()
        self._fixed = fixed(source, arguments)
        used = source.used()
        live = [(i, node) for i, node in enumerate(source.nodes) if used[i]]
        self._divisors = Counter(node.args[1] for _, node in live if node.op == "div")
        self._root = {node.args[0]: i for i, node in live if node.op == "sqrt"}
        self._map: list[int] = []
        for node in source.nodes:
            self._map.append(self._copy(node))
        self.target.results = [(element, self._map[node]) for element, node in source.results]

    def _copy(self, node: Node) -> int:
        target = self.target
        args = [self._map[a] for a in node.args]
        if node.op != "div":
            return target.add(node.op, *args, value=node.value)
        if tie := self._tie(node):
            return tie
        numerator, divisor = node.args
        if self._divisors[divisor] == 1 and not self._at_hand(divisor):
            return target.add("div", *args)
        inverse = self._inverse(divisor)
        return inverse if self._source.number(numerator) == 1.0 else target.add("mul", args[0], inverse)

    def _tie(self, node: Node) -> int | None:
        """a / (a + b) of truth values, which is how CasADi writes the derivative of fmax: 1, 1/2 at a tie, or 0."""
        source, target = self._source, self.target
        total = source.nodes[node.args[1]]
        values = [source.nodes[i] for i in (node.args[0], *total.args)]
        if total.op != "add" or any(v.op != "real" for v in values) or values[0] not in values[1:]:
            return None
        numerator, other = values[0], values[2] if values[0] == values[1] else values[1]
        a, b = self._map[numerator.args[0]], self._map[other.args[0]]
        neither = target.add("select", b, target.const(0.0), target.const(math.nan))
        return target.add("select", a, target.add("select", b, target.const(0.5), target.const(1.0)), neither)

    def _at_hand(self, index: int) -> bool:
        """Whether the inverse of a node costs no division of its own."""
        return self._fixed[index] or self._finer_root(index) is not None or self._factors(index) is not None

    def _finer_root(self, index: int) -> int | None:
        """The node sqrt(s) of a node s = sqrt(...), if something is divided by it: 1/s is its inverse squared."""
        root = self._root.get(index) if self._source.nodes[index].op == "sqrt" else None
        return root if root is not None and self._divisors[root] else None

    def _factors(self, index: int) -> tuple[int | None, int] | None:
        """The node as a constant (None: 2) times a rest whose inverse is needed anyway."""
        node = self._source.nodes[index]
        pairs = [(None, node.args[0])] if node.op == "add" and node.args[0] == node.args[1] else []
        if node.op == "mul":
            pairs = [(a, b) for a, b in (node.args, node.args[::-1]) if self._fixed[a]]
        return next((pair for pair in pairs if self._divisors[pair[1]] or self._at_hand(pair[1])), None)

    def _inverse(self, index: int) -> int:
        target = self.target
        number = self._source.number(index)
        if number:
            return target.const(1.0 / number)
        if (root := self._finer_root(index)) is not None:
            inverse = self._inverse(root)
            return target.add("mul", inverse, inverse)
        if not self._fixed[index] and (factors := self._factors(index)):
            constant, rest = factors
            factor = target.const(0.5) if constant is None else self._inverse(constant)
            return target.add("mul", factor, self._inverse(rest))
        return target.add("div", target.const(1.0), self._map[index])
