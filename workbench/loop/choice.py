"""Which controller to take of those that were judged over the envelope, in a sentence."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .envelope_row import EnvelopeRow

Goal = Mapping[str, Any]  # of a row


def choice(rows: Sequence[EnvelopeRow], step: str) -> str:
    """Which controller to take and where it is weakest; where none meets every goal, which comes nearest. In the words
    of the `step` that was judged."""
    able = [row for row in rows if row["met"] and row["settling_worst_s"] is not None]
    if not able:
        nearest = min(rows, key=shortfall)
        return (
            f"No controller meets every goal and settles over stroke and rigs; nearest comes {nearest['controller']}: "
            f"it {_settles(step, nearest)}, and {_first_miss(nearest)}."
        )
    best = min(able, key=lambda row: row["settling_worst_s"])
    return (
        f"Take {best['controller']}: it meets every goal over stroke and rigs and {_settles(step, best)}; it is "
        f"weakest in {_weakest(best)}{_sooner(rows, best)}."
    )


def shortfall(row: EnvelopeRow) -> tuple[bool, int, float, float]:
    """How far a row falls short: never settles, goals missed, by how much in all, worst settling [s]."""
    misses = [goal["miss"] for goal in row["goals"] if goal["miss"] != 0]
    settling = row["settling_worst_s"]
    return settling is None, len(misses), sum(miss for miss in misses if miss is not None), settling or np.inf


def _settles(step: str, row: EnvelopeRow) -> str:
    worst = row["settling_worst_s"]
    if worst is None:
        return f"does not settle {step} on {row['where']}"
    return f"settles {step} within {worst:.3g} s at worst, on {row['where']}"


def _weakest(row: EnvelopeRow) -> str:
    """The goal with the least left to its limit."""

    def share(goal: Goal) -> float:
        ratio = goal["value"] / goal["limit"]
        return 1 / ratio if goal["name"].startswith("gain margin") else ratio

    goal = max((goal for goal in row["goals"] if goal["limit"] and goal["value"]), key=share)
    return f"{goal['name']}, {goal['value']:.3g} with a limit of {goal['limit']:g}, on {goal['where']}"


def _sooner(rows: Sequence[EnvelopeRow], best: EnvelopeRow) -> str:
    """Of the controllers that settle sooner, the one that falls short least."""
    sooner = [row for row in rows if (row["settling_worst_s"] or np.inf) < best["settling_worst_s"]]
    if not sooner:
        return ""
    row = min(sooner, key=shortfall)
    return f"; {row['controller']} settles sooner, within {row['settling_worst_s']:.3g} s, but {_first_miss(row)}"


def _first_miss(row: EnvelopeRow) -> str:
    """In the sentence: the first goal that is missed and its worst plant, and how many more there are."""
    missed = [goal for goal in row["goals"] if goal["miss"]]
    if not missed:
        return "misses no goal"
    more = f" and {len(missed) - 1} more" if missed[1:] else ""
    return f'misses "{missed[0]["name"]}" ({missed[0]["where"]}){more}'
