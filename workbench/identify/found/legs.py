"""The answers of six legs, and of what they carry, as one: names that say the leg, one ranking, one verdict."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

NAMING = ("named", "tied", "incomplete")  # verdicts with names
Answer = Mapping[str, Any]
"""What trace.json says of one leg."""


def suspected(legs: Sequence[Answer]) -> list[int]:
    """The legs, counted from 0, that lack something or have a number that is another one, the largest misfit first."""
    able = [i for i, leg in enumerate(legs) if leg["verdict"] != "none" or leg["numbers"]]
    return sorted(able, key=lambda i: -_misfit(legs[i]))


def platform_answer(legs: Sequence[Answer], own: Answer) -> dict[str, Any]:
    """The answer by the keys of trace.json: effects are `leg4.main.deadband`, signals `leg4.pa [bar]`. A share in the
    ranking is of what the platform's model misses, all legs and the balance of their wrench together. `legs` has each
    leg's own verdict, `own` is the answer on joints and payload, as of `wrench_answer`."""
    judged = [own] if own["verdict"] else []
    parts = [_of_leg(legs[i], i + 1) for i in suspected(legs)] + [each for each in judged if each["verdict"] != "none"]
    parts.sort(key=lambda part: -_misfit(part))
    return {
        "verdict": _verdict([part["verdict"] for part in parts]),
        "effects": [name for part in parts for name in part["effects"]],
        "equation": next((part["equation"] for part in parts if part["equation"]), None),
        "ranking": _ranking([*(_of_leg(leg, i) for i, leg in enumerate(legs, 1)), *judged]),
        "chi2": {key: mean_known([leg["chi2"][key] for leg in legs]) for key in ("before", "after")},
        "rms": {f"leg{i}.{label}": row for i, leg in enumerate(legs, 1) for label, row in leg["rms"].items()},
        "learned": [{"leg": i, **shape} for i, leg in enumerate(legs, 1) for shape in leg["learned"]],
        "numbers": [
            {**wrong, "name": f"leg{i}.{wrong['name']}"} for i, leg in enumerate(legs, 1) for wrong in leg["numbers"]
        ],
        "legs": [
            {"leg": i, **{key: leg[key] for key in ("verdict", "effects", "equation", "chi2")}}
            for i, leg in enumerate(legs, 1)
        ],
        "wrench": {key: own[key] for key in ("verdict", "effects", "chi2", "not_shown")},
    }


def _of_leg(leg: Answer, number: int) -> Answer:
    """An answer whose names say the leg."""
    effects = [f"leg{number}.{name}" for name in leg["effects"]]
    ranking = [{**row, "effect": f"leg{number}.{row['effect']}"} for row in leg["ranking"]]
    return {**leg, "effects": effects, "ranking": ranking}


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


def _ranking(parts: Sequence[Answer]) -> list[dict[str, Any]]:
    """The rankings of all parts in one: what the verdict names first, then by share."""
    whole = sum(_misfit(part) for part in parts) or 1.0
    added = {name for part in parts for name in part["effects"]}
    rows = list(_shares(parts, whole))
    return sorted(rows, key=lambda row: (row["effect"] not in added, -row["explained"]))


def _shares(parts: Sequence[Answer], whole: float) -> Iterator[dict[str, Any]]:
    for part in parts:
        share = _misfit(part) / whole
        yield from ({**row, "explained": row["explained"] * share} for row in part["ranking"])


def _misfit(leg: Answer) -> float:
    """chi2 above 1 of the held-out records; infinite where they could not be simulated."""
    before = leg["chi2"]["before"]
    return float("inf") if before is None else max(0.0, before - 1)


def mean_known(values: Sequence[float | None]) -> float | None:
    """Their mean; None where one of them is."""
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if len(known) == len(values) else None
