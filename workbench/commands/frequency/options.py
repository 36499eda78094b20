"""`jackbench frequency CAMPAIGN|SHEET.csv --output SIGNAL`: a measured frequency response beside the model's."""

import argparse
from functools import partial

from ..common.options import computes, finish
from ..common.shipped import campaign
from .config import identity, load


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("source", type=campaign, help="folder with a campaign.toml, or a sheet: frequency, gain, phase")
    parser.add_argument("--input", default="command", help="input signal (default: command)")
    parser.add_argument("--output", required=True, help="output signal, such as spool")
    parser.add_argument("--record", action="append", default=[], help="name of a record, instead of those held out")
    parser.add_argument("--period", type=float, help="length of one period [s] (default: found in the record)")
    parser.add_argument("--amplitude", type=float, help="amplitude of a sheet, in the unit of its input: 1, mA, mm")
    computes(parser, _frequency)


def _frequency(options: argparse.Namespace, words: list[str]) -> None:
    pair = (options.input, options.output)
    task = load(options.source, pair, options.rig, options.record, options.period, options.amplitude)
    from .study import run_frequency

    name = "-".join(["frequency", task.source, *pair])
    whole = {"command": "frequency", "rig": task.rig.table(), **identity(task)}
    finish(options, words, name, whole, partial(run_frequency, task))
