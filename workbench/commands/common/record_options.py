"""The arguments of a command that plays a record, as an experiment says."""

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from .experiment import data_files
from .options import computes, draws, finish, plants
from .outcome import Outcome
from .shipped import experiment

Load = Callable[[Path, str | None, int | None], Any]


def record_options(
    parser: argparse.ArgumentParser, shown: str, load: Load, study: Callable[[], Callable[..., Outcome]]
) -> None:
    """Of an experiment such as `shown`. `load` reads it, with another rig or number of plants; `study` imports what
    computes."""
    parser.add_argument("experiment", type=experiment, help=f"an experiment file, such as experiments/{shown}")
    draws(parser)
    computes(parser, partial(_play, load, study))


def _play(
    load: Load, study: Callable[[], Callable[..., Outcome]], options: argparse.Namespace, words: list[str]
) -> None:
    config = load(options.experiment, options.rig, plants(options))
    record = config.record
    identity = {"command": words[0], "experiment": record.source, "rig": record.rig.table()}
    if record.drawn is not None:
        identity["plants"] = record.drawn.plants
    if files := data_files(record.source):
        identity["files"] = files
    finish(options, words, Path(options.experiment).stem, identity, partial(study(), config))
