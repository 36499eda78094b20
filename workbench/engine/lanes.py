"""LLVM IR for operations on vectors of doubles, one lane a plant, written as text.

Every lane runs the same IEEE operations whatever the width: one lane and eight agree to the last bit.
"""

import struct
from collections.abc import Callable, Sequence


class Code:
    """The body of one IR function, written an operation at a time; every method returns the name of its value."""

    def __init__(self, width: int, fused: bool, label: str = "entry") -> None:
        self.width, self.fused = width, fused
        self.lines: list[str] = []
        self.declared: set[str] = set()
        self.type, self.mask, self.bits = (self._vector(t) for t in ("double", "i1", "i64"))
        self.true = self._constant("i1", "true")
        self._suffix = "f64" if width == 1 else f"v{width}f64"
        self._label = label
        self._count = 0

    def _vector(self, scalar: str) -> str:
        return scalar if self.width == 1 else f"<{self.width} x {scalar}>"

    def _constant(self, scalar: str, digits: str) -> str:
        return digits if self.width == 1 else "<" + ", ".join([f"{scalar} {digits}"] * self.width) + ">"

    def write(self, line: str) -> None:
        """Append a line that has no value."""
        self.lines.append("  " + line)

    def do(self, operation: str) -> str:
        """Append an operation."""
        self._count += 1
        self.write(f"%v{self._count} = {operation}")
        return f"%v{self._count}"

    def number(self, value: float) -> str:
        """A constant in every lane."""
        return self._constant("double", f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}")

    def integer(self, value: int) -> str:
        """A 64-bit integer constant in every lane."""
        return self._constant("i64", str(value))

    def binary(self, op: str, a: str, b: str) -> str:
        """fadd, fsub, fmul or fdiv."""
        return self.do(f"{op} {self.type} {a}, {b}")

    def add(self, a: str, b: str) -> str:
        """a + b."""
        return self.binary("fadd", a, b)

    def sub(self, a: str, b: str) -> str:
        """a - b."""
        return self.binary("fsub", a, b)

    def mul(self, a: str, b: str) -> str:
        """a b."""
        return self.binary("fmul", a, b)

    def div(self, a: str, b: str) -> str:
        """a / b."""
        return self.binary("fdiv", a, b)

    def neg(self, a: str) -> str:
        """-a."""
        return self.do(f"fneg {self.type} {a}")

    def fma(self, a: str, b: str, c: str) -> str:
        """a b + c, rounded once where the processor can."""
        return self.intrinsic("fma", a, b, c) if self.fused else self.add(self.mul(a, b), c)

    def integers(self, op: str, a: str, b: str) -> str:
        """An operation on 64-bit integers."""
        return self.do(f"{op} {self.bits} {a}, {b}")

    def as_bits(self, a: str) -> str:
        """The bits of a double."""
        return self.do(f"bitcast {self.type} {a} to {self.bits}")

    def as_double(self, a: str) -> str:
        """The double with these bits."""
        return self.do(f"bitcast {self.bits} {a} to {self.type}")

    def compare(self, condition: str, a: str, b: str) -> str:
        """A mask: olt, ole, oeq, une, ogt, uno."""
        return self.do(f"fcmp {condition} {self.type} {a}, {b}")

    def logic(self, op: str, a: str, b: str) -> str:
        """and, or, xor of masks."""
        return self.do(f"{op} {self.mask} {a}, {b}")

    def select(self, mask: str, a: str, b: str) -> str:
        """a where the mask holds, else b."""
        return self.do(f"select {self.mask} {mask}, {self.type} {a}, {self.type} {b}")

    def intrinsic(self, name: str, *args: str) -> str:
        """An LLVM intrinsic on vectors: sqrt, fabs, copysign, floor, ceil, fma."""
        full = f"@llvm.{name}.{self._suffix}"
        self.declared.add(f"declare {self.type} {full}({', '.join([self.type] * len(args))})")
        return self.do(f"call {self.type} {full}({', '.join(f'{self.type} {a}' for a in args)})")

    def lane_by_lane(self, name: str, *args: str) -> str:
        """A function of the C library, called once a lane."""
        self.declared.add(f"declare double @{name}({', '.join(['double'] * len(args))})")
        if self.width == 1:
            return self.do(f"call double @{name}({', '.join(f'double {a}' for a in args)})")
        result = "undef"
        for lane in range(self.width):
            scalars = [self.do(f"extractelement {self.type} {a}, i32 {lane}") for a in args]
            value = self.do(f"call double @{name}({', '.join(f'double {a}' for a in scalars)})")
            result = self.do(f"insertelement {self.type} {result}, double {value}, i32 {lane}")
        return result

    def call(self, name: str, given: Sequence[str], found: int) -> str:
        """Call a kernel; the address of what it finds. In one lane only."""
        assert self.width == 1, "a kernel computes one lane at a time"
        self.declared.add(f"declare void @{name}(ptr, ptr)")
        to, back = self.do(f"alloca [{len(given)} x double]"), self.do(f"alloca [{found} x double]")
        for k, value in enumerate(given):
            self.write(f"store double {value}, ptr {self.do(f'getelementptr double, ptr {to}, i64 {k}')}")
        self.write(f"call void @{name}(ptr {to}, ptr {back})")
        return back

    def element(self, array: str, place: int) -> str:
        """An element of an array in memory."""
        return self.do(f"load double, ptr {self.do(f'getelementptr double, ptr {array}, i64 {place}')}")

    def bits_of(self, mask: str) -> str:
        """The mask as an integer, lane 0 in the lowest bit."""
        packed = mask if self.width == 1 else self.do(f"bitcast {self.mask} {mask} to i{self.width}")
        return self.do(f"zext i{self.width} {packed} to i64")

    def usually(self, mask: str, value: str, other: Callable[[], str]) -> str:
        """`value` where the mask holds; elsewhere `other`, which is computed only if some lane needs it."""
        self._count += 1
        slow, join, before = f"slow{self._count}", f"join{self._count}", self._label
        everywhere = self.do(f"icmp eq i64 {self.bits_of(mask)}, {(1 << self.width) - 1}")
        self.write(f"br i1 {everywhere}, label %{join}, label %{slow}")
        self._start(slow)
        patched = self.select(mask, value, other())
        after = self._label
        self.write(f"br label %{join}")
        self._start(join)
        return self.do(f"phi {self.type} [{value}, %{before}], [{patched}, %{after}]")

    def _start(self, label: str) -> None:
        self.lines.append(f"{label}:")
        self._label = label

    def polynomial(self, coefficients: Sequence[float], x: str) -> str:
        """sum c_i x^i: even and odd powers apart, which halves the chain of operations that wait for each other."""
        square = self.mul(x, x)
        return self.fma(self._horner(coefficients[1::2], square), x, self._horner(coefficients[::2], square))

    def _horner(self, coefficients: Sequence[float], x: str) -> str:
        total = self.number(coefficients[-1])
        for c in reversed(coefficients[:-1]):
            total = self.fma(total, x, self.number(c))
        return total
