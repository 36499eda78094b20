"""Steps of a closed loop: metrics, margins at two operating points, closed-loop Bode linear and by stepped sine."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import metrics
from ..config import StepConfig
from ..engine import Engine
from ..loop import LoopRun, run_loop
from ..loop_response import closed_loop_sine, sampled_frequencies
from ..margins import LinearLoop, linear_loop
from ..plant import build
from ..recipe import Recipe
from ..report import Curve, Figure, FrequencyCurve, Page, Panel, Section, Table, bode
from ..response import crossing, decibels, degrees
from ..scenario import Scenario
from ..views import Equilibrium, equilibrium
from .outcome import Outcome, Progress, Stage

MOVING = 0.1  # m/s: the second operating point, outside the lap's doubled gain
COLUMNS = (
    ("controller", ""), ("scenario", ""), ("settling_s", "settling [s]"), ("overshoot_percent", "overshoot [%]"),
    ("rise_s", "rise [s]"), ("steady_state_error", "final error [mm]"), ("iae", "IAE [mm s]"),
    ("peak_command", "peak command [1]"), ("saturated_s", "limited [s]"), ("cavitation_s", "cavitation [s]"),
    ("residual_oscillation", "oscillation [% of step]"), ("stable", ""), ("tripped", ""),
)  # fmt: skip


@dataclass(frozen=True)
class _Bench:
    """A rig ready to close loops on: its engine, and the points at which loops are linearised."""

    engine: Engine
    null: Equilibrium
    null_smooth: Equilibrium
    moving: Equilibrium
    smooth: np.ndarray


def run_steps(config: StepConfig, stage: Stage, progress: Progress) -> Outcome:
    """Every controller in every scenario on the configured rig."""
    plant = build(config.rig)
    smooth = plant.without_dry_friction()
    bench = _Bench(
        Engine(plant),
        equilibrium(plant),
        equilibrium(plant, p=smooth),
        equilibrium(plant, speed=MOVING, p=smooth),
        smooth,
    )
    rows, runs, loops = [], {}, {}
    for chosen in config.controllers:
        progress(f"{chosen.name}: margins and steps")
        loops[chosen.name] = _loops(config, chosen, bench)
        for wanted in config.scenarios:
            runs[chosen.name, wanted.name] = run = _step(config, chosen, wanted, bench)
            rows.append(_row(config, chosen, wanted, run, loops[chosen.name]))
    sines = {
        c.name: stage(f"bode-{c.name}", lambda c=c: _sines(config, c, bench, progress)) for c in config.controllers
    }
    page = _page(config, rows, runs, loops, sines)
    return Outcome({"rows": rows}, page, _step_figure(config, config.scenarios[-1], runs), _tables(runs, sines, loops))


def _loops(config: StepConfig, chosen: Recipe, bench: _Bench) -> tuple[LinearLoop, LinearLoop]:
    """The linear loop at null and moving."""
    period = config.rig.period.value
    plant, controller = bench.engine.plant, chosen.make(period)
    return (
        linear_loop(plant, bench.null_smooth, controller, period, bench.smooth),
        linear_loop(plant, bench.moving, controller, period, bench.smooth),
    )


def _step(config: StepConfig, chosen: Recipe, wanted: Scenario, bench: _Bench) -> LoopRun:
    period = config.rig.period.value
    start = float(bench.engine.observe(bench.null.x, bench.null.u)[bench.engine.plant.output(wanted.signal)])
    reference = np.full(round(wanted.duration / period) + 1, start + wanted.step)
    return run_loop(bench.engine, config.rig, chosen.make(period), bench.null, reference)


def _row(
    config: StepConfig, chosen: Recipe, wanted: Scenario, run: LoopRun, loops: tuple[LinearLoop, LinearLoop]
) -> dict[str, Any]:
    """One row of metrics.json: SI but for what its key says. Margins are the worse of the two operating points."""
    signals, t = run.record.signals, run.record.t
    y, before, target = signals[wanted.signal], float(signals[wanted.signal][0]), float(signals["reference"][-1])
    null = loops[0]
    stable = all(loop.stable for loop in loops)
    there = run.tripped is None
    return {
        "controller": chosen.name,
        "rig": config.rig.name,
        "scenario": wanted.name,
        "settling_s": metrics.settling_time(t, y, before, target) if there else None,
        "overshoot_percent": metrics.overshoot(y, before, target),
        "rise_s": metrics.rise_time(t, y, before, target),
        "steady_state_error": metrics.steady_state_error(t, y, target) if there else None,
        "iae": metrics.iae(t, y, target) if there else None,
        "peak_command": float(np.abs(signals["command"]).max()),
        "saturated_s": metrics.saturated_time(t, run.demanded, signals["command"]),
        "cavitation_s": metrics.cavitation_time(t, signals["lowest_pressure"]),
        "residual_oscillation": metrics.residual_oscillation(t, y, before, target) if there else None,
        "stable": stable,
        "tripped": run.tripped,
        "f3db_hz": None if null.closed is None else crossing(null.f, decibels(null.closed), -3.0),
        "f90_hz": None if null.closed is None else crossing(null.f, degrees(null.closed), -90.0),
        "peak_db": None if null.closed is None else float(decibels(null.closed).max()),
        "gain_margin_db": _worst(min, [loop.gain_margin_db for loop in loops]) if stable else None,
        "phase_margin_deg": _worst(min, [loop.phase_margin_deg for loop in loops]) if stable else None,
        "ms": _worst(max, [loop.ms for loop in loops]) if stable else None,
    }


def _worst(pick: Any, values: list[float | None]) -> float | None:
    there = [value for value in values if value is not None]
    return pick(there) if there else None


def _sines(config: StepConfig, chosen: Recipe, bench: _Bench, progress: Progress) -> dict[str, dict[str, np.ndarray]]:
    """Closed-loop stepped sine at each amplitude, as columns."""
    period = config.rig.period.value
    f = sampled_frequencies(config.bode.low, config.bode.high, config.bode.points, period)
    found = {}
    for amplitude in config.bode.amplitudes:
        progress(f"{chosen.name}: stepped sine of {amplitude * 1e3:g} mm")
        sine = closed_loop_sine(bench.engine, config.rig, lambda: chosen.make(period), bench.null, f, amplitude)
        response = sine.response[chosen.make(period).measures[0]]
        found[f"{amplitude * 1e3:g} mm"] = {
            "f_hz": sine.f,
            "real": np.real(response),
            "imag": np.imag(response),
            "settled": sine.settled,
            "saturated": sine.saturated,
            "cavitated": sine.cavitated,
        }
    return found


def _tables(
    runs: dict[tuple[str, str], LoopRun],
    sines: dict[str, dict[str, dict[str, np.ndarray]]],
    loops: dict[str, tuple[LinearLoop, LinearLoop]],
) -> dict[str, dict[str, np.ndarray]]:
    tables = {
        f"step-{controller}-{wanted}": {"t [s]": run.record.t, "demanded [1]": run.demanded, **run.record.signals}
        for (controller, wanted), run in runs.items()
    }
    for controller, (null, _) in loops.items():
        if null.closed is not None and null.sensitivity is not None:
            tables[f"linear-{controller}"] = {
                "f_hz": null.f,
                "closed_real": np.real(null.closed),
                "closed_imag": np.imag(null.closed),
                "sensitivity_real": np.real(null.sensitivity),
                "sensitivity_imag": np.imag(null.sensitivity),
            }
    for controller, found in sines.items():
        tables |= {f"sine-{controller}-{size.replace(' ', '')}": columns for size, columns in found.items()}
    return tables


def _page(
    config: StepConfig,
    rows: list[dict[str, Any]],
    runs: dict[tuple[str, str], LoopRun],
    loops: dict[str, tuple[LinearLoop, LinearLoop]],
    sines: dict[str, dict[str, dict[str, np.ndarray]]],
) -> Page:
    return Page(
        f"Position steps on {config.rig.name}",
        _verdict(rows),
        [
            Section("Metrics", [_metrics_table(rows), _margins_table(loops)]),
            Section("Steps", [_step_figure(config, wanted, runs) for wanted in config.scenarios]),
            Section("Closed-loop Bode", [_bode(name, loops[name], sines[name]) for name in loops]),
            Section("Sensitivity", [_sensitivity(loops)]),
        ],
    )


def _verdict(rows: list[dict[str, Any]]) -> str:
    settled = [row for row in rows if row["settling_s"] is not None and row["stable"]]
    bad = sorted({row["controller"] for row in rows if not row["stable"]})
    unstable = f" Unstable: {', '.join(bad)}." if bad else ""
    if not settled:
        return f"No controller settles.{unstable}"
    names = {row["scenario"] for row in settled}
    wanted = "position-10mm" if "position-10mm" in names else next(row["scenario"] for row in settled)
    best = min((row for row in settled if row["scenario"] == wanted), key=lambda row: row["settling_s"])
    return (
        f"{wanted}: {best['controller']} settles first, in {best['settling_s']:.2f} s at Ms {best['ms']:.2f}.{unstable}"
    )


def _metrics_table(rows: list[dict[str, Any]]) -> Table:
    factors = {"steady_state_error": 1e3, "iae": 1e3, "residual_oscillation": 100.0}

    def cell(row: dict[str, Any], key: str) -> Any:
        value = row[key]
        if key == "tripped":
            return value or "no"
        return value * factors[key] if key in factors and value is not None else value

    return Table(
        "Step metrics",
        [shown or key for key, shown in COLUMNS],
        [[cell(row, key) for key, _ in COLUMNS] for row in rows],
        note="Settling to 2 %. Limited: the guard changed the command. Cavitation: a chamber below 0 bar.",
        best={"settling [s]": "min", "IAE [mm s]": "min"},
    )


def _margins_table(loops: dict[str, tuple[LinearLoop, LinearLoop]]) -> Table:
    lines = []
    for name, pair in loops.items():
        for where, loop in zip(("null", f"moving at {MOVING:g} m/s"), pair, strict=True):
            closed = loop.closed
            lines.append(
                [
                    name,
                    where,
                    loop.stable,
                    loop.ms,
                    loop.gain_margin_db,
                    loop.phase_margin_deg,
                    None if closed is None else crossing(loop.f, decibels(closed), -3.0),
                    None if closed is None else crossing(loop.f, degrees(closed), -90.0),
                ]
            )
    return Table(
        "Margins of the sampled linear loop",
        [
            "controller",
            "operating point",
            "stable",
            "Ms [1]",
            "gain margin [dB]",
            "phase margin [deg]",
            "-3 dB [Hz]",
            "-90 deg [Hz]",
        ],
        lines,
        note="At null the lap doubles the flow gain. An unstable loop has no margins.",
    )


def _step_figure(config: StepConfig, wanted: Scenario, runs: dict[tuple[str, str], LoopRun]) -> Figure:
    chosen = {c.name: runs[c.name, wanted.name] for c in config.controllers}
    first = next(iter(chosen.values())).record
    reference = Curve("reference", first.t, first.signals["reference"] * 1e3, "dot")

    def curves(signal: str, factor: float) -> list[Curve]:
        return [Curve(name, run.record.t, run.record.signals[signal] * factor) for name, run in chosen.items()]

    return Figure(
        f"Step of {wanted.step * 1e3:g} mm",
        "time [s]",
        [
            Panel("position [mm]", [reference, *curves(wanted.signal, 1e3)]),
            Panel("command [1]", curves("command", 1.0)),
            Panel("pressure A [bar]", curves("pa", 1e-5)),
        ],
    )


def _bode(name: str, pair: tuple[LinearLoop, LinearLoop], sines: dict[str, dict[str, np.ndarray]]) -> Figure:
    curves = []
    for where, loop in zip(("linear, null", f"linear, {MOVING:g} m/s"), pair, strict=True):
        if loop.closed is not None:
            shown = (loop.f > 0.05) & (loop.f < 100)
            curves.append(FrequencyCurve(where, loop.f[shown], loop.closed[shown], "dash"))
    notes = []
    for size, columns in sines.items():
        curves.append(FrequencyCurve(f"sine, {size}", columns["f_hz"], columns["real"] + 1j * columns["imag"]))
        if np.any(columns["saturated"]):
            notes.append(
                f"at {size} the guard limits the command from {np.min(columns['f_hz'][columns['saturated']]):.3g} Hz"
            )
        if np.any(columns["cavitated"]):
            notes.append(
                f"at {size} a chamber falls below 0 bar from {np.min(columns['f_hz'][columns['cavitated']]):.3g} Hz"
            )
    return bode(f"Closed loop: {name}", curves, note="; ".join(notes))


def _sensitivity(loops: dict[str, tuple[LinearLoop, LinearLoop]]) -> Figure:
    curves = [
        Curve(name, loop.f, decibels(loop.sensitivity))
        for name, (loop, _) in loops.items()
        if loop.sensitivity is not None
    ]
    return Figure("Sensitivity at null", "frequency [Hz]", [Panel("|S| [dB]", curves)], log_x=True)
