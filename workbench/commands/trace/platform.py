"""Which leg, and which effect: the campaign of a platform traced leg by leg, each cut out by its measured force.

A leg under a known force is a jack, so that its trace is that of a jack. What acts on what a jack moves is no
candidate there: all of it is in the measured force. A leg that follows its records costs one fit. Joints and payload
are traced by the wrench of all legs.
"""

import json
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...base.checkpoint import Progress, Stage
from ...base.words import listed
from ...identify.found.legs import NAMING, Answer, platform_answer, suspected, ties
from ...identify.found.wrench import WrenchAnswer, wrench_answer
from ...identify.trace.rule import gate
from ...identify.wrench.leg_cut import CutLeg, cut_legs, payload_problem, whole_campaigns
from ...identify.wrench.lines import BAND
from ...identify.wrench.search import WrenchTrace
from ...plant.effects import Effect, inside_port
from ...plant.effects.declared import effects_for
from ...records import Campaign
from ...records.campaign import campaign_rig
from ...report import Curve, Figure, Mark, Page, Panel, Scene, Section, Table, within
from ...rigs.platform import Platform, load_platform
from ...rigs.rig import Rig
from ...rigs.rig_file import rig_text
from ..common.error_page import AFTER, BEFORE
from ..common.legs import chi2_figure, each_leg, leg_sections, leg_tables
from ..common.outcome import Outcome, no_checkpoint
from ..common.platform_scene import platform_scene
from ..common.run_folder import metrics_json
from .answer import TraceAnswer
from .payload import payload_numbers, payload_sentence, payload_table
from .study import trace_answer
from .words import FREE_RUN, RETUNE

_FRAME = 0.02  # s
_LARGER = 5.0  # times the motion is drawn
_OF_ONE_JACK = (RETUNE, FREE_RUN)  # advice that no platform can follow
_HOW = (
    "Each leg is a jack that carries its rod under the force that its load cell measured, or, without load cells, what "
    "it alone moves under the rest of what the payload's motion asks: platform, payload and the other legs act in that "
    "force and in none of the errors. chi2 is that of the held-out records, and 1 is the noise "
    "floor; before: the leg's numbers fitted; after: with what was named."
)
_NOTE = (
    "The wrench that all legs give the payload, less what its motion asks for, line by line up to "
    f"{BAND:g} Hz over the noise of the record at rest. Explained: the share of the held-out misfit that a candidate "
    "alone takes away, once the payload's numbers are fitted with it."
)
_NO_RECORD = (
    "Joints are not judged: that takes a record at rest, which tells the noise, and a held-out one. Add both to "
    "campaign.toml."
)
_NO_CELLS = (
    "Joints are not judged: without load cells the forces are those of the pressures, and dry friction of a jack would "
    "look like friction of its joints."
)


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

    def traced(leg: CutLeg, stage: Stage, progress: Progress) -> TraceAnswer:
        library = leg_effects(leg.rig, files, without)
        asked = (files, without, several, jobs)
        return trace_answer(leg.campaign, leg.rig, library, stage, progress, *asked, learns=False)

    return _outcome(platform, wrench, each_leg(legs, stage, progress, traced))


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


def legs_page(platform: Platform, wrench: WrenchAnswer, answers: Sequence[TraceAnswer]) -> tuple[Page, Figure]:
    """The page and its telling figure, from the answer of every leg [6] and that on joints and payload."""
    legs = [answer.outcome.metrics for answer in answers]
    marked = suspected(legs)
    picture = _by_leg(answers)
    own = [section for i in marked for section in leg_sections(i + 1, answers[i].outcome.page, _OF_ONE_JACK)]
    said = f"{sentence(legs, {i: answers[i].sentence for i in marked})} {wrench_sentence(wrench.told)}".rstrip()
    said += payload_sentence(payload_numbers(platform, wrench.payload))
    campaign = answers[0].trace.problem.campaign.path.resolve().name
    title = f"{campaign} on {platform.name}: which leg, and what its model lacks"
    pointed = sorted({*marked, *pointed_at(wrench.told)})
    sections = [Section("Legs", [_scene(platform, answers, pointed), picture, _table(answers)])]
    sections += [Section("Joints and payload", [*wrench_items(wrench), payload_table(platform, wrench.payload)]), *own]
    return Page(title, said, sections), picture


def _by_leg(answers: Sequence[TraceAnswer]) -> Figure:
    """chi2 of every leg before and after; the gate above which a leg is searched."""
    before, after = ([answer.chi2[key] or np.nan for answer in answers] for key in ("before", "after"))
    gates = [gate(answer.trace.problem.deviation(answer.trace.heldout[0].samples)) for answer in answers]
    ends = 0.9, 1.2 * float(np.nanmax([*before, *after, 1.5]))
    curves = {"as its numbers fit": (before, BEFORE), "with what was named": (after, AFTER)}
    return chi2_figure(curves, (Mark(max(gates), "something is missing above"),), ends)


def _table(answers: Sequence[TraceAnswer]) -> Table:
    rows = [
        [f"leg {i}", answer.verdict, " + ".join(answer.effects) or None, answer.chi2["before"], answer.chi2["after"]]
        for i, answer in enumerate(answers, 1)
    ]
    return Table("What each leg lacks", ["leg", "verdict", "effects", "chi2 before", "after"], rows, _HOW)


def _scene(platform: Platform, answers: Sequence[TraceAnswer], marked: Collection[int]) -> Scene:
    """The platform as it moves in the first held-out record, by the measured lengths of its legs."""
    records = [answer.trace.problem.heldout.records[0] for answer in answers]
    stride = max(1, round(_FRAME / records[0].period))
    positions = np.column_stack([record.signals["position"][::stride] for record in records])
    poses = platform.poses(positions)
    names = ", ".join(f"leg {i + 1}" for i in sorted(marked))
    note = f"{names.capitalize()} stands out: something is missing from its model. " if len(marked) == 1 else ""
    note = f"{names.capitalize()} stand out: something is missing from their models. " if len(marked) > 1 else note
    note += f"Record {records[0].name}, poses by the measured lengths of the legs, drawn {_LARGER:g} times larger."
    takes = {records[0].name: _LARGER * poses}
    return platform_scene("The platform in the held-out record", platform, takes, _FRAME, note, marked=set(marked))


def sentence(legs: Sequence[Answer], said: Mapping[int, str]) -> str:
    """Which leg lacks what, each with what its own trace `said`, by leg from 0; and which follow their records."""
    order = suspected(legs)
    words = [f"Leg {i + 1}: {' '.join(filter(None, (_names(legs[i]), said[i])))}" for i in order]
    others = [str(i + 1) for i in range(len(legs)) if i not in order]
    if not order:
        return "No leg lacks anything that these records could show: each follows them to its own noise."
    if others:
        words.append(f"Nothing is missing from {'leg' if len(others) == 1 else 'legs'} {listed(others)}.")
    return " ".join(words)


def _names(leg: Answer) -> str:
    """What a leg lacks, in a few words: "main.deadband."; nothing where only a number is another one."""
    if leg["verdict"] not in NAMING:
        return "unknown." if leg["verdict"] == "unknown" else ""
    return listed(leg["effects"], "or" if leg["verdict"] == "tied" else "and") + "."


def pointed_at(told: Mapping[str, Any]) -> list[int]:
    """The legs, counted from 0, whose joints are named."""
    return [int(name[3]) - 1 for name in told["effects"] if name.startswith("leg")]


def wrench_sentence(told: Mapping[str, Any]) -> str:
    """What joints and payload lack, in a sentence; nothing where they lack nothing."""
    before, after = told["chi2"]["before"], told["chi2"]["after"]
    if told["verdict"] == "none":
        return ""
    if told["verdict"] is None:
        return "Joints are not judged."
    if told["verdict"] == "unknown":
        return (
            f"Legs and payload do not balance (chi2 {before:.3g}), and no joint's friction, play or place, nor a "
            "payload that gives way, explains most of it."
        )
    names = listed(told["effects"], "or" if told["verdict"] == "tied" else "and")
    end = " Something else is missing besides." if told["verdict"] == "incomplete" else ""
    return f"Joints and payload: {names} (chi2 {before:.3g} to {after:.3g}).{end}"


def wrench_items(wrench: WrenchAnswer) -> list[Any]:
    """A figure by frequency and a table of candidates; one line where nothing could be judged."""
    if wrench.trace is None:
        return [_NO_RECORD if wrench.cells else _NO_CELLS]
    items: list[Any] = [_figure(wrench.trace)]
    if wrench.told["ranking"]:
        items.append(_candidates(wrench))
    if wrench.trace.not_shown:
        items.append(
            f"Not shown by these records, in which these legs push all the time: {listed(wrench.trace.not_shown)}."
        )
    return items


def _figure(trace: WrenchTrace) -> Figure:
    (f, before), (_, after) = trace.before.spectrum(), trace.after.spectrum()
    curves = [Curve("payload fitted", f, _smooth(before), "line", BEFORE)]
    if trace.after is not trace.before:
        curves.append(Curve("with what was named", f, _smooth(after), "line", AFTER))
    panel = Panel("held-out chi2 [1]", curves, log_y=True, marks=(Mark(1.0, "noise"),))
    return Figure("The balance of the wrench by frequency", "frequency [Hz]", [panel])


def _smooth(power: np.ndarray) -> np.ndarray:
    """Over five lines."""
    return np.convolve(np.pad(power, 2, mode="edge"), np.full(5, 0.2), "valid")


def _candidates(wrench: WrenchAnswer) -> Table:
    rows = []
    for row in wrench.told["ranking"]:
        for label, (value, low, high) in row["parameters"].items():
            cells = [value, None, None] if low is None else list(within(value, low, high))
            rows.append([row["effect"], row["formula"], row["explained"], label, *cells])
    return Table(
        "What joints and payload may show",
        ["effect", "formula", "explained", "number", "value", "95 % low", "95 % high"],
        rows,
        _NOTE,
    )
