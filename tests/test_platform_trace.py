"""Which leg, and which effect: a platform's campaign traced leg by leg, and the answers of six legs as one."""

import json
import re
from collections import Counter
from dataclasses import replace

import pytest

from experiments.studies.trace.platforms import DrawnPlatform, platform_draws
from experiments.studies.trace.score import judged, odds
from workbench.cli import main
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.common.platform_scene import MARK
from workbench.commands.record import platform as record
from workbench.commands.record.platform import platform_plan
from workbench.commands.trace.platform import leg_effects, sentence
from workbench.identify.found.legs import platform_answer, suspected
from workbench.plant.effects import find, known_effects
from workbench.rigs.number import Number
from workbench.rigs.platform import load_platform
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

PARTS = """rig = "hexapod"
[records]
static = ["static.csv"]
train = [{file = "slow.csv", from = 1.0, to = 4.0}]
heldout = [{file = "mixed.csv", from = 1.0, to = 3.0}]
"""


def leg(verdict="none", effects=(), before=1.0, after=1.0, ranking=(), numbers=()):
    """What a trace says of one leg."""
    return {
        "verdict": verdict,
        "effects": list(effects),
        "equation": None if verdict == "none" else "force",
        "chi2": {"before": before, "after": after},
        "rms": {"pa [bar]": {"before": before, "after": after, "floor": 1.0}},
        "ranking": [{"effect": name, "formula": "", "explained": share, "parameters": {}} for name, share in ranking],
        "learned": [],
        "numbers": list(numbers),
    }


BALANCED = {**leg(), "tied": {}, "not_shown": []}  # what is said of joints and payload that lack nothing


def declared(name, formula):
    """An effect as a rig declares it, at its typical numbers."""
    numbers = {n.name: Number(n.name, n.typical, n.si, n.si, "made here") for n in find(name, formula).numbers}
    return EffectUse(name, formula, numbers)


def test_the_answers_of_six_legs_are_one_that_says_the_leg():
    named = leg("named", ["main.deadband"], 9.0, 1.0, [("main.deadband", 1.0), ("jack.friction", 0.4)])
    tied = leg("tied", ["drive.lag", "drive.delay"], 3.0, 1.0, [("drive.lag", 0.9)])
    legs = [leg(), tied, leg(), named, leg(), leg()]
    answer = platform_answer(legs, BALANCED)
    assert suspected(legs) == [3, 1]
    assert answer["verdict"] == "tied"
    assert answer["effects"] == ["leg4.main.deadband", "leg2.drive.lag", "leg2.drive.delay"]
    assert [row["effect"] for row in answer["ranking"]] == [
        "leg4.main.deadband", "leg2.drive.lag", "leg4.jack.friction"
    ]  # fmt: skip
    assert [row["explained"] for row in answer["ranking"]] == pytest.approx([0.8, 0.18, 0.32])
    assert answer["chi2"] == pytest.approx({"before": 16 / 6, "after": 1.0})
    assert answer["rms"]["leg4.pa [bar]"]["before"] == 9.0
    said = sentence(legs, {1: "", 3: ""})
    assert said.startswith("Leg 4: main.deadband. Leg 2: drive.lag or drive.delay.")
    assert said.endswith("Nothing is missing from legs 1, 3, 5 and 6.")


def test_a_balance_that_was_not_judged_says_nothing_and_takes_no_share():
    unjudged = {**BALANCED, "verdict": None, "chi2": {"before": None, "after": None}}
    legs = [leg()] * 5 + [leg("named", ["jack.friction"], 5.0, 1.0, [("jack.friction", 1.0)])]
    answer = platform_answer(legs, unjudged)
    assert (answer["verdict"], answer["effects"]) == ("named", ["leg6.jack.friction"])
    assert answer["ranking"][0]["explained"] == pytest.approx(1.0)
    assert answer["wrench"]["verdict"] is None
    truth = DrawnPlatform(1, "single", ((6, "jack.friction", "coulomb"),)).known()
    assert judged(truth, answer)["chi2_before"] == 5.0


@pytest.mark.parametrize(
    ("verdicts", "whole"),
    [
        ([], "none"),
        (["named", "named"], "named"),
        (["named", "unknown"], "incomplete"),
        (["named", "incomplete"], "incomplete"),
        (["unknown"], "unknown"),
        (["tied", "named"], "tied"),
    ],
)
def test_the_verdict_is_no_more_certain_than_that_of_any_leg(verdicts, whole):
    legs = [leg(verdict, ["jack.friction"] if verdict != "unknown" else [], 5.0) for verdict in verdicts]
    assert platform_answer(legs + [leg()] * (6 - len(legs)), BALANCED)["verdict"] == whole


def test_a_leg_lacks_nothing_that_acts_on_what_it_moves():
    rig = load_rig("jack-10t")
    able = {effect.name for effect in leg_effects(rig)}
    assert {"jack.friction", "main.deadband", "drive.delay", "oil.air", "sensor.lag"} <= able
    outside = {effect.name for effect in known_effects() if effect.name.startswith("load.")}
    assert outside
    assert not outside & able


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """A recorded platform with dry friction in leg 4, of which the campaign says nothing; parts of its records."""
    folder = tmp_path_factory.mktemp("platform")
    plan, (_, slow, mixed) = platform_plan("hexapod", 2), record.MOTIONS
    rubbing = replace(plan.platform.legs[3].rig, effects=(declared("jack.friction", "coulomb"),))
    legs = [replace(leg, rig=rubbing) if i == 3 else leg for i, leg in enumerate(plan.platform.legs)]
    made = replace(plan, platform=replace(plan.platform, legs=tuple(legs)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(record, "MOTIONS", (replace(slow, seconds=4.0), replace(mixed, seconds=3.0)))
        files = record.run_platform_record(made, no_checkpoint, lambda _: None).files
    for name, text in files.items():
        (folder / name).write_text(text)
    (folder / "campaign.toml").write_text(PARTS)
    return folder


def test_a_trace_names_the_leg_and_the_effect(campaign, tmp_path):
    rivals = {"jack.friction", "jack.external_leakage"}
    others = sorted({effect.name for effect in leg_effects(load_platform("hexapod").legs[0].rig)} - rivals)
    main(["trace", str(campaign), "--out", str(tmp_path / "out"), "--jobs", "1", "--without", *others])
    answer = json.loads((tmp_path / "out" / "trace.json").read_text())
    assert (answer["verdict"], answer["effects"]) == ("named", ["leg4.jack.friction"])
    assert [each["verdict"] for each in answer["legs"]] == ["none"] * 3 + ["named"] + ["none"] * 2
    value, low, high = answer["ranking"][0]["parameters"]["Fc [N]"]
    assert low < 800.0 < high
    assert value == pytest.approx(800.0, rel=0.05)
    assert answer["rms"]["leg4.pa [bar]"]["after"] < 1.2 * answer["rms"]["leg4.pa [bar]"]["floor"]
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Leg 4: jack.friction." in page
    marked = [number for colour, number in re.findall(r'<text [^>]*fill="([^"]*)">(\d)</text>', page) if colour == MARK]
    assert marked == ["4"]
    assert len(re.findall(r"<text [^>]*>[1-6]</text>", page)) == 6
    assert (tmp_path / "out" / "leg4.toml").exists()


def test_what_a_study_of_platforms_draws_and_scores():
    """One effect, two in two legs, or none, by seed; no command late in one leg alone; a leg that is another one is
    wrong though the name is right."""
    draws = platform_draws(20, 7)
    assert Counter(each.kind for each in draws) == {"single": 12, "clean": 4, "pair": 4}
    assert draws == platform_draws(20, 7)
    for each in draws:
        assert len({leg for leg, _, _ in each.effects}) == {"clean": 0, "single": 1, "pair": 2}[each.kind]
        assert not any(find(name, formula).delay for _, name, formula in each.effects)
    truth = DrawnPlatform(1, "single", ((4, "jack.friction", "coulomb"),)).known()
    said = [leg()] * 3 + [leg("named", ["jack.friction"], 5.0, 1.0, [("jack.friction", 1.0)])] + [leg()] * 2
    for legs, result in ((said, "right"), ([*said[1:], said[0]], "wrong"), ([leg()] * 6, "right")):
        row = judged(truth, platform_answer(legs, BALANCED))
        assert row["result"] == result
    assert row["group"] == "faint"
    assert odds([row]) == []
