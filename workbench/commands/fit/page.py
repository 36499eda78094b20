"""The report of a fit: each number in its declared range, what the records cannot see, what moves together."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...base.units import from_si
from ...base.words import counted
from ...identify.fit.sessions import SessionDifference
from ...identify.found.fitted import Fitted, fitted_cells, pinned_sentence
from ...identify.found.session_fit import SessionFit
from ...identify.trace.information import linked
from ...identify.trace.problem import EstimationProblem
from ...report import Curve, Figure, Page, Panel, Section, Table
from ...report.figures import Mark
from ..common.error_page import AFTER, BEFORE, GIVEN, error_figure, error_table
from ..common.session_tables import session_fits_sentence, session_fits_table
from ..common.sessions import sessions_section, sessions_sentence
from ..residual.study import noise_table
from .ladder import ladder_section, ladder_sentence
from .remains import remains_sentence
from .shares import shares_sentence
from .tells import tells_sentence, tells_table

STRONG = 0.95  # a correlation above says that only a combination of two numbers is known
_MOST = 10  # pairs listed


def fit_page(
    problem: EstimationProblem,
    numbers: Sequence[Fitted],
    in_sessions: Sequence[SessionFit],
    differences: Sequence[SessionDifference],
    metrics: Mapping[str, Any],
) -> tuple[Page, Figure]:
    """The page, and the figure of the numbers in their ranges."""
    picture, labels = ranges_figure({"fitted": numbers}), ["rig file", "fitted"]
    sections = [
        Section("Numbers", [picture, numbers_table(numbers)]),
        *([Section("In sessions", [session_fits_table(problem, in_sessions)])] if in_sessions else []),
        Section(
            "Held-out error",
            [error_figure(metrics["rms"], labels), error_table(metrics["rms"], labels, problem.free_run)],
        ),
        *([ladder_section(metrics["ladder"])] if "ladder" in metrics else []),
        *sessions_section(problem, differences),
        *([Section("What each signal tells", [tells_table(metrics["tells"])])] if "tells" in metrics else []),
        Section("What moves together", [_pairs(metrics["correlations"]), _matrix(metrics["correlations"])]),
        Section("Noise floor", [noise_table(problem.floor)]),
    ]
    name = problem.campaign.path.resolve().name
    return Page(
        f"{problem.rig.name} fitted to {name}",
        _verdict(problem, numbers, metrics)
        + session_fits_sentence(in_sessions)
        + sessions_sentence(problem, differences),
        sections,
    ), picture


def numbers_table(numbers: Sequence[Fitted]) -> Table:
    """Each number before and after, with interval and range, in the unit that the rig file has."""
    rows = []
    for entry in numbers:
        number = entry.number
        ends = [float(from_si(v, number.unit, number.si)) for v in (number.low, number.high) if v is not None]
        shown = [number.shown, *fitted_cells(entry), *ends]
        state = "at an end" if entry.at_bounds else "not seen" if entry.unseen else ""
        rows.append([number.name, number.unit, *shown, state])
    return Table(
        "Numbers of the rig",
        ["number", "unit", "rig file", "fitted", "95 % low", "95 % high", "range low", "range high", ""],
        rows,
        note="At an end of its declared range: something that the model lacks may have pushed it there. Not seen: the "
        "interval is not shorter than 80 % of the range, so that the records do not tell.",
    )


def ranges_figure(fits: Mapping[str, Sequence[Fitted]]) -> Figure:
    """Places of numbers in their declared ranges: in the rig file, and after each of some fits, by label.

    The 95 % interval is that of the last fit.
    """
    *_, last = fits.values()
    places = np.arange(1.0, len(last) + 1)
    curves = [Curve("rig file", places, _shares(last, [entry.number.value for entry in last]), "markers", GIVEN)]
    for (label, numbers), colour in zip(fits.items(), (BEFORE, AFTER)[-len(fits) :], strict=True):
        curves.append(Curve(label, places, _shares(numbers, [entry.value for entry in numbers]), "markers", colour))
    ends = np.column_stack([_shares(last, [getattr(entry, end) for entry in last]) for end in ("low", "high")])
    across = np.column_stack((places, places, np.full(len(last), np.nan))).ravel()
    up = np.column_stack((ends, np.full(len(last), np.nan))).ravel()
    curves.append(Curve("95 % interval", across, up, color=AFTER))
    marks = (Mark(0.0, "low end"), Mark(1.0, "high end"))
    panel = Panel("place in the declared range [1]", curves, y_range=(-0.08, 1.08), marks=marks)
    return Figure(
        "The rig's numbers in their declared ranges", "number", [panel], x_names=[entry.number.name for entry in last]
    )


def _shares(numbers: Sequence[Fitted], values: Sequence[float]) -> np.ndarray:
    """Values as parts of the declared ranges."""
    ends = np.array([(entry.number.low, entry.number.high) for entry in numbers], dtype=float)
    return (np.array(values) - ends[:, 0]) / (ends[:, 1] - ends[:, 0])


def _strongest(correlation: Mapping[str, Any]) -> list[tuple[str, str, float]]:
    """Pairs of numbers, most correlated first."""
    names, matrix = correlation["names"], np.asarray(correlation["matrix"])
    pairs = [(names[j], names[i], float(matrix[i, j])) for i in range(len(names)) for j in range(i)]
    return sorted(pairs, key=lambda pair: -abs(pair[2]))


def groups(correlation: Mapping[str, Any]) -> list[list[str]]:
    """Names of numbers of which the records know a combination only, each group linked by correlations above STRONG."""
    return linked(correlation["names"], np.abs(np.asarray(correlation["matrix"])) > STRONG)


def _pairs(correlation: Mapping[str, Any]) -> Table:
    rows = [[first, second, round(value, 3)] for first, second, value in _strongest(correlation)[:_MOST]]
    note = "Near 1 or -1 the records only know a combination of the two."
    return Table("Strongest correlations", ["number", "with", "correlation"], rows, note=note)


def _matrix(correlation: Mapping[str, Any]) -> Table:
    names, matrix = correlation["names"], np.asarray(correlation["matrix"])
    rows = [[name, *row] for name, row in zip(names, np.round(matrix, 2).tolist(), strict=True)]
    return Table("All correlations", ["", *names], rows)


def beside_noise(chi2: float, missing: bool, quiet: bool) -> str:
    """What chi2 says of the model: more than the noise is `missing`; `quiet`: the errors are as far below it."""
    if missing:
        return ": the model misses something, and jackbench trace asks what."
    if quiet:
        return ": the noise floor is too high for these records, and may hide a misfit."
    return ", as it should be."


def _verdict(problem: EstimationProblem, numbers: Sequence[Fitted], metrics: Mapping[str, Any]) -> str:
    chi2 = metrics["chi2"]["heldout"]
    count = len(metrics["parameters"])
    said = f"{counted(count, 'number')} of {problem.rig.name} {'is' if count == 1 else 'are'} fitted; "
    if chi2 is None:
        return f"{said}the held-out records cannot be simulated whole with them."
    said += f"the held-out error is {np.sqrt(chi2):.3f} times the noise (chi2 {chi2:.4g})"
    missing = problem.misses(chi2, problem.heldout.samples)
    said += beside_noise(chi2, missing, problem.misses(2 - chi2, problem.heldout.samples))
    if pole := metrics.get("growing_pole"):
        said += (
            f" The loop that was found is unstable at rest (it grows by {pole[0]:.3g} 1/s at {pole[1]:.3g} Hz), and "
            "one that came to rest is not: give more --starts, or narrower bounds."
        )
    if pushed := [entry.number.name for entry in numbers if entry.pushed]:
        said += f" At an end of its range: {', '.join(pushed)}."
        said += " Something that the model lacks may have pushed it there." if missing else ""
    if pushed or missing:
        said += pinned_sentence(problem.rig)
    said += shares_sentence(metrics["shares"]) if "shares" in metrics else ""
    said += remains_sentence(metrics["remains"]) if "remains" in metrics else ""
    said += (
        tells_sentence(metrics["tells"], problem.rig.inner.controls) if "tells" in metrics and problem.rig.inner else ""
    )
    said += ladder_sentence(metrics["ladder"]) if "ladder" in metrics else ""
    if metrics["unseen"]:
        said += f" Not seen by these records: {', '.join(metrics['unseen'])}."
    together = [" with ".join((", ".join(names[:-1]), names[-1])) for names in groups(metrics["correlations"])]
    return said + (f" Known only together: {'; '.join(together)}." if together else "")
