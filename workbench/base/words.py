"""Counts, lists and ranges as a sentence has them."""

from collections.abc import Iterable, Sequence


def counted(count: int, one: str) -> str:
    """So many of what `one` is called: 1 rig, 3 rigs."""
    return f"{count} {one}" if count == 1 else f"{count} {one}s"


def agreed(verb: str, count: int) -> str:
    """What so many do: one needs, three need."""
    return f"{verb}s" if count == 1 else verb


def spanned(values: Iterable[float]) -> str:
    """From the least to the largest to three digits, 10.2 to 10.5; one number where both are the same to a reader."""
    least_first = sorted(values)
    return " to ".join(dict.fromkeys(f"{value:.3g}" for value in (least_first[0], least_first[-1])))


def listed(names: Sequence[str], last: str = "and") -> str:
    """ "a, b and c"."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} {last} {names[-1]}"
