"""`jackbench coefficients EXPERIMENT`: discrete coefficients of its controllers at the rig's period."""

import argparse
import sys
from dataclasses import replace

from ...base.errors import InputError
from ..common.designs import of_controllers, print_each, read


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    of_controllers(parser, _coefficients)


def _coefficients(options: argparse.Namespace, _words: list[str]) -> None:
    config = read(options)
    from ...control.export import Coefficients, as_json, as_text, coefficients
    from ...control.protocol import fallbacks

    period = config.rig.period.value
    exported: dict[str, Coefficients] = {}
    notes: list[str] = []
    for spec in config.controllers:
        try:
            if spec.stiffest is not None:
                notes.append(f"{spec.name}: as on the specimen of its design; it measures the stiffness, this does not")
            controller = replace(spec, softest=None, stiffest=None).build(period)
            exported[spec.name] = coefficients(controller, period)
            if fallbacks(controller) is not None:
                notes.append(f"{spec.name}: the law far from its limits; its plan cannot be exported")
        except InputError as error:
            notes.append(f"{spec.name}: {error}")
    if not exported:
        raise InputError("; ".join(notes))
    print_each(
        options,
        {name: as_json(law) for name, law in exported.items()},
        lambda name: as_text(name, exported[name]),
    )
    for line in notes:
        print(f"jackbench: {line}", file=sys.stderr)
