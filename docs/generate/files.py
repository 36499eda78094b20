"""Experiments, campaigns, linear plants and tasks: a file of each kind with every key, as its reader reads it."""

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from envs.task import load_task
from workbench.commands.common.bench_experiment import BenchConfig
from workbench.commands.common.declared import Experiment, keys_of, meanings
from workbench.commands.common.step_experiment import StepConfig
from workbench.commands.faults.options import FaultsConfig
from workbench.commands.inverse.options import InverseConfig
from workbench.commands.learn.options import LearnConfig, PlatformLearnConfig
from workbench.commands.robustness.options import PlatformRobustness, RobustnessConfig
from workbench.commands.run.options import CorrectorConfig, PaperConfig
from workbench.commands.run.platform_config import PlatformConfig
from workbench.commands.sines.options import SinesConfig
from workbench.commands.train.options import TrainConfig
from workbench.commands.tune.options import TuneConfig
from workbench.records import load_campaign
from workbench.rigs.platform import load_platform
from workbench.rigs.rig_file import load_rig

from .markdown import page, plain, table
from .readings import WORDS, Readings, watched
from .readme import ROOT

FOLDER = ROOT / "docs" / "files"
_EXPERIMENTS = """What `jackbench run`, `bench`, `tune` and the others take: one TOML file a run. For each kind there
is a file with every key that its reader knows; the table says how the reader reads each. A number with a unit is text,
`"10 mm"`, or `{value = 10, unit = "mm"}`; ranges are in SI. A key that is not listed is refused with the nearest one
that is. The tables of controllers are in [](controllers.md). In place of `rig` a table `[plant]` may name the file of a
[linear plant](linear_plants.md)."""
_LINEAR = """A plant of your own that is no jack: `state_space`, `transfer_function`, `chain` or a measured
`frequency_response`, in a file that an experiment names: `plant = {transfer_function = "axis.toml"}`. A sheet may stand
in the experiment itself, under `[plant]`, with these tables beside it. The unit of the position says what is
controlled; in design numbers "m" stands for its SI unit."""
_PLATFORMS = """A payload on six jacks: `jackbench run experiments/hexapod.toml` judges loops on one. The file has every
number of payload and geometry, and of each leg its jack as a rig.

A controller of such an experiment stands on each leg, or there is a law on each mode: `[controllers.NAME]` has a list
`[[controllers.NAME.laws]]`, each a controller with `modes = [1, 2]`, counted from the slowest, and where it has one
`forward = {velocity_gain = "7.4 m/s", frequency = "15.6 Hz", damping = "0.5"}`, the inverse of its mode from the
reference. `command_map` is a compensator that maps the command of each jack. `smoothing = {corner = "15 Hz"}`, which a
controller on the legs may have too, is four lags that the pose asked for goes through."""
_CAMPAIGN = """A folder with recordings and a `campaign.toml`; [](../how/campaign.md) says how it is used, and
`jackbench import` writes one of recordings in these and other formats. Records are CSV, CSV.gz, Parquet or MAT, with
header cells `name [unit]`."""
_TASKS = """What an episode of a Gymnasium environment asks for, what is observed and what a step costs; see
[](../environments.md)."""


def pages() -> dict[str, str]:
    """The pages of the kinds of files. Raises RuntimeError for a key that no file has, or that nothing explains."""
    experiments = _part(
        ("run: steps of a loop", StepConfig, ("step.toml", "force.toml", "linear_step.toml")),
        ("bench", BenchConfig, ("bench.toml",)),
        ("tune", TuneConfig, ("tune.toml",)),
        ("train", TrainConfig, ("train.toml",)),
        ("robustness", RobustnessConfig, ("robustness.toml",)),
        ("robustness: a platform on six jacks", PlatformRobustness, ("robustness_platform.toml",)),
        ("faults", FaultsConfig, ("faults.toml",)),
        ("learn", LearnConfig, ("learn.toml",)),
        (
            "learn: a platform on six jacks",
            PlatformLearnConfig,
            ("learn_platform.toml", "learn_platform_road.toml"),
        ),
        ("inverse", InverseConfig, ("inverse.toml",)),
        ("sines", SinesConfig, ("sines.toml",)),
        ("run: the paper's figures", PaperConfig, ("paper.toml",)),
        ("run: correctors of a spool loop", CorrectorConfig, ("corrector.toml",)),
        ("run: a platform on six jacks", PlatformConfig, ("platform.toml", "platform_record.toml")),
    )
    linear = _part(
        ("A transfer function", load_rig, ("linear.toml",)),
        ("A state space", load_rig, ("linear_states.toml",)),
        ("A chain of parts", load_rig, ("linear_chain.toml",)),
        ("A measured frequency response", load_rig, ("linear_sheet.toml",)),
    )
    platform = _part(("Every key", load_platform, ("platform_rig.toml",)))
    campaign = _part(("campaign.toml", load_campaign, ("campaign/campaign.toml", "campaign/session.toml")))
    tasks = _part(("Every key", lambda path: load_task(path, "force"), ("task.toml",)))
    return {
        "experiment_files.md": page("Experiment files", _EXPERIMENTS, *experiments),
        "linear_plants.md": page("Linear plants", _LINEAR, *linear),
        "platforms.md": page("Platforms", _PLATFORMS, *platform),
        "campaign_file.md": page("Campaign file", _CAMPAIGN, *campaign),
        "tasks.md": page("Tasks", _TASKS, *tasks),
    }


Load = type[Experiment] | Callable[[Path], Any]  # an experiment says what its keys mean, a reader only what it asks


def _part(*kinds: tuple[str, Load, Sequence[str]]) -> list[str]:
    """Title, files and keys of each kind. Raises RuntimeError for a key that no file has, or that nothing explains."""
    parts, explained, known = [], {}, set()
    for title, kind, names in kinds:
        load, declared = (kind.load, meanings(kind)) if isinstance(kind, type) else (kind, {})
        rows: dict[str, tuple[str, str]] = {}
        for name in names:
            with watched() as documents:
                load(FOLDER / name)
            own = next(readings for document, readings in documents.items() if document.endswith(Path(name).name))
            rows |= {key: row for key, row in _rows(own, name, declared).items() if key not in rows}
            known |= _allowed(own)
        rows |= {key: row for key, row in _declared(kind).items() if key not in rows}
        explained = {key: meaning for key, (_, meaning) in rows.items() if meaning} | explained
        if unexplained := [key for key in rows if key not in explained]:
            raise RuntimeError(f"docs/files/{names[0]}: what is {', '.join(unexplained)}? Add a comment on its line")
        cells = [[f"`{key}`", plain(reads), plain(meaning or explained[key])] for key, (reads, meaning) in rows.items()]
        sources = [f"```{{literalinclude}} ../files/{name}\n:language: toml\n```" for name in names]
        parts += [f"## {title}", *sources, table(("key", "reads", "meaning"), cells)]
    shown = {".".join(key.split(".")[:end]) for key in explained for end in range(1, 5)}
    if missing := known - shown:
        raise RuntimeError(f"docs/files: no file has {', '.join(sorted(missing))}; add what the readers allow")
    return parts


def _declared(kind: Load) -> dict[str, tuple[str, str]]:
    """How each field of one key is read, and its meaning, whether or not a file has it."""
    own = keys_of(kind).items() if isinstance(kind, type) else ()
    return {name: (WORDS[key.of[0]](key.of[1]), key.meanings[""]) for name, key in own if key.of}


def _rows(readings: Readings, name: str, declared: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    """How each key of a file is read, and its meaning: the comment on its line, or what is declared; in order."""
    lines = (FOLDER / name).read_text("utf-8").splitlines()
    rows = {}
    for path, line in sorted(readings.lines.items(), key=lambda item: (item[1], len(item[0]))):
        reads, known = readings.asked.get(path, ("", ""))
        comment = re.search(r" # ?(.*)$", lines[line - 1])
        meaning = comment[1] if comment else known or declared.get(readings.named(path), "")
        if path in readings.shown and (reads or meaning):
            rows.setdefault(readings.named(path), (reads, meaning))
    return rows


def _allowed(readings: Readings) -> set[str]:
    """Every key that the readers of a document's tables know."""
    keys = {(*path, key) for path, known in readings.allowed.items() for key in known}
    return {readings.named(path) for path in keys if not readings.is_elsewhere(path)}
