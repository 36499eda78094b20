"""The numbers of a plan by the keys of metrics.json."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...identify.trace.record_gain import Pair, UnseenNumber


@dataclass(frozen=True)
class Check:
    """The record of a pair as played with the first effect on: the cosine then, and what each effect explains."""

    record: str
    played: Mapping[str, float]


def plan_metrics(
    alike: Sequence[Pair],
    unseen: Sequence[UnseenNumber],
    gains: Mapping[str, float],
    played: Mapping[str, Mapping[str, Any]],
    checks: Mapping[tuple[str, str], Check],
) -> dict[str, Any]:
    """Pairs, numbers, and the records that are best for one, those of most information first, each with what is
    `played` of it, by name."""
    pairs = [_pair_json(pair, checks.get(pair.names)) for pair in alike]
    numbers = [_number_json(number, gains) for number in unseen]
    best = {row["best"] for row in (*pairs, *numbers) if row["best"]}
    chosen = sorted(best, key=lambda name: -gains[name])
    listed = [_record_json(name, gains[name], pairs, numbers) | dict(played[name]) for name in chosen]
    return {"pairs": pairs, "numbers": numbers, "records": listed}


def _pair_json(pair: Pair, check: Check | None) -> dict[str, Any]:
    return {
        "effects": list(pair.names),
        "cosine": pair.cosine,
        "after": dict(pair.after),
        "best": check and check.record,
        "played": check and dict(check.played),
    }


def _number_json(number: UnseenNumber, gains: Mapping[str, float]) -> dict[str, Any]:
    """`share`: 95 % interval over the declared range."""
    return {
        "number": number.name,
        "share": number.share,
        "after": dict(number.after),
        "best": number.best(gains),
    }


def _record_json(
    name: str, information: float, alike: Sequence[Mapping[str, Any]], unseen: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    return {
        "record": name,
        "file": f"{name}.csv",
        "information": information,
        "splits": [row["effects"] for row in alike if row["best"] == name],
        "tells": [row["number"] for row in unseen if row["best"] == name],
    }
