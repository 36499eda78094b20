"""`jackbench coefficients EXPERIMENT`: discrete coefficients of its controllers at the rig's period."""

import argparse

from ..common.designs import of_controllers, print_each, read


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    of_controllers(parser, _coefficients)


def _coefficients(options: argparse.Namespace, _words: list[str]) -> None:
    config = read(options)
    from ...control.export import as_json, as_text, coefficients

    period = config.rig.period.value
    exported = {spec.name: coefficients(spec.build(period), period) for spec in config.controllers}
    print_each(
        options,
        {name: as_json(law) for name, law in exported.items()},
        lambda name: as_text(name, exported[name]),
    )
