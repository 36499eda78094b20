"""What a long computation is given: stages that are computed once, and somebody to tell how far it is."""

from collections.abc import Callable
from typing import Protocol, TypeVar

T = TypeVar("T")


class Stage(Protocol):
    """Computes a named stage once; a resumed run gets the stored result."""

    def __call__(self, name: str, compute: Callable[[], T]) -> T: ...


def within(stage: Stage, part: str) -> Stage:
    """The stages of a `part` of a computation, which has others of the same names."""

    def staged(name: str, compute: Callable[[], T]) -> T:
        return stage(f"{part}-{name}", compute)

    return staged


class OutOfTime(Exception):
    """A computation may go on no longer; its stages that are done stay."""


def until(stage: Stage, over: Callable[[], bool]) -> Stage:
    """The stages of `stage` until time is `over`. Raises OutOfTime where one would begin after that."""

    def staged(name: str, compute: Callable[[], T]) -> T:
        if over():
            raise OutOfTime
        return stage(name, compute)

    return staged


def no_checkpoint(name: str, compute: Callable[[], T]) -> T:
    """A stage that stores nothing."""
    return compute()


def endless() -> bool:
    """Whether time is over, where it never is."""
    return False


Progress = Callable[[str], None]
