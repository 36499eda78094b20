"""The service of a rig: it prints its address, serves until Ctrl-C, and leaves what its clock did."""

import gc
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import Any

from ...link.bench import bench
from ...link.opc_ua import opc_ua_server, supervised_rig
from ...link.paced import LockstepServer, RealTimeServer
from ...link.rig_server import LOOPBACK, RigServer
from ...link.served_rig import ServedRig
from ...report import Curve, Figure, Page, Panel, Section, Table
from ...rigs.platform import Platform
from ...rigs.rig import Rig
from ..common.outcome import Outcome, Progress, Stage
from ..common.page_server import page_server
from .config import Service
from .figures import quantiles, steps
from .page import RigPage, page_files

_SWITCH_INTERVAL = 1e-5  # s: how long the page may keep the service waiting


def run_service(rig: Rig | Platform, wanted: Service, stage: Stage, progress: Progress) -> Outcome:
    """Serve until interrupted. `periods`, `missed`, `jitter_us`, `age_us`, `core_load`, `dropped`, `trips`."""
    served = ServedRig(bench(rig, computes=wanted.lockstep, ideal=wanted.ideal), wanted.seed)
    server = (LockstepServer if wanted.lockstep else RealTimeServer)(
        served, wanted.port, wanted.host or LOOPBACK, wanted.token, progress
    )
    print("udp://{}:{}".format(*server.address), flush=True)
    page = RigPage(server)
    began = time.perf_counter()
    with ExitStack() as stack:
        pages = stack.enter_context(
            page_server(page_files(page.start()), page.answers, wanted.page_port, "--page-port")
        )
        if wanted.opc_ua is not None:
            panel = opc_ua_server(supervised_rig(server), wanted.opc_ua)
            progress(f"for a panel: {stack.enter_context(panel)}")
        stack.enter_context(_quiet())
        threading.Thread(target=pages.serve_forever, daemon=True).start()
        progress(f"{served.bench.name}, {_pace(wanted, served)}; its page: {pages.address} (Ctrl-C ends it)")
        _until_interrupted(server)
        pages.shutdown()
    lasted = time.perf_counter() - began
    server.close()
    metrics = _metrics(server, lasted)
    return Outcome(metrics, lambda: (_page(server, wanted, metrics), _figure(server)))


def _until_interrupted(server: RigServer) -> None:
    """Serve in a thread of its own."""
    over = threading.Event()
    failed: list[BaseException] = []

    def serve() -> None:
        try:
            server.serve()
        except BaseException as error:  # told where it can be seen, in the main thread
            failed.append(error)
        over.set()

    thread = threading.Thread(target=serve)
    thread.start()
    with suppress(KeyboardInterrupt):
        over.wait()
    server.stop()
    thread.join()
    if failed:
        raise failed[0]


@contextmanager
def _quiet() -> Iterator[None]:
    """No garbage collection, and the page's thread gives way at once."""
    before = sys.getswitchinterval()
    gc.collect()
    gc.freeze()
    gc.disable()
    sys.setswitchinterval(_SWITCH_INTERVAL)
    try:
        yield
    finally:
        sys.setswitchinterval(before)
        gc.enable()
        gc.unfreeze()


def _metrics(server: RigServer, lasted: float) -> dict[str, Any]:
    pace = server.pace
    return {
        "periods": server.periods,
        "missed": pace.missed,
        "jitter_us": quantiles(pace.late.counts) | _worst(pace.worst),
        "age_us": quantiles(server.ages.counts),
        "core_load": server.cpu_s / lasted,
        "dropped": server.dropped,
        "trips": server.trips,
    }


def _worst(ns: int) -> dict[str, float]:
    """The worst beyond the histogram's end, too."""
    return {"worst": ns / 1e3} if ns else {}


def _pace(wanted: Service, served: ServedRig) -> str:
    return "paced by its client" if wanted.lockstep else f"{1 / served.bench.period:g} Hz"


def _page(server: RigServer, wanted: Service, metrics: dict[str, Any]) -> Page:
    jitter, age = metrics["jitter_us"], metrics["age_us"]
    served = server.rig
    verdict = f"{served.bench.name}, {_pace(wanted, served)}: {metrics['periods']} periods"
    if jitter["p50"] is not None:
        verdict += f", {metrics['missed']} readings a whole period late, 99.9 % at most {jitter['p999']:.0f} us"
    verdict += f"; {metrics['dropped']} datagrams dropped, {metrics['trips']} trips."
    rows = [[what, *(times[key] for key in ("p50", "p99", "p999", "worst"))] for what, times in
            (("readings after their instant", jitter), ("commands when they act, since they came", age))]  # fmt: skip
    note = f"The service took {100 * metrics['core_load']:.1f} % of a core, its page not counted."
    table = Table("Times", ["time [us]", "median", "99 %", "99.9 %", "worst"], rows, note)
    return Page(f"{served.bench.name} behind a wire", verdict, [Section("Times", [table, _figure(server)])])


def _figure(server: RigServer) -> Figure:
    times = {
        "readings after their instant": server.pace.late.counts,
        "commands when they act, since they came": server.ages.counts,
    }
    curves = [Curve(shown, *steps(counts)) for shown, counts in times.items() if counts.any()]
    return Figure("How often later", "time [us]", [Panel("share of all", curves, log_y=True)], log_x=True)
