"""What a study leaves behind, and what it is given to work with."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeVar

import numpy as np

from ..report import Figure, Page

T = TypeVar("T")


@dataclass(frozen=True)
class Outcome:
    """`metrics` for metrics.json, `tables` for *.parquet (columns by name), the report and its telling figure.

    `files` are further text files, content by name.
    """

    metrics: Mapping[str, Any]
    page: Page
    picture: Figure
    tables: Mapping[str, Mapping[str, np.ndarray]] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)


class Stage(Protocol):
    """Computes a named stage once; a resumed run gets the stored result."""

    def __call__(self, name: str, compute: Callable[[], T]) -> T: ...


def at_once(name: str, compute: Callable[[], T]) -> T:
    """A stage that stores nothing."""
    return compute()


Progress = Callable[[str], None]
