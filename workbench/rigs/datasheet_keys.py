"""What a datasheet must state: the numbers by valve and jack, and which of them a file leaves out."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..base.errors import InputError
from ..base.table import ConfigTable
from ..base.units import Spec
from . import schema
from .jack import JACKS, JackKind
from .valve import VALVES, ValveKind

RESPONSE = {
    "amplitude": Spec("1", 1e-3, 1.0, "amplitude of the sine, over full input"),
    "reference": Spec("Hz", 1e-3, 1e4, "frequency that the gain is referred to"),
    "f3db": Spec("Hz", 1e-2, 1e4, "where the gain has fallen by 3 dB"),
    "f90": Spec("Hz", 1e-2, 1e4, "where the phase is -90 deg"),
}


@dataclass(frozen=True)
class DatasheetEntry:
    """A number that a datasheet states: its table, its stage where it is of a `[[valve.response]]`, key and range."""

    section: str
    key: str
    spec: Spec
    stage: str = ""

    def in_(self, top: Mapping[str, Any]) -> bool:
        """Whether a document has it."""
        part = top.get(self.section)
        if not self.stage or not isinstance(part, Mapping):
            return isinstance(part, Mapping) and self.key in part
        responses = part.get("response")
        entries = responses if isinstance(responses, list) else []
        own = [entry for entry in entries if isinstance(entry, Mapping) and entry.get("stage") == self.stage]
        return bool(own) and all(self.key in entry for entry in own)


def figures(valve: ValveKind | None, jack: JackKind | None) -> tuple[DatasheetEntry, ...]:
    """What the sheet of a jack with this valve must state, in the order in which an engineer reads a datasheet."""
    supply = ("Ps",) if valve is None or valve.needs_geometry else ("Ps", "Pr")
    return (
        *(DatasheetEntry("supply", key, schema.SUPPLY[key]) for key in supply),
        *(DatasheetEntry("valve", key, spec) for key, spec in (valve.figures.items() if valve else ())),
        *(
            DatasheetEntry("valve", key, spec, stage)
            for stage in (valve.stages if valve else ())
            for key, spec in RESPONSE.items()
        ),
        *(_of_jack(jack) if jack else ()),
        DatasheetEntry("load", "M", schema.LOAD["M"]),
    )


def _of_jack(jack: JackKind) -> list[DatasheetEntry]:
    return [DatasheetEntry("jack", key, jack.numbers[key]) for key in dict.fromkeys((*jack.areas, "S"))]


def check_complete(top: ConfigTable) -> None:
    """Raises InputError with the names of all numbers that the document leaves out."""
    kinds = {"valve": VALVES, "jack": JACKS}
    known = {section: _kind(top, section, names) for section, names in kinds.items()}
    missing = [f"{section}.kind ({' or '.join(kinds[section])})" for section, kind in known.items() if kind is None]
    absent = [figure for figure in figures(known["valve"], known["jack"]) if not figure.in_(top.values)]
    missing += [_named(figure) for figure in absent if not figure.stage]
    for stage in dict.fromkeys(figure.stage for figure in absent if figure.stage):
        keys = ", ".join(figure.key for figure in absent if figure.stage == stage)
        missing.append(f'{keys} of [[valve.response]] stage = "{stage}"')
    if known["valve"] is not None and known["valve"].needs_geometry and "like" not in top.values["valve"]:
        missing.append('valve.like (a rig with the printed numbers of such a valve: "jack-10t")')
    if missing:
        raise InputError(f"{top.place}: missing: {'; '.join(missing)}; `jackbench new DIR --ask KIND` asks for them")


def _kind(top: ConfigTable, section: str, kinds: Mapping[str, Any]) -> Any:
    """The kind that a section says, None where it says none. Raises InputError for one that is unknown."""
    part = top.optional_table(section)
    return kinds[part.word("kind", kinds)] if "kind" in part else None


def _named(figure: DatasheetEntry) -> str:
    return f"{figure.section}.{figure.key} ({figure.spec.meaning}, in {figure.spec.unit})"
