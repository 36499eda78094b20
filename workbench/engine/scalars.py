"""Scalar IR around a job, written a line at a time."""

from .jobs import KINDS, Job


class Scalars:
    """Loads, stores, address arithmetic and blocks, written a line at a time."""

    def __init__(self, job: Job, name: str) -> None:
        self._type = name
        self._names = [field for field, _ in job.FIELDS]
        self._kinds = dict(job.FIELDS)
        self.lines: list[str] = []
        self._count = 0

    def do(self, operation: str) -> str:
        """Append an operation; returns the name of its value."""
        self._count += 1
        self.lines.append(f"  %i{self._count} = {operation}")
        return f"%i{self._count}"

    def write(self, line: str) -> None:
        """Append a line without a value; one that ends in a colon starts a block."""
        self.lines.append(line if line.endswith(":") else "  " + line)

    def get(self, name: str) -> str:
        """Value of a field of the job."""
        return self.do(f"load {KINDS[self._kinds[name]]}, ptr {self.field(name)}")

    def field(self, name: str) -> str:
        """Address of a field of the job."""
        return self.do(f"getelementptr {self._type}, ptr %job, i32 0, i32 {self._names.index(name)}")

    def at(self, base: str, index: str | int) -> str:
        """Address of an element of an array of numbers."""
        return self.do(f"getelementptr i64, ptr {base}, i64 {index}")

    def load(self, base: str, index: str | int, kind: str = "double") -> str:
        """Element of an array."""
        return self.do(f"load {kind}, ptr {self.at(base, index)}")

    def store(self, value: str, base: str, index: str | int, kind: str = "double") -> None:
        """Set an element of an array."""
        self.write(f"store {kind} {value}, ptr {self.at(base, index)}")

    def integer(self, op: str, a: str, b: str | int) -> str:
        """Arithmetic on 64-bit integers."""
        return self.do(f"{op} i64 {a}, {b}")

    def branch(self, condition: str, yes: str, no: str) -> None:
        """End a block."""
        self.write(f"br i1 {condition}, label %{yes}, label %{no}")

    def take(self) -> tuple[str, str]:
        """The next trajectory of the job, and whether there was one."""
        lane = self.do(f"atomicrmw add ptr {self.field('next')}, i64 1 monotonic")
        return lane, self.do(f"icmp slt i64 {lane}, {self.get('lanes')}")
