"""What a run takes and gives: its stepping, the jobs that machine code reads, the frame of a block, and a batch."""

import ctypes
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

KINDS = {ctypes.c_void_p: "ptr", ctypes.c_int64: "i64", ctypes.c_double: "double"}
Fields = tuple[tuple[str, type[ctypes.c_void_p] | type[ctypes.c_int64] | type[ctypes.c_double]], ...]


def _fields(addresses: str, integers: str, numbers: str = "") -> Fields:
    kinds = ((addresses, ctypes.c_void_p), (integers, ctypes.c_int64), (numbers, ctypes.c_double))
    return tuple((name, kind) for names, kind in kinds for name in names.split())


class RunJob(ctypes.Structure):
    """Arguments of `run`: addresses, counts and strides in numbers, limits."""

    FIELDS = _fields(
        "x0 duration u p x attempts failed sample law rows_in numbers rows_out",
        "next lanes rows every records t_lane u_lane p_lane "
        "parts law_lane in_lane in_row numbers_lane out_lane out_row",
        "first_step tolerance cap rate burst",
    )
    _fields_ = FIELDS

    def stop(self) -> None:
        """Let the lanes that run fail at their next interval, and begin no other."""
        self.next, self.cap = self.lanes, 0.0


class OutputJob(ctypes.Structure):
    """Arguments of `outputs`: addresses, counts and strides in numbers."""

    FIELDS = _fields("x u p y", "next lanes rows u_lane u_row p_lane p_row")
    _fields_ = FIELDS

    def stop(self) -> None:
        """Begin no other lane."""
        self.next = self.lanes


Job = type[RunJob] | type[OutputJob]


@dataclass(frozen=True)
class Stepping:
    """How attempts are made: their tolerance, the first step of a run [s], how many an interval may take, and how many
    a run may have taken at any of its moments: `burst`, and `rate` for each second [1/s] that it has come."""

    tolerance: float
    first_step: float
    cap: int
    rate: float = np.inf
    burst: float = np.inf

    @property
    def limits(self) -> dict[str, float]:
        """The fields that a job has, but for the first step."""
        return {"tolerance": self.tolerance, "cap": self.cap, "rate": self.rate, "burst": self.burst}

    def spent(self, attempts: int, seconds: float) -> bool:
        """Whether a run that failed within so many seconds had no attempts left, rather than no way on."""
        return attempts >= self.burst + self.rate * seconds * (1 - 1e-9)


@dataclass(frozen=True)
class Batch:
    """States x [lanes, rows, n], attempts [lanes], and for each lane the interval in which it failed, or -1; from
    there on its states are NaN."""

    x: np.ndarray
    attempts: np.ndarray
    failed: np.ndarray

    @property
    def ok(self) -> np.ndarray:
        """Lanes that were integrated to the end, bool [lanes]."""
        return self.failed < 0


@dataclass(frozen=True)
class Frame:
    """The places of a block's numbers, in units of eight bytes: element i of lane w stands at i width + w.

    `commands`: how many of the inputs, the first ones, are commands that may change inside a period.
    """

    width: int
    n: int
    inputs: int
    parameters: int
    prepared: int
    commands: int = 1

    @property
    def places(self) -> dict[str, int]:
        """First element of each part, and the end; the state x is followed by time left, step and attempts."""
        sizes = {"x": self.n, "left": 1, "step": 1, "attempts": 1, "u": self.inputs, "p": self.parameters}
        sizes |= {"tolerance": 1, "prepared": self.prepared, "limit": 1, "budget": 1}
        sizes |= {"lane": 1, "row": 1, "clock": 1, "input": 1, "target": 1, "wait": 1}
        sizes |= {"law": 1, "row_in": 1, "numbers": 1, "row_out": 1, "end": 0}
        ends = accumulate(sizes.values())
        return {name: (end - size) * self.width for (name, size), end in zip(sizes.items(), ends, strict=True)}


def structure(job: Job) -> str:
    """The IR type of a job."""
    return "{" + ", ".join(KINDS[kind] for _, kind in job.FIELDS) + "}"
