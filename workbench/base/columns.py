"""Named columns as people ask for them: by a name that may be mistyped, and as a pandas table."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from .errors import InputError, nearest

if TYPE_CHECKING:
    import pandas  # pyright: ignore[reportMissingImports]

T = TypeVar("T")


def lookup(values: Mapping[str, T], name: str, what: str) -> T:
    """The value of a name. Raises KeyError that says `what` has no such name, and the nearest that there is."""
    if name not in values:
        raise KeyError(f'no {what} "{name}"; {nearest(str(name), values)}')
    return values[name]


def data_frame(columns: Mapping[str, Any]) -> "pandas.DataFrame":
    """A pandas table of columns [n] by name. Raises InputError where pandas is not installed."""
    try:
        import pandas  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise InputError("pandas is not installed; pip install pandas") from None
    return pandas.DataFrame(dict(columns))
