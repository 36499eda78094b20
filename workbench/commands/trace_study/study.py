"""How often a trace is right: campaigns that are drawn, or given with their truth, each traced and scored."""

import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any, Protocol, cast

import numpy as np

from ...base.process_pool import Jobs, process_pool
from ..common.outcome import Outcome, Progress, Stage
from ..common.run_folder import metrics_json
from .campaigns.cause import LIBRARY_CAUSES, OTHER_FORMULA_CAUSES, UNNAMED_CAUSES, Cause, cause
from .campaigns.draw import CampaignPlan, Kind, draw
from .campaigns.noise import BLEMISHES, Noise
from .given import TRUTH, Given
from .page import page, picture
from .score import FAMILY, FINE, Row, confusion, failed, judged, scores

SHARES = {"single": 0.55, "clean": 0.15, "off": 0.15, "pair": 0.15}
MISFIT = (2.0, 15.0)  # held-out chi2 that a refit of the base model leaves, log-uniform
SHARP, TIMING_SHARP = (0.25, 1.0), (0.1, 0.25)  # late currents show far too well where the command is rough
NOISES: tuple[Noise, ...] = ("white", "white", "white", "tripled", "coloured")
FEW, POOR, SUPPLY, BLEMISHED = 0.08, 0.05, 0.5, 0.25  # of the campaigns


class Tracer(Protocol):
    """Traces a campaign folder without the effects called `removed`; a trace.json as a dict. A function of a module."""

    def __call__(self, folder: Path, removed: tuple[str, ...]) -> dict[str, Any]: ...


Item = CampaignPlan | Given


def default_plan(count: int, seed: int) -> list[CampaignPlan]:
    """`count` campaigns by SHARES, shuffled, so that the first ones represent all.

    The singles take the names of the library in turn, in formulas of the library and others.
    """
    parts = np.floor(np.cumsum([0.0, *SHARES.values()]) * count + 0.5).astype(int)
    kinds = np.repeat(list(SHARES), np.diff(parts))
    order = np.random.default_rng([seed, 0])
    names = order.permutation(list(FAMILY)).tolist()
    return [_campaign_plan(str(kinds[i]), seed, int(i), names) for i in order.permutation(count)]


def identity(plan: Sequence[Item]) -> list[dict[str, Any]]:
    """What says that a study is the same one."""
    return [asdict(item) if isinstance(item, CampaignPlan) else {"truth": item.truth} for item in plan]


def run_trace_study(
    plan: Sequence[Item],
    trace: Tracer,
    stage: Stage,
    progress: Progress,
    jobs: Jobs = 1,
    keep: Path | None = None,
) -> Outcome:
    """Draw, trace and score every item; `keep` is where drawn folders stay, with their truth.json. One stage an item.

    `jobs` worker processes take an item each; with one, everything runs in this process.
    """
    tally = _Tally(len(plan), progress)
    with process_pool(jobs, partial(partial, _traced, trace=trace, keep=keep)) as traced:
        results = traced({f"campaign-{item.id}": item for item in plan}, stage, lambda result: tally(result["row"]))
    if keep is not None:
        truths = [result["truth"] for result in results]
        (keep / TRUTH).write_text(metrics_json({"set": "drawn", "campaigns": truths}), encoding="utf-8")
    rows = [result["row"] for result in results]
    rates = scores(rows)
    timing = {"campaigns": [{"id": item.id, **result["timing"]} for item, result in zip(plan, results, strict=True)]}
    table = confusion(rows)
    metrics = {"rows": rows, "scores": [asdict(rate) for rate in rates], "confusion": table}
    metrics |= {"items": identity(plan), "timing": timing}
    return Outcome(metrics, page(rows, rates, table, timing["campaigns"]), picture(rows))


def _traced(item: Item, trace: Tracer, keep: Path | None) -> dict[str, Any]:
    """The work on one item: its truth, its row, and the seconds that drawing and tracing took."""
    with tempfile.TemporaryDirectory() as scratch:
        began = perf_counter()
        truth = _known(item)
        try:
            folder = item.folder if isinstance(item, Given) else (keep or Path(scratch)) / item.id
            truth = draw(item, folder) if isinstance(item, CampaignPlan) else truth
            drawn = perf_counter()
            row = judged(truth, trace(folder, tuple(truth.get("removed", ()))))
        except Exception as error:  # one campaign that fails is a row of the report, not the end of the study
            drawn, row = perf_counter(), failed(truth, f"{type(error).__name__}: {error}")
    timing = {"draw_s": drawn - began, "trace_s": perf_counter() - drawn}
    return {"truth": truth, "row": row, "timing": timing}


class _Tally:
    """Prints every result as it comes, with the score so far."""

    def __init__(self, count: int, progress: Progress) -> None:
        self._count, self._progress = count, progress
        self._done: Counter[str] = Counter()
        self._fine: Counter[str] = Counter()

    def __call__(self, row: Row) -> None:
        self._done[row["group"]] += 1
        self._fine[row["group"]] += row["result"] in FINE
        said = row["error"] or " + ".join(row["named"]) or row["verdict"]
        true = " + ".join(row["truth"]) or "nothing"
        score = ", ".join(f"{group} {self._fine[group]}/{n}" for group, n in sorted(self._done.items()))
        number = f"{self._done.total()}/{self._count}"
        self._progress(f"{number} {row['id']}: {true} -> {said}: {row['result']}; so far {score}")


def _known(item: Item) -> dict[str, Any]:
    """What is known of an item before it is drawn."""
    if isinstance(item, Given):
        return item.truth
    causes = [cause(*key) for key in item.effects]
    equations = list(dict.fromkeys(equation for cause in causes for equation in cause.equations))
    return {**asdict(item), "id": item.id, "effects": [name for name, _ in item.effects], "equations": equations}


def _campaign_plan(kind: str, seed: int, number: int, names: Sequence[str]) -> CampaignPlan:
    """One campaign of a plan; everything about it follows from seed and number."""
    drawn = np.random.default_rng([seed, 1, number])
    causes, removed = _causes(kind, number, names, drawn)
    timing = any(cause.effect.family == "drive timing" for cause in causes)
    few = kind == "single" and drawn.random() < FEW
    blemish = tuple(drawn.choice(BLEMISHES, drawn.integers(1, 4), replace=False).tolist())
    return CampaignPlan(
        seed=seed * 100_000 + number,
        kind=cast(Kind, kind),
        effects=tuple(cause.key for cause in causes),
        removed=removed,
        misfit=_log_uniform(drawn, MISFIT),
        sharp=_log_uniform(drawn, TIMING_SHARP if timing else SHARP),
        noise=NOISES[drawn.integers(len(NOISES))],
        supply=bool(drawn.random() < SUPPLY),
        few=few,
        poor=kind == "single" and not few and bool(drawn.random() < POOR),
        blemish=blemish if drawn.random() < BLEMISHED else (),
    )


def _causes(
    kind: str, number: int, names: Sequence[str], drawn: np.random.Generator
) -> tuple[list[Cause], tuple[str, ...]]:
    """What a campaign is short of, and what the tracer's library is to be without."""
    if kind == "clean":
        return [], ()
    if kind == "off" and number % 2:
        return [UNNAMED_CAUSES[drawn.integers(len(UNNAMED_CAUSES))]], ()
    first = _formula(names[number % len(names)], drawn)
    if kind == "single":
        return [first], ()
    kin = tuple(name for name, family in FAMILY.items() if family == FAMILY[first.effect.name])
    if kind == "off":
        return [first], kin
    others = [name for name in names if name not in kin]
    return [first, _formula(others[drawn.integers(len(others))], drawn)], ()


def _formula(name: str, drawn: np.random.Generator) -> Cause:
    """A formula of a named effect: one of the library's or another, as likely."""
    own, others = (
        [cause for cause in pool if cause.effect.name == name] for pool in (LIBRARY_CAUSES, OTHER_FORMULA_CAUSES)
    )
    pool = own if drawn.random() < 0.5 else others
    return pool[drawn.integers(len(pool))]


def _log_uniform(drawn: np.random.Generator, band: tuple[float, float]) -> float:
    return float(np.exp(drawn.uniform(*np.log(band))))
