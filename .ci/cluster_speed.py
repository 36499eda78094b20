"""What a cluster costs: the overhead of a task, and the efficiency of tasks of a second, over 1, 2 and 64 workers.

    .ci/cluster_speed.py [WORKERS ...]

Scheduler and workers are processes of this machine; tasks sleep, so that few cores stand for as many as there are
workers. The overhead is the time of a task that does nothing, from the first to the last result, through the pool that
every command uses, and beside it the CPU time of the busiest of command, scheduler and workers, which is what holds a
cluster up whose parts have machines of their own. The efficiency is that of tasks of a second.
"""

import asyncio
import logging
import multiprocessing
import sys
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager
from functools import partial
from socket import socket
from tempfile import TemporaryDirectory
from time import perf_counter, process_time, sleep
from typing import Any

import dask
from distributed import Client, Scheduler, Worker

from workbench.base.checkpoint import no_checkpoint
from workbench.base.cluster import Cluster, cluster_at, installation
from workbench.base.process_pool import ProcessPool, process_pool

_EMPTY, _LONG, _ROUNDS = 1000, 1.0, 20  # empty tasks; s of a long one; long ones a worker
_STARTS = 60.0  # s within which all workers join
_QUIET = {  # what workers do besides takes 3 % of a core each, which 64 of them share here
    "distributed.worker.profile.enabled": False,
    "distributed.admin.system-monitor.interval": "1 minute",
    "distributed.admin.tick.interval": "1 minute",
    "distributed.admin.tick.limit": "5 minutes",
}


@contextmanager
def local_cluster(workers: int) -> Iterator[Cluster]:
    """A scheduler and worker processes of one thread; forked, so that 64 of them start within seconds."""
    with socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    fork = multiprocessing.get_context("fork")
    installation()  # worked out once: 64 machines would each do it by themselves
    with TemporaryDirectory() as place, dask.config.set(_QUIET):
        parts = [_schedules, *(partial(_works, f"{place}/{number}") for number in range(workers))]
        started = [fork.Process(target=_serves, args=(part, address), daemon=True) for part in parts]
        for process in started:
            process.start()
        try:
            with Client(address, timeout=_STARTS, set_as_default=False) as client:
                client.wait_for_workers(workers, _STARTS)
            yield cluster_at(address)
        finally:
            for process in reversed(started):
                process.kill()
                process.join()


def _serves(part: Callable[[str], Coroutine[Any, Any, None]], address: str) -> None:
    logging.disable()
    asyncio.run(part(address))


async def _schedules(address: str) -> None:
    async with Scheduler(host=address, dashboard=False) as scheduler:
        await scheduler.finished()


async def _works(place: str, address: str) -> None:
    async with Worker(address, nthreads=1, dashboard=False, local_directory=place) as worker:
        await worker.finished()


def took(pool: ProcessPool[float, None], count: int, seconds: float) -> float:
    """Time [s] of so many tasks."""
    began = perf_counter()
    pool({f"task-{number}": seconds for number in range(count)}, no_checkpoint, lambda _: None)
    return perf_counter() - began


def measured(workers: int) -> str:
    """A line of the table."""
    with (
        local_cluster(workers) as cluster,
        process_pool(cluster, partial(partial, sleep)) as pool,
        Client(cluster.address, set_as_default=False) as client,
    ):
        took(pool, 4 * workers, 0.1)  # each worker imports what it needs
        before = _cpu(client)
        empty = took(pool, _EMPTY, 0.0)
        busiest = max(after - first for after, first in zip(_cpu(client), before, strict=True))
        long = took(pool, _ROUNDS * workers, _LONG)
    overheads = f"{1e3 * empty / _EMPTY:11.2f}  {1e3 * busiest / _EMPTY:10.2f}"
    return f"{workers:7d}  {overheads}  {100 * _ROUNDS * _LONG / long:12.1f}"


def _cpu(client: Client) -> list[float]:
    """CPU time [s] so far of this process, the scheduler and the workers."""
    workers: Any = client.run(process_time)
    return [process_time(), client.run_on_scheduler(process_time), *workers.values()]


if __name__ == "__main__":
    print("workers  overhead ms  of CPU, ms  efficiency %")
    for count in [int(word) for word in sys.argv[1:]] or [1, 2, 64]:
        print(measured(count), flush=True)
