"""What the page of a trace says of the effects that the records of a closed loop show, hide, or leave alike."""

from ...base.words import counted, listed
from ...identify.trace.findings import Trace
from ...identify.trace.rule import ALIKE
from ...report import Section, Table

_SAID = (
    "Computed about the fitted rig before any effect was tried. Shown: at its typical strength an effect leaves a "
    "misfit that no number of the rig hides. Looks like: linked by cosines of {:g} or more, so that one may be named "
    "for the other."
)


def told_sentence(trace: Trace) -> str:
    """What the loop hides, and what looks like what was named; nothing without a loop that somebody else closed."""
    if trace.told is None:
        return ""
    said = f" Of {counted(len(trace.told.shown + trace.told.hidden), 'effect')} these records of a closed loop could "
    said += f"show {len(trace.told.shown)} at their typical strength."
    named = {fit.candidate.effect.name for fit in trace.effects}
    for group in trace.told.alike:
        if own := [name for name in group if name in named]:
            others = [name for name in group if name not in named]
            said += f" They do not tell {listed(own)} from {listed(others, 'or')}." if others else ""
    return said


def told_section(trace: Trace) -> list[Section]:
    """Every effect, whether it shows, and what it looks like."""
    if trace.told is None:
        return []
    alike = {name: [other for other in group if other != name] for group in trace.told.alike for name in group}
    rows = [
        [name, name in trace.told.shown, ", ".join(alike.get(name, ()))]
        for name in sorted(trace.told.shown + trace.told.hidden)
    ]
    table = Table("Effects in a closed loop", ["effect", "shown", "looks like"], rows, note=_SAID.format(ALIKE))
    return [Section("What the loop lets through", [table])]
