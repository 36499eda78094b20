"""The numbers of sessions as a report shows them."""

from collections.abc import Sequence

from ...base.units import from_si
from ...identify.found.session_fit import SessionFit
from ...identify.trace.problem import EstimationProblem
from ...report import Table


def session_fits_table(problem: EstimationProblem, fits: Sequence[SessionFit]) -> Table:
    """Each beside the rig's own number."""
    head = ["session", "number", "unit", "rig's own", "in the session", "95 % low", "95 % high", "factor"]
    every = "; ".join(
        f"{session.name}: {', '.join(session.records)}{_warm(session.temperature)}"
        for session in problem.campaign.sessions
    )
    note = f"The interval is that of the difference: the rig's own number is taken as fitted. Sessions: {every}."
    return Table("Numbers of sessions", head, [each.row() for each in fits], note=note)


def session_fits_sentence(fits: Sequence[SessionFit]) -> str:
    """One sentence on all of them; nothing without any."""
    by_session: dict[str, list[str]] = {}
    for each in fits:
        kind = "Drift" if each.own.per else "In session"
        by_session.setdefault(f"{kind} {each.own.session}", []).append(str(each))
    return "".join(f" {where}: {', '.join(said)}." for where, said in by_session.items())


def _warm(temperature: float | None) -> str:
    return "" if temperature is None else f" ({float(from_si(temperature, 'degC', 'K')):.3g} degC)"
