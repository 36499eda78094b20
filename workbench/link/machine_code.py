"""The machine code of a served rig: rig.ll with its shorthands written out, compiled once and kept."""

import ctypes
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from ..engine import object_cache
from ..engine.jobs import KINDS, Fields

_NUMBERS = "socket length address_length owner_length attention sequence tick flags state trip limited fresh arrived "
_NUMBERS += "overtaken silent watchdog asked refused dropped missed periods readings worst due period_ns clock_id "
_NUMBERS += "dontwait states commands channels limits late interpolated normal_row normal_rows reading_size "
_NUMBERS += "jitter_bins age_bins"
_ADDRESSES = "run run_job run_next duration first_step failed x reached u p outputs output_job output_next y "
_ADDRESSES += (
    "columns noise resolution normal limit_column limit_middle limit_size low high rate command demanded line "
)
_ADDRESSES += "valve_place valve_open valve_leak valve_time packet address owner reading jitter ages"
_FIELDS: Fields = (
    *((name, ctypes.c_void_p) for name in _ADDRESSES.split()),
    *((name, ctypes.c_int64) for name in _NUMBERS.split()),
    *((name, ctypes.c_double) for name in ["period", "part", "first_part", "second_part", "closed"]),
)
_TIMER_SLACK = 29  # of prctl
_GET = re.compile(r"^(\s*)(%[\w.]+) = get (\w+)$")
_SET = re.compile(r"^(\s*)set (\w+), (\S+)$")
_AT = re.compile(r"^(\s*)(%[\w.]+) = at (\w+) (\S+), (\S+)$")
_PUT = re.compile(r"^(\s*)put (\w+) (\S+), (\S+), (\S+)$")


class LinkJob(ctypes.Structure):
    """All that the machine code of a served rig reads and writes; rig.ll says what each field is for."""

    _fields_ = _FIELDS


@dataclass(frozen=True)
class RigCode:
    """Its functions, each of a LinkJob: `sample`, `step`, `answer`, the two that serve until Python is needed, and
    `idle`, which only keeps the clock. They are there as long as their library is held."""

    library: object_cache.Library
    sample: Callable[[int], None]
    step: Callable[[int], None]
    answer: Callable[[int], None]
    lockstep: Callable[[int], int]
    realtime: Callable[[int], int]
    idle: Callable[[int], None]


@cache
def rig_code() -> RigCode:
    """Compiled, or from the cache. Raises OSError or RuntimeError where this machine cannot compile."""
    if sys.platform == "win32":
        raise OSError("its sockets and its clock are those of Linux and macOS")
    names = ("sample", "step", "answer", "lockstep", "realtime", "idle")
    text = _written_out((Path(__file__).parent / "rig.ll").read_text(encoding="utf-8"))
    library = object_cache.load(("link", text), lambda: text, names)
    results = (None, None, None, ctypes.c_int64, ctypes.c_int64, None)
    kinds = (ctypes.CFUNCTYPE(result, ctypes.c_void_p) for result in results)
    return RigCode(library, *(kind(library[name]) for kind, name in zip(kinds, names, strict=True)))


def set_addresses(job: LinkJob, **arrays: np.ndarray) -> None:
    """Tell a job where arrays are; who calls keeps them alive."""
    for name, array in arrays.items():
        setattr(job, name, array.ctypes.data)


def exact_timers() -> None:
    """Let this thread wake up when it asked to, where the system would else bundle wake-ups (Linux: 50 us)."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_TIMER_SLACK, 1, 0, 0, 0)


def _written_out(text: str) -> str:
    kinds = ", ".join(KINDS[kind] for _, kind in _FIELDS)
    lines = [f"%link = type {{{kinds}}}"]
    for number, line in enumerate(text.splitlines()):
        lines += _line(line, number)
    return "\n".join(lines)


def _line(line: str, number: int) -> Sequence[str]:
    """A line of rig.ll as lines of IR."""
    if match := _GET.match(line):
        space, value, field = match.groups()
        return _field(field, f"%f{number}"), f"{space}{value} = load {_kind(field)}, ptr %f{number}"
    if match := _SET.match(line):
        space, field, value = match.groups()
        return _field(field, f"%f{number}"), f"{space}store {_kind(field)} {value}, ptr %f{number}"
    if match := _AT.match(line):
        space, value, kind, base, index = match.groups()
        return _element(base, index, f"%e{number}"), f"{space}{value} = load {kind}, ptr %e{number}"
    if match := _PUT.match(line):
        space, kind, value, base, index = match.groups()
        return _element(base, index, f"%e{number}"), f"{space}store {kind} {value}, ptr %e{number}"
    return (line,)


def _field(name: str, address: str) -> str:
    place = [field for field, _ in _FIELDS].index(name)
    return f"  {address} = getelementptr %link, ptr %job, i32 0, i32 {place}"


def _element(base: str, index: str, address: str) -> str:
    return f"  {address} = getelementptr i64, ptr {base}, i64 {index}"


def _kind(field: str) -> str:
    return KINDS[dict(_FIELDS)[field]]
