"""Modal laws for another platform, and what they gain there: the numbers that follow from a mode go with it.

Along its mode a platform is a jack of one mass m on the oil of six, w^2 = c/m with the same c. A feed-forward of that
mode has its w; a pressure feedback that damps it as much has a gain in proportion to w (2 zeta = gain c/(w Kv)). Gain
of position and corners stay.
"""

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...base.table import ConfigTable
from ...base.toml_text import toml_text
from ...control.platform_controller import LEGS
from ...loop.platform.loop import PlatformRun
from ...loop.platform.rows import judge_platform, linear_numbers
from ...loop.platform.setup import platform_setup
from ...report import Figure, Page, Section, Table
from ...rigs.platform.platform_file import platform_files
from ..common.metric_table import MetricView
from ..common.outcome import Outcome, Progress, Stage
from ..run.platform_config import PlatformConfig
from ..run.platform_page import step_figure

_FEEDS_PRESSURE = "PressureFeedback"
Runs = dict[tuple[str, str, str], PlatformRun]  # by controller, old or retuned, step


@dataclass(frozen=True)
class PlatformRetune:
    """An experiment on the declared platform and on the found one, which `rig` names; only controllers on modes can
    follow it."""

    declared: PlatformConfig
    found: PlatformConfig
    top: ConfigTable
    path: Path
    rig: str

    @property
    def modal(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(spec.name for spec in self.found.controllers if spec.modal)

    def retuned(self, ratio: np.ndarray) -> PlatformConfig:
        """The experiment on the found platform with laws whose modes are `ratio` [6] times as fast as before."""
        tables = {name: followed(self.found.source["controllers"][name], ratio) for name in self.modal}
        top = self.top.replaced({**self.top.values, "controllers": tables})
        return PlatformConfig.of(top, self.path, self.rig)


def load_platform_retune(top: ConfigTable, path: Path, rig: str | None, found: str) -> PlatformRetune:
    """The experiment on both, `rig` in place of the declared one where it is given.

    Raises InputError with file and key, and where no controller has laws on modes.
    """
    retune = PlatformRetune(PlatformConfig.of(top, path, rig), PlatformConfig.of(top, path, found), top, path, found)
    if not retune.modal:
        raise top.complaint("controllers", "none has laws on modes; only those follow another payload")
    return retune


def followed(table: Mapping[str, Any], ratio: np.ndarray) -> dict[str, Any]:
    """The table of a controller on modes for modes [6] so many times as fast."""
    table = deepcopy(dict(table))
    for law in table["laws"]:
        own = float(np.mean([ratio[int(mode) - 1] for mode in law["modes"] if 1 <= mode <= LEGS]))
        if "forward" in law and "frequency" in law["forward"]:
            law["forward"]["frequency"] = _times(law["forward"]["frequency"], own)
        for compensator in law.get("compensators", ()):
            if compensator["use"].endswith(_FEEDS_PRESSURE):
                compensator["gain"] = _times(compensator["gain"], own)
    return table


def _times(quantity: Any, ratio: float) -> Any:
    """A number with its unit, as a file has it, so many times larger, to five digits."""
    if isinstance(quantity, Mapping):
        return {**quantity, "value": _rounded(quantity["value"] * ratio)}
    number, _, unit = str(quantity).partition(" ")
    return f"{_rounded(float(number) * ratio):g} {unit}".strip()


def _rounded(value: float) -> float:
    return float(f"{value:.5g}")


def run_platform_retune(config: PlatformRetune, stage: Stage, progress: Progress) -> Outcome:
    """`rows`, a step each, and `linear`, of every modal controller, old and retuned, on the found platform; `modes`.

    `retuned.toml` is left, the experiment with the retuned laws, and the found platform that it names.
    """
    progress("modes of both platforms")
    declared, found = (platform_setup(each.rig, each.delay) for each in (config.declared, config.found))
    ratio = np.sqrt(declared.masses / found.masses)
    ways = {
        "old": (config.found, found.known_as(declared)),
        "retuned": (config.retuned(ratio), found),
    }
    rows, linear, runs = [], [], Runs()
    for way, (experiment, setup) in ways.items():
        for spec in (each for each in experiment.controllers if each.modal):
            progress(f"{spec.name}, {way}")
            judged = judge_platform(setup, spec, experiment.steps, experiment.f, experiment.conditions.noise)
            linear.append({"controller": spec.name, "way": way, **linear_numbers(judged.transfer)})
            runs |= {(spec.name, way, step): run for step, run in judged.runs.items()}
            rows += [{**row, "way": way} for row in judged.rows]
    metrics = {
        "rows": rows,
        "linear": linear,
        "modes": [{"mode": i + 1, "times_as_fast": float(ratio[i])} for i in range(LEGS)],
        "left_out": [spec.name for spec in config.found.controllers if not spec.modal],
    }
    return Outcome(metrics, lambda: (_page(config, metrics, runs), _figure(config, runs)), {}, _files(config, ratio))


def _files(config: PlatformRetune, ratio: np.ndarray) -> dict[str, str]:
    """The experiment and the platform that it names, by file."""
    source = {**config.retuned(ratio).source, "rig": "platform.toml"}
    return {"retuned.toml": toml_text(source), **platform_files(config.found.rig)}


def _page(config: PlatformRetune, metrics: dict[str, Any], runs: Runs) -> Page:
    rows, linear = metrics["rows"], metrics["linear"]
    view, laws = MetricView(), {"way": "laws", "scenario": "step"}
    steps = view.table(
        "Steps on the found platform",
        [{**row, "cross_worst_percent": max(row["cross"].values())} for row in rows],
        ("scenario", "controller", "way", "settling_s", "overshoot_percent", "cross_worst_percent"),
        "Other axes: how far any of them goes, in percent of the step, angles times the radius of the joints.",
        heads=laws,
    )
    keys = ("controller", "way", "stable", "ms", "coupling_percent")
    loops = view.table("Linear loops on the found platform", linear, keys, heads=laws)
    modes = Table(
        "Modes",
        ["mode", "times as fast as declared"],
        [[row["mode"], row["times_as_fast"]] for row in metrics["modes"]],
        "Feed-forward frequencies and gains of pressure feedback go with the mode; gains of position and corners stay.",
    )
    left = metrics["left_out"]
    said = [f"Not retuned, for their laws are not on modes: {', '.join(left)}."] if left else []
    title = f"Modal laws retuned on {config.found.rig.name}"
    return Page(title, _verdict(linear), [Section("What it gains", [loops, steps, *said]), Section("Numbers", [modes])])


def _verdict(linear: list[dict[str, Any]]) -> str:
    parts = []
    for row in (each for each in linear if each["way"] == "retuned"):
        old = next(e for e in linear if e["way"] == "old" and e["controller"] == row["controller"])
        was, now = (_percent(each["coupling_percent"]) for each in (old, row))
        parts.append(f"{row['controller']}: at 5 Hz a surge moves the pitch by {now}, before retuning by {was}.")
    return " ".join(parts)


def _percent(value: float | None) -> str:
    return "no number, as the loop is unstable" if value is None else f"{value:.2g} %"


def _figure(config: PlatformRetune, runs: Runs) -> Figure:
    """The first step, old and retuned."""
    step = config.found.steps[0]
    own = {f"{name}, {way}": run for (name, way, which), run in runs.items() if which == step.name}
    return replace(step_figure(step, config.found.rig, own), title=f"{step.name} on the found platform")
