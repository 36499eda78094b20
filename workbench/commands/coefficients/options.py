"""`jackbench coefficients EXPERIMENT`: discrete coefficients of its controllers at the rig's period."""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from ...base.errors import InputError
from ..common.designs import of_controllers, print_each, read
from ..common.new_folder import check_new


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    of_controllers(parser, _coefficients)
    files = "leave each law as JSON, C, Structured Text and .mat, the plant as .mat, and laws at a link as link_main.c"
    parser.add_argument("--out", type=Path, metavar="DIR", help=files)


def _coefficients(options: argparse.Namespace, _words: list[str]) -> None:
    config = read(options)
    if options.out is not None:
        check_new(options.out)
    from ...control.export import Coefficients, as_json, as_text, coefficients
    from ...control.protocol import Controller

    period = config.rig.period.value
    laws: dict[str, tuple[Controller, Coefficients]] = {}
    notes: list[str] = []
    for spec in config.controllers:
        try:
            controller = replace(spec, softest=None, stiffest=None).build(period)
            laws[spec.name] = controller, coefficients(controller, period)
        except InputError as error:
            notes.append(f"{spec.name}: {error}")
            continue
        if spec.stiffest is not None:
            notes.append(f"{spec.name}: as on the specimen of its design; it measures the stiffness, this does not")
    if not laws:
        raise InputError("; ".join(notes))
    if options.out is not None:
        from .folder import leave_laws

        print(leave_laws(options.out, config.rig, laws))
    else:
        results = {name: as_json(law) for name, (_, law) in laws.items()}
        print_each(options, results, lambda name: as_text(name, laws[name][1]))
    for line in notes:
        print(f"jackbench: {line}", file=sys.stderr)
