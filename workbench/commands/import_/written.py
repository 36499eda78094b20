"""campaign.toml of imported recordings, with a line for every column that is left out."""

from collections.abc import Mapping, Sequence
from typing import Any

from ...base.signals import SIGNALS
from ...base.toml_text import toml_value
from ...identify.columns.guess import GUESSED, ColumnGuess
from ...identify.columns.roles import Roles

CLOCKLESS = '# t = {period = "1 ms"}  # no column is a clock: give the time from row to row'


def signal_entries(guesses: Sequence[ColumnGuess]) -> dict[str, dict[str, Any]]:
    """[signals] by name: value = scale * column + offset, in the unit `to`."""
    entries = {}
    for guess in guesses:
        if guess.signal is not None and guess.conversion is not None:
            how = guess.conversion
            entries[guess.signal] = {
                "column": guess.column.cell, "unit": how.unit, "scale": how.scale, "to": how.to, "offset": how.offset,
            }  # fmt: skip
    return {name: entries[name] for name in GUESSED if name in entries}


def campaign_text(rig: str, roles: Roles, guesses: Sequence[ColumnGuess], period: float | None) -> str:
    """campaign.toml, a line a signal with its reason, and as comments the lines that would add what is left out."""
    lines = [
        "# made by `jackbench import`; check every line that is not called clear",
        _pair("rig", rig),
        "",
        f"# {roles.reason}",
        "[records]",
        *(_pair(role, list(entries)) for role, entries in roles.entries.items() if entries),
        "",
        "[signals]",
    ]
    by_signal = {guess.signal: guess for guess in guesses if guess.signal is not None}
    for name, entry in signal_entries(guesses).items():
        guess = by_signal[name]
        between = {"between": guess.column.between} if guess.column.between else {}
        lines.append(f"{_pair(name, _short(entry) | between)}  # {guess.confidence}: {guess.reason}")
    if "t" not in by_signal:
        lines.append(CLOCKLESS if period is None else f't = {{period = "{period:.9g} s"}}  # said above the table')
    left = [guess for guess in guesses if guess.signal is None]
    lines += ["", "# left out:"] if left else []
    lines += [f"# {line_to_add(guess)}  # {guess.reason}" for guess in left]
    return "\n".join(lines) + "\n"


def line_to_add(guess: ColumnGuess) -> str:
    """The line of [signals] that would add a column that is left out."""
    signal, unit = guess.suggested or "SIGNAL", guess.column.unit
    entry: dict[str, Any] = {"column": guess.column.cell}
    if guess.suggested == "t":
        return _pair(signal, entry | {"unit": unit or "s"})
    if guess.suggested:
        return _pair(signal, entry | {"scale": 1.0, "to": SIGNALS[signal].unit, "offset": 0.0})
    return _pair(signal, entry | ({"unit": unit} if unit else {"scale": 1.0}))


def _short(entry: Mapping[str, Any]) -> dict[str, Any]:
    """An entry without what goes without saying."""
    plain = entry["scale"] == 1.0 and entry["offset"] == 0.0 and entry["to"] == entry["unit"]
    kept = ("column", "unit") if plain else ("column", "unit", "scale", "to", "offset")
    return {key: entry[key] for key in kept if entry[key] is not None}


def _pair(key: str, value: Any) -> str:
    """A key and its value on one line of TOML."""
    return f"{key} = {toml_value(value)}"
