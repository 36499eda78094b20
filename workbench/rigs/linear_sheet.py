"""A linear plant out of a measured frequency response."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from ..base.errors import InputError
from ..base.table import ConfigTable
from ..base.units import Spec
from ..records.frequency_sheet import read_response
from ..records.rational_fit import FitOrder, RationalFit, fit_rational

_MOST_POLES = 50
_SHARE = Spec("1", 1e-6, 1.0, "largest error")
LARGEST_ERROR = 0.1  # rms of the relative error over the sheet, where the table says nothing else


def fit_sheet(table: ConfigTable, unit: str, si: str, delay: float | None) -> RationalFit:
    """The model of a table [frequency_response] whose output has the `unit`; `delay` [s] where it is known.

    Raises InputError where no model comes near enough.
    """
    table.allow("gain", "file", "poles", "zeros", "integrators", "unstable", "largest_error")
    path = table.path("file", Path(table.place.document).parent, ".csv")
    f, response = read_response(path, unit, si)
    counts: Mapping[str, int] = {
        name: table.count(name, least, _MOST_POLES)
        for name, least in (("poles", 1), ("zeros", 0), ("integrators", 0))
        if name in table
    }
    order = FitOrder(**counts, delay=delay, stable=not table.flag("unstable", False))
    try:
        fit = fit_rational(f, response, order)
    except InputError as error:
        raise table.error(str(error)) from None
    largest = table.quantity("largest_error", _SHARE) if "largest_error" in table else LARGEST_ERROR
    if fit.error > largest:
        raise table.error(_too_far(fit, largest, order))
    return fit


def _too_far(fit: RationalFit, largest: float, order: FitOrder) -> str:
    """Why a model is refused, and what may help."""
    hint = "give more poles" if order.poles else "cut the sheet to the band that matters"
    if order.stable and fit_rational(fit.f, fit.response, replace(order, stable=False)).error <= largest:
        hint = "the plant is unstable: write unstable = true"
    return f"the best model ({fit}) is farther off than largest_error, {100 * largest:g} %; {hint}"
