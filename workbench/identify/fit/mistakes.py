"""Mistakes that a column may be: what happened, in words; how to undo it in a record; what to write to mend it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...base.words import agreed, listed
from ...records import Record


@dataclass(frozen=True)
class Mistake:
    """What may have happened, in words; how to undo it in a record; what to write to mend it.

    kind: "turned", "swapped", "scaled", "shifted" or "foreign", what the rig cannot have, of `signals`; or "doubtful":
    several, none of which cures it. `late` [s]: of those signals that are shifted, and what is wrong `beside` that.
    chi2 of the rig, fitted to a few windows, before and after it is undone, where that tells.
    """

    kind: str
    signals: tuple[str, ...]
    words: str
    undone: Callable[[Record], Record]
    remedy: str
    late: Mapping[str, float] = field(default_factory=dict)
    beside: "Mistake | None" = None
    chi2: tuple[float, float] | None = None

    def told(self, rig: str) -> str:
        """What may have happened to the records of a rig, and what says so."""
        if self.chi2 is None:
            return self.words
        before, after = (f"{chi2:.3g}" for chi2 in self.chi2)
        without = "at best" if self.kind == "doubtful" else "without that"
        return f"{self.words}: chi2 of {rig}, fitted to a few windows, is {before} as they are and {after} {without}"


def scaled(name: str, factor: float) -> Mistake:
    how = f"{factor:.3g} times too large" if factor > 1 else f"{1 / factor:.3g} times too small"
    return Mistake(
        "scaled",
        (name,),
        f"{name} looks {how}",
        lambda r: _changed(r, lambda s: {name: s[name] / factor} if name in s else {}),
        f"give its unit or scale under [signals.{name}]",
    )


def swapped(*turned: str) -> Mistake:
    """Pressures that changed places, and signals whose sign is wrong beside that."""
    signs = f", and the sign of {' and '.join(turned)} wrong" if turned else ""
    remedy = f", and turn the other by scale = -1 under [signals.{turned[0]}]" if turned else ""
    return Mistake(
        "swapped",
        ("pa", "pb", *turned),
        f"pa and pb look swapped{signs}",
        lambda r: _changed(
            r, lambda s: {"pa": s["pb"], "pb": s["pa"]} | {name: -s[name] for name in turned if name in s}
        ),
        f"exchange the two columns under [signals]{remedy}",
    )


def turned(*names: str) -> Mistake:
    return Mistake(
        "turned",
        names,
        f"the sign of {' and '.join(names)} looks wrong",
        lambda r: _changed(r, lambda s: {name: -s[name] for name in names if name in s}),
        f"turn it by scale = -1 under [signals.{names[0]}]",
    )


def shifted(late: Mapping[str, float], beside: Mistake | None = None) -> Mistake:
    """Signals that are late, each by its own [s], and what is wrong beside that."""
    groups = {one: [name for name in late if late[name] == one] for one in dict.fromkeys(late.values())}
    told = [
        f"{listed(names)} {agreed('look', len(names))} {abs(1e3 * one):.2g} ms {'late' if one > 0 else 'early'}"
        for one, names in groups.items()
    ]
    words = f"{listed(told)}, as from a second logger or behind a filter of its own"
    remedy = f"shift {'them' if len(late) > 1 else 'it'} by as much against the command, or record all by one logger"
    if beside is None:
        return Mistake("shifted", tuple(late), words, lambda r: r.earlier(late), remedy, late)
    signals = tuple(dict.fromkeys((*late, *beside.signals)))
    words, remedy = f"{words}, and {beside.words}", f"{remedy}; {beside.remedy}"
    return Mistake("shifted", signals, words, lambda r: beside.undone(r.earlier(late)), remedy, late, beside)


def doubtful(mistakes: Sequence[Mistake], chi2: tuple[float, float]) -> Mistake:
    """Mistakes of which none cures what is wrong."""
    words = list(dict.fromkeys(each.words for each in mistakes))
    none = "one of these, none of which cures it" if len(words) > 1 else "which does not cure it"
    signals = tuple(dict.fromkeys(name for each in mistakes for name in each.signals))
    remedy = "check the sign, the unit, the place and the clock of every column, then the rig file"
    return Mistake("doubtful", signals, f"{'; or '.join(words)}: {none}", lambda r: r, remedy, chi2=chi2)


def _changed(record: Record, change: Callable[[Mapping[str, np.ndarray]], Mapping[str, np.ndarray]]) -> Record:
    """The record with some of its signals changed, where it carries them."""
    try:
        return replace(record, signals={**record.signals, **change(record.signals)})
    except KeyError:
        return record
