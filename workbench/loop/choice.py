"""Which controller to take of those that were judged over the envelope, in a sentence."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .envelope_row import EnvelopeRow

Goal = Mapping[str, Any]  # of a row


def choice(rows: Sequence[EnvelopeRow], step: str) -> str:
    """Which controller to take and where it is weakest; where none meets every goal, which comes nearest. In the words
    of the `step` that is in the goals.

    Of several that meet every goal it is the one that is least behind in the step in which it is most behind the
    soonest of them: one that wins a hair in one step and is slow in another is not the one to take.
    """
    able = [row for row in rows if row["met"] and row["settling_worst_s"] is not None]
    if not able:
        nearest = min(rows, key=shortfall)
        return (
            f"No controller meets every goal and settles over stroke and rigs; nearest comes {nearest['controller']}: "
            f"it {_settles(step, nearest)}, and {_first_miss(nearest)}."
        )
    best = min(able, key=lambda row: (_behind(row, able), row["settling_worst_s"]))
    return (
        f"Take {best['controller']}: it meets every goal over stroke and rigs and {_settles(step, best)}"
        f"{_other_steps(best, step)}; it is weakest in {_weakest(best)}{_sooner(rows, best)}."
    )


def _behind(row: EnvelopeRow, able: Sequence[EnvelopeRow]) -> float:
    """How many times the settling of the soonest a row's is, in the step in which that is most; a step that none
    settles tells nothing."""
    times = [_times(each) for each in able]
    soonest = {name: min(each[name] for each in times) for name in times[0]}
    return max(_times(row)[name] / least for name, least in soonest.items() if np.isfinite(least))


def _times(row: EnvelopeRow) -> dict[str, float]:
    """Worst settling [s] by step."""
    return {each["scenario"]: each["settling_worst_s"] or np.inf for each in row["steps"]}


def _other_steps(row: EnvelopeRow, step: str) -> str:
    """In the sentence: the steps that are not in the goals."""
    others = {name: time for name, time in _times(row).items() if name != step}
    said = [f"{name} within {time:.3g} s" if np.isfinite(time) else f"{name} never" for name, time in others.items()]
    return f" ({', '.join(said)})" if said else ""


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
    slower = [each for each in row["steps"] if _times(row)[each["scenario"]] > _times(best)[each["scenario"]]]
    but = _first_miss(row)
    if row["met"] and slower:
        most = max(slower, key=lambda each: _times(row)[each["scenario"]] / _times(best)[each["scenario"]])
        took = most["settling_worst_s"]
        but = f"{most['scenario']} takes it {took:.3g} s" if took else f"never settles {most['scenario']}"
    return f"; {row['controller']} settles it sooner, within {row['settling_worst_s']:.3g} s, but {but}"


def _first_miss(row: EnvelopeRow) -> str:
    """In the sentence: the first goal that is missed and its worst plant, and how many more there are."""
    missed = [goal for goal in row["goals"] if goal["miss"]]
    if not missed:
        return "misses no goal"
    more = f" and {len(missed) - 1} more" if missed[1:] else ""
    return f'misses "{missed[0]["name"]}" ({missed[0]["where"]}){more}'
