"""Effects that are not to be tried: a name that there is not is refused before a solver is loaded."""

from collections.abc import Sequence
from pathlib import Path

from ...base.errors import check_known
from ...rigs.rig_file import effect_files
from .effect_words import ALL_EFFECTS


def check_library(without: Sequence[str], rig: str | Path, files: Sequence[Path]) -> None:
    """Raises InputError for a name that the library has not, where all effects are its own.

    What `files` or those of the rig define is known when they have run.
    """
    if without and not files and not effect_files(rig):
        check_known("--without", without, ALL_EFFECTS, "effect")
