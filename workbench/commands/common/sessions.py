"""Groups of records between which a number of the rig differs, as the reports of fit and trace tell them."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from ...identify.fit.sessions import SessionDifference, groups, session_differences
from ...identify.fit.solver import Fit
from ...identify.trace.problem import EstimationProblem
from ...report import Table

_LISTED = 4  # records of a group that are named


def sessions(problem: EstimationProblem, fit: Fit) -> list[SessionDifference]:
    """What groups of the train records differ by, most first, about a fit of all of them."""
    return session_differences(fit, problem.train, groups(problem.train.records), problem.kappa)


def sessions_json(differences: Sequence[SessionDifference]) -> list[dict[str, Any]]:
    """As metrics.json has them."""
    return [asdict(each) | {"records": list(each.records)} for each in differences]


def sessions_sentence(differences: Sequence[SessionDifference]) -> str:
    """One sentence on the clearest; nothing without any."""
    if not differences:
        return ""
    first = differences[0]
    by = f"{abs(first.percent):.2g} % {'larger' if first.percent > 0 else 'smaller'}"
    return f" The records {first.group} are of another state of the rig: there {first.number} is {by}."


def sessions_table(differences: Sequence[SessionDifference]) -> Table:
    """Every group with what it differs by."""
    rows = [
        [each.group, each.number, round(each.percent, 2), round(each.error, 2), _named(each.records)]
        for each in differences
    ]
    return Table(
        "Groups of records that differ",
        ["group", "number", "larger by [%]", "95 % +- [%]", "records"],
        rows,
        note="One fit has them alike. If they are of different days or temperatures, fit each by itself "
        "(--heldout takes the others out), or record them in one session.",
    )


def _named(records: Sequence[str]) -> str:
    more = len(records) - _LISTED
    return ", ".join(records[:_LISTED]) + (f" and {more} more" if more > 0 else "")
