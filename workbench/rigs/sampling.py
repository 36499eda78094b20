"""What becomes of a reading and of a command at a sampling instant: of numbers, arrays and graphs by the same rule.

Who asks brings the functions of his kind: Python's `min` and `max`, numpy's `fmin`, `fmax`, `floor` and `where`, or
CasADi's `fmin`, `fmax`, `floor` and `if_else`.
"""

from collections.abc import Callable
from typing import Any


def in_steps(value: Any, coarse: Any, step: Any, floor: Callable[[Any], Any], where: Callable[..., Any]) -> Any:
    """A reading as the nearest of its sensor's steps where that is `coarse`; of two as near the upper one. All SI,
    `step` > 0."""
    return where(coarse, floor(value / step + 0.5) * step, value)


def command_change(
    demanded: Any, command: Any, low: Any, high: Any, step: Any, least: Callable[..., Any], most: Callable[..., Any]
) -> Any:
    """By how much a drive's `command` changes for the demanded one: limited in size, and in a period by a `step`."""
    return least(step, most(-step, least(high, most(low, demanded)) - command))


def arriving(before: Any, now: Any, part: Any, interpolated: bool) -> tuple[Any, Any]:
    """What a plant holds for the first `part` of a period, in which the command `now` arrives after the one `before`,
    and for the rest; their mean throughout where the drive is `interpolated`."""
    if not interpolated:
        return before, now
    mean = part * before + (1 - part) * now
    return mean, mean
