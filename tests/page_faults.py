"""In tests a report that cannot be drawn is an error; `TOLD` is the sentence that users get instead."""

from collections.abc import Sequence

from workbench.commands.common import drawing

TOLD = drawing.fault_words


def raised(error: Exception, _: Sequence[str]) -> str:
    """The error itself."""
    raise error
