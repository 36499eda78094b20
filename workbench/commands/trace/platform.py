"""Which leg, and which effect: the campaign of a platform traced leg by leg, each cut out by its measured force.

A leg under a known force is a jack, so that its trace is that of a jack. What acts on what a jack moves is no
candidate there: all of it is in the measured force. A leg that follows its records costs one fit. Joints and payload
are traced by the wrench of all legs.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...base.checkpoint import Progress, Stage
from ...identify.found.legs import platform_answer, suspected, ties
from ...identify.found.wrench import WrenchAnswer, wrench_answer
from ...identify.wrench.leg_cut import CutLeg, cut_legs, payload_problem, whole_campaigns
from ...plant.effects import Effect, inside_port
from ...plant.effects.declared import effects_for
from ...records import Campaign
from ...records.campaign import campaign_rig
from ...report import Figure, Page
from ...rigs.platform import Platform, load_platform
from ...rigs.rig import Rig
from ...rigs.rig_file import rig_text
from ..common.legs import leg_tables, of_leg
from ..common.outcome import Outcome, no_checkpoint
from ..common.run_folder import metrics_json
from .answer import TraceAnswer
from .legs_page import legs_page
from .payload import payload_numbers
from .study import trace_answer


def leg_effects(rig: Rig, files: Sequence[str] = (), without: Sequence[str] = ()) -> tuple[Effect, ...]:
    """The effects that a leg of a platform may lack. Raises InputError for a name in `without` that there is not."""
    return tuple(effect for effect in effects_for(rig, files, without) if inside_port(effect.laws))


def run_platform_trace(
    platform: Platform,
    whole: Sequence[Campaign],
    legs: Sequence[CutLeg],
    stage: Stage,
    progress: Progress,
    files: Sequence[str] = (),
    without: Sequence[str] = (),
    several: bool = False,
    jobs: int = 1,
) -> Outcome:
    """Trace the records of every leg [6], cut out, to what it lacks, and the `whole` ones [6] to what joints and
    payload lack; `jobs` processes share the work on one leg.

    No shape is learned: with six legs the names are what is asked.
    """
    progress("joints and payload")
    wrench = wrench_answer(payload_problem(platform, whole))
    answers = []
    for number, leg in enumerate(legs, 1):
        own = of_leg(stage, progress, number)
        library = leg_effects(leg.rig, files, without)
        answers.append(trace_answer(leg.campaign, leg.rig, library, *own, files, without, several, jobs, learns=False))
    return _outcome(platform, wrench, answers)


def traced_platform(folder: Path, removed: tuple[str, ...] = (), several: bool = False) -> dict[str, Any]:
    """The answer about a platform's campaign folder without effects called `removed`, as in metrics.json."""
    platform = load_platform(campaign_rig(folder))
    more: dict[str, Any] = {"without": removed, "several": several}
    whole = whole_campaigns(folder)
    legs = cut_legs(platform, whole)
    outcome = run_platform_trace(platform, whole, legs, no_checkpoint, lambda _: None, **more)
    return json.loads(metrics_json(outcome.metrics))


def traced_balance(folder: Path, removed: tuple[str, ...] = ()) -> dict[str, Any]:
    """What is said of joints and payload alone, by the keys of trace.json; all of their effects are known."""
    answer = wrench_answer(payload_problem(load_platform(campaign_rig(folder)), whole_campaigns(folder)))
    return json.loads(metrics_json(answer.told))


def _outcome(platform: Platform, wrench: WrenchAnswer, answers: Sequence[TraceAnswer]) -> Outcome:
    legs = [answer.outcome.metrics for answer in answers]
    whole, wrong = platform_answer(legs, wrench.told), suspected(legs)
    whole["numbers"] += payload_numbers(platform, wrench.payload)
    texts = {"trace.json": metrics_json(whole)}
    texts |= {f"leg{i + 1}.toml": rig_text(answers[i].rig) for i in wrong}
    tables = leg_tables({i + 1: answers[i].outcome for i in wrong})
    more: dict[str, Any] = {f"leg{i}": {"base": leg["base"], "failed": leg["failed"]} for i, leg in enumerate(legs, 1)}
    if tied := ties(legs) | wrench.told["tied"]:
        more["tied"] = tied

    def draw() -> tuple[Page, Figure]:
        return legs_page(platform, wrench, answers)

    return Outcome(whole | more, draw, tables, texts)
