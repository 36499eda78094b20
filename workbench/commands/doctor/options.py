"""`jackbench doctor`: what this installation can do."""

import argparse
import json

from ..common.columns import columns
from ..common.options import prints


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    prints(parser, _doctor)


def _doctor(options: argparse.Namespace, _words: list[str]) -> None:
    from .checks import checks

    rows = checks()
    if options.json:
        print(json.dumps([vars(row) for row in rows], indent=2))
        return
    print(columns([[row.what, "ok" if row.works else "missing", row.found] for row in rows]))
    advice = [f"  {row.what}: {row.advice}" for row in rows if not row.works]
    print("\n".join(["", "to get what is missing:", *advice]) if advice else "\nnothing is missing")
