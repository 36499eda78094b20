"""Work for the process that reads files, good and bad."""

import os
import pickle
import resource
import signal

import numpy as np

from workbench.base.contained import MOST_MEMORY


def numbers(path):
    yield from range(3)


def printing(path):
    print("what a library prints")
    os.write(1, b"\x80\x04what C prints")
    yield "read"


def ends(path):
    yield 1
    os.kill(os.getpid(), signal.SIGSEGV)


def fails(path):
    raise KeyError("two\nlines " + "q" * 500)


def takes_memory(path):
    yield bytearray(MOST_MEMORY)


def takes_time(path):
    resource.setrlimit(resource.RLIMIT_CPU, (1, resource.getrlimit(resource.RLIMIT_CPU)[1]))
    while True:
        pass


def process_number(path):
    yield os.getpid()


def arrays(path):
    yield [np.arange(6.0).reshape(2, 3).T, np.zeros((0, 4), np.int16), [True, None, 1.5, "ä\ud800"]]
    yield ("x", np.array([2**62 + 1, -1])), np.array([True]), np.float32([np.nan, np.inf])


def objects(path):
    yield np.array([{}, 1], dtype=object)


class _Code:
    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (f"{self.path}.made",)


def subverted(path):
    """Answer what a file that took the process over may want to."""
    for descriptor in range(3, 12):
        try:
            os.write(descriptor, pickle.dumps(("piece", _Code(path))) + b"\n" * 100)
        except OSError:
            continue
    os._exit(0)
