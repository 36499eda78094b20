"""Hidden rigs served, commissioned through the wire, and judged beside a tuning that knows what the rig is."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from workbench.base.errors import InputError
from workbench.base.process_pool import Jobs, process_pool
from workbench.commands.commission.study import Wanted, run_commission
from workbench.commands.common.outcome import Outcome, Progress, leave, no_checkpoint
from workbench.commands.common.run_folder import RunFolder, open_run
from workbench.control.automatic_tuning import Mode, SmallMoves
from workbench.control.shells import SineShell as Sine
from workbench.link.bench import bench
from workbench.link.client import LinkClient
from workbench.link.commissioning.allowed import allowed, doubted, is_of
from workbench.link.commissioning.designs import exactly, searched_designs
from workbench.link.commissioning.relay import with_dither
from workbench.link.commissioning.rig_time import RigTime
from workbench.link.commissioning.verify import SINES, Way, played_way, settling_of
from workbench.link.course import wire_rig
from workbench.link.paced import LockstepServer
from workbench.link.rig_server import in_background
from workbench.link.served_rig import ServedRig
from workbench.loop.automatic import automatic
from workbench.rigs.rig import Rig

from .benches import datasheet_of
from .colour import ColouredDraws
from .page import page
from .plan import HiddenPlan, hidden_rig

GOAL = "position-10mm"
MINUTES = 10.0  # of the rig
_COMPUTING = 20.0  # CPU minutes

Row = dict[str, Any]


def run_commission_study(plans: Sequence[HiddenPlan], run: RunFolder, progress: Progress, jobs: Jobs = 1) -> Outcome:
    """`rows`, one a rig; `summary`, the counts and medians of them. Each rig's own report is in `rigs`."""

    def done(row: Row) -> None:
        progress(f"{row['id']}: {row['said'] or row['verdict'] or row['error']}; {GOAL} {_seconds(row['settling_s'])}")

    with process_pool(jobs, partial(partial, commissioned, folder=run.dir / "rigs")) as work:
        rows = work({plan.id: plan for plan in plans}, run.stage, done)
    timing = {row["id"]: row.pop("computing_seconds") for row in rows}
    metrics = {"rows": rows, "summary": summary(rows), "plans": [asdict(plan) for plan in plans], "timing": timing}
    return Outcome(metrics, lambda: page(metrics))


def commissioned(plan: HiddenPlan, folder: Path) -> Row:
    """One rig, served and commissioned: what was said and measured, and what a tuning with the truth known settles in,
    which is not searched for other benches.

    The rig's report is left in `folder`/ID.
    """
    datasheet, began = datasheet_of(plan.bench), process_time()
    truth = doubted(hidden_rig(datasheet, plan))
    colour = partial(ColouredDraws, period=truth.period.value)
    own = bench(truth, computes=True)
    served = ServedRig(own, plan.seed, colour) if plan.coloured else ServedRig(own, plan.seed)
    with in_background(LockstepServer(served)) as server:
        try:
            told = _told(datasheet, server.at, folder / plan.id)
        except InputError as error:
            told = {"error": str(error)}
        spent = process_time() - began
        known = _known(truth, told, server.at) if told.get("rows") and not plan.bench else None
        trips = server.trips
    return _row(plan, told, known, trips, spent)


def _told(datasheet: Rig, at: str, out: Path) -> Mapping[str, Any]:
    """metrics.json of a commissioning, whose report is left in a folder."""
    wanted = Wanted(datasheet, at, "", 60 * MINUTES, 60 * _COMPUTING, GOAL, 1)
    identity = {"command": "commission", "at": "served here", "rig": datasheet.table()}
    with open_run(out, identity, True) as run:
        outcome = run_commission(wanted, run, lambda _: None)
        leave(run, outcome, identity)
    return outcome.metrics


def _known(truth: Rig, told: Mapping[str, Any], at: str) -> float | None:
    """What the goal settles in [s], measured, by the same search on the rig as it is."""
    known = dict(told["small_moves"])
    mode = known.pop("mode")
    dither = told["dither"]
    sine = None if dither is None else Sine(dither["amplitude"], dither["frequency_hz"], truth.period.value)
    law = with_dither(automatic(truth, SmallMoves(**known, mode=mode and Mode(**mode))), sine)
    designs, _ = searched_designs(truth, law, "known", GOAL, no_checkpoint, lambda _: None, 1)
    with LinkClient(at, "") as client:
        spent = RigTime(client, truth, 60 * MINUTES, no_checkpoint)
        spent.stay_on(sine is not None)
        way = Way(designs[0], allowed(exactly(wire_rig(truth, client))))
        judged = played_way(spent, "known", way, (GOAL,), lambda _: None)
    return settling_of(judged, GOAL)


def _row(plan: HiddenPlan, told: Mapping[str, Any], known: float | None, trips: int, spent: float) -> Row:
    ways = {row["way"]: row for row in told.get("rows", ()) if is_of(row["scenario"], GOAL) and row["way"] != "limit"}
    settling = {way: row["settling_s"]["measured"] for way, row in ways.items()} | {"known": known}
    true = [effect.name for effect in plan.effects]
    said = list(told.get("effects", ()))
    return {
        "id": plan.id,
        "truth": true,
        "formulas": [effect.formula for effect in plan.effects],
        "trap": plan.trap,
        "coloured": plan.coloured,
        "verdict": told.get("verdict"),
        "said": said,
        "wrong": bool(said) and told["verdict"] != "unknown" and not _right(told["verdict"], said, true),
        "trips": trips,
        "rig_seconds": told.get("rig_seconds"),
        "settling_s": settling,
        "predicted_s": {way: row["settling_s"]["predicted"] for way, row in ways.items()},
        "ended": told.get("ended"),
        "rounds": told.get("rounds"),
        "kept": told.get("way"),
        "exact_s": told.get("exact_s"),
        "steps": _steps(told),
        "guard_trips": told.get("trips"),
        "obstacles": [each["what"] for each in told.get("obstacles", ())],
        "error": told.get("error") or (None if told["rows"] else told["ended"]),
        "computing_seconds": spent,
    }


def _steps(told: Mapping[str, Any]) -> dict[str, list[float | None]]:
    """What the steps of the controller that was kept settle in [s]: predicted, measured."""
    own = [row for row in told.get("rows", ()) if row["way"] == told["way"] and row["scenario"] not in SINES]
    return {row["scenario"]: [row["settling_s"][key] for key in ("predicted", "measured")] for row in own}


def _right(verdict: str, said: Sequence[str], true: Sequence[str]) -> bool:
    """Whether no name is wrong: of tied ones it is enough that one is right."""
    return any(name in true for name in said) if verdict == "tied" else all(name in true for name in said)


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Counts and ratios over rigs that were commissioned: for which a rig was found, and a controller for it. The
    ratios are those of the controller that was kept."""
    whole = [row for row in rows if not row["error"] and "found" in row["settling_s"]]
    return {
        "rigs": len(rows),
        "commissioned": len(whole),
        "trips": sum(row["trips"] for row in rows),
        "wrong_names": sum(row["wrong"] for row in rows),
        "most_rig_seconds": max((row["rig_seconds"] for row in whole), default=None),
        "over_known": _quantiles(whole, "known"),
        "over_automatic": _quantiles(whole, "automatic"),
        "over_datasheet": _quantiles(whole, "datasheet"),
        "within_1.15_of_known": sum(_ratio(row, "known") <= 1.15 for row in whole),
        "predicted_within_15_percent": sum(_predicted(row) <= 0.15 for row in whole),
    }


def _ratio(row: Row, way: str) -> float:
    """Settling of the controller that was kept over that of a way; infinite where it never settles, 1 where neither
    does."""
    first, second = row["settling_s"].get(row["kept"]), row["settling_s"].get(way)
    if second is None:
        return 1.0 if first is None else 0.0
    return np.inf if first is None else first / second


def _predicted(row: Row) -> float:
    """By what share the predicted settling of the controller that was kept is off."""
    measured, predicted = row["settling_s"].get(row["kept"]), row["predicted_s"].get(row["kept"])
    if measured is None or predicted is None:
        return 0.0 if measured is predicted else np.inf
    return abs(predicted / measured - 1)


def _quantiles(rows: Sequence[Row], other: str) -> dict[str, float | None]:
    ratios = [_ratio(row, other) for row in rows]
    return {"median": float(np.median(ratios)) if ratios else None, "worst": max(ratios, default=None)}


def _seconds(settling: Mapping[str, float | None]) -> str:
    return ", ".join(f"{way} {'never' if value is None else f'{value:.3g} s'}" for way, value in settling.items())
