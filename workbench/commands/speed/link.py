"""How fast a rig behind the wire is: periods in lockstep, and in real time what is late, beside an empty loop."""

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import InputError, LinkLost
from ...control.controller_type import controller
from ...control.export.c_code import c_code
from ...control.export.link_program import link_program
from ...control.export.program import program_of
from ...link.client import LinkClient
from ...link.pace import idle_pace
from ...report import Curve, Figure, Page, Panel, Section, Table
from ...rigs.rig import Rig
from ...rigs.rig_file import rig_text
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from ..fmu.compiler import compiler
from ..serve.figures import SHARES, quantiles

RATES = (1000.0, 5000.0)  # Hz
_LOCKSTEP = 20_000  # periods


def run_link_speed(rig: Rig, minutes: float, stage: Stage, progress: Progress) -> Outcome:
    """`lockstep`: periods a second; `realtime`: by rate, shares of readings a whole period late, and what an empty loop
    misses on this machine in the same minutes."""
    progress("lockstep")
    lockstep = stage("lockstep", lambda: _lockstep(rig))
    rows = []
    for rate in RATES:
        progress(f"real time, {rate:g} Hz: {minutes:g} minutes")
        rows.append(stage(f"realtime-{rate:g}", lambda rate=rate: _realtime(rig, rate, 60 * minutes)))
    speed = {"lockstep": lockstep, "realtime": rows}
    return Outcome({"speed": speed}, lambda: (_page(speed), _figure(speed)), subject=Subject(rig))


@contextmanager
def _served(rig: Rig, *words: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """The address of a rig served by a process of its own, and what that has left at its end."""
    left: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        file, out = Path(folder) / "rig.toml", Path(folder) / "out"
        file.write_text(rig_text(rig), encoding="utf-8")
        command = [sys.executable, "-m", "workbench.cli", "serve", str(file), *words, "--out", str(out)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
            try:
                yield (process.stdout.readline().strip() if process.stdout else ""), left
            finally:
                process.terminate()
        left |= json.loads((out / "metrics.json").read_text(encoding="utf-8"))


def _lockstep(rig: Rig) -> dict[str, float | None]:
    """Periods a second that a client in Python drives, and the exported C program, None where nothing compiles it."""
    with _served(rig, "--lockstep") as (where, _), LinkClient(where) as client:
        client.on()
        began = time.perf_counter()
        for _ in range(_LOCKSTEP):
            client.exchange((0.0,))
        lasted = time.perf_counter() - began
        client.off()
    return {"python_periods_per_s": _LOCKSTEP / lasted, "c_periods_per_s": _compiled_client(rig)}


def _compiled_client(rig: Rig) -> float | None:
    """Periods a second of a P loop at rest, its start not counted."""
    program = program_of("p", controller("controllers.p:P", gain=0.3).build(rig.period.value), False, {})
    try:
        cc = compiler()
    except InputError:
        return None
    with tempfile.TemporaryDirectory() as folder, _served(rig, "--lockstep") as (where, _):
        for name, text in {**c_code(program), **link_program([program], rig.limit("command_rate"))}.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        program = Path(folder) / "link_main"
        sources = [str(file) for file in Path(folder).glob("*.c")]
        subprocess.run([cc, "-std=c99", "-O2", *sources, "-o", str(program), "-lm"], check=True)
        spent = []
        for periods in (1, _LOCKSTEP):
            began = time.perf_counter()
            seconds = f"{periods * rig.period.value:g}"
            subprocess.run([str(program), "p", where, "0.001", seconds], stdout=subprocess.DEVNULL, check=True)
            spent.append(time.perf_counter() - began)
    return (_LOCKSTEP - 1) / (spent[1] - spent[0])


def _realtime(rig: Rig, rate: float, seconds: float) -> dict[str, Any]:
    """The rig in service, its client here, and an empty loop beside both in the same minutes."""
    with (
        _served(rig, "--rate", f"{rate:g}") as (where, left),
        LinkClient(where) as client,
        ProcessPoolExecutor(1, get_context("spawn")) as beside,
    ):
        empty = beside.submit(idle_pace, rate, seconds)
        _drive(client, round(rate * seconds))
        idle = empty.result()
    floor = {
        "missed": idle.missed,
        "periods": int(idle.late.counts.sum()),
        "jitter_us": quantiles(idle.late.counts) | {"worst": idle.worst / 1e3},
    }
    return {"rate_hz": rate, "rig": left, "empty_loop": floor}


def _drive(client: LinkClient, periods: int) -> None:
    """Answer so many readings."""
    reading = client.on()
    try:
        while reading.tick < periods:
            reading = client.exchange((0.0,))
    except LinkLost:
        return
    client.off()


def _figure(speed: dict[str, Any]) -> Figure:
    curves = [
        Curve(f"{who} at {row['rate_hz']:g} Hz", np.array([50, 99, 99.9]), _late(row[key]), "points")
        for row in speed["realtime"]
        for who, key in (("rig", "rig"), ("empty loop", "empty_loop"))
    ]
    return Figure("Lateness", "share of readings [%]", [Panel("late by at most [us]", curves, log_y=True)])


def _late(times: dict[str, Any]) -> np.ndarray:
    return np.array([np.nan if times["jitter_us"][key] is None else times["jitter_us"][key] for key in SHARES])


def _page(speed: dict[str, Any]) -> Page:
    rows = []
    for row in speed["realtime"]:
        for who, each in (("rig", row["rig"]), ("empty loop", row["empty_loop"])):
            jitter = each["jitter_us"]
            rows.append([row["rate_hz"], who, each["periods"], each["missed"], *(jitter[key] for key in jitter),
                         100 * each["core_load"] if "core_load" in each else None])  # fmt: skip
    heads = ["rate [Hz]", "who", "periods", "a period late", "late, median [us]", "99 %", "99.9 %", "worst", "core [%]"]
    rate = speed["lockstep"]["python_periods_per_s"]
    verdict = f"In lockstep {rate:,.0f} periods a second with a client in Python"
    c_rate = speed["lockstep"]["c_periods_per_s"]
    verdict += "." if c_rate is None else f", {c_rate:,.0f} with the exported C program."
    return Page("The rig behind the wire", verdict, [Section("Real time", [Table("", heads, rows), _figure(speed)])])
