"""`jackbench frequency CAMPAIGN|RECORDING...|SHEET --output SIGNAL`: a measured response beside a model's."""

import argparse
import re
from functools import partial

from ...base.errors import InputError
from ..common.options import computes, finish
from ..common.shipped import campaign
from .config import identity, load


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    what = "folder with a campaign.toml; or recordings with two columns; or a sheet, frequency, gain, phase, with --rig"
    parser.add_argument("source", type=campaign, nargs="+", help=what)
    parser.add_argument("--input", default="command", help="input signal, or column of recordings (default: command)")
    parser.add_argument("--output", required=True, help="output signal, such as spool, or column of recordings")
    parser.add_argument("--record", action="append", default=[], help="name of a record, instead of those held out")
    parser.add_argument("--period", type=float, help="length of one period [s] (default: found in the record)")
    parser.add_argument("--amplitude", type=float, help="amplitude of a sheet, in the unit of its input: 1, mA, mm")
    parser.add_argument("--model", action="store_true", help="fit a transfer function, and leave it as plant.toml")
    computes(parser, _frequency)


def _frequency(options: argparse.Namespace, words: list[str]) -> None:
    pair = (options.input, options.output)
    task = load(options.source, pair, options.rig, options.record, options.period, options.amplitude, options.model)
    whole = {"command": "frequency", **identity(task)}
    if options.model and not task.pairs:
        raise InputError("--model: a sheet is fitted as a linear plant by [frequency_response]; name recordings here")
    from .study import run_frequency
    from .two_columns import run_pairs

    name = "-".join(re.sub(r"\W+", "-", part) for part in ("frequency", task.source, *pair))
    study = partial(run_frequency, task)
    if task.rig is None:
        whole, study = {**whole, "model": options.model}, partial(run_pairs, task, options.model)
    else:
        whole["rig"] = task.rig.table()
    finish(options, words, name, whole, study)
