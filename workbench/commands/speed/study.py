"""The proof of speed: public solvers, this engine's back ends, batches and environments, side by side in one run."""

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.cores import cores
from ...control.controller_spec import ControllerSpec
from ...control.controller_type import controller
from ...engine import Engine
from ...engine.peers import PEERS
from ...linear import Equilibrium, equilibrium
from ...loop.sampled_loop import SampledLoop
from ...plant import Plant, build
from ...report import Page, Section, Table
from ...report.figures import Curve, Figure, Panel
from ...rigs.rig import Rig
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from .loops import loop_times

if TYPE_CHECKING:
    from ...engine.floor import KernelTimeBound

ENVIRONMENTS = "envs.speed:measure"  # reached by name: the workbench does not import environments
ERROR = 1e-4  # of each state's magnitude: "equal accuracy"
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
BATCHES = (1, 8, 64, 256, 1024)
_REPEATS = 5
_MARGINS = {
    "cpu_ms": "a design on a plant that is linearised",
    "cpu_ms_with_plant": "with the plant's linearisation",
    "cpu_ms_in_lanes": "in lanes, with each plant's linearisation",
}
_CLI = "import sys; from workbench.cli import main; main(sys.argv[1:])"
_SIMULATION = """
import numpy as np
from workbench import Engine, build, equilibrium, load_rig
plant = build(load_rig("jack-10t"))
Engine(plant).run(equilibrium(plant).x, np.arange(1001) * 1e-3, np.zeros((1001, len(plant.inputs))))
"""
_PROCESSES = {
    "version": (_CLI, "--version"),
    "numpy": ("import numpy",),
    "list": (_CLI, "list", "rigs"),
    "refusal": (_CLI, "run", "nothere.toml"),
    "first_simulation": (_SIMULATION,),
}
_STARTS = 3


@dataclass(frozen=True)
class TimedDrive:
    """One closed-loop second: the commands that a loop wrote, and the states that an exact solver reaches."""

    name: str
    t: np.ndarray
    u: np.ndarray
    exact: np.ndarray


def run_speed(rig: Rig, stage: Stage, progress: Progress) -> Outcome:
    """Time everything on the same closed-loop second of a rig, at 1e-4 of each state's magnitude or better."""
    plant = build(rig)
    rest = equilibrium(plant)
    engine = Engine(plant)
    peers, batch = [], []
    least = _floor(plant) if engine.back_end == "compiled" else None
    for drive in _drives(rig, engine, rest):
        progress(f"{drive.name}: solvers")
        peers += stage(f"peers-{drive.name}", lambda drive=drive: _peers(plant, rest, drive))
        progress(f"{drive.name}: batches")
        batch += stage(f"batch-{drive.name}", lambda drive=drive: _batches(engine, rest, drive, least))
    progress("closed loops")
    loops = stage("loops", lambda: loop_times(rig, _controllers()))
    progress("starts")
    start = stage("start", start_times)
    progress("environments")
    envs = stage("envs", _environments)
    speed = {"peers": peers, "batch": batch, "envs": envs, "start": start, "floor": _floor_row(least), **loops}
    return Outcome(speed, lambda: (_page(rig, engine, speed), _picture(batch)), subject=Subject(rig, _controllers()))


def _controllers() -> list[ControllerSpec]:
    """P, and P with the pressure feedback of experiments/position_step.toml."""
    pressure = controller("controllers.pressure:PressureFeedback", gain="2.15e-4 1/bar", corner="0.25 Hz")
    damped = controller("controllers.p:P", gain=3.7) + pressure
    return [controller("controllers.p:P", gain=0.24).named("p"), damped.named("p-dp")]


def _drives(rig: Rig, engine: Engine, rest: Equilibrium) -> list[TimedDrive]:
    """Easy: a 10 mm step under P control. Hard: high gain, following 40 mm at 3 Hz and 2 mm at 21 Hz."""
    period = rig.period.value
    t = np.arange(round(1 / period) + 1) * period
    hard = 0.04 * np.sin(2 * np.pi * 3 * t) + 2e-3 * np.sin(2 * np.pi * 21 * t)
    exact = Engine(engine.plant, 1e-9)
    drives = []
    for name, gain, reference in (("easy", 0.24, np.full(len(t), 0.01)), ("hard", 3.0, hard)):
        law = controller("controllers.p:P", gain=gain).build(period)
        run = SampledLoop(engine, rig, law, rest).run(reference)
        u = np.zeros((len(t), len(engine.plant.inputs)))
        u[: len(run.record.t), 0] = run.record.signals["command"]
        drives.append(TimedDrive(name, t, u, exact.run(rest.x, t, u).x))
    return drives


def _peers(plant: Plant, rest: Equilibrium, drive: TimedDrive) -> list[dict[str, Any]]:
    """Each solver at its loosest tolerance that is accurate enough; `times_ours` is over our compiled back end."""
    rows = []
    for name, solve in _solvers(plant).items():
        took, error, tolerance = _accurate(solve, plant, rest, drive)
        if took < 0.5:  # quick ones are timed again: the first run also warms caches
            took = min(_timed(lambda s=solve, tol=tolerance: s(rest.x, drive.t, drive.u, tol)) for _ in range(_REPEATS))
        rows.append({"name": name, "excitation": drive.name, "ms_per_simulated_second": took * 1e3, "error": error})
    ours = rows[0]["ms_per_simulated_second"]
    return [{**row, "times_ours": row["ms_per_simulated_second"] / ours} for row in rows]


def _accurate(
    solve: Callable[..., np.ndarray], plant: Plant, rest: Equilibrium, drive: TimedDrive
) -> tuple[float, ...]:
    """Time [s], error and tolerance of the loosest tolerance that is accurate enough, or of the tightest tried."""
    took, error, tolerance = np.inf, np.inf, TOLERANCES[0]
    for tolerance in TOLERANCES:
        began = perf_counter()
        states = solve(rest.x, drive.t, drive.u, tolerance)
        took = perf_counter() - began
        error = float(np.abs((states - drive.exact) / plant.scale).max())
        if error <= ERROR:
            break
    return took, error, tolerance


def _solvers(plant: Plant) -> dict[str, Callable[..., np.ndarray]]:
    engines: dict[tuple[str, float], Engine] = {}

    def ours(back_end: Any) -> Callable[..., np.ndarray]:
        def solve(x0: np.ndarray, t: np.ndarray, u: np.ndarray, tolerance: float) -> np.ndarray:
            key = (back_end, tolerance)
            if key not in engines:
                engines[key] = Engine(plant, tolerance, back_end)
            return engines[key].run(x0, t, u).x

        return solve

    public = {name: lambda *a, peer=peer: peer(plant, *a) for name, peer in PEERS.items()}
    return {"jackbench": ours("auto"), "jackbench interpreted": ours("interpreted"), **public}


def _batches(
    engine: Engine, rest: Equilibrium, drive: TimedDrive, least: "KernelTimeBound | None"
) -> list[dict[str, Any]]:
    """Plants with different masses, driven alike; the share of the floor counts every core that worked."""
    rows = []
    plant = engine.plant
    for count in BATCHES:
        p = np.tile(plant.p, (count, 1))
        p[:, plant.parameters.index("M")] *= np.linspace(0.9, 1.1, count)
        x0 = np.tile(rest.x, (count, 1))
        times, attempts = [], 0
        for _ in range(3):
            began = perf_counter()
            attempts = int(engine.run_batch(x0, drive.t, drive.u, p, every=len(drive.t) - 1).attempts.sum())
            times.append(perf_counter() - began)
        took, busy = min(times), min(cores(), count)
        share = None if least is None else least.attempt_s * attempts / (took * busy)
        rows.append(
            {
                "plants": count,
                "excitation": drive.name,
                "simulated_seconds_per_second": float(count * drive.t[-1] / took),
                "share_of_floor": share,
                "lane_steps_per_second": count * (len(drive.t) - 1) / took,
                "ns_per_attempt_and_core": took * busy / attempts * 1e9,
            }
        )
    return rows


def _environments() -> list[dict[str, Any]]:
    module, name = ENVIRONMENTS.split(":")
    return getattr(import_module(module), name)()


def _timed(call: Callable[[], object]) -> float:
    began = perf_counter()
    call()
    return perf_counter() - began


def _floor(plant: Plant) -> "KernelTimeBound":
    from ...engine.floor import kernel_time_bound

    return kernel_time_bound(plant)


def _floor_row(least: "KernelTimeBound | None") -> dict[str, Any] | None:
    if least is None:
        return None
    return {
        "divisions": least.divisions,
        "roots": least.roots,
        "ns_per_division": least.division_s * 1e9,
        "ns_per_root": least.root_s * 1e9,
        "ns_per_attempt": least.attempt_s * 1e9,
    }


def _page(rig: Rig, engine: Engine, speed: dict[str, Any]) -> Page:
    slow = [row for row in speed["peers"] if not row["name"].startswith("jackbench")]
    best, radau = min(row["times_ours"] for row in slow), max(row["times_ours"] for row in slow)
    peers = Table(
        "One closed-loop second, 1 ms period, one core",
        ["solver", "excitation", "ms per simulated second", "error / magnitude", "times jackbench"],
        [
            [r["name"], r["excitation"], r["ms_per_simulated_second"], r["error"], r["times_ours"]]
            for r in speed["peers"]
        ],
        note="Each at its loosest tolerance with an error of 1e-4 or better; every solver starts anew in every period.",
    )
    batch = Table(
        "Batches",
        [
            "plants",
            "excitation",
            "simulated s per s",
            "share of floor",
            "control periods per s",
            "ns per attempt and core",
        ],
        [[*row.values()] for row in speed["batch"]],
        note="The floor is the time of the kernel's divisions and square roots alone, measured on this core.",
    )
    envs = Table(
        "Environments",
        ["environment", "steps per s", "CPU us a step"],
        [[r["name"], r["steps_per_second"], r["cpu_us_per_step"]] for r in speed["envs"]],
    )
    sections = [Section("Solvers", [peers]), Section("Batches", [batch]), Section("Environments", [envs])]
    starts = [[name.removesuffix("_cpu_s").replace("_", " "), value] for name, value in speed["start"].items()]
    sections.append(Section("Closed loops", _loop_tables(speed)))
    sections.append(Section("Start", [Table("A new process, CPU time", ["what", "s"], starts)]))
    if speed["floor"]:
        sections.append(
            Section("Floor", [Table("An attempt's floor", [*speed["floor"]], [[*speed["floor"].values()]])])
        )
    verdict = (
        f"The {engine.back_end} engine is {best:.0f} to {radau:.0f} times as fast as the public solvers on {rig.name}."
    )
    return Page(f"Speed on {rig.name}", verdict, sections)


def _loop_tables(speed: dict[str, Any]) -> list[Table]:
    columns = ["controller", "way", "CPU ms per simulated second", "times the engine", "difference / step"]
    loops = Table("A step of 10 mm, CPU time", columns, [[*row.values()] for row in speed["loops"]])
    costs = [[_MARGINS[key], value] for key, value in speed["margins"].items()]
    margins = Table("Margins of one loop, CPU time", ["", "ms"], costs)
    return [loops, margins]


def _picture(batch: list[dict[str, Any]]) -> Figure:
    curves = [
        Curve(
            name,
            np.array([r["plants"] for r in batch if r["excitation"] == name], dtype=float),
            np.array([r["simulated_seconds_per_second"] for r in batch if r["excitation"] == name]),
        )
        for name in ("easy", "hard")
    ]
    return Figure("Batches", "plants", [Panel("simulated seconds per second", curves, log_y=True)], log_x=True)


def start_times() -> dict[str, float]:
    """{"version_cpu_s": ...}: user and system time [s] of a new process; POSIX only, elsewhere 0."""
    return {f"{name}_cpu_s": min(_cpu(words) for _ in range(_STARTS)) for name, words in _PROCESSES.items()}


def _cpu(words: tuple[str, ...]) -> float:
    before = os.times()
    subprocess.run([sys.executable, "-c", *words], capture_output=True, check=False)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system
