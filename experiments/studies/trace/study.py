"""How often a trace is right: campaigns that are drawn, or given with their truth, each traced and scored."""

import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from time import process_time
from typing import Any, Protocol

from workbench.base.process_pool import Jobs, process_pool
from workbench.commands.common.outcome import Outcome, Progress, Stage
from workbench.commands.common.run_folder import metrics_json

from .campaigns.draw import CampaignPlan, draw, planned_equations
from .given import TRUTH, Given
from .joints import DrawnJoint
from .page import page, picture
from .platforms import DrawnPlatform
from .score import FINE, Row, confusion, failed, judged, odds, scores


class Tracer(Protocol):
    """Traces a campaign folder without the effects called `removed`; a trace.json as a dict. A function of a module."""

    def __call__(self, folder: Path, removed: tuple[str, ...]) -> dict[str, Any]: ...


Item = CampaignPlan | DrawnPlatform | DrawnJoint | Given


def identity(plan: Sequence[Item]) -> list[dict[str, Any]]:
    """What says that a study is the same one."""
    return [{"truth": item.truth} if isinstance(item, Given) else asdict(item) for item in plan]


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
    metrics |= {"odds": odds(rows)}
    metrics |= {"items": identity(plan), "timing": timing}
    return Outcome(metrics, lambda: (page(rows, rates, table, timing["campaigns"]), picture(rows)))


def _traced(item: Item, trace: Tracer, keep: Path | None) -> dict[str, Any]:
    """The work on one item: its truth, its row, and the CPU seconds that drawing and tracing took."""
    with tempfile.TemporaryDirectory() as scratch:
        began = process_time()
        truth = _known(item)
        try:
            folder = item.folder if isinstance(item, Given) else (keep or Path(scratch)) / item.id
            truth = _drawn(item, folder)
            drawn = process_time()
            row = judged(truth, trace(folder, tuple(truth.get("removed", ()))))
        except Exception as error:  # one campaign that fails is a row of the report, not the end of the study
            drawn, row = process_time(), failed(truth, f"{type(error).__name__}: {error}")
    timing = {"draw_s": drawn - began, "trace_s": process_time() - drawn}
    return {"truth": truth, "row": row, "timing": timing}


def _drawn(item: Item, folder: Path) -> dict[str, Any]:
    """What an item is short of, once its records are in the folder."""
    if isinstance(item, Given):
        return item.truth
    return item.draw(folder) if isinstance(item, DrawnPlatform | DrawnJoint) else draw(item, folder)


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
    if isinstance(item, DrawnPlatform | DrawnJoint):
        return item.known()
    equations = planned_equations(item)
    return {**asdict(item), "id": item.id, "effects": [name for name, _ in item.effects], "equations": equations}
