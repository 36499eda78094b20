"""Runs of one command that does next to nothing, for the tests of run folders."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from workbench.commands.common.run_folder import RunFolder, open_run, resolved_config
from workbench.report import Page, render

COMMAND = {"command": "bench", "config": {"rigs": ["nominal", "mass+50"], "step": 1e-3}, "seed": 7}
PAGE = Page("Bench", "It runs.", [])


def finish(run: RunFolder, value: object = 1.5, tables: Mapping[str, Mapping[str, np.ndarray]] | None = None) -> None:
    run.finish({"rows": [{"value": value}]}, resolved_config(COMMAND), tables or {}, render(PAGE))


def complete(out: Path, value: object = 1.5, **options: Any) -> Path:
    with open_run(out, COMMAND, **options) as run:
        finish(run, value)
    return out


def stop(out: Path, block: Callable[[RunFolder], object]) -> None:
    """Open a run, do `block` and be interrupted."""

    def interrupted() -> None:
        with open_run(out, COMMAND) as run:
            block(run)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()


def value_of(out: Path) -> object:
    return json.loads((out / "metrics.json").read_text())["rows"][0]["value"]
