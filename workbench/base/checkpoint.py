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


def no_checkpoint(name: str, compute: Callable[[], T]) -> T:
    """A stage that stores nothing."""
    return compute()


Progress = Callable[[str], None]
