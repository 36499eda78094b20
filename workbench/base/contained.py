"""Readers of files that others made, in a process of their own: a damaged file may end it, or take no more than it may.

What it answers is text and arrays of numbers, of which none is code, whatever a file makes of the process. The process
stays for the next file. One that is ended while it reads is begun again for that file once, so that no file
answers for what another left behind.
"""

import atexit
import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from importlib import import_module
from io import BufferedReader
from math import prod
from pathlib import Path
from typing import IO, Any

import numpy as np

from .errors import InputError, clipped, short_path

try:
    import resource
except ImportError:  # Windows knows no such limits
    resource = None

MOST_MEMORY = 3 * 2**30  # bytes of address space
_SECONDS, _SECONDS_PER_MEBIBYTE = 60, 4  # of the processor, for a file
_IDLE = 60  # s, after which a process without a file ends
_NO_MEMORY = 3  # exit status
_ENVIRONMENT = {
    **dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "ARROW_IO_THREADS", "MALLOC_ARENA_MAX"), "1"),
    "ARROW_DEFAULT_MEMORY_POOL": "system",  # others set aside 1 GiB that they do not use
}
_BEGIN = "from workbench.base.contained import serve; serve()"
_LOST = (EOFError, OSError)
_MOST_TEXT = 2**28  # bytes, of an answer without its arrays
_NUMBERS = re.compile(r"[<>|][biuf]\d{1,2}")  # the types of arrays
_idle: "list[_Process]" = []


def contained(work: Callable[[Path], Iterator[Any]], path: Path) -> Generator[Any, None, None]:
    """What `work`, a function of a module, yields for a file, piece by piece, from a process with limits: numbers,
    text, None, arrays of numbers, and lists of these; a tuple comes as a list.

    Raises InputError where `work` does, for any other error in it, and where the process ends: by a fault of a
    library, or by more than MOST_MEMORY or the time that a file of this size may take.
    """
    seconds = _SECONDS + _SECONDS_PER_MEBIBYTE * path.stat().st_size // 2**20
    process, (kind, value) = _begun([os.getcwd(), seconds, work.__module__, work.__name__, str(path)], path, seconds)
    try:
        while kind == "piece":
            yield value
            kind, value = process.answer()
    except _LOST:
        raise process.died(path, seconds) from None
    finally:
        if kind == "piece":
            process.end()
        else:
            _idle.append(process)
    if kind == "refused":
        raise InputError(value)


def _begun(request: Any, path: Path, seconds: int) -> "tuple[_Process, tuple[str, Any]]":
    """A process that reads the file, and its first answer."""
    while True:
        try:
            process = _idle.pop()
        except IndexError:
            process = _Process()
        try:
            return process, process.asked(request)
        except _LOST:
            error = process.died(path, seconds)
            if process.files == 1:
                raise error from None
        except BaseException:  # Ctrl-C
            process.end()
            raise


class _Process:
    """A process that reads one file after the other."""

    def __init__(self) -> None:
        self.files = 0
        self._process = subprocess.Popen(
            [sys.executable, "-c", _BEGIN],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=os.environ | _ENVIRONMENT | {"PYTHONPATH": os.pathsep.join(map(os.path.abspath, sys.path))},
            start_new_session=True,  # Ctrl-C is for this process, which then ends that one
        )

    def asked(self, request: Any) -> tuple[str, Any]:
        """The first answer to a request."""
        self.files += 1
        assert self._process.stdin is not None
        _send(self._process.stdin, request)
        return self.answer()

    def answer(self) -> tuple[str, Any]:
        """The next answer to the same."""
        assert isinstance(self._process.stdout, BufferedReader)
        kind, value = _received(self._process.stdout)
        return kind, value

    def end(self) -> int:
        """End the process; its exit status, where it had ended before."""
        for pipe in (self._process.stdout, self._process.stdin):
            assert pipe is not None
            with suppress(OSError):  # of what it was never told
                pipe.close()
        try:
            return self._process.wait(0.1)
        except subprocess.TimeoutExpired:
            self._process.kill()
            return self._process.wait()

    def died(self, path: Path, seconds: int) -> InputError:
        """Why there is no answer."""
        status = self.end()
        if status == _NO_MEMORY:
            return InputError(f"{short_path(path)}: to read it takes more than {MOST_MEMORY >> 30} GiB; split it")
        if status == -getattr(signal, "SIGXCPU", 0):
            return InputError(f"{short_path(path)}: to read it takes more than {seconds} s; split it or export less")
        how = signal.Signals(-status).name if status < 0 else f"exit status {status}"
        return InputError(f"{short_path(path)}: it ends the library that reads it ({how}); record or export it again")


def _send(stream: IO[bytes], value: Any) -> None:
    """Write a value: the length of its text, its text, in which an array is its type and shape, then the arrays."""
    arrays: list[np.ndarray] = []

    def told(array: np.ndarray) -> dict[str, Any]:
        arrays.append(np.ascontiguousarray(array))
        return {"type": array.dtype.str, "shape": array.shape}

    text = json.dumps(value, default=told).encode()
    stream.write(len(text).to_bytes(8))
    stream.write(text)
    for array in arrays:
        stream.write(array.data if array.size else b"")
    stream.flush()


def _received(stream: BufferedReader) -> Any:
    """The value that was sent. Raises EOFError where there is none, or what is no value."""

    def array(told: dict[str, Any]) -> np.ndarray:
        if not _NUMBERS.fullmatch(told["type"]) or prod(told["shape"]) * int(told["type"][2:]) > MOST_MEMORY:
            raise ValueError
        values = np.empty(told["shape"], told["type"])
        if values.size and stream.readinto(values.reshape(-1).view(np.uint8).data) != values.nbytes:
            raise EOFError
        return values

    size = int.from_bytes(stream.read(8))
    if not 0 < size <= _MOST_TEXT:
        raise EOFError
    try:
        return json.loads(stream.read(size), object_hook=array)
    except (ValueError, TypeError, KeyError, RecursionError, MemoryError):
        raise EOFError from None


@atexit.register
def _end_all() -> None:
    while _idle:
        _idle.pop().end()


def serve() -> None:
    """Read one file after the other, as the process that asks says, until it asks for no more."""
    requests, answers = os.fdopen(0, "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print is no answer
    if resource is not None:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        _lower(resource.RLIMIT_AS, MOST_MEMORY)
    while True:
        if resource is not None:
            signal.alarm(_IDLE)
        try:
            folder, seconds, module, name, path = _received(requests)
        except EOFError:
            os._exit(0)
        os.chdir(folder)
        if resource is not None:
            signal.alarm(0)
            used = resource.getrusage(resource.RUSAGE_SELF)
            _lower(resource.RLIMIT_CPU, int(used.ru_utime + used.ru_stime) + seconds)
        for answer in _answers(getattr(import_module(module), name), Path(path)):
            _send(answers, answer)


def _lower(limit: int, most: int) -> None:
    assert resource is not None
    _, hard = resource.getrlimit(limit)
    with suppress(ValueError):  # of a macOS that does not limit the address space
        resource.setrlimit(limit, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


def _answers(work: Callable[[Path], Iterator[Any]], path: Path) -> Iterator[tuple[str, Any]]:
    try:
        for piece in work(path):
            yield "piece", piece
    except InputError as error:
        yield "refused", str(error)
    except MemoryError:
        os._exit(_NO_MEMORY)
    except Exception as error:  # of a library: struct.error, zlib.error, KeyError, ArrowException, a bare Exception ...
        reason = clipped((str(error).splitlines() or [type(error).__name__])[0])
        yield "refused", f"{short_path(path)}: broken {path.suffix[1:]} file ({reason}); record or export it again"
    else:
        yield "end", None
