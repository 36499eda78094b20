"""The report of a fit: each number in its declared range, what the records can not see, what moves together."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..identify.refit import Case, Stand
from ..report import Curve, Figure, Page, Panel, Section, Table
from ..report.figures import Mark
from ..units import from_si
from .fit_result import Fitted

STRONG = 0.9  # a correlation above says that only a combination of two numbers is known
_MOST = 12  # pairs listed


def fit_page(case: Case, stand: Stand, found: Sequence[Fitted], metrics: dict[str, Any]) -> tuple[Page, Figure]:
    """The page, and the figure of the numbers in their ranges."""
    picture = ranges_figure(found)
    name = case.campaign.path.resolve().name
    sections = [
        Section("Numbers", [picture, numbers_table(found)]),
        Section("What moves together", [_pairs(metrics["correlations"])]),
    ]
    return Page(f"Fit of {case.rig.name} to {name}", _verdict(metrics), sections), picture


def numbers_table(found: Sequence[Fitted]) -> Table:
    """Each number before and after, with interval and range, in the unit that the rig file has."""
    rows = []
    for one in found:
        number = one.number
        values = (number.value, one.value, one.low, one.high, number.low, number.high)
        shown = [float(from_si(v, number.unit, number.si)) for v in values if v is not None]
        state = "at an end" if one.held else "not seen" if one.unseen else ""
        rows.append([number.name, number.unit, *shown, state])
    return Table(
        "Numbers of the rig",
        ["number", "unit", "before", "fitted", "95 % low", "95 % high", "range low", "range high", ""],
        rows,
        note="At an end of its declared range: something that the model lacks may have pushed it there. Not seen: the "
        "interval is not shorter than 80 % of the range, so that the records do not tell.",
    )


def ranges_figure(found: Sequence[Fitted]) -> Figure:
    """Where each number stands in its declared range, 0 to 1."""
    places = np.arange(1, len(found) + 1, dtype=float)
    share = np.array([[_share(one, v) for v in (one.number.value, one.value, one.low, one.high)] for one in found])
    curves = [Curve("fitted", places, share[:, 1], "markers"), Curve("before", places, share[:, 0], "markers")]
    return Figure("Numbers", "number", [Panel("place in range [1]", curves, marks=(Mark(0.0), Mark(1.0)))])


def _share(one: Fitted, value: float) -> float:
    assert one.number.low is not None
    assert one.number.high is not None
    return (value - one.number.low) / (one.number.high - one.number.low)


def _pairs(correlation: dict[str, Any]) -> Table:
    names, matrix = correlation["names"], np.abs(correlation["matrix"])
    pairs = sorted(((matrix[i, j], i, j) for i in range(len(names)) for j in range(i)), reverse=True)[:_MOST]
    rows = [[names[j], names[i], float(correlation["matrix"][i, j])] for _, i, j in pairs]
    return Table("Strongest correlations", ["number", "with", "correlation"], rows)


def _verdict(metrics: dict[str, Any]) -> str:
    chi2 = metrics["chi2"]
    return f"chi2 {chi2['heldout']:.3g} on held-out records (1 is the noise floor), {chi2['train']:.3g} on train."
