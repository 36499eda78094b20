"""The sheets and the rig that a command line names: whatever is wrong with them is said before a solver is loaded."""

import argparse
import math
from pathlib import Path

from ...base.errors import InputError, nearest
from ...base.signals import SIGNALS
from ...base.units import quantity, to_si
from ...records.frequency_sheet import Columns, amplitude_needed
from ...records.sheet_points import SheetPoints, named_apart, read_points
from ...rigs.rig import Rig
from ...rigs.rig_file import load_rig
from .without import check_library


def read_sheets(options: argparse.Namespace) -> tuple[Rig, tuple[SheetPoints, ...]]:
    """The rig and the sheets, each at its amplitude. Raises InputError."""
    paths: list[Path] = options.campaign
    for name, option in ((options.input, "--input"), (options.output, "--output")):
        if name is None or name not in SIGNALS or name == "t":
            known = nearest(name or "", [signal for signal in SIGNALS if signal != "t"])
            raise InputError(f'{paths[0]}: a sheet needs {option}, a signal, not "{name}"; {known}')
    if options.rig is None:
        raise InputError(f"{paths[0]}: a sheet names no rig; add --rig")
    for given, option in ((options.several, "--several"), (options.jobs, "--jobs")):
        if given:
            raise InputError(f"{paths[0]}: {option} is for campaigns; leave it out")
    if options.sigma and not all(0 < value < math.inf for value in options.sigma):
        raise InputError("--sigma {:g} {:g}: both must be above 0".format(*options.sigma))
    sizes = options.amplitude or [None]
    if len(sizes) not in (1, len(paths)):
        raise InputError(f"--amplitude: {len(sizes)} for {len(paths)} sheets; give one, or one a sheet")
    sizes = sizes * len(paths) if len(sizes) == 1 else sizes
    for path, size in zip(paths, sizes, strict=True):
        amplitude_needed(Columns(path), size, SIGNALS[options.input].si)
    check_library(options.without, options.rig, options.effects)
    rig = load_rig(options.rig)
    sizes = [None if size is None else _size(size, options.input, rig) for size in sizes]
    sheets = tuple(
        read_points(path, size, options.input, options.output) for path, size in zip(paths, sizes, strict=True)
    )
    named_apart(sheets)
    return rig, sheets


def _size(text: str, input: str, rig: Rig) -> float:
    """An amplitude [SI of the input]: a share of full input, text with a unit, or a number in the unit shown."""
    signal = SIGNALS[input]
    if text.strip().endswith("%"):
        full = rig["imax"] if input == "current" else 1.0
        return full * quantity(text, "1")
    try:
        return float(to_si(float(text), signal.unit, signal.si))
    except ValueError:
        return quantity(text, signal.si)
