"""The keys of an experiment that say on what its loops have to hold: [within], positions, [goals]."""

from dataclasses import fields

from ...base.table import ConfigTable
from ...loop.scenarios import POSITIONS, Limits
from ...rigs.rig import Rig
from .declared import ExperimentFile

MOST_PLANTS = 1_000_000  # that are drawn
MOST_MOVES = 20
WITHIN = {"within": "least and largest factor on numbers of the rig; all others that it gives bounds within these"}


def read_factors(top: ConfigTable, rig: Rig) -> dict[str, tuple[float, float]]:
    """[within]: the least and the largest factor on numbers of the rig, by name; none without the table.

    Raises InputError with file, line and key.
    """
    within = top.optional_table("within")
    factors = {}
    for name in within:
        if name not in rig.numbers:
            raise within.complaint(name, f"the rig {rig.name} has no such number; see jackbench show {rig.name}")
        factors[name] = read_ends(within, name, "[0.5, 1.5]")
    return factors


def read_ends(table: ConfigTable, key: str, example: str = "[0.75, 1.25]") -> tuple[float, float]:
    """The least and the largest factor. Raises InputError with file, line and key."""
    low, *high = table.numbers(key, example)
    if len(high) != 1 or not 0 < low <= high[0]:
        raise table.complaint(key, f"write the least and the largest factor, such as {example}")
    return low, high[0]


def draws_nothing(at: ExperimentFile, *keys: str) -> bool:
    """Whether a file draws no plants, for it does not say how many. Raises InputError where it or an option says
    something of them all the same."""
    if "plants" in at.top:
        return False
    for key in keys:
        if key in at.top:
            raise at.top.complaint(key, "of drawn plants; say how many under `plants`")
    if at.asked.get("plants"):
        raise at.top.complaint("plants", "missing: the experiment draws none, and --plants cannot say how; add it")
    return True


def read_positions(top: ConfigTable) -> tuple[float, ...]:
    """positions: shares of the stroke limit at which loops are judged; five over the stroke where none are given."""
    if "positions" not in top:
        return POSITIONS
    positions = top.numbers("positions", "[-0.9, 0, 0.9]")
    if max(map(abs, positions)) > 1 or len(set(positions)) < len(positions):
        raise top.complaint("positions", "different shares of the stroke limit, each from -1 to 1")
    return positions


def read_limits(top: ConfigTable) -> Limits:
    """[goals]: the limits of the hard goals that are not as usual."""
    table = top.optional_table("goals")
    table.allow(*(entry.name for entry in fields(Limits)))
    moves = table.count("moves", 0, MOST_MOVES) if "moves" in table else 0
    return Limits(**{name: table.positive(name) for name in table if name != "moves"}, moves=moves)
