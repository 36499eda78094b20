"""The report of a platform's trace: the platform with the suspected legs marked, chi2 by leg, and why each is one."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from ...base.words import listed
from ...identify.found.legs import NAMING, Answer, suspected
from ...identify.found.wrench import WrenchAnswer
from ...identify.trace.rule import gate
from ...report import Figure, Mark, Page, Scene, Section, Table
from ...rigs.platform import Platform
from ..common.error_page import AFTER, BEFORE
from ..common.legs import chi2_figure
from ..common.platform_scene import leg_labels, platform_lines
from .answer import TraceAnswer
from .payload import payload_numbers, payload_sentence, payload_table
from .words import FREE_RUN, RETUNE
from .wrench_items import pointed_at, wrench_items, wrench_sentence

_FRAME = 0.02  # s
_LARGER = 5.0  # times the motion is drawn
_OF_ONE_JACK = (RETUNE, FREE_RUN)  # advice that no platform can follow
_HOW = (
    "Each leg is a jack that carries its rod under the force that its load cell measured, or, without load cells, what "
    "it alone moves under the rest of what the payload's motion asks: platform, payload and the other legs act in that "
    "force and in none of the errors. chi2 is that of the held-out records, and 1 is the noise "
    "floor; before: the leg's numbers fitted; after: with what was named."
)


def legs_page(platform: Platform, wrench: WrenchAnswer, answers: Sequence[TraceAnswer]) -> tuple[Page, Figure]:
    """The page and its telling figure, from the answer of every leg [6] and that on joints and payload."""
    legs = [answer.outcome.metrics for answer in answers]
    marked = suspected(legs)
    picture = _by_leg(answers)
    own = [
        Section(f"Leg {i + 1}: {section.title}", items)
        for i in marked
        for section in answers[i].outcome.page.sections
        if (items := [item for item in section.items if item not in _OF_ONE_JACK])
    ]
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
    still = int(np.argmax(np.abs(poses).max(axis=1)))
    names = ", ".join(f"leg {i + 1}" for i in sorted(marked))
    note = f"{names.capitalize()} stands out: something is missing from its model. " if len(marked) == 1 else ""
    note = f"{names.capitalize()} stand out: something is missing from their models. " if len(marked) > 1 else note
    note += f"Record {records[0].name}, poses by the measured lengths of the legs, drawn {_LARGER:g} times larger."
    lines = platform_lines(platform, _LARGER * poses, set(marked))
    return Scene(
        "The platform in the held-out record",
        {records[0].name: lines},
        _FRAME,
        note,
        still,
        leg_labels(platform, marked),
    )


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
