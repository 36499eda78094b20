"""The limit of every step and of every reference that moves of an experiment, a stage each."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...base.process_pool import Jobs, process_pool
from ...base.signals import SIGNALS
from ...base.units import from_si
from ...base.words import counted, spanned
from ...loop.limit import Limit, settling_limit
from ...loop.metrics import chamber_row
from ...loop.scenarios import Scenario
from ...loop.tracking_limit import TrackingLimit, tracking_limit
from ...report import Curve, Figure, Page, Panel, Section, Table
from ...rigs.rig import Rig
from ..common.bench_experiment import BenchConfig
from ..common.judged import gas_words
from ..common.metric_table import MetricView
from ..common.outcome import Outcome, Progress, Stage
from ..common.step_experiment import StepConfig

_NOMINAL = "nominal"
PLACES = (-0.5, 0.0, 0.5)  # of the stroke limit, where a scenario does not say where it starts
_STEPS = (
    *("scenario", "rig", "x_m", "stiffness_n_per_m", "limit_s", "mesh_difference_s", "cavitation_s"),
    *("lowest_pressure_bar", "peak_command", "overshoot_percent", "played_off_percent", "reason"),
)
_MOVING = (
    *("scenario", "x_m", "limit_error", "mesh_difference_error", "largest_error", "cavitation_s"),
    *("lowest_pressure_bar", "peak_command", "reason"),
)
_SHOWN = ("position", "force", "command", "pa", "pb")

Courses = Mapping[str, Mapping[str, np.ndarray]]


@dataclass(frozen=True)
class PlacedStep:
    """A step on a rig with its specimen, `of` a name in its set, from where it starts."""

    rig: Rig
    of: str
    scenario: Scenario

    @property
    def position(self) -> float:
        """The start [m from mid stroke]."""
        return self.scenario.position(self.rig.limit("stroke"))

    @property
    def name(self) -> str:
        """The scenario, its place, and where a force acts on a specimen the rig."""
        on = f" on {self.of}" if self.scenario.signal == "force" else ""
        return f"{self.scenario.name} from {1e3 * self.position:g} mm{on}"


def run_limit(
    config: BenchConfig | StepConfig, margin: float, stage: Stage, progress: Progress, jobs: Jobs = 1
) -> Outcome:
    """`rows`: the limit of each scenario at each place, no chamber less than `margin` [Pa] above 1 atm."""
    steps = {step.name: step for step in placed_steps(config)}
    with process_pool(jobs, _Work(margin)) as found:
        results = found(steps, stage, lambda result: progress(result["name"]))
    courses = {result["name"]: result["signals"] for result in results if result["signals"]}
    metrics = {"rows": [result["row"] for result in results], "margin_bar": margin / 1e5}

    def draw() -> tuple[Page, Figure]:
        return limit_page(config.rig, metrics, courses), limit_picture(courses)

    return Outcome(metrics, draw, {_table(name): columns for name, columns in courses.items()})


class _Work:
    """What a process does: a step's name, row and signals."""

    def __init__(self, margin: float) -> None:
        self.margin = margin

    def __call__(self) -> Callable[[PlacedStep], Mapping[str, Any]]:
        return self.limit

    def limit(self, step: PlacedStep) -> Mapping[str, Any]:
        if step.scenario.is_step:
            limit = settling_limit(step.rig, step.scenario, self.margin)
            own = _settling(step, limit)
        else:
            limit = tracking_limit(step.rig, step.scenario, self.margin)
            own = _tracking(limit)
        return {"name": step.name, "row": _row(step, limit) | own, "signals": dict(limit.signals)}


def _row(step: PlacedStep, limit: Limit | TrackingLimit) -> dict[str, Any]:
    """SI but for what keys say; None, and the reason, where no motion was found."""
    return {
        "scenario": step.scenario.name,
        "rig": step.of,
        "signal": step.scenario.signal,
        "moves": not step.scenario.is_step,
        "x_m": step.position,
        "stiffness_n_per_m": step.rig.specimen_stiffness,
        **chamber_row(limit.signals.get("t [s]", np.zeros(0)), limit.signals.get("lowest_pressure")),
        "peak_command": limit.peak_command,
        "reason": limit.reason,
        **dict.fromkeys(_OWN),
    }


_OWN = (
    *("limit_s", "mesh_difference_s", "overshoot_percent", "played_off_percent", "band"),  # of a step
    *("limit_error", "mesh_difference_error", "largest_error"),  # of a reference that moves
)


def _settling(step: PlacedStep, limit: Limit) -> dict[str, Any]:
    return {
        "limit_s": limit.settling,
        "mesh_difference_s": limit.mesh_difference,
        "overshoot_percent": limit.overshoot,
        "played_off_percent": None if limit.off is None else 100 * limit.off / abs(step.scenario.size),
        "band": limit.band,
    }


def _tracking(limit: TrackingLimit) -> dict[str, Any]:
    return {
        "limit_error": limit.error,
        "mesh_difference_error": limit.mesh_difference,
        "largest_error": limit.largest,
    }


def _table(name: str) -> str:
    return "".join(letter if letter.isalnum() else "_" for letter in name)


def placed_steps(config: BenchConfig | StepConfig) -> list[PlacedStep]:
    """The steps of every scenario, and those that are no steps. Raises InputError for a linear plant."""
    if not config.rig.is_jack:
        raise InputError(f"{config.rig.name} is a linear plant: it has no chambers, which set the limit; name a jack")
    return [
        PlacedStep(rig, name, placed)
        for own, others, scenarios in _loops(config)
        for scenario in scenarios
        for name, rig in (_specimens(own, others) if scenario.signal == "force" else {_NOMINAL: own}).items()
        for placed in _placed(scenario)
    ]


def _loops(config: BenchConfig | StepConfig) -> Iterator[tuple[Rig, Mapping[str, Rig], Sequence[Scenario]]]:
    """The nominal rig of every loop, the rigs of its set by name, and its scenarios."""
    if isinstance(config, StepConfig):
        yield config.rig, {}, config.scenarios
        return
    for loop in config.loops:
        yield loop.rig, loop.rigs, loop.scenarios


def _specimens(rig: Rig, others: Mapping[str, Rig]) -> dict[str, Rig]:
    """The nominal rig, and each of its set that presses on another specimen, by name."""
    own = rig["ks"], rig["cs"]
    return {_NOMINAL: rig} | {name: other for name, other in others.items() if (other["ks"], other["cs"]) != own}


def _placed(scenario: Scenario) -> list[Scenario]:
    if scenario.start or scenario.start_share or not scenario.is_step:
        return [scenario]
    return [replace(scenario, start_share=share) for share in PLACES]


def limit_page(rig: Rig, metrics: Mapping[str, Any], courses: Courses) -> Page:
    """One table, and a figure for every scenario."""
    rows = metrics["rows"]
    steps, moving = ([row for row in rows if row["moves"] is moves] for moves in (False, True))
    tables = [_steps_table(metrics, steps)] if steps else []
    sections = [Section("Limits", [*tables, *_tracking_tables(metrics, moving)])]
    sections += [Section(scenario, [_figure(scenario, courses)]) for scenario in _scenarios(courses)]
    return Page(f"The limit of {rig.name}", _verdict(rows), sections)


def limit_picture(courses: Courses) -> Figure:
    """The motions of the first scenario; an empty figure where nothing was found."""
    return _figure(next(iter(_scenarios(courses)), ""), courses)


def _verdict(rows: Sequence[Mapping[str, Any]]) -> str:
    settled = [f"{name} in {spanned(times)} s" for name, times in _by_scenario(rows, "limit_s").items()]
    signals = {row["scenario"]: SIGNALS[row["signal"]] for row in rows}
    followed = [
        f"{name} within {spanned([float(from_si(error, signals[name].unit, signals[name].si)) for error in errors])} "
        f"{signals[name].unit}"
        for name, errors in _by_scenario(rows, "limit_error").items()
    ]
    said = [f"The soonest that the optimiser finds, {_meshes(rows)}: {'; '.join(settled)}."] if settled else []
    said += [f"The nearest that the optimiser follows, root mean square: {'; '.join(followed)}."] if followed else []
    lacking = sum(row["limit_s"] is None and row["limit_error"] is None for row in rows)
    said += [f"No limit in {lacking} of {counted(len(rows), 'row')}; the table says why."] if lacking else []
    return " ".join(said) + gas_words(rows)


def _meshes(rows: Sequence[Mapping[str, Any]]) -> str:
    """How far the last two meshes of the steps' limits differ at most."""
    found = [row for row in rows if row["limit_s"] is not None]
    if any(row["mesh_difference_s"] is None for row in found):
        return "some of it on one mesh alone"
    return f"on two meshes within {max(100 * row['mesh_difference_s'] / row['limit_s'] for row in found):.1g} %"


def _by_scenario(rows: Sequence[Mapping[str, Any]], key: str) -> dict[str, list[float]]:
    found: dict[str, list[float]] = {}
    for row in rows:
        if row[key] is not None:
            found.setdefault(row["scenario"], []).append(row[key])
    return found


def _tracking_tables(metrics: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> list[Table]:
    """Tables of references that move, one for each signal."""
    note = (
        "The least root mean square of the error over the scenario, from rest, with the reference known ahead. It is "
        "found by direct collocation in windows, and played by the engine: the same command limits, stroke and "
        f"pressures, {metrics['margin_bar']:g} bar above 1 atm. By the mesh: the change when its intervals are "
        "halved."
    )
    by_signal = {
        name: [row for row in rows if row["signal"] == name] for name in dict.fromkeys(r["signal"] for r in rows)
    }
    return [MetricView(SIGNALS[name]).table("", own, _MOVING, note) for name, own in by_signal.items()]


def _steps_table(metrics: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> Table:
    """The table of steps."""
    note = (
        "The least time from rest until a step is settled as a bench counts it, found by direct collocation on the "
        "known plant: command within 1 and its rate, the jack within stroke and speed, and no chamber less than "
        f"{metrics['margin_bar']:g} bar above 1 atm, below which gas comes out of the oil. Many motions arrive as "
        "soon; the one with the quietest command is shown, which costs some 0.2 % of the time. By the mesh: the change "
        "when its intervals were last halved, which is the error of a held command: coarse meshes promise too much. "
        "The optimum is a local one. Pressure, overshoot and the distance from what was found belong to the motion "
        "that the engine plays, open loop."
    )
    return MetricView().table("", rows, _STEPS, note)


def _scenarios(courses: Courses) -> list[str]:
    return list(dict.fromkeys(name.partition(" from ")[0] for name in courses))


def _figure(scenario: str, courses: Courses) -> Figure:
    """Its motions from every place: signals, command and chamber pressures."""
    runs = {name.partition(" from ")[2]: run for name, run in courses.items() if name.startswith(f"{scenario} from ")}
    panels = [
        Panel(SIGNALS[key].label, tuple(_curve(place, key, run) for place, run in runs.items() if key in run))
        for key in _SHOWN
        if any(key in run and np.ptp(run[key]) > 0 for run in runs.values())
    ]
    return Figure(f"{scenario}: the best that was found", "time [ms]", panels)


def _curve(name: str, key: str, run: Mapping[str, np.ndarray]) -> Curve:
    values = run[key] - run[key][0] if key == "position" else run[key]
    return Curve(name, 1e3 * run["t [s]"], from_si(values, SIGNALS[key].unit, SIGNALS[key].si))
