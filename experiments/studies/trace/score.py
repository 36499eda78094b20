"""What a trace's answer is worth beside the truth, and how often traces are right: rates with 95 % intervals."""

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.stats import binom, binomtest

from workbench.base.units import to_si
from workbench.identify.trace.localise import BETWEEN
from workbench.plant.effects import known_effects

from .campaigns.draw import JACK
from .campaigns.scene import drawn_rig

VISIBLE = 1.2  # chi2 of the base fit; a misfit below is faint
SHOWN = 1.05  # chi2 that a refit leaves of the train records: below, nothing fitted to them can know the effect
FIRST = 3  # of the ranking
FLOOR = 1.15  # held-out RMS over the noise floor
FINE = ("right", "tied", "incomplete", "both", "one, incomplete")  # results that are as good as can be asked
LEAST = 1e-3  # of a misfit: less than that is left by chance
HOW = ("right", "tied", "wrong", "unnamed")  # the answers of campaigns whose effect has neighbours
NAMING = ("named", "tied", "incomplete")
GROUPS = ("single", "clean", "off", "pair", "faint", "number")
FAMILY = {effect.name: effect.kin for effect in known_effects()}
_CELL = re.compile(r"(?P<name>\S+) \[(?P<unit>[^\]]+)\]")

Row = dict[str, Any]
Truth = Mapping[str, Any]
Answer = Mapping[str, Any]


@dataclass(frozen=True)
class TraceScore:
    """A rate (or a median) with its 95 % interval and what it should be; `sense` says on which side of the target."""

    id: str
    value: float | None
    low: float | None
    high: float | None
    target: float | None
    sense: Literal["at least", "at most", ""]
    n: int
    unit: str = "1"

    @property
    def label(self) -> str:
        """As people read it."""
        return self.id.replace("_", " ")

    @property
    def met(self) -> bool | None:
        """Whether the value is where it should be; None where there is nothing to say."""
        if self.value is None or self.target is None:
            return None
        return self.value >= self.target if self.sense == "at least" else self.value <= self.target


def judged(truth: Truth, answer: Answer) -> Row:
    """One row of the study: what was drawn, what was said, and whether that is right.

    group: what the campaign counts for: "error", "few sensors", "poor excitation" (of the train records is enough),
    "clean", or, of "single", "number", "off" and "pair", the word itself or "faint" where the base fit leaves less than
    VISIBLE. A described number that is named as wrong stands among the names as `number.NAME`. Of a platform chi2 is
    that of the leg, or the balance of the payload, which leaves most.
    """
    names = list(answer["effects"]) if answer["verdict"] in NAMING else []
    names += [f"number.{_cell(wrong['name'])}" for wrong in answer.get("numbers", ())]
    verdict = "named" if names and answer["verdict"] == "none" else answer["verdict"]
    ranked = [entry["effect"] for entry in answer["ranking"]]
    parts = [*answer.get("legs", ()), *([own] if (own := answer.get("wrench")) and own["verdict"] else [])]
    chi2 = max((part["chi2"] for part in parts), key=_before, default=answer["chi2"])
    row = {
        **_drawn(truth),
        "group": _group(truth, chi2["before"]),
        "verdict": verdict,
        "named": names,
        "tied": answer.get("tied", {}),
        "alike": sorted({title.split()[0] for titles in answer.get("alike", {}).values() for title in titles}),
        "said_equation": answer["equation"],
        "may_sit_in": answer.get("equations", []),
        "ranked": ranked[:FIRST],
        "explained": _explained(answer["ranking"]),
        "chi2_before": chi2["before"],
        "chi2_after": chi2["after"],
        "at_floor": all(error["after"] <= FLOOR * error["floor"] for error in answer["rms"].values()),
        "covers": _covered(truth, answer),
        "error": None,
    }
    return row | {"result": _result(row)}


def _before(chi2: Mapping[str, float | None]) -> float:
    return np.inf if chi2["before"] is None else chi2["before"]


def failed(truth: Truth, error: str) -> Row:
    """The row of a campaign whose trace raised."""
    return {**_drawn(truth), "group": "error", "error": error, "result": "error"}


def scores(rows: Sequence[Row]) -> list[TraceScore]:
    """Every rate that a trace is judged by. A group without campaigns gives a score without a value."""
    single, clean, off, pair, faint, number = ([row for row in rows if row["group"] == group] for group in GROUPS)
    right = [row for row in single if row["result"] in ("right", "tied", "incomplete")]
    shares = [(r["chi2_after"] - 1) / (r["chi2_before"] - 1) for r in right if r["chi2_after"] is not None]
    covers = {
        kind: [inside for row in rows for inside in row.get("covers", {}).get(kind, [])] for kind in ("effect", "base")
    }
    rest = [row for row in rows if row["group"] in ("few sensors", "poor excitation")]
    return [
        _rate("named_or_tied", single, lambda r: r["truth"][0] in (*r["named"], *r.get("alike", ())), 0.85),
        _rate("first_three", single, lambda r: r["truth"][0] in r["ranked"], 0.95),
        _rate("right_family", single, lambda r: _family(r["truth"][0]) in map(_family, r["named"]), 0.90),
        _rate("false_alarms", clean, lambda r: r["verdict"] != "none", 1 / 60, most=True),
        _rate("off_library_named", off, lambda r: bool(r["named"]), 0.05, most=True),
        _rate("off_library_equation", off, _places, 0.85),
        _median("misfit_left", shares, 0.05),
        _rate("at_floor_or_incomplete", right, lambda r: r["at_floor"] or r["verdict"] == "incomplete", 0.80),
        _rate("intervals_cover", covers["effect"], bool, 0.90),
        _rate("base_intervals_cover", covers["base"], bool, None),
        _rate("pair_both", pair, lambda r: r["result"] == "both", None),
        _rate("pair_one_incomplete", pair, lambda r: r["result"] == "one, incomplete", None),
        _rate("pair_wrong", pair, lambda r: r["result"] == "wrong", None),
        _rate("faint_right", faint, lambda r: r["result"] == "right", None),
        _rate("faint_wrong", faint, lambda r: r["result"] == "wrong", None),
        _rate("hard_to_see_wrong", rest, lambda r: r["result"] == "wrong", None),
        _rate("number_named", number, lambda r: r["truth"][0] in r["named"], None),
        _rate("number_and_nothing_else", number, lambda r: r["result"] in FINE, None),
        _rate("number_blamed", [*single, *clean, *off], _blames_number, None),
        _rate("errors", rows, lambda r: r["group"] == "error", 0.0, most=True),
    ]


def odds(rows: Sequence[Row]) -> list[Row]:
    """Of each effect that has neighbours in its family: how often it was named for itself, tied, named for another, or
    not at all, and the `leads` of those that count: what the neighbour leaves more, of what the true name leaves.

    A lead of NEIGHBOUR (rule.py) or less ties; a negative one is of a neighbour that explains more.
    """
    single = [row for row in rows if row["kind"] == "single" and row["group"] != "error"]
    of = [row for row in single if row["truth"][0] in FAMILY]  # names of a platform's effects begin with the leg
    table = []
    for name in dict.fromkeys(sorted(row["truth"][0] for row in of)):
        mine = [row for row in of if row["truth"][0] == name]
        leads = [lead for row in mine for lead in _leads(row, name)]
        if any(other != name and family == FAMILY[name] for other, family in FAMILY.items()):
            counts = Counter(_how(row, name) for row in mine)
            table.append({"effect": name, "campaigns": len(mine), **{key: counts[key] for key in HOW}, "leads": leads})
    return table


def _leads(row: Row, name: str) -> list[float]:
    """Of the best neighbour of the true name; none where one of the two was not fitted, or explains nothing."""
    shares = row["explained"]
    others = [shares[other] for other in shares if other != name and FAMILY.get(other) == FAMILY[name]]
    if not shares.get(name) or not others:
        return []
    left, other = max(1 - shares[name], LEAST), max(1 - max(others), LEAST)
    return [other / left - 1 if other >= left else 1 - left / other]


def _how(row: Row, name: str) -> str:
    if not row["named"]:
        return "unnamed"
    if row["verdict"] == "tied":
        return "tied" if name in row["named"] else "wrong"
    return "right" if row["named"][0] == name else "wrong"


def _explained(ranking: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """The share of the misfit that the best formula of each ranked effect takes away."""
    shares: dict[str, float] = {}
    for entry in ranking:
        shares[entry["effect"]] = max(entry["explained"], shares.get(entry["effect"], 0.0))
    return shares


def confusion(rows: Sequence[Row]) -> dict[str, Any]:
    """Counts [truths][answers] of the campaigns that are scored: the first name that is said, else the verdict."""
    scored = [row for row in rows if row["group"] in (*GROUPS, "error")]
    pairs = [(_true_label(row), _said_label(row)) for row in scored]
    order = [*FAMILY]
    truths = sorted({truth for truth, _ in pairs}, key=lambda label: _place(label, order))
    said = sorted({said for _, said in pairs}, key=lambda label: _place(label, order))
    return {"truths": truths, "answers": said, "counts": [[pairs.count((a, b)) for b in said] for a in truths]}


def _drawn(truth: Truth) -> Row:
    return {
        "id": truth["id"],
        "kind": truth["kind"],
        "seed": truth.get("seed"),
        "noise": truth.get("noise"),
        "truth": list(truth["effects"]),
        "formula": list(truth.get("formula", [])),
        "equations": list(truth["equations"]),
        "removed": list(truth.get("removed", [])),
    }


def _group(truth: Truth, chi2: float | None) -> str:
    if truth.get("few"):
        return "few sensors"
    if truth.get("poor") or any(chi2 < SHOWN for chi2 in truth.get("expected_train", [])):
        return "poor excitation"
    if truth["kind"] != "clean" and chi2 is not None and chi2 < VISIBLE:
        return "faint"
    return truth["kind"]


def _result(row: Row) -> str:
    """right, tied, incomplete, both, "one, incomplete" (all fine); one, missed, unknown (short of it); wrong."""
    named, truth, verdict = set(row["named"]), set(row["truth"]), row["verdict"]
    if row["kind"] == "clean":
        return "right" if verdict == "none" else "wrong"
    if row["kind"] == "off":
        return _off_result(row)
    if verdict == "none":
        return "right" if row["group"] == "faint" else "missed"
    if verdict == "unknown":
        return "unknown"
    if row["kind"] == "pair":
        if verdict == "tied":
            return _tied_pair(row)
        if not named <= truth:
            return "wrong"
        return "both" if named == truth else "one, incomplete" if verdict == "incomplete" else "one"
    if row["kind"] == "single" and verdict == "named" and len(named) == 1 and truth <= set(row["alike"]):
        return "tied"
    if not truth <= named or (verdict != "tied" and named != truth):
        return "wrong"
    return {"named": "right"}.get(verdict, verdict)


def _tied_pair(row: Row) -> str:
    """Of two effects: "tied" where each was added or ties with one that was, "one" where only one effect was added."""
    named, truth = set(row["named"]), set(row["truth"])
    added = named - {name for names in row["tied"].values() for name in names}
    found = [{name, *row["tied"].get(name, ())} for name in added]
    if len(found) == len(truth) and truth <= named and all(truth & alike for alike in found):
        return "tied"
    return "one" if truth & named else "wrong"


def _off_result(row: Row) -> str:
    if row["named"]:
        return "wrong"
    if row["verdict"] == "none":
        return "right" if row["group"] == "faint" else "missed"
    if row["said_equation"] in row["equations"]:
        return "right"
    return "tied" if _is_between(row) and set(row["may_sit_in"]) & set(row["equations"]) else "other equation"


def _places(row: Row) -> bool:
    """Whether it says the right equation, or that it sits between command and flow where it does."""
    return row["result"] == "tied" or row["said_equation"] in row["equations"]


def _is_between(row: Row) -> bool:
    """Whether the answer is that it sits between command and flow."""
    return set(row.get("may_sit_in", ())) == BETWEEN


def _covered(truth: Truth, answer: Answer) -> dict[str, list[bool]]:
    """Whether each interval holds the truth: of the effect's numbers where the traced formula is the drawn one (or
    nothing was drawn), and of the rig's own numbers beside them."""
    own: list[bool] = []
    if truth["kind"] == "number":
        cells = {wrong["name"]: (wrong["found"], wrong["low"], wrong["high"]) for wrong in answer.get("numbers", ())}
        return {"effect": _inside(truth.get("true", {}), cells, _rig_units(truth)), "base": []}
    if truth["kind"] == "clean":
        same = answer["verdict"] == "none"
    else:
        key = (truth["effects"][0], (truth.get("formula") or [""])[0])
        entry = next((entry for entry in answer["ranking"] if entry["effect"] in answer["effects"]), None)
        same = truth["kind"] == "single" and entry is not None and (entry["effect"], entry["formula"]) == key
        if entry and same:
            numbers = {k.removeprefix(f"{key[0]}."): v for k, v in truth.get("numbers", {}).items()}
            own = _inside(numbers, entry["parameters"], _units(*key))
    rig = _inside(truth.get("true", {}), answer.get("base", {}), _rig_units(truth)) if same else []
    return {"effect": own, "base": rig}


def _units(name: str, formula: str) -> dict[str, str]:
    effects = [effect for effect in known_effects() if (effect.name, effect.formula) == (name, formula)]
    return {number.name: number.si for effect in effects for number in effect.numbers}


def _rig_units(truth: Truth) -> dict[str, str]:
    return {name: number.si for name, number in drawn_rig(truth.get("rig", JACK), "").numbers.items()}


def _inside(true: Mapping[str, float], intervals: Mapping[str, Sequence[float]], si: Mapping[str, str]) -> list[bool]:
    """For each `name [unit]`: [value, low, high] whose true SI value is known, whether the interval holds it."""
    covered = []
    for cell, (_, low, high) in intervals.items():
        parts = _CELL.fullmatch(cell)
        if parts and parts["name"] in si and parts["name"] in true and None not in (low, high):
            low, high = (float(to_si(edge, parts["unit"], si[parts["name"]])) for edge in (low, high))
            covered.append(low <= true[parts["name"]] <= high)
    return covered


def _rate(
    id: str, campaigns: Sequence[Any], is_so: Callable[[Any], bool], target: float | None, most: bool = False
) -> TraceScore:
    sense = "" if target is None else "at most" if most else "at least"
    if not campaigns:
        return TraceScore(id, None, None, None, target, sense, 0)
    hits = sum(is_so(campaign) for campaign in campaigns)
    low, high = binomtest(hits, len(campaigns)).proportion_ci(0.95, "exact")
    return TraceScore(id, hits / len(campaigns), float(low), float(high), target, sense, len(campaigns))


def _median(id: str, values: Sequence[float], target: float) -> TraceScore:
    """A median that should be small, with the interval that its order statistics give."""
    n = len(values)
    if n == 0:
        return TraceScore(id, None, None, None, target, "at most", 0)
    ordered, edge = np.sort(values), max(0, int(binom.ppf(0.025, n, 0.5)) - 1)
    low, high = float(ordered[edge]), float(ordered[n - 1 - edge])
    return TraceScore(id, float(np.median(ordered)), low, high, target, "at most", n)


def _blames_number(row: Row) -> bool:
    return any(name.startswith("number.") for name in row["named"])


def _cell(text: str) -> str:
    """The name in a cell such as "AB [cm^2]"."""
    parts = _CELL.fullmatch(text)
    return parts["name"] if parts else text


def _family(name: str) -> str:
    return FAMILY.get(name, name)


def _true_label(row: Row) -> str:
    if row["kind"] in ("clean", "pair"):
        return row["kind"]
    return row["truth"][0] if row["kind"] in ("single", "number") else f"off-library: {row['equations'][0]}"


def _said_label(row: Row) -> str:
    if row["group"] == "error":
        return "error"
    return row["named"][0] if row["named"] else row["verdict"]


def _place(label: str, order: Sequence[str]) -> tuple[int, str]:
    return (order.index(label), "") if label in order else (len(order), label)
