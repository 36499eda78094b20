"""`jackbench force-test CAMPAIGN|RIG`: its arguments."""

import argparse
from dataclasses import replace
from functools import partial

from ...base.errors import InputError
from ...rigs.load import GRIPS, LOADS
from ...rigs.number import Number
from ...rigs.rig import Rig
from ...rigs.schema import LOAD
from ..common.options import finish, measured
from ..common.sheet_options import asked, identity, sheet_options

_MOST = 50.0  # %


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    sheet_options(parser, _force_test)
    specimen = "stiffness of a played rig's specimen, such as '1e7 N/m'"
    measured(parser, "--specimen", LOAD["ks"], specimen, "STIFFNESS")
    grips = "mass between load cell and specimen of a played rig, such as '12 kg'"
    measured(parser, "--grips", LOADS[GRIPS]["Mg"], grips, "MASS")
    parser.add_argument(
        "--within",
        type=float,
        default=1.0,
        metavar="PERCENT",
        help="largest error of a force range that passes (default: 1)",
    )
    parser.add_argument(
        "--reference-within",
        type=float,
        default=0.0,
        metavar="PERCENT",
        help="half of the reference cell's 95 %% interval, which widens that of every error (default: 0)",
    )


def _force_test(options: argparse.Namespace, words: list[str]) -> None:
    within, reference = (_share(options, name) for name in ("within", "reference_within"))
    if within <= 0:
        raise InputError(f"--within {options.within:g}: must be above 0")
    sheet = asked(options)
    sheet = replace(sheet, rig=_changed(sheet.rig, options))
    from ...identify.acceptance.force_test import Reference
    from ..common.sheet_page import browser, printed

    if options.pdf:
        browser()  # refused before anything is computed
    from .study import run_force_test

    name, whole = f"force-test-{sheet.name}", identity("force-test", sheet) | {"within": within, "reference": reference}
    study = partial(run_force_test, sheet, Reference(reference, within))
    printed(options, finish(options, words, name, whole, study), name)


def _share(options: argparse.Namespace, name: str) -> float:
    percent = getattr(options, name)
    if not 0 <= percent <= _MOST:
        raise InputError(f"--{name.replace('_', '-')} {percent:g}: must be from 0 to {_MOST:g} %")
    return percent / 100


def _changed(rig: Rig, options: argparse.Namespace) -> Rig:
    """With another specimen and other grips, where these are asked for. Raises InputError."""
    if options.specimen is not None:
        rig = rig.with_values(ks=options.specimen)
    return rig if options.grips is None else with_grips(rig, options.grips)


def with_grips(rig: Rig, mass: float) -> Rig:
    """A rig with a mass [kg] between load cell and specimen. Raises InputError for one above the moving mass, and for a
    rig with a load of another kind."""
    if mass > rig["M"]:
        raise InputError(f"--grips {mass:g} kg: is part of the moving mass, which is {rig['M']:g} kg; give less")
    if LOADS[rig.load] and rig.load != GRIPS:
        raise InputError(f"--grips: {rig.name} has a load of kind {rig.load}; take the option out")
    return replace(rig, load=GRIPS, numbers={**rig.numbers, "Mg": Number("Mg", mass, "kg", "kg", "--grips")})
