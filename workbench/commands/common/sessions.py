"""Groups of records between which a number of the rig differs, as the reports of fit and trace tell them."""

import re
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from ...identify.fit.sessions import LATER, SessionDifference, groups, session_differences
from ...identify.fit.solver import Fit
from ...identify.trace.problem import EstimationProblem
from ...records import Campaign
from ...records.campaign import FILE
from ...records.sessions import REPEAT, DeclaredSession
from ...report import Section, Table

_LISTED = 4  # records of a group that are named


def sessions(problem: EstimationProblem, fit: Fit) -> list[SessionDifference]:
    """What groups of the train records differ by, most first, about a fit of all of them: declared sessions, and
    groups that may be some."""
    names = [record.name for record in problem.train.records]
    declared = {
        f"of session {session.name}": tuple(k for k, name in enumerate(names) if name in session.records)
        for session in problem.campaign.sessions
    }
    known = [set(places) for places in declared.values()]
    known += [set(range(len(names))) - places for places in known]
    others = {name: own for name, own in groups(problem.train.records).items() if set(own) not in known}
    return session_differences(fit, problem.train, declared | others, problem.kappa)


def sessions_json(differences: Sequence[SessionDifference]) -> list[dict[str, Any]]:
    """The differences of sessions as metrics.json has them."""
    return [asdict(each) | {"records": list(each.records)} for each in differences]


def sessions_sentence(problem: EstimationProblem, differences: Sequence[SessionDifference]) -> str:
    """One sentence on the clearest, with what to write where; nothing without any."""
    if not differences:
        return ""
    first = differences[0]
    by = f"{abs(first.percent):.2g} % {'larger' if first.percent > 0 else 'smaller'}"
    said = f" The records {first.group} were recorded with the rig in another state: there {first.number} is {by}."
    lines = session_lines(problem, first)
    return said + (f" To fit it apart, have in {FILE}: {' '.join(lines)}." if lines else "")


def sessions_section(problem: EstimationProblem, differences: Sequence[SessionDifference]) -> list[Section]:
    """Every group with what it differs by, and the lines that declare the clearest a session; none without any."""
    if not differences:
        return []
    rows = [
        [each.group, each.number, round(each.percent, 2), round(each.error, 2), _named(each.records)]
        for each in differences
    ]
    lines = session_lines(problem, differences[0])
    table = Table(
        "Groups of records that differ",
        ["group", "number", "larger by [%]", "95 % +- [%]", "records"],
        rows,
        note="One fit has them alike. If they were recorded on different days or at different temperatures, "
        f"declare them a session: {' '.join(lines) or f'[sessions.NAME] in {FILE}'}",
    )
    return [Section("Sessions", [table])]


def session_lines(problem: EstimationProblem, difference: SessionDifference) -> list[str]:
    """The lines of campaign.toml that give the group the number to itself; none for a number that is no rig's own."""
    if difference.number not in problem.rig.numbers:
        return []
    if difference.group == LATER:
        return ["[drifts.repeats]", 'records = ["*"]', f'numbers = ["{difference.number}"]', f'per = "{REPEAT}"']
    own = _declared(problem.campaign, difference)
    if own is not None:
        numbers = ", ".join(f'"{name}"' for name in (*own.numbers, difference.number))
        return [f"[sessions.{own.name}]", f"numbers = [{numbers}]"]
    name = re.sub(r"\W+", "_", difference.group.removeprefix("with "))
    return [f"[sessions.{name}]", f"records = {_pattern(problem, difference)}", f'numbers = ["{difference.number}"]']


def _declared(campaign: Campaign, difference: SessionDifference) -> DeclaredSession | None:
    return next((s for s in campaign.sessions if difference.group == f"of session {s.name}"), None)


def _pattern(problem: EstimationProblem, difference: SessionDifference) -> str:
    """The records of the group in every role: by what their names begin with, where no other's do, else listed."""
    campaign = problem.campaign
    moving = [*campaign.train, *campaign.select, *campaign.heldout]
    every = groups(moving).get(difference.group)  # none where other roles' records carry other signals
    names = list(difference.records) if every is None else [moving[k].name for k in every]
    begins = (names[0][:end] for end in range(len(names[0]), 0, -1))
    begin = next((part for part in begins if all(name.startswith(part) for name in names)), "")
    others = [record.name for record in moving if record.name not in names]
    if len(names) > 1 and begin and not any(name.startswith(begin) for name in others):
        return f'["{begin}*"]'
    return "[" + ", ".join(f'"{name}"' for name in names) + "]"


def _named(records: Sequence[str]) -> str:
    more = len(records) - _LISTED
    return ", ".join(records[:_LISTED]) + (f" and {more} more" if more > 0 else "")
