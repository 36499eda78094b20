"""Worker processes of other machines: a Dask cluster that the user has started, with jackbench on every worker.

Dask carries bytes only, so that results are those of a process of this machine. The task of a worker that dies goes to
another worker. Whatever else ends the work is a ClusterError: what is done is kept, and the same command resumes.
"""

import asyncio
import logging
import pickle
import platform
import socket
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, lru_cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any, TypeVar
from urllib.parse import urlsplit
from uuid import uuid4

from threadpoolctl import threadpool_limits

from .errors import ClusterError, InputError
from .trust import granted, lent

if TYPE_CHECKING:
    from distributed import Client, Future as DaskFuture

Installation = tuple[tuple[str, str], ...]  # name and version

_ROOT = Path(__file__).parents[2]
_CODE = "workbench", "controllers"
_LIBRARIES = "numpy", "scipy", "casadi", "control", "llvmlite"
A = TypeVar("A")
B = TypeVar("B")

IN_FLIGHT = 256  # tasks that wait at the scheduler, so that no worker waits for one
_ANSWERS, _JOINS = 10.0, 60.0  # s within which a scheduler answers, and a first worker joins
_SCHEMES = "tcp", "tls"
_START = "`dask worker {address} --nworkers auto --nthreads 1`"

_one_at_a_time = Lock()  # in a worker with several threads: an engine is not theirs to share


@cache
def installation() -> Installation:
    """jackbench with the digest of its code, Python, and the libraries that compute."""
    own = f"{_version('jackbench')} ({_digest()})"
    return ("jackbench", own), ("Python", platform.python_version()), *((name, _version(name)) for name in _LIBRARIES)


def differences(here: Installation, there: Installation) -> str:
    """What differs there, and from what it differs here; nothing where all is the same."""
    ours = dict(here)
    return ", ".join(f"{name} {version}, not {ours[name]}" for name, version in there if version != ours[name])


def _digest() -> str:
    code = sha256()
    for path in sorted(path for package in _CODE for path in (_ROOT / package).rglob("*.py")):
        code.update(path.relative_to(_ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    return code.hexdigest()[:12]


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


@dataclass(frozen=True)
class Cluster:
    """A Dask cluster by the address of its scheduler, tcp://HOST:PORT or tls://HOST:PORT."""

    address: str


@dataclass(frozen=True)
class _Work:
    """What a worker needs before its first item: `make`, pickled, and what the sender has installed and trusts."""

    make: bytes
    installation: Installation
    trusted: str


def cluster_at(address: str) -> Cluster:
    """The cluster at HOST:PORT, with or without tcp:// or tls:// before it.

    Raises InputError for what is no address or does not answer, and where the group `cluster` is not installed.
    """
    whole = address if "://" in address else f"tcp://{address}"
    place = _host_and_port(whole)
    if place is None:
        raise InputError(f"--cluster {address}: not the address of a scheduler, such as tcp://192.168.0.7:8786")
    if find_spec("distributed") is None:
        raise InputError("--cluster needs distributed; pip install 'jackbench[cluster]' here and on the workers")
    try:
        socket.create_connection(place, _ANSWERS).close()
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"--cluster {address}: {reason}; start `dask scheduler` there or mend the address") from None
    return Cluster(whole)


def _host_and_port(address: str) -> tuple[str, int] | None:
    try:
        parts = urlsplit(address)
        host, port = parts.hostname, parts.port
    except ValueError:
        return None
    return (host, port) if parts.scheme in _SCHEMES and host and port else None


@contextmanager
def cluster_workers(cluster: Cluster, make: Callable[[], Callable[[A], B]]) -> Iterator[Callable[[A], B]]:
    """A function that does an item on a worker and waits for it, for several threads at once.

    Each worker process calls `make` once. What is under way when the context ends is cancelled. Raises ClusterError.
    """
    with _client(cluster) as client:
        # tasks of one group: what no worker takes yet, the scheduler keeps
        group, numbers = f"jackbench-{uuid4().hex}", count()
        work = client.submit(_itself, _Work(pickle.dumps(make), installation(), granted()), pure=False)
        lock, waiting = Lock(), set[Future[bytes]]()
        running: Any = client.loop  # one of asyncio

        def call(item: A) -> B:
            with lock:
                if client.status in ("closing", "closed"):
                    raise CancelledError
                task = client.submit(_call, work, pickle.dumps(item), key=(group, next(numbers)))
                future = asyncio.run_coroutine_threadsafe(_awaited(task), running.asyncio_loop)
                waiting.add(future)
            try:
                return pickle.loads(_result(future, cluster))
            finally:
                waiting.discard(future)

        try:
            yield call
        finally:
            with lock:
                for future in waiting.copy():
                    future.cancel()
                client.close()


@contextmanager
def _client(cluster: Cluster) -> Iterator["Client"]:
    from distributed import Client

    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # what it would tell, a ClusterError says
    try:
        client = Client(cluster.address, timeout=_ANSWERS, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ClusterError(f"--cluster {cluster.address}: no Dask scheduler answers there: {error}") from None
    with client:
        try:
            client.wait_for_workers(1, _JOINS)
        except TimeoutError:
            start = _START.format(address=cluster.address)
            raise ClusterError(f"--cluster {cluster.address}: no worker joins; start some with {start}") from None
        answers: Any = client.run(pickle.loads, pickle.dumps(_Asked()), on_error="return")
        if refused := [
            line for worker, answer in answers.items() if (line := _refusal(worker, installation(), answer))
        ]:
            raise ClusterError(f"{refused[0]}; {len(refused)} of {len(answers)} workers")
        yield client


class _Asked:
    """What is installed where this is unpickled: a worker without this module answers with an ImportError."""

    def __reduce__(self) -> tuple[Callable[[], Installation], tuple[()]]:
        return installation, ()


def _refusal(worker: str, here: Installation, there: Installation | BaseException) -> str:
    """Why a worker may not compute for a sender who is `here`; nothing where it may."""
    if isinstance(there, BaseException):
        return f"worker {worker} has no jackbench, or another one ({there}); install there what is installed here"
    different = differences(here, there)
    return f"worker {worker} has {different}; install there what is installed here" if different else ""


async def _awaited(task: "DaskFuture") -> bytes:
    return await task


def _result(future: Future[bytes], cluster: Cluster) -> bytes:
    """Raises what the task raised, or ClusterError."""
    from distributed import KilledWorker
    from distributed.comm.core import CommClosedError

    try:
        return future.result()
    except (CancelledError, CommClosedError):
        reason = "the scheduler is gone"
    except KilledWorker as error:
        reason = f"one task ended {error.allowed_failures + 1} workers, for want of memory perhaps"
    except ModuleNotFoundError as error:
        reason = f"a worker has no module {error.name}; install there what is installed here"
    raise ClusterError(f"--cluster {cluster.address}: {reason}; the same command resumes")


def _itself(work: _Work) -> _Work:
    """The work as a task, so that the scheduler knows it whichever workers die."""
    return work


def _call(work: _Work, item: bytes) -> bytes:
    """On a worker."""
    with _one_at_a_time, lent(work.trusted):
        return pickle.dumps(_worker(work)(pickle.loads(item)))


@lru_cache(maxsize=2)
def _worker(work: _Work) -> Callable[[Any], Any]:
    """The work of this process. Raises ClusterError where it joined late and computes otherwise than the sender."""
    from distributed import get_worker

    if refusal := _refusal(get_worker().address, work.installation, installation()):
        raise ClusterError(refusal)
    threadpool_limits(limits=1, user_api="blas")
    return pickle.loads(work.make)()
