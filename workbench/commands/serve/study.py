"""The service of a rig: it prints its address, serves until Ctrl-C, and leaves what its clock did."""

import gc
import json
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

from ...base.errors import InputError
from ...base.signals import output_signal
from ...base.units import from_si
from ...link import datagrams
from ...link.bench import bench
from ...link.opc_ua import opc_ua_server, supervised_rig
from ...link.paced import LockstepServer, RealTimeServer
from ...link.rig_server import LOOPBACK, RigServer
from ...link.served_rig import ServedRig
from ...report import Curve, Figure, Page, Panel, Section, Table
from ...rigs.platform import Platform
from ...rigs.rig import Rig
from ..common.outcome import Outcome, Progress, Stage
from ..common.page_server import KINDS, Answers, Files, page_server
from .config import Service
from .figures import quantiles, steps

_SWITCH_INTERVAL = 1e-5  # s: how long the page may keep the service waiting
_SHOWN = ("position", "pa", "pb", "spool", "force", "supply")
_SWITCHES = {"on": datagrams.ON, "off": datagrams.OFF, "reset": datagrams.RESET}


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
        if wanted.opcua is not None:
            panel = opc_ua_server(supervised_rig(server), wanted.opcua)
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


class RigPage:
    """What the page of a server shows, true values in the units that people read."""

    def __init__(self, server: RigServer) -> None:
        self._server, self._began = server, time.monotonic()
        plant = server.rig.bench.plant
        names = [name for name in plant.outputs if name.rpartition(".")[2] in _SHOWN]
        self._shown = [(plant.output(name), name, output_signal(name)) for name in names]

    def start(self) -> dict[str, Any]:
        """What the page has to know before it asks."""
        bench = self._server.rig.bench
        limits = {limit.signal: list(limit.ends) for limit in bench.limits}
        signals = [
            {"name": name, "unit": s.unit, "limits": from_si(limits.get(name, []), s.unit, s.si).tolist()}
            for _, name, s in self._shown
        ]
        commands = [{"name": each.name, "unit": "1", "limits": [each.low, each.high]} for each in bench.commands]
        where = "udp://{}:{}".format(*self._server.address)
        return {"rig": bench.name, "at": where, "period": bench.period, "signals": signals, "commands": commands}

    @property
    def answers(self) -> Answers:
        """What the page may ask for, by name."""
        return {"now": self._now, "switch": self._switch}

    def _now(self, _: Mapping[str, Any]) -> dict[str, Any]:
        rig, server = self._server.rig, self._server
        outputs = rig.outputs
        values = [float(from_si(outputs[place], s.unit, s.si)) for place, _, s in self._shown]
        return {
            "t": time.monotonic() - self._began,
            "state": rig.state,
            "trip": rig.trip or "",
            "watchdog": bool(rig.flags & datagrams.WATCHDOG),
            "values": values,
            "commands": rig.command,
            "periods": server.periods,
            "missed": server.pace.missed,
            "dropped": server.dropped,
        }

    def _switch(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        what = asked.get("to")
        if what not in _SWITCHES:
            raise InputError("to: must be on, off or reset; reload the page")
        self._server.wish(_SWITCHES[what])
        return {}


def page_files(start: Mapping[str, Any]) -> Files:
    """Kind and content of what the page is made of, by name."""
    assets = files("workbench") / "commands" / "serve" / "assets"
    html = Template((assets / "page.html").read_text("utf-8"))
    data = json.dumps(start, allow_nan=False).replace("<", "\\u003c")  # no text can end the script element
    page = html.substitute(title=escape(f"{start['rig']} at {start['at']}"), start=data).encode()
    own = {name: (KINDS[name.rpartition(".")[2]], (assets / name).read_bytes()) for name in ("rig.js", "rig.css")}
    return {**own, "": (KINDS["html"], page)}
