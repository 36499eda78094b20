"""The answers of six legs as one: names that say the leg, one ranking, one verdict."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

NAMING = ("named", "tied", "incomplete")  # verdicts with names
Answer = Mapping[str, Any]
"""What trace.json says of one leg."""


def suspected(legs: Sequence[Answer]) -> list[int]:
    """The legs, counted from 0, that lack something or have a number that is another one, the largest misfit first."""
    able = [i for i, leg in enumerate(legs) if leg["verdict"] != "none" or leg["numbers"]]
    return sorted(able, key=lambda i: -_misfit(legs[i]))


def platform_answer(legs: Sequence[Answer]) -> dict[str, Any]:
    """The answer by the keys of trace.json: effects are `leg4.main.deadband`, signals `leg4.pa [bar]`. A share in the
    ranking is of what the platform's model misses, all legs together. `legs` has each leg's own verdict."""
    order = suspected(legs)
    return {
        "verdict": _verdict([legs[i]["verdict"] for i in order]),
        "effects": [f"leg{i + 1}.{name}" for i in order for name in legs[i]["effects"]],
        "equation": next((legs[i]["equation"] for i in order if legs[i]["equation"]), None),
        "ranking": _ranking(legs),
        "chi2": {key: _mean([leg["chi2"][key] for leg in legs]) for key in ("before", "after")},
        "rms": {f"leg{i}.{label}": row for i, leg in enumerate(legs, 1) for label, row in leg["rms"].items()},
        "learned": [{"leg": i, **shape} for i, leg in enumerate(legs, 1) for shape in leg["learned"]],
        "numbers": [
            {**wrong, "name": f"leg{i}.{wrong['name']}"} for i, leg in enumerate(legs, 1) for wrong in leg["numbers"]
        ],
        "legs": [
            {"leg": i, **{key: leg[key] for key in ("verdict", "effects", "equation", "chi2")}}
            for i, leg in enumerate(legs, 1)
        ],
    }


def ties(legs: Sequence[Answer]) -> dict[str, list[str]]:
    """What explains as much as an effect that was added, by the effect; all names with their leg."""
    named = [(f"leg{i}", each, others) for i, leg in enumerate(legs, 1) for each, others in leg.get("tied", {}).items()]
    return {f"{leg}.{each}": [f"{leg}.{other}" for other in others] for leg, each, others in named}


def _verdict(verdicts: Sequence[str]) -> str:
    """One verdict of those of the legs that lack something: the least certain, where anything is named at all."""
    if not any(verdict in NAMING for verdict in verdicts):
        return "unknown" if "unknown" in verdicts else "none"
    if "unknown" in verdicts:
        return "incomplete"
    return next((verdict for verdict in ("incomplete", "tied") if verdict in verdicts), "named")


def _ranking(legs: Sequence[Answer]) -> list[dict[str, Any]]:
    """Every leg's ranking in one: what the verdict names first, then by share."""
    whole = sum(_misfit(leg) for leg in legs) or 1.0
    rows = list(_shares(legs, whole))
    return sorted(rows, key=lambda row: (row["effect"] not in _added(legs), -row["explained"]))


def _shares(legs: Sequence[Answer], whole: float) -> Iterator[dict[str, Any]]:
    for i, leg in enumerate(legs, 1):
        share = _misfit(leg) / whole
        for row in leg["ranking"]:
            yield {**row, "effect": f"leg{i}.{row['effect']}", "explained": row["explained"] * share}


def _added(legs: Sequence[Answer]) -> set[str]:
    return {f"leg{i}.{name}" for i, leg in enumerate(legs, 1) for name in leg["effects"]}


def _misfit(leg: Answer) -> float:
    """chi2 above 1 of the held-out records; infinite where they could not be simulated."""
    before = leg["chi2"]["before"]
    return float("inf") if before is None else max(0.0, before - 1)


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if len(known) == len(values) else None
