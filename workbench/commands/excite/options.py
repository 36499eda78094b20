"""`jackbench excite RIG KIND`: designs an excitation and writes the file that a drive plays."""

import argparse
from pathlib import Path

from ...base.errors import InputError
from ...records.excitation import KINDS
from ...rigs.rig_file import load_rig
from .config import SETS

_SIZES = ("amplitude", "seconds")


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("rig", help="the bundled rig or rig file whose control period and limits are kept")
    parser.add_argument(
        "kind",
        choices=(*KINDS, *SETS),
        help="kind of excitation; valve-test, force-test: all that a sheet of that command needs",
    )
    parser.add_argument("--signal", choices=("command", "reference"), default="command", help="signal that is excited")
    parser.add_argument("--amplitude", type=float, help="peak of the command [1] or of the reference [mm]")
    parser.add_argument("--seconds", type=float, help="length of one period [s]")
    parser.add_argument("--repeat", type=int, default=1, help="number of periods (default: 1)")
    parser.add_argument("--band", type=float, nargs=2, metavar="HZ", help="band of a chirp or multisine")
    parser.add_argument("--lines", type=int, help="about how many lines a multisine has (default: every harmonic)")
    parser.add_argument("--spectrum", choices=("flat", "1/f"), default="flat", help="spectrum of a multisine")
    parser.add_argument("--sweep", choices=("log", "linear"), default="log", help="sweep of a chirp")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="a .csv file; a new folder for a sheet")
    parser.add_argument("--force", action="store_true", help="replace an existing file")
    parser.set_defaults(call=_excite)


def _excite(options: argparse.Namespace, _words: list[str]) -> None:
    if options.kind in SETS:
        _set(options)
        return
    for name in _SIZES:
        if getattr(options, name) is None:
            raise InputError(f"--{name}: missing; a {options.kind} needs it")
    band = tuple(options.band) if options.band else None
    shape = (options.repeat, band, options.lines, options.spectrum, options.sweep)
    rig = load_rig(options.rig)
    from ...loop.standard_records import Design
    from .study import excite

    design = Design(options.kind, options.signal, options.amplitude, options.seconds, *shape)

    print(excite(design, rig, options.out, options.force))


def _set(options: argparse.Namespace) -> None:
    for name in (*_SIZES, "band", "lines"):
        if getattr(options, name) is not None:
            raise InputError(f"--{name}: belongs to a single excitation; a {options.kind} has its own, leave it out")
    from .sets import write_set

    print(write_set(options.kind, load_rig(options.rig), options.out))
