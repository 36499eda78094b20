"""What each recorded signal tells of the numbers that a fit moves, and what a channel that is missing would cost."""

from collections.abc import Mapping
from typing import Any

from ...base.words import listed
from ...identify.found.channels import longer_without
from ...identify.trace.problem import EstimationProblem
from ...identify.trace.refit import FittedModel
from ...report import Table

_LOOP = ("loop_gain", "loop_delay")
_OTHERS = 2  # numbers beside them, in the sentence


def signals_tell(problem: EstimationProblem, found: FittedModel) -> dict[str, Any]:
    """`tells`: how many times as long the interval of each number is `without` a signal, and with each `alone`; nothing
    where one signal is compared, or no number is fitted."""
    names = problem.train.names
    if len(names) < 2 or not found.fit.free:
        return {}
    others = [[other for other in names if other != name] for name in names]
    without, alone = (longer_without(problem, found, sets) for sets in ([[name] for name in names], others))
    return {
        "tells": {
            "numbers": [free.name for free in found.fit.free],
            "without": dict(zip(names, without.tolist(), strict=True)),
            "alone": dict(zip(names, alone.tolist(), strict=True)),
        }
    }


def tells_sentence(tells: Mapping[str, Any], controlled: str) -> str:
    """How much sharper what is recorded beside that which a loop controls makes the loop's numbers, and those of the
    others that gain most."""
    others = [name for name in tells["without"] if name != controlled]
    told = [name for name in _LOOP if name in tells["numbers"]]
    if controlled not in tells["alone"] or not others or not told:
        return ""
    longer = dict(zip(tells["numbers"], tells["alone"][controlled], strict=True))
    told += sorted((name for name in longer if name not in _LOOP), key=lambda name: -longer[name])[:_OTHERS]
    times = [f"{longer[name]:.2g}" for name in told]
    return f" With {controlled} alone the intervals of {listed(told)} would be {listed(times)} times as long."


def tells_table(tells: Mapping[str, Any]) -> Table:
    """A row a number, a column a signal."""
    rows = [
        [number, *(round(column[place], 2) for column in tells["without"].values())]
        for place, number in enumerate(tells["numbers"])
    ]
    note = "How many times as long the 95 % interval of a number would be without a signal; 1: the others tell as much."
    return Table("Interval without a signal, over that with all", ["number", *tells["without"]], rows, note=note)
