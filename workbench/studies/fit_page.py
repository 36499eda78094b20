"""The report of a fit: each number in its declared range, what the records can not see, what moves together."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..identify.refit import Case, Stand
from ..report import Curve, Figure, Page, Panel, Section, Table
from ..report.figures import Mark
from ..units import from_si
from .fit_result import Fitted

RIG_FILE, BEFORE, AFTER = "#8c959f", "#d55e00", "#0072b2"
STRONG = 0.9  # a correlation above says that only a combination of two numbers is known
_MOST = 12  # pairs listed


def fit_page(case: Case, stand: Stand, found: Sequence[Fitted], metrics: dict[str, Any]) -> tuple[Page, Figure]:
    """The page, and the figure of the numbers in their ranges."""
    picture = ranges_figure({"fitted": found})
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


def ranges_figure(fits: Mapping[str, Sequence[Fitted]]) -> Figure:
    """Where each number stands in its declared range: in the rig file, and after each of some fits, by label.

    The 95 % interval is that of the last fit.
    """
    *_, last = fits.values()
    places = np.arange(1.0, len(last) + 1)
    curves = [Curve("rig file", places, _shares(last, [one.number.value for one in last]), "markers", RIG_FILE)]
    for (label, found), colour in zip(fits.items(), (BEFORE, AFTER)[-len(fits) :], strict=True):
        curves.append(Curve(label, places, _shares(found, [one.value for one in found]), "markers", colour))
    ends = np.column_stack([_shares(last, [getattr(one, end) for one in last]) for end in ("low", "high")])
    across = np.column_stack((places, places, np.full(len(last), np.nan))).ravel()
    up = np.column_stack((ends, np.full(len(last), np.nan))).ravel()
    curves.append(Curve("95 % interval", across, up, color=AFTER))
    marks = (Mark(0.0, "low end"), Mark(1.0, "high end"))
    panel = Panel("place in the declared range [1]", curves, y_range=(-0.08, 1.08), marks=marks)
    return Figure(
        "The rig's numbers in their declared ranges", "number", [panel], x_names=[one.number.name for one in last]
    )


def _shares(found: Sequence[Fitted], values: Sequence[float]) -> np.ndarray:
    """Values as parts of the declared ranges."""
    ends = np.array([(one.number.low, one.number.high) for one in found], dtype=float)
    return (np.array(values) - ends[:, 0]) / (ends[:, 1] - ends[:, 0])


def _pairs(correlation: dict[str, Any]) -> Table:
    names, matrix = correlation["names"], np.abs(correlation["matrix"])
    pairs = sorted(((matrix[i, j], i, j) for i in range(len(names)) for j in range(i)), reverse=True)[:_MOST]
    rows = [[names[j], names[i], float(correlation["matrix"][i, j])] for _, i, j in pairs]
    return Table("Strongest correlations", ["number", "with", "correlation"], rows)


def _verdict(metrics: dict[str, Any]) -> str:
    chi2 = metrics["chi2"]
    return f"chi2 {chi2['heldout']:.3g} on held-out records (1 is the noise floor), {chi2['train']:.3g} on train."
