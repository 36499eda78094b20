"""`jackbench learn EXPERIMENT`: its arguments."""

import argparse
from collections.abc import Callable

from ..common.outcome import Outcome
from ..common.record_options import record_options
from .config import load_any


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    record_options(parser, "learn_sine.toml", load_any, _study)


def _study() -> Callable[..., Outcome]:
    from .platform import run_any

    return run_any
