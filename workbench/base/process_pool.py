"""Worker processes that do the stages of a study: of this machine, a core each, or of a cluster."""

import multiprocessing
import os
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import cache, partial
from threading import Lock, Thread
from time import process_time
from typing import Any, TypeVar

from threadpoolctl import threadpool_limits

from .checkpoint import Stage
from .cluster import IN_FLIGHT, Cluster, cluster_workers
from .errors import InputError

A = TypeVar("A")
B = TypeVar("B")
Jobs = int | Cluster  # worker processes of this machine, or those of a cluster
ProcessPool = Callable[[Mapping[str, A], Stage, Callable[[B], None]], list[B]]

_work: Callable[[], Callable[[Any], Any]]  # of a worker process: made at its first item
_told = 0.0  # s: of a worker process's CPU time, what its parent has heard of


class _Elsewhere:
    """CPU time [s] of the items that other processes did for this one."""

    def __init__(self) -> None:
        self.spent, self._lock = 0.0, Lock()

    def unwrapped(self, work: Callable[[A], tuple[B, float]]) -> Callable[[A], B]:
        """`work` that tells its CPU time [s] too, as work whose time counts here."""

        def counted(item: A) -> B:
            result, spent = work(item)
            with self._lock:
                self.spent += spent
            return result

        return counted


_elsewhere = _Elsewhere()


def cpu_time() -> float:
    """CPU time [s] of this process, and of its workers on this machine in the items that they have done."""
    return process_time() + _elsewhere.spent


def one_blas_thread() -> threadpool_limits:
    """BLAS on one thread inside this context.

    The engine has a thread a core, and matrices here are so small that more threads gain nothing; but idle BLAS
    threads spin, and on two cores the engine then takes three to six times as long.
    """
    return threadpool_limits(limits=1, user_api="blas")


@contextmanager
def process_pool(jobs: Jobs, make: Callable[[], Callable[[A], B]]) -> Iterator[ProcessPool[A, B]]:
    """A function (items by name, stage, done) -> results in their order: every item is a stage, done by a worker.

    Each of `jobs` worker processes, or of a cluster's, calls `make` once for the work that it does on items; with one
    job, and only when there is something to do, this process. `make` and items have to be picklable. `done` hears of
    every result as it comes. Raises ClusterError.
    """
    if jobs == 1:
        made = cache(make)
        with one_blas_thread():
            yield lambda items, stage, done: _in_turn(items, lambda item: made()(item), stage, done)
        return
    threads = IN_FLIGHT if isinstance(jobs, Cluster) else jobs
    workers = cluster_workers(jobs, make) if isinstance(jobs, Cluster) else worker_processes(jobs, make)
    with (
        ThreadPoolExecutor(threads) as waiting,
        workers as work,
    ):  # each thread waits for a worker, and stores what it did
        yield partial(_shared, waiting, Lock(), work)


@contextmanager
def worker_processes(jobs: int, make: Callable[[], Callable[[A], B]]) -> Iterator[Callable[[A], B]]:
    """A function that does an item in a worker process. They are spawned: forking one with threads may lock it up."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, context, initializer=_begin, initargs=(make,)) as pool:
        try:
            yield _elsewhere.unwrapped(lambda item: pool.submit(_call, item).result())
        except BrokenProcessPool:
            raise InputError(
                "a worker process ended by itself: for want of memory take fewer jobs; a script of your own asks for "
                'several below `if __name__ == "__main__":`'
            ) from None
        except KeyboardInterrupt:  # which a signal to this process alone does not bring to them
            for worker in multiprocessing.active_children():
                worker.terminate()
            raise
        finally:  # once, and to the end: a second shutdown waits for nothing
            pool.shutdown(wait=True, cancel_futures=True)


def _shared(
    threads: ThreadPoolExecutor,
    lock: Lock,
    work: Callable[[A], B],
    items: Mapping[str, A],
    stage: Stage,
    done: Callable[[B], None],
) -> list[B]:
    def report(result: B) -> None:
        with lock:
            done(result)

    waiting = [threads.submit(_in_turn, {name: item}, work, stage, report) for name, item in items.items()]
    try:
        return [result for future in waiting for result in future.result()]
    finally:
        for future in waiting:
            future.cancel()


def _in_turn(items: Mapping[str, A], work: Callable[[A], B], stage: Stage, done: Callable[[B], None]) -> list[B]:
    results = []
    for name, item in items.items():
        results.append(stage(name, lambda item=item: work(item)))
        done(results[-1])
    return results


def _begin(make: Callable[[], Callable[[Any], Any]]) -> None:
    """A worker whose parent was killed would wait for ever."""
    global _work
    parent = multiprocessing.parent_process()

    def wait() -> None:
        if parent is not None:
            parent.join()
        os._exit(1)

    Thread(target=wait, daemon=True).start()
    threadpool_limits(limits=1, user_api="blas")
    _work = cache(make)


def _call(item: Any) -> tuple[Any, float]:
    """The result, and the CPU time [s] of this process since the last one: its start counts too."""
    global _told
    result = _work()(item)
    before, _told = _told, process_time()
    return result, _told - before
