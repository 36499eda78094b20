"""What a trace says of drawn loops that lack a friction, a leak, a play, or nothing, where their valves are hidden."""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from workbench.base.errors import InputError
from workbench.commands.common.outcome import Outcome, Progress, Stage, no_checkpoint
from workbench.commands.trace.study import trace_campaign
from workbench.plant.effects import Effect
from workbench.records import Campaign
from workbench.report import Curve, Figure, Page, Panel, Section, Table
from workbench.rigs.driven import driven
from workbench.rigs.rig import Rig

from ..trace.campaigns.cause import cause
from .study import drawn_loop, played

NOTHING = "nothing"
_LACKING = {
    "jack.friction": ("coulomb", "stribeck", "dahl"),
    "jack.external_leakage": ("laminar", "orifice", "mixed, one side"),
    "load.backlash": ("measured on the rod", "measured on the load", "round contact"),
    NOTHING: ("",),
}
"""In turn, by formulas that the library has and that it lacks."""
_SIZE = {"jack.friction": (0.005, 0.08), "jack.external_leakage": (0.01, 0.2), "load.backlash": (2e-4, 5e-3)}
"""Of the stall force; at half the supply pressure, of the label's flow; of the stroke."""


def run_names(number: int, seed: int, stage: Stage, progress: Progress) -> Outcome:
    """`rows`: of each drawn loop what it lacks and how much of it, what its records show, and what a trace names."""
    rows: list[dict[str, Any]] = []
    for k in range(number):
        progress(f"loop {k + 1} of {number}")
        rows.append(stage(f"names {k}", lambda own=k: _named(own, seed)))
        progress(f"{rows[-1]['lacks']}: {rows[-1]['result']}")
    return Outcome({"rows": rows}, lambda: _page(rows))


def _named(number: int, seed: int) -> dict[str, Any]:
    rig, true = drawn_loop(number, seed)
    names = tuple(_LACKING)
    name = names[number % len(names)]
    formula = _LACKING[name][number // len(names) % len(_LACKING[name])]
    random = np.random.default_rng((seed, number, 9))
    size = float(np.exp(random.uniform(*np.log(_SIZE[name])))) if name in _SIZE else 0.0
    lacking = [_lacking(name, formula, size, true)] if name in _SIZE else []
    train, heldout = (
        played(true, np.random.default_rng((seed, number, k)), which, lacking=lacking)
        for k, which in enumerate(("train", "heldout"))
    )
    row = {"loop": number, "lacks": name, "formula": formula, "size": size}
    campaign = driven(Campaign(Path(), rig.name, (), (train,), (heldout,)), rig)
    try:
        answer = trace_campaign(campaign, rig, stage=no_checkpoint, learns=False)
    except InputError as refused:
        return row | {"verdict": "refused", "said": str(refused), "result": "refused"}
    metrics = answer.outcome.metrics
    said = {key: metrics[key] for key in ("verdict", "effects", "equation", "equations", "chi2")}
    said["shown"] = name in metrics.get("told", {}).get("shown", ())
    return row | said | {"result": _result(name, metrics)}


def _lacking(name: str, formula: str, size: float, rig: Rig) -> tuple[Effect, dict[str, float]]:
    """The effect with numbers of a size that goes with the rig's."""
    effect = cause(name, formula, rig).effect
    typical = {number.name: number.typical for number in effect.numbers}
    area, supply, flow = rig["Aj"], rig["Ps"], rig["K3"] * rig["z3max"] * np.sqrt(rig["Ps"] / 2)
    whole = {
        "jack.friction": ("Fc", size * area * supply),
        "jack.external_leakage": (next(iter(typical)), size * flow / (supply / 2)),
        "load.backlash": ("gap", size * rig["S"]),
    }
    first, value = whole[name]
    if first.startswith("k"):  # an orifice's, over the root of the pressure
        value *= np.sqrt(supply / 2)
    scale = value / typical[first]
    grows = {"Fc", "Fs", "C", "CA", "CB", "k", "kA", "kB", "gap"}
    return effect, {key: number * scale if key in grows else number for key, number in typical.items()}


def _result(name: str, metrics: Mapping[str, Any]) -> str:
    """right, tied, wrong; unknown, or hidden where the records were said not to show it; clean.

    A second name beside the right one is wrong, unless the answer says that it is one of both.
    """
    named = list(metrics["effects"]) if metrics["verdict"] in ("named", "tied", "incomplete") else []
    if name == NOTHING:
        return "wrong" if named else "clean" if metrics["verdict"] == "none" else "unknown"
    if named:
        if metrics["verdict"] == "tied" and name in named:
            return "tied"
        return "right" if named == [name] else "wrong"
    shown = name in metrics.get("told", {}).get("shown", ())
    return "unknown" if shown and metrics["verdict"] == "unknown" else "hidden"


def _page(rows: list[dict[str, Any]]) -> tuple[Page, Figure]:
    counts = [
        [name, len(own := [row["result"] for row in rows if row["lacks"] == name]), str(dict(Counter(own)))]
        for name in _LACKING
    ]
    before = np.array([row["chi2"]["before"] if "chi2" in row else np.nan for row in rows], dtype=float)
    curve = Curve("of the fitted rig", np.arange(len(rows), dtype=float), before, "markers")
    figure = Figure("What the fitted rig leaves", "loop", [Panel("chi2 [1]", [curve])])
    wrong = sum(row["result"] == "wrong" for row in rows)
    table = Table("What a trace says", ["lacks", "loops", "said"], counts)
    said = f"{wrong} of {len(rows)} loops whose valve nobody recorded got a wrong name."
    return Page("Names on hidden loops", said, [Section("Names", [table, figure])]), figure
