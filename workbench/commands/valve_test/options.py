"""`jackbench valve-test CAMPAIGN|RIG`: its arguments."""

import argparse
from functools import partial

from ...base.errors import InputError
from ..common.options import finish
from ..common.sheet_options import asked, check_metered, identity, sheet_options


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    sheet_options(parser, _valve_test)


def _valve_test(options: argparse.Namespace, words: list[str]) -> None:
    sheet = asked(options)
    if not sheet.rig.is_throttled:
        raise InputError(f"{sheet.rig.name}: a {sheet.rig.valve} has no lands to test; name a rig with a servo-valve")
    check_metered(sheet.rig)
    from ..common.sheet_page import browser, printed

    if options.pdf:
        browser()  # refused before anything is computed
    from .study import run_valve_test

    outcome = finish(
        options, words, f"valve-test-{sheet.name}", identity("valve-test", sheet), partial(run_valve_test, sheet)
    )
    printed(options, outcome, f"valve-test-{sheet.name}")
