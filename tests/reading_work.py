"""Work for the process that reads files, good and bad."""

import os
import resource
import signal

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
