"""What a platform should move next: effects that a slow heave leaves alike, the motion that a plan asks for, and what
the legs tell when it has been played."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.base.process_pool import one_blas_thread
from workbench.cli import main
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.common.platform_motion import file_motion
from workbench.commands.plan import platform, study
from workbench.commands.plan.fitted import fitted_campaign, told
from workbench.commands.plan.page import _label
from workbench.commands.plan.platform import run_platform_plan
from workbench.commands.plan.platform_page import _strays
from workbench.commands.record.platform import platform_plan, run_platform_record
from workbench.identify.fit.free_parameters import Candidate, at_strength
from workbench.identify.plan.motions import MOTIONS, PlannedMotion
from workbench.identify.plan.platform_played import as_played, with_effect_in
from workbench.identify.trace import problem
from workbench.identify.trace.information import cosines, effects_alone
from workbench.identify.wrench.leg_cut import cut_legs, whole_campaigns
from workbench.plant.effects import find
from workbench.records.frequency_sheet import table_text
from workbench.report import render
from workbench.rigs.platform import AXES, LEGS, load_platform

PLATFORM = load_platform("hexapod")
LATE, INTEGRAL = find("drive.delay", "shift"), find("drive.corrector", "pi")
DESIGNS = tuple(design for design in MOTIONS if design.name in ("sines-wide", "heave-creep"))
SLOW = """rig = "hexapod"
[records]
static = ["static.csv"]
train = [{file = "slow.csv", from = 0.6, to = 3.4}]
heldout = [{file = "slower.csv", from = 0.6, to = 3.4}]
"""


def played(folder, files):
    """What a platform whose commands are late logs of files of poses, as files in a folder."""
    plan = platform_plan("hexapod", 2, [folder / name for name in files])
    late = with_effect_in(PLATFORM, 3, Candidate(LATE, at_strength(LATE, 1.0)))
    outcome = run_platform_record(replace(plan, platform=late), no_checkpoint, lambda _: None)
    for name, text in outcome.files.items():
        (folder / name).write_text(text)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A campaign of slow heaves, by which no leg can tell a late command from a corrector."""
    out = tmp_path_factory.mktemp("slow")
    t = np.arange(0.0, 3.01, 0.05)
    for name, size in (("slow", 0.02), ("slower", 0.014)):
        (out / f"{name}.csv").write_text(table_text({"t": t, "heave": size * np.sin(2 * np.pi * t / 3)}))
    played(out, ["slow.csv", "slower.csv"])
    (out / "campaign.toml").write_text(SLOW)
    return out


@pytest.fixture(scope="module")
def plan(folder):
    """By what all legs tell, for the pairs of two of them."""
    whole = whole_campaigns(folder)
    legs = cut_legs(PLATFORM, whole)

    def for_two(parts, *others):
        return study.planned_next({name: parts[name] for name in ("leg2.", "leg4.")}, *others)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(platform, "planned_next", for_two)
        patch.setattr(problem, "check_columns", lambda *_: None)
        return run_platform_plan(PLATFORM, whole, legs, no_checkpoint, lambda _: None, (LATE, INTEGRAL), DESIGNS)


def test_effects_that_look_alike_in_a_leg_are_split_by_the_motion_that_is_planned(plan):
    """As it is expected, and as it comes out when the motion is played with an effect on."""
    pairs = [pair for pair in plan.metrics["pairs"] if pair["effects"][0].startswith("leg4.")]
    assert [set(pair["effects"]) for pair in pairs] == [{"leg4.drive.delay", "leg4.drive.corrector"}]
    (pair,) = pairs
    assert pair["cosine"] > 0.8
    assert pair["best"] == "sines-wide"
    assert pair["after"]["sines-wide"] < 0.3
    assert pair["played"]["cosine"] == pytest.approx(pair["after"]["sines-wide"], abs=0.1)
    first, second = pair["effects"]
    assert pair["played"][first] > 0.7 > 0.1 > pair["played"][second]
    assert plan.metrics["records"][0]["axes"] == list(AXES)
    assert all(pair["effects"] in plan.metrics["records"][0]["splits"] for pair in plan.metrics["pairs"])


def test_legs_that_follow_their_records_are_all_planned_for(plan):
    assert [row["leg"] for row in plan.metrics["legs"]] == [1, 2, 3, 4, 5, 6]
    assert all(row["planned"] and row["follows"] for row in plan.metrics["legs"])
    assert plan.page.verdict.startswith("Each leg follows its records.")


@pytest.mark.usefixtures("right_columns")
def test_the_planned_motion_splits_the_pair_on_the_platform_that_has_the_effect(plan, folder, tmp_path):
    """The file is played by a platform whose commands are late, and added to the campaign: the cosine of the pair has
    fallen as the plan said."""
    (pair,) = [pair for pair in plan.metrics["pairs"] if pair["effects"][0].startswith("leg4.")]
    for file in folder.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    (tmp_path / f"{pair['best']}.csv").write_text(plan.files[f"{pair['best']}.csv"])
    played(tmp_path, [f"{pair['best']}.csv"])
    (tmp_path / "campaign.toml").write_text(SLOW.replace("train = [", f'train = ["{pair["best"]}.csv", '))
    with one_blas_thread():
        leg, silent = cut_legs(PLATFORM, whole_campaigns(tmp_path))[3], (no_checkpoint, lambda _: None)
        now = told(fitted_campaign(leg.campaign, leg.rig, (LATE, INTEGRAL), *silent), *silent)
    likeness = cosines(effects_alone(now.now, now.effects.model_fit.fit))
    assert likeness[0, 1] == pytest.approx(pair["after"][pair["best"]], abs=0.15)
    assert now.fitted.misses


def test_the_report_says_which_motion_is_for_which_legs(plan):
    text = render(plan.page)
    assert plan.metrics["records"][0]["file"] in plan.page.verdict
    assert "which tells leg" in plan.page.verdict
    for said in (
        "What each leg needs",
        "The platform in the best motion",
        "Cosine after each motion",
        "--play FILE.csv",
    ):
        assert said in text


@pytest.mark.parametrize("design", MOTIONS, ids=lambda design: design.name)
def test_a_motion_is_left_as_a_file_that_is_played_as_it_was_planned(design, tmp_path):
    """From home and back, of its size at the joints; a file of it is read as the poses that were simulated."""
    motion = PlannedMotion.sized(design, PLATFORM, 0.01)
    assert np.abs(motion.course[[0, -1]]).max() * PLATFORM.geometry.weights.max() < 1e-4
    joints = np.abs(motion.course).max(axis=0) * PLATFORM.geometry.weights
    moving = [axis in design.axes for axis in AXES]
    assert joints == pytest.approx(np.where(moving, 0.01, 0.0))
    (tmp_path / "motion.csv").write_text(table_text(motion.columns()))
    assert file_motion(tmp_path / "motion.csv", PLATFORM).pose == pytest.approx(as_played(PLATFORM, motion), abs=1e-9)


def test_a_late_command_is_late_in_all_legs_and_another_effect_in_its_own():
    late, own = (Candidate(effect, at_strength(effect, 1.0)) for effect in (LATE, INTEGRAL))
    assert [len(leg.rig.effects) for leg in with_effect_in(PLATFORM, 3, late).legs] == [1] * LEGS
    assert [len(leg.rig.effects) for leg in with_effect_in(PLATFORM, 3, own).legs] == [0, 0, 0, 1, 0, 0]


def test_the_page_says_which_legs_miss_something_and_names_the_leg_of_a_pair_once():
    legs = [{"leg": i, "follows": i not in (2, 4)} for i in range(1, LEGS + 1)]
    assert _strays({"legs": legs}) == "Legs 2 and 4 miss something. "
    assert _strays({"legs": legs[2:]}) == "Leg 4 misses something. "
    assert _label(["leg4.drive.lag", "leg4.drive.delay"]) == "leg4.drive.lag / drive.delay"
    assert _label(["drive.lag", "drive.delay"]) == "drive.lag / drive.delay"


def test_a_sheet_of_a_platform_s_campaign_is_refused_in_one_line(folder, tmp_path, capsys):
    assert main(["plan", str(folder), "--for", "valve-test", "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "--for valve-test is for one jack" in line
    assert not (tmp_path / "out").exists()
