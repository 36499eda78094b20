"""A tape as LLVM IR: one value an operation, products fused into the sums that use them."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping

import casadi as ca

from . import vector_math
from .lanes import Code
from .tape import Tape, opcodes

_ELEMENTARY: dict[str, Callable[..., str]] = {
    "add": Code.add,
    "sub": Code.sub,
    "mul": Code.mul,
    "div": Code.div,
    "neg": Code.neg,
    "lt": lambda c, a, b: c.compare("olt", a, b),
    "le": lambda c, a, b: c.compare("ole", a, b),
    "eq": lambda c, a, b: c.compare("oeq", a, b),
    "ne": lambda c, a, b: c.compare("une", a, b),
    "and": lambda c, a, b: c.logic("and", a, b),
    "or": lambda c, a, b: c.logic("or", a, b),
    "not": lambda c, a: c.logic("xor", a, c.true),
    "real": lambda c, a: c.select(a, c.number(1.0), c.number(0.0)),
    "select": Code.select,
    **{
        name: (lambda c, *a, name=name: c.intrinsic(name, *a)) for name in ("sqrt", "fabs", "copysign", "floor", "ceil")
    },
    **{name: (lambda c, *a, name=name: c.lane_by_lane(name, *a)) for name in vector_math.LIBM},
    "sign": vector_math.sign,
    "exp": vector_math.exp,
    "log": vector_math.log,
    "tanh": vector_math.tanh,
    "sin": vector_math.sin,
    "cos": vector_math.cos,
    "pow": vector_math.power,
}
_READ_OTHERWISE = {
    "input",
    "output",
    "const",
    "assign",
    "sq",
    "twice",
    "inv",
    "if_else_zero",
    "constpow",
    "fmin",
    "fmax",
}
SUPPORTED = _ELEMENTARY.keys() | _READ_OTHERWISE


def first_unsupported(function: ca.Function) -> str | None:
    """Name of an operation of an SX function that has no compiled form, or None."""
    return min(opcodes(function) - SUPPORTED, default=None)


def emit(code: Code, tape: Tape, results: Iterable[int], given: Mapping[int, Callable[[], str]]) -> dict[int, str]:
    """Write what the `results` nodes need; returns their values by node. `given` are the nodes that can be loaded."""
    needed, uses = set(results), Counter(results)
    for index in range(max(needed, default=-1), -1, -1):
        if index in needed and index not in given:
            needed.update(tape.nodes[index].args)
            uses.update(tape.nodes[index].args)
    products = {i for i in needed - given.keys() if tape.nodes[i].op == "mul" and uses[i] == 1}
    fused = {}
    for index in needed - given.keys():
        node = tape.nodes[index]
        if node.op in ("add", "sub") and (factor := next((a for a in reversed(node.args) if a in products), None)):
            fused[index] = factor
    values: dict[int, str] = {}
    for index in sorted(needed - set(fused.values())):
        if index in given:
            values[index] = given[index]()
        elif index in fused:
            values[index] = _fused(code, tape, index, fused[index], values)
        else:
            values[index] = _plain(code, tape, index, values)
    return values


def _plain(code: Code, tape: Tape, index: int, values: Mapping[int, str]) -> str:
    node, number = tape.nodes[index], tape.number(index)
    if number is not None:
        return code.number(number)
    if node.op in ("fmin", "fmax"):
        a, b = node.args if tape.number(node.args[0]) is None else node.args[::-1]
        known = tape.number(b)
        condition = "olt" if node.op == "fmin" else "ogt"
        return vector_math.extreme(code, condition, values[a], values[b], known is not None and known == known)
    if node.op == "call":
        parts = (int(str(part.value)) for part in tape.nodes if part.op == "part" and part.args == (index,))
        return code.call(str(node.value), [values[a] for a in node.args], 1 + max(parts))
    if node.op == "part":
        return code.element(values[node.args[0]], int(str(node.value)))
    return _ELEMENTARY[node.op](code, *(values[a] for a in node.args))


def _fused(code: Code, tape: Tape, index: int, product: int, values: Mapping[int, str]) -> str:
    """x y + z, z - x y or x y - z in one rounding."""
    node = tape.nodes[index]
    x, y = (values[a] for a in tape.nodes[product].args)
    if node.op == "add":
        return code.fma(x, y, values[node.args[0] if node.args[1] == product else node.args[1]])
    if node.args[1] == product:
        return code.fma(code.neg(x), y, values[node.args[0]])
    return code.fma(x, y, code.neg(values[node.args[1]]))
