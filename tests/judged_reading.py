"""What a reading must not do: take long, fail with any other error, repeat the input, give numbers without end."""

import ast
import faulthandler
import resource
import signal
import traceback
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
from mutants import LONG

# the document itself; what may be without limit
UNCHECKED = ("source", "rate", "overshoot_percent", "load_left", "bound")
GIVEN_UP = 120.0  # s, of a machine that may be busy
ECHOED = 80  # characters of the input that a message may repeat


class TooSlow(BaseException):
    """A reading that took its time; no reader may catch it."""


def bad_message(message: str) -> str:
    """What is wrong with an error's message; nothing where it is one line that repeats little of the input."""
    after_path = message.partition(": ")[2]
    if not message or len(after_path.splitlines()) > 1:
        return f"not one line: {message[:300]!r}"
    if LONG[: ECHOED + 1] in after_path:
        return f"repeats more than {ECHOED} characters: {message[:300]!r}"
    return ""


def unbounded(value: Any, where: str = "") -> str:
    """Where a number that is not finite is in what a reader gave; nothing where all are finite."""
    if isinstance(value, np.ndarray | float | complex):
        return "" if np.all(np.isfinite(value)) else f"{where[:200]} not finite"
    checked = {key: entry for key, entry in _entries(value) if key not in UNCHECKED}
    return next(filter(None, (unbounded(entry, f"{where}.{key}") for key, entry in checked.items())), "")


def _entries(value: Any) -> Iterable[tuple[Any, Any]]:
    if is_dataclass(value):
        return ((entry.name, getattr(value, entry.name)) for entry in fields(value))
    if isinstance(value, Mapping):
        return value.items()
    return enumerate(value) if isinstance(value, tuple | list) else ()


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raises TooSlow in what takes more than `seconds` of the processor.

    A loop inside a C function hears no signal: after GIVEN_UP seconds of any clock the process says where it is, and
    ends.
    """

    def stop(signum: int, frame: FrameType | None) -> None:
        raise TooSlow(f"more than {seconds:g} s")

    faulthandler.dump_traceback_later(GIVEN_UP, exit=True)
    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
        faulthandler.cancel_dump_traceback_later()


def peak_memory() -> int:
    """The most memory [byte] that this process ever had."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def raise_sites(file: str) -> set[tuple[str, int]]:
    """Where a file raises an error of its own: the lines of its `raise` statements."""
    nodes = ast.walk(ast.parse(Path(file).read_text(encoding="utf-8")))
    return {(file, node.lineno) for node in nodes if isinstance(node, ast.Raise) and node.exc is not None}


def sites(error: BaseException | None) -> Iterator[tuple[str, int]]:
    """Where an error was raised, and those that led to it."""
    while error is not None:
        frames = traceback.extract_tb(error.__traceback__)
        yield from ((frame.filename, frame.lineno or 0) for frame in frames[-1:])
        error = error.__cause__ or error.__context__
