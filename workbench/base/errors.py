"""The exception for bad input, a line that says where it is, what is wrong and what to do; what else can be lost."""

from collections.abc import Collection, Iterable
from difflib import get_close_matches


class InputError(ValueError):
    """Input that a person can mend. The command line prints it as one line and exits with status 2."""


class ClusterError(Exception):
    """Workers of other machines that cannot go on: what is done is kept. Printed as one line, status 2."""


class LinkLost(Exception):
    """A rig that no longer answers: what is done is kept. Printed as one line, status 2."""


def nearest(name: str, known: Iterable[str]) -> str:
    """A hint for an unknown name: the nearest known one, or the whole list when nothing is near."""
    names = sorted(known)
    close = get_close_matches(name, names, n=1, cutoff=0.5)
    if close:
        return f'did you mean "{close[0]}"?'
    return "known: " + ", ".join(names)


def check_known(option: str, names: Iterable[str], known: Collection[str], what: str) -> None:
    """Raises InputError for a name, given to an `option`, of a thing (`what`) that there is not."""
    for name in names:
        if name not in known:
            raise InputError(f'{option} {name}: no {what} "{name}"; {nearest(name, known)}')


def echo(value: object) -> str:
    """What was read, on one line of at most 80 characters."""
    try:
        text = f'"{value}"' if isinstance(value, str) and value.isprintable() else repr(value)
    except ValueError:  # a whole number of more digits than Python prints
        return "a number of too many digits"
    return clipped(text)


def clipped(text: str, most: int = 80) -> str:
    """At most so many characters of a text."""
    return text if len(text) <= most else f"{text[: most - 3]}..."


def short_path(path: object, most: int = 80) -> str:
    """A path, no name in it longer than 80 characters or `most`, and 400 in all."""
    return clipped("/".join(clipped(name, most) for name in str(path).split("/")), 400)
