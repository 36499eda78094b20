"""`jackbench spread EXPERIMENT`: overshoot of linear steps, one number of loop or rig varied at a time."""

import argparse
import sys
from dataclasses import replace

from ..common.designs import of_controllers, print_each
from ..common.step_experiment import load_steps


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    of_controllers(parser, _spread)


def _spread(options: argparse.Namespace, _words: list[str]) -> None:
    config = load_steps(options.experiment, options.rig, options.controller)
    from ...loop.overshoots import overshoot_spread, spread

    period = config.rig.period.value
    able = [
        spec for spec in config.controllers if replace(spec, compensators=()).build(period).measures == ("position",)
    ]
    specs = able or config.controllers  # where there is none, the first says why
    if left := [spec.name for spec in config.controllers if spec not in specs]:
        print(f"left out: {', '.join(left)}; a spread needs position laws", file=sys.stderr)
    spreads = {spec.name: overshoot_spread(config.rig, spec) for spec in specs}

    def text(name: str) -> str:
        lines = [f"{name}: overshoot [%] of a linear step"]
        for what, overshoot in spreads[name].items():
            row = "  ".join(f"{how}: {_percent(value)}" for how, value in overshoot.items())
            lines.append(f"  {what:6s} spread {_percent(spread(overshoot)):>8s}   {row}")
        return "\n".join(lines)

    print_each(options, spreads, text)


def _percent(value: float | None) -> str:
    return "unstable" if value is None else f"{value:.1f}"
