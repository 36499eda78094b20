"""`jackbench retune EXPERIMENT --found RIG`: a controller tuned anew on the rig as found, and the old one beside it."""

import argparse
from functools import partial
from pathlib import Path

from ...base.errors import InputError
from ...base.table import ConfigTable
from ..common.declared import finish_experiment
from ..common.experiment_file import read_experiment
from ..common.options import bounded, computes, jobs, works
from ..common.shipped import experiment
from .config import load_retune


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument(
        "experiment", type=experiment, help="a tune, run or bench experiment, such as experiments/tune_p_dp.toml"
    )
    parser.add_argument(
        "--found", required=True, metavar="RIG", help="the .toml file of the rig that fit or trace found"
    )
    parser.add_argument("--controller", metavar="NAME", help="the controller to retune, if the experiment has several")
    bounded(parser, "--designs", 1, "number of designs to try (default: the experiment's)")
    works(parser)
    computes(parser, _retune)


def _retune(options: argparse.Namespace, words: list[str]) -> None:
    top = read_experiment(options.experiment)
    if top.values.get("experiment") == "platform":
        _retune_platform(options, words, top)
        return
    config = load_retune(options.experiment, options.found, options.rig, options.controller, options.designs)
    from .study import run_retune

    study = partial(run_retune, config, jobs=jobs(options))
    finish_experiment(options, words, "retune", config.declared, study, "retune-", found=config.found.rig.table())


def _retune_platform(options: argparse.Namespace, words: list[str], top: ConfigTable) -> None:
    """Laws on modes follow the found platform by formulas: nothing is searched."""
    for name in ("controller", "designs"):
        if getattr(options, name) is not None:
            raise InputError(f"--{name} belongs to a search on one jack; leave it out on a platform")
    from .platform import load_platform_retune, run_platform_retune

    config = load_platform_retune(top, Path(options.experiment), options.rig, options.found)
    study, found = partial(run_platform_retune, config), config.found.rig.table()
    finish_experiment(options, words, "retune", config.declared, study, "retune-", found=found)
