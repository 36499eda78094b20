"""A kernel as LLVM IR: its variables in memory, for the compiler to take into registers."""

import ast
import struct
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .kernel import KernelShape

_OPERATIONS = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "div"}
_COMPARISONS = {ast.Lt: "lt", ast.LtE: "le", ast.Gt: "gt", ast.GtE: "ge", ast.Eq: "eq", ast.NotEq: "ne"}
_ARRAYS = {"space": "double", "places": "i64"}
_FUNCTIONS = {"abs": "fabs", "sqrt": "sqrt"}
Value = tuple[str, str]  # type and name


def kernel_code(shape: "KernelShape") -> str:
    """IR of `name(ptr given, ptr found)`."""
    writer = _Writer(shape)
    for statement in shape.tree.body:
        writer.statement(statement)
    lines = [
        *(f"declare double @llvm.{name}.f64(double)" for name in _FUNCTIONS.values()),
        f"define void @{shape.name}(ptr noalias %given, ptr noalias %found) nounwind {{",
        "entry:",
        *writer.entry,
        f"  %told = getelementptr double, ptr %given, i64 {shape.given}",
        "  %number = load double, ptr %told",
        "  %address = fptoui double %number to i64",
        "  %tables = inttoptr i64 %address to ptr",
        *writer.lines,
        "  ret void",
        "}",
    ]
    return "\n".join(lines)


class _Writer:
    def __init__(self, shape: "KernelShape") -> None:
        self.entry: list[str] = []
        self.lines: list[str] = []
        self._shape, self._constants, self._first = shape, dict(shape.constants), shape.first
        self._variables: dict[str, Value] = {}
        self._arrays: dict[str, Value] = {"given": ("double", "%given"), "found": ("double", "%found")}
        self._count = 0

    def statement(self, node: ast.stmt) -> None:
        """Any that a kernel may have."""
        getattr(self, f"_{type(node).__name__.lower()}")(node)

    def _expr(self, node: Any) -> None:
        assert isinstance(node.value, ast.Constant), "a kernel has no statement but assignments, loops and branches"

    def _assign(self, node: Any) -> None:
        (target,), made = node.targets, self._shape.array(node.value)
        if made:
            kind, size = _ARRAYS[made[0]], made[1]
            self.entry.append(f"  %{target.id} = alloca [{size} x {kind}], align 64")
            self._arrays[target.id] = kind, f"%{target.id}"
        else:
            self._store(target, self._value(node.value))

    def _augassign(self, node: Any) -> None:
        self._store(node.target, self._binary(node.op, self._value(node.target), self._value(node.value)))

    def _store(self, target: Any, value: Value) -> None:
        if isinstance(target, ast.Name) and target.id not in self._variables:
            self.entry.append(f"  %{target.id} = alloca {value[0]}")
            self._variables[target.id] = value[0], f"%{target.id}"
        kind, address = self._variables[target.id] if isinstance(target, ast.Name) else self._element(target)
        assert kind == value[0], f"{ast.unparse(target)} is {kind} and becomes {value[0]}"
        self.lines.append(f"  store {kind} {value[1]}, ptr {address}")

    def _for(self, node: Any) -> None:
        arguments = [self._value(argument) for argument in node.iter.args]
        low, high = arguments if len(arguments) > 1 else [("i64", "0"), *arguments]
        self._store(node.target, low)
        self._loop(lambda: self._do(f"icmp slt i64 {self._value(node.target)[1]}, {high[1]}"), node.body, node.target)

    def _while(self, node: ast.While) -> None:
        self._loop(lambda: self._condition(node.test), node.body)

    def _loop(self, going: Any, body: list[ast.stmt], counter: Any = None) -> None:
        again, inside, after = self._labels("again", "inside", "after")
        self._branch(again)
        self._start(again)
        self.lines.append(f"  br i1 {going()}, label %{inside}, label %{after}")
        self._start(inside)
        for statement in body:
            self.statement(statement)
        if counter is not None:
            self._store(counter, ("i64", self._do(f"add nsw i64 {self._value(counter)[1]}, 1")))
        self._branch(again)
        self._start(after)

    def _if(self, node: ast.If) -> None:
        then, other, after = self._labels("then", "other", "after")
        self.lines.append(f"  br i1 {self._condition(node.test)}, label %{then}, label %{other}")
        for label, body in ((then, node.body), (other, node.orelse)):
            self._start(label)
            for statement in body:
                self.statement(statement)
            self._branch(after)
        self._start(after)

    def _condition(self, node: Any) -> str:
        if isinstance(node, ast.BoolOp):
            assert isinstance(node.op, ast.And), f"{ast.unparse(node)} is no `and`"
            first, second = (self._condition(value) for value in node.values)
            return self._do(f"and i1 {first}, {second}")
        if isinstance(node, ast.UnaryOp):
            return self._do(f"xor i1 {self._condition(node.operand)}, true")
        assert isinstance(node, ast.Compare)
        (op,), (right,) = node.ops, node.comparators
        (kind, a), (other, b), word = self._value(node.left), self._value(right), _COMPARISONS[type(op)]
        assert kind == other, f"{ast.unparse(node)} compares {kind} and {other}"
        if kind == "double":
            return self._do(f"fcmp {'une' if word == 'ne' else 'o' + word} double {a}, {b}")
        return self._do(f"icmp {word if word in ('eq', 'ne') else 's' + word} i64 {a}, {b}")

    def _value(self, node: Any) -> Value:
        if isinstance(node, ast.Constant):
            return self._number(node.value)
        if isinstance(node, ast.Name):
            if node.id in self._constants:
                return self._number(self._constants[node.id])
            kind, address = self._variables[node.id]
            return kind, self._do(f"load {kind}, ptr {address}")
        if isinstance(node, ast.Subscript):
            kind, address = self._element(node)
            return kind, self._do(f"load {kind}, ptr {address}")
        if isinstance(node, ast.BinOp):
            return self._binary(node.op, self._value(node.left), self._value(node.right))
        if isinstance(node, ast.UnaryOp):
            kind, value = self._value(node.operand)
            return kind, self._do(f"fneg double {value}" if kind == "double" else f"sub nsw i64 0, {value}")
        name, (argument,) = _FUNCTIONS[node.func.id], node.args
        return "double", self._do(f"call double @llvm.{name}.f64(double {self._value(argument)[1]})")

    def _binary(self, op: ast.operator, left: Value, right: Value) -> Value:
        assert left[0] == right[0], f"{left} and {right} differ in kind"
        word = _OPERATIONS[type(op)]
        word = f"f{word} contract" if left[0] == "double" else f"{word} nsw"
        return left[0], self._do(f"{word} {left[0]} {left[1]}, {right[1]}")

    def _element(self, node: Any) -> Value:
        name, at = node.value.id, self._value(node.slice)[1]
        if name in self._first:
            at, name = self._do(f"add nsw i64 {at}, {self._first[name]}"), "tables"
        kind, address = self._arrays.get(name, ("double", "%tables"))
        return kind, self._do(f"getelementptr inbounds {kind}, ptr {address}, i64 {at}")

    def _number(self, value: Any) -> Value:
        if isinstance(value, int):
            return "i64", str(value)
        return "double", f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"

    def _do(self, operation: str) -> str:
        self._count += 1
        self.lines.append(f"  %v{self._count} = {operation}")
        return f"%v{self._count}"

    def _labels(self, *words: str) -> list[str]:
        self._count += 1
        return [f"{word}{self._count}" for word in words]

    def _branch(self, label: str) -> None:
        self.lines.append(f"  br label %{label}")

    def _start(self, label: str) -> None:
        self.lines.append(f"{label}:")
