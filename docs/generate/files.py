"""Experiments, campaigns, linear plants and tasks: a file of each kind with every key, as its reader reads it."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from envs.task import load_task
from workbench.commands.common.bench_experiment import load_bench
from workbench.commands.faults.config import load_faults
from workbench.commands.inverse.config import load_inverse
from workbench.commands.learn.config import load_any, load_learning
from workbench.commands.robustness.config import load_any as load_robustness_of_any, load_robustness
from workbench.commands.run.config import load_config
from workbench.commands.sines.config import load_sines
from workbench.commands.train.config import load_train
from workbench.commands.tune.config import load_tune
from workbench.records import load_campaign
from workbench.rigs.platform import load_platform
from workbench.rigs.rig_file import load_rig

from .markdown import page, plain, table
from .readings import Readings, watched
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
        ("run: steps of a loop", load_config, ("step.toml", "force.toml", "linear_step.toml")),
        ("bench", load_bench, ("bench.toml",)),
        ("tune", load_tune, ("tune.toml",)),
        ("train", load_train, ("train.toml",)),
        ("robustness", load_robustness, ("robustness.toml",)),
        ("robustness: a platform on six jacks", load_robustness_of_any, ("robustness_platform.toml",)),
        ("faults", load_faults, ("faults.toml",)),
        ("learn", load_learning, ("learn.toml",)),
        ("learn: a platform on six jacks", load_any, ("learn_platform.toml", "learn_platform_road.toml")),
        ("inverse", load_inverse, ("inverse.toml",)),
        ("sines", load_sines, ("sines.toml",)),
        ("run: the paper's figures", load_config, ("paper.toml",)),
        ("run: correctors of a spool loop", load_config, ("corrector.toml",)),
        ("run: a platform on six jacks", load_config, ("platform.toml", "platform_record.toml")),
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


def _part(*kinds: tuple[str, Callable[[Path], Any], Sequence[str]]) -> list[str]:
    """Title, files and keys of each kind. Raises RuntimeError for a key that no file has, or that nothing explains."""
    parts, meanings, known = [], {}, set()
    for title, load, names in kinds:
        rows: dict[str, tuple[str, str]] = {}
        for name in names:
            with watched() as documents:
                load(FOLDER / name)
            own = next(readings for document, readings in documents.items() if document.endswith(Path(name).name))
            rows |= {key: row for key, row in _rows(own, name).items() if key not in rows}
            known |= _allowed(own)
        meanings = {key: meaning for key, (_, meaning) in rows.items() if meaning} | meanings
        if unexplained := [key for key in rows if key not in meanings]:
            raise RuntimeError(f"docs/files/{names[0]}: what is {', '.join(unexplained)}? Add a comment on its line")
        cells = [[f"`{key}`", plain(reads), plain(meaning or meanings[key])] for key, (reads, meaning) in rows.items()]
        sources = [f"```{{literalinclude}} ../files/{name}\n:language: toml\n```" for name in names]
        parts += [f"## {title}", *sources, table(("key", "reads", "meaning"), cells)]
    explained = {".".join(key.split(".")[:end]) for key in meanings for end in range(1, 5)}
    if missing := known - explained:
        raise RuntimeError(f"docs/files: no file has {', '.join(sorted(missing))}; add what the readers allow")
    return parts


def _rows(readings: Readings, name: str) -> dict[str, tuple[str, str]]:
    """How each key of a file is read, and its meaning: the comment on its line, or what the code says; in order."""
    lines = (FOLDER / name).read_text("utf-8").splitlines()
    rows = {}
    for path, line in sorted(readings.lines.items(), key=lambda item: (item[1], len(item[0]))):
        reads, known = readings.asked.get(path, ("", ""))
        comment = re.search(r" # ?(.*)$", lines[line - 1])
        if path in readings.shown and (reads or comment):
            rows.setdefault(readings.named(path), (reads, comment[1] if comment else known))
    return rows


def _allowed(readings: Readings) -> set[str]:
    """Every key that the readers of a document's tables know."""
    keys = {(*path, key) for path, known in readings.allowed.items() for key in known}
    return {readings.named(path) for path in keys if not readings.is_elsewhere(path)}
