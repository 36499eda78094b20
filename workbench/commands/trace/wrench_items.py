"""What the report of a platform's trace says of its joints and payload."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...base.words import listed
from ...identify.found.wrench import WrenchAnswer
from ...identify.wrench.lines import BAND
from ...identify.wrench.search import WrenchTrace
from ...report import Curve, Figure, Mark, Panel, Table, within
from ..common.error_page import AFTER, BEFORE

_NOTE = (
    "The wrench that all legs give the payload, less what its motion asks for, line by line up to "
    f"{BAND:g} Hz over the noise of the record at rest. Explained: the share of the held-out misfit that a candidate "
    "alone takes away, once the payload's numbers are fitted with it."
)
_NO_RECORD = (
    "Joints are not judged: that takes a record at rest, which tells the noise, and a held-out one. Add both to "
    "campaign.toml."
)
_NO_CELLS = (
    "Joints are not judged: without load cells the forces are those of the pressures, and dry friction of a jack would "
    "look like friction of its joints."
)


def pointed_at(told: Mapping[str, Any]) -> list[int]:
    """The legs, counted from 0, whose joints are named."""
    return [int(name[3]) - 1 for name in told["effects"] if name.startswith("leg")]


def wrench_sentence(told: Mapping[str, Any]) -> str:
    """What joints and payload lack, in a sentence; nothing where they lack nothing."""
    before, after = told["chi2"]["before"], told["chi2"]["after"]
    if told["verdict"] == "none":
        return ""
    if told["verdict"] is None:
        return "Joints are not judged."
    if told["verdict"] == "unknown":
        return (
            f"Legs and payload do not balance (chi2 {before:.3g}), and no joint's friction, play or place, nor a "
            "payload that gives way, explains most of it."
        )
    names = listed(told["effects"], "or" if told["verdict"] == "tied" else "and")
    end = " Something else is missing besides." if told["verdict"] == "incomplete" else ""
    return f"Joints and payload: {names} (chi2 {before:.3g} to {after:.3g}).{end}"


def wrench_items(wrench: WrenchAnswer) -> list[Any]:
    """A figure by frequency and a table of candidates; one line where nothing could be judged."""
    if wrench.trace is None:
        return [_NO_RECORD if wrench.cells else _NO_CELLS]
    items: list[Any] = [_figure(wrench.trace)]
    if wrench.told["ranking"]:
        items.append(_candidates(wrench))
    if wrench.trace.not_shown:
        items.append(
            f"Not shown by these records, in which these legs push all the time: {listed(wrench.trace.not_shown)}."
        )
    return items


def _figure(trace: WrenchTrace) -> Figure:
    (f, before), (_, after) = trace.before.spectrum(), trace.after.spectrum()
    curves = [Curve("payload fitted", f, _smooth(before), "line", BEFORE)]
    if trace.after is not trace.before:
        curves.append(Curve("with what was named", f, _smooth(after), "line", AFTER))
    panel = Panel("held-out chi2 [1]", curves, log_y=True, marks=(Mark(1.0, "noise"),))
    return Figure("The balance of the wrench by frequency", "frequency [Hz]", [panel])


def _smooth(power: np.ndarray) -> np.ndarray:
    """Over five lines."""
    return np.convolve(np.pad(power, 2, mode="edge"), np.full(5, 0.2), "valid")


def _candidates(wrench: WrenchAnswer) -> Table:
    rows = []
    for row in wrench.told["ranking"]:
        for label, (value, low, high) in row["parameters"].items():
            cells = [value, None, None] if low is None else list(within(value, low, high))
            rows.append([row["effect"], row["formula"], row["explained"], label, *cells])
    return Table(
        "What joints and payload may show",
        ["effect", "formula", "explained", "number", "value", "95 % low", "95 % high"],
        rows,
        _NOTE,
    )
