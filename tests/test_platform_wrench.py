"""Joints and payload of a platform: what they do in the plant, and what their trace says of them."""

import re
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from workbench import InputError
from workbench.cli import main
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.record.platform import platform_plan, run_platform_record
from workbench.commands.trace.payload import payload_numbers
from workbench.commands.trace.platform import pointed_at, wrench_sentence
from workbench.identify.found.wrench import wrench_answer
from workbench.identify.trace.problem import estimation_problem
from workbench.identify.trace.refit import fit_rig
from workbench.identify.wrench.candidates import leg_candidates, with_joint
from workbench.identify.wrench.fitted import fit_payload
from workbench.identify.wrench.leg_cut import cut_legs, payload_problem, whole_campaigns
from workbench.identify.wrench.lines import line_noise, lines
from workbench.linear.platform_modes import platform_equilibrium, platform_modes
from workbench.plant import build_platform
from workbench.rigs.platform import AXES, load_platform, platform_effect
from workbench.rigs.platform.platform_file import load_platform as read, platform_text

PLATFORM = load_platform("hexapod")
MOMENT, LEG = 90.0, 3
MOVED, BY = 5, np.array([0.008, -0.006, 0.005])
PARTS = """rig = "hexapod"
[records]
static = ["static.csv"]
train = [{file = "fast.csv", from = 0.5, to = 4.0}, {file = "slow.csv", from = 1.0, to = 4.0}]
heldout = [{file = "mixed.csv", from = 0.5, to = 4.0}]
"""


def hertz(platform):
    plant = build_platform(platform)
    smooth = plant.without_dry_friction()
    return np.array([m.hz for m in platform_modes(platform, plant, platform_equilibrium(plant, None, smooth), smooth)])


def powers(platform):
    """Power [k] that the wrench of joints gives the platform in random motion, W, by what they add to accelerations."""
    rigid, own = build_platform(PLATFORM), build_platform(platform)
    random = np.random.default_rng(0)
    found = []
    for _ in range(20):
        x = platform_equilibrium(rigid).x.copy()
        pose, twist = rigid.state(AXES[0]), rigid.state("velocity_x")
        x[pose : pose + 6], x[twist : twist + 6] = 0.05 * random.standard_normal(6), 0.3 * random.standard_normal(6)
        u = np.zeros(len(rigid.inputs))
        rates = [np.array(plant.f(x, u, plant.p)).ravel()[twist : twist + 6] for plant in (rigid, own)]
        found.append(float((rates[1] - rates[0]) @ mass_matrix(rigid, x) @ x[twist : twist + 6]))
    return np.array(found)


def mass_matrix(plant, x):
    """By the accelerations that a unit of wrench gives."""
    symbols = ca.MX.sym("u", len(plant.inputs))
    first = plant.state("velocity_x")
    slopes = ca.jacobian(plant.f(x, symbols, plant.p), symbols)
    columns = ca.Function("slopes", [symbols], [slopes])(np.zeros(len(plant.inputs)))
    wrench = plant.input("force_x")
    return np.linalg.inv(np.array(columns)[first : first + 6, wrench : wrench + 6])


def test_friction_of_joints_only_takes_energy():
    """In any pose and motion, all of it in proportion to its moment."""
    one, two = (
        powers(replace(PLATFORM, effects=(platform_effect("joint.friction", LEG, moment=m),))) for m in (50.0, 100.0)
    )
    assert np.all(one < 0)
    assert two == pytest.approx(2 * one, rel=1e-6)


def test_a_stiff_joint_and_a_stiff_payload_are_rigid():
    """Modes go to those of rigid bodies as what gives way gets stiff; a mass on springs at 12 Hz parts them."""
    rigid = hertz(PLATFORM)
    play = platform_effect("joint.play", LEG, width=1e-4, stiffness=1e11, damping=0.2)
    part = {"mass": 800.0, "damping": 0.02, "height": 1.0}
    stiff = platform_effect("payload.flexible", 0, frequency=900.0, **part)
    soft = platform_effect("payload.flexible", 0, frequency=12.0, **part)
    assert hertz(replace(PLATFORM, effects=(play,))) == pytest.approx(rigid, rel=2e-3)
    assert hertz(replace(PLATFORM, effects=(stiff,))) == pytest.approx(rigid, rel=2e-3)
    assert np.abs(hertz(replace(PLATFORM, effects=(soft,))) / rigid - 1).max() > 0.1


def test_effects_of_joints_are_read_back_shown_and_checked(tmp_path, capsys):
    made = replace(PLATFORM, effects=(platform_effect("joint.friction", LEG, moment=MOMENT),))
    file = tmp_path / "found.toml"
    text = platform_text(made, ["jack-10t"] * 6)
    file.write_text(text)
    (effect,) = read(file).effects
    assert (effect.label, effect.numbers["moment"].value) == ("leg3.joint.friction", MOMENT)
    main(["show", str(file)])
    assert "Effect leg3.joint.friction" in capsys.readouterr().out
    for old, new, said in (
        ("joint.friction", "joint.frction", "joint.friction"),
        ("leg = 3", "leg = 9", "from 1 to 6"),
        (f"value = {MOMENT}", "value = -1.0", "outside"),
    ):
        file.write_text(text.replace(old, new))
        with pytest.raises(InputError, match=said):
            read(file)


def test_lines_of_noise_that_grows_with_frequency_come_out_white():
    """Positions with white noise, differentiated twice: over the noise at rest, every part of the band counts alike."""
    random = np.random.default_rng(1)
    rest, moving = (np.gradient(np.gradient(random.standard_normal((n, 6)), axis=0), axis=0) for n in (2000, 8000))
    noise = line_noise(*lines(rest, 1e-3))
    f, values = lines(moving, 1e-3)
    whitened = noise.over(f, values).reshape(2, f.size, 6)
    for part in np.array_split(whitened, 3, axis=1):
        assert np.mean(part**2) == pytest.approx(1.0, abs=0.2)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A platform with friction in the joints of leg 3 and the base joint of leg 5 elsewhere, of which its campaign says
    nothing."""
    folder = tmp_path_factory.mktemp("joints")
    plan = platform_plan("hexapod", 2)
    made = with_joint(plan.platform, MOVED - 1, "base", BY)
    made = replace(made, effects=(platform_effect("joint.friction", LEG, moment=MOMENT),))
    for name, text in run_platform_record(replace(plan, platform=made), no_checkpoint, lambda _: None).files.items():
        (folder / name).write_text(text)
    (folder / "campaign.toml").write_text(PARTS)
    return folder


@pytest.fixture(scope="module")
def answer(folder):
    return wrench_answer(payload_problem(PLATFORM, whole_campaigns(folder)))


def test_two_joints_are_named_with_their_numbers(answer):
    """Friction and place within one and a half 95 % intervals and 2 %, and the payload's mass within 0.1 %."""
    told = answer.told
    assert sorted(told["effects"]) == ["leg3.joint.friction", "leg5.base.place"]
    assert told["verdict"] == "named"
    assert told["chi2"]["before"] > 2 > 1.3 > told["chi2"]["after"]
    numbers = {row["effect"]: row["parameters"] for row in told["ranking"][:2]}
    true = {"moment [N m]": MOMENT} | dict(zip(("dx [m]", "dy [m]", "dz [m]"), BY.tolist(), strict=True))
    for name, (value, low, high) in {k: v for each in numbers.values() for k, v in each.items()}.items():
        assert abs(value - true[name]) < 1.5 * (high - low) / 2 + 0.02 * abs(true[name]), name
    assert answer.payload.values[0] == pytest.approx(PLATFORM["mass"], rel=1e-3)
    assert pointed_at(told) in ([2, 4], [4, 2])
    assert wrench_sentence(told).startswith("Joints and payload: ")


def test_play_is_no_candidate_of_a_joint_that_is_only_pushed(folder):
    signals = payload_problem(PLATFORM, whole_campaigns(folder)).signals["static"]
    assert not [each for each in leg_candidates(signals) if each.name.endswith("joint.play")]


def test_legs_without_load_cells_follow_what_the_payload_asks(folder, tmp_path):
    """Without them the payload's mass comes from pressures, and the other five legs are jacks as declared still, to a
    noise that is foretold."""
    for file in folder.iterdir():
        (tmp_path / file.name).write_text(re.sub(r"leg(\d)\.force ", r"cell\1 ", file.read_text()))
    whole = whole_campaigns(tmp_path)
    bare = wrench_answer(payload_problem(PLATFORM, whole))
    assert bare.trace is None
    assert (bare.told["verdict"], bare.told["chi2"]["before"]) == (None, None)
    assert wrench_sentence(bare.told) == "Joints are not judged."
    assert bare.payload.values[0] == pytest.approx(PLATFORM["mass"], rel=2e-3)
    leg = cut_legs(PLATFORM, whole)[0]
    problem = estimation_problem(leg.campaign, leg.rig)
    fit = fit_rig(problem)
    assert not problem.misses(fit.chi2, fit.samples)
    assert leg.rig["M"] > 1000


def test_records_that_hardly_move_contradict_no_number_of_the_payload(folder):
    """At rest nothing is told of inertia, whatever a fit makes of the noise."""
    still = [replace(campaign, train=campaign.static) for campaign in whole_campaigns(folder)]
    assert payload_numbers(PLATFORM, fit_payload(payload_problem(PLATFORM, still))) == []
