"""Workers give what one process gives, in order; what they raise comes through, and they make their tools once."""

import os
import threading
import time
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress

import pytest

from workbench.base.errors import InputError
from workbench.base.process_pool import process_pool, worker_processes
from workbench.commands.common.outcome import no_checkpoint


def squares():
    made = os.getpid()
    return lambda number: {"square": number**2, "made": made, "pid": os.getpid()}


def sleeps():
    return time.sleep


def refuses():
    raise InputError("rig: no equilibrium; ask for less")


ITEMS = {f"item-{i}": i for i in range(6)}


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_come_in_order_and_all_are_told(jobs):
    told = []
    with process_pool(jobs, squares) as work:
        first, second = work(ITEMS, no_checkpoint, told.append), work({"more": 7}, no_checkpoint, told.append)
    assert [one["square"] for one in (*first, *second)] == [0, 1, 4, 9, 16, 25, 49]
    assert sorted(one["square"] for one in told) == [0, 1, 4, 9, 16, 25, 49]
    assert all(one["made"] == one["pid"] for one in first)
    assert (os.getpid() in {one["pid"] for one in first}) is (jobs == 1)


def test_what_is_stored_is_not_done_again():
    with process_pool(1, refuses) as work:
        assert work(ITEMS, lambda name, _: name, lambda _: None) == list(ITEMS)


@pytest.mark.parametrize("jobs", [1, 2])
def test_bad_input_comes_through(jobs):
    with pytest.raises(InputError, match="no equilibrium; ask for less"), process_pool(jobs, refuses) as work:
        work(ITEMS, no_checkpoint, lambda _: None)


def test_what_is_interrupted_leaves_no_thread_behind():
    """One that still closes the pool's pipes while Python ends would write a traceback on the screen."""
    before, under_way = set(threading.enumerate()), threading.Event()

    def wait(work):
        under_way.set()
        with suppress(BrokenProcessPool):
            work(60)

    with suppress(KeyboardInterrupt), worker_processes(1, sleeps) as work:
        asked = threading.Thread(target=wait, args=(work,), daemon=True)
        asked.start()
        under_way.wait()
        time.sleep(0.5)
        raise KeyboardInterrupt
    assert {thread.name for thread in set(threading.enumerate()) - before - {asked}} == set()
