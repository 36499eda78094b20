"""`jackbench coefficients EXPERIMENT`: discrete coefficients of its controllers at the rig's period."""

import argparse
import sys
from pathlib import Path

from ...base.errors import InputError
from ..common.designs import of_controllers, print_each
from ..common.new_folder import check_new
from ..common.step_experiment import load_steps


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    of_controllers(parser, _coefficients)
    files = "leave each law as JSON, C, Structured Text and .mat, the plant as .mat, and laws at a link as link_main.c"
    parser.add_argument("--out", type=Path, metavar="DIR", help=files)
    alone = "export the linear view at mid stroke alone, without limits or anti-windup; the files say so"
    parser.add_argument("--linear", action="store_true", help=alone)


def _coefficients(options: argparse.Namespace, _words: list[str]) -> None:
    config = load_steps(options.experiment, options.rig, options.controller)
    if options.out is not None:
        check_new(options.out)
    from ...control.export import as_json, as_text
    from .laws import exported

    laws, notes = exported(config.rig, config.controllers, options.linear)
    if not laws:
        raise InputError("; ".join(notes))
    if options.out is not None:
        from .folder import leave_laws

        print(leave_laws(options.out, config.rig, laws))
    else:
        results = {law.program.name: as_json(law.program, law.sections) for law in laws}
        texts = {law.program.name: law for law in laws}
        print_each(options, results, lambda name: as_text(texts[name].program, texts[name].sections))
    for line in notes:
        print(f"jackbench: {line}", file=sys.stderr)
