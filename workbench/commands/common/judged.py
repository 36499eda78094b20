"""Under which conditions loops were judged, and where the oil cavitates, in words."""

from collections.abc import Iterable, Mapping
from typing import Any

from ...base.words import counted
from ...loop.rig_variations import Conditions
from ...rigs.rig import Rig


def played_words(conditions: Conditions, rig: Rig) -> str:
    """A sentence for the note of a table, on what was simulated."""
    return f"{_conditions(conditions, rig)}."


def judged_words(conditions: Conditions, rig: Rig) -> str:
    """That sentence where hunting was judged too."""
    return _conditions(conditions, rig) + ("." if conditions.ideal else "; lasting oscillations without noise.")


def _conditions(conditions: Conditions, rig: Rig) -> str:
    if conditions.ideal:
        return "Without computing delay, sensor noise and resolution"
    delay = rig.computing_delay.value * 1e3
    return (
        f"With a computing delay of {delay:g} ms, or the controller's own, and the sensors' noise (seed "
        f"{conditions.seed}) and resolution"
    )


def gas_words(rows: Iterable[Mapping[str, Any]]) -> str:
    """In which rows gas comes out of the oil in a chamber, the longest first, after a space; or empty."""
    those = sorted((row for row in rows if row["cavitation_s"]), key=lambda row: row["cavitation_s"], reverse=True)
    if not those:
        return ""
    longest, others = those[0], len(those) - 1
    names = [f" {word} {longest[key]}" for word, key in (("with", "controller"), ("on", "rig")) if key in longest]
    more = f", and for less long in {counted(others, 'other run')}" if others else ""
    return (
        f" Gas comes out of the oil in a chamber: {_played(longest)}{''.join(names)}, {gas_span(longest)}{more}. "
        "The chamber carries next to nothing then, and what fills again may knock."
    )


def gas_span(row: Mapping[str, Any]) -> str:
    """For how long gas is out of the oil, and down to which pressure."""
    return f"for {1e3 * row['cavitation_s']:.3g} ms and down to {row['lowest_pressure_bar']:.2g} bar absolute"


def _played(row: Mapping[str, Any]) -> str:
    """What was played: a scenario, a sine, an iteration or a record."""
    if "frequency" in row:
        return f"a sine of {row['frequency']:g} Hz"
    return row.get("scenario") or (f"iteration {row['iteration']}" if "iteration" in row else "the record")
