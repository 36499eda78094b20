"""`jackbench inverse EXPERIMENT`: its arguments."""

import argparse
from collections.abc import Callable

from ..common.outcome import Outcome
from ..common.record_options import record_options
from .config import load_inverse


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    record_options(parser, "inverse.toml", load_inverse, _study)


def _study() -> Callable[..., Outcome]:
    from .study import run_inverse

    return run_inverse
