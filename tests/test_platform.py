"""A platform on six jacks: kinematics, energy, equilibrium, modes, against formulas and against finite differences."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from workbench import InputError, load_rig
from workbench.engine import Engine
from workbench.linear.platform_modes import decoupling, platform_equilibrium, platform_modes
from workbench.loop.capability import oil_stiffness
from workbench.loop.platform.reach import MOST_CONDITION, check_poses, outline, reach, static_forces, worst_poses
from workbench.plant import build_platform
from workbench.rigs.platform import AXES, forward, leg_lengths, leg_speeds, load_platform, pose_rates
from workbench.rigs.platform.kinematics import condition, joint_angles, leg_vectors, rotation

HEXAPOD = load_platform("hexapod")
MASSLESS = HEXAPOD.without_leg_inertia()
LIMITS = np.array([0.15, 0.15, 0.15, 0.15, 0.15, 0.15])
TURNED = np.array([0.06, -0.04, 0.05, 0.05, -0.08, 0.06])


@pytest.fixture(scope="module")
def plant():
    return build_platform(HEXAPOD)


def test_legs_are_at_mid_stroke_at_home():
    assert leg_lengths(HEXAPOD.geometry, np.zeros(6)) == pytest.approx(HEXAPOD.middle, abs=2e-6)


@given(st.lists(st.floats(-1, 1), min_size=6, max_size=6))
@settings(max_examples=60, deadline=None)
def test_forward_kinematics_takes_inverse_kinematics_back(share):
    pose = np.array(share) * LIMITS
    assert forward(HEXAPOD.geometry, leg_lengths(HEXAPOD.geometry, pose)) == pytest.approx(pose, abs=1e-9)


@given(st.lists(st.floats(-1, 1), min_size=6, max_size=6))
@settings(max_examples=30, deadline=None)
def test_the_jacobian_is_the_slope_of_inverse_kinematics(share):
    pose, e = np.array(share) * LIMITS, 1e-6
    differences = [
        (leg_lengths(HEXAPOD.geometry, pose + e * d) - leg_lengths(HEXAPOD.geometry, pose - e * d)) / (2 * e)
        for d in np.eye(6)
    ]
    assert np.transpose(differences) @ pose_rates(pose) == pytest.approx(leg_speeds(HEXAPOD.geometry, pose), abs=1e-8)


def test_lengths_that_no_pose_has_are_refused():
    with pytest.raises(InputError, match="no pose"):
        forward(HEXAPOD.geometry, np.full(6, 0.5))


def test_a_search_from_a_singular_pose_is_refused():
    turned = np.array([0, 0, 0, 0, 0, np.pi / 2])
    with pytest.raises(InputError, match="no pose"):
        forward(HEXAPOD.geometry, leg_lengths(HEXAPOD.geometry, np.zeros(6)), turned)


def test_the_condition_grows_towards_a_singular_pose():
    turned = np.zeros((3, 6))
    turned[:, 5] = np.radians([0, 40, 88])  # about 90 degrees of yaw are singular where joints lie on two circles
    values = condition(HEXAPOD.geometry, turned)
    assert values[0] < values[1] < MOST_CONDITION < values[2]


def test_joint_angles_are_those_between_legs_and_home():
    base, joint = joint_angles(HEXAPOD.geometry, TURNED)
    home, legs = leg_vectors(HEXAPOD.geometry, np.zeros(6)), leg_vectors(HEXAPOD.geometry, TURNED)
    for i in range(6):
        own = legs[i] @ rotation(TURNED)
        for angle, leg in ((base[i], legs[i]), (joint[i], own)):
            assert np.cos(angle) == pytest.approx(leg @ home[i] / np.linalg.norm(leg) / np.linalg.norm(home[i]))


def kinetic_and_potential(pose, twist):
    """Energy [J] of payload and legs, each leg as two rigid rods."""
    p, turned, down = HEXAPOD, rotation(pose), HEXAPOD["gravity"]
    centre = turned @ np.array([p["cx"], p["cy"], p["cz"]])
    inertia = turned @ np.diag([p["Ixx"], p["Iyy"], p["Izz"]]) @ turned.T
    speed = twist[:3] + np.cross(twist[3:], centre)
    kinetic = p["mass"] * speed @ speed / 2 + twist[3:] @ inertia @ twist[3:] / 2
    potential = p["mass"] * down * (pose[2] + p["height"] + centre[2])
    joints = HEXAPOD.geometry.joints @ turned.T
    for leg, arm, vector in zip(p.legs, joints, leg_vectors(p.geometry, pose), strict=True):
        n = {name: number.value for name, number in leg.numbers.items()}
        length = np.linalg.norm(vector)
        along, end = vector / length, twist[:3] + np.cross(twist[3:], arm)
        turning = np.cross(along, end) / length
        halves = (
            ("cylinder", n["cylinder_centre"] * along, 0.0),
            ("rod", (length - n["rod_centre"]) * along, along @ end),
        )
        for half, place, sliding in halves:
            velocity = np.cross(turning, place) + sliding * along
            kinetic += n[f"{half}_mass"] * velocity @ velocity / 2 + n[f"{half}_inertia"] * turning @ turning / 2
            potential += n[f"{half}_mass"] * down * (np.array(leg.base) + place)[2]
    return kinetic + potential


def test_the_energy_grows_by_what_jacks_and_wrench_do(plant):
    rng = np.random.default_rng(3)
    first = plant.state(AXES[0])
    x = plant.start.copy()
    x[first : first + 6], x[first + 6 :] = TURNED, rng.uniform(-0.5, 0.5, 6)
    for i in range(6):
        x[plant.state(f"leg{i + 1}.P1")] += rng.uniform(-5e6, 5e6)
    u = np.append(np.zeros(6), rng.uniform(-1e4, 1e4, 6))
    rates, y = np.array(plant.f(x, u, plant.p)).ravel(), plant.observe(x, u)[0]
    pose, twist, e = TURNED, x[first + 6 :], 1e-6
    ahead, behind = (
        kinetic_and_potential(pose + h * rates[first : first + 6], twist + h * rates[first + 6 :]) for h in (e, -e)
    )
    legs = [
        y[plant.output(f"leg{i + 1}.velocity")]
        * (y[plant.output(f"leg{i + 1}.jack_force")] - leg.rig["b"] * y[plant.output(f"leg{i + 1}.velocity")])
        for i, leg in enumerate(HEXAPOD.legs)
    ]
    assert (ahead - behind) / (2 * e) == pytest.approx(sum(legs) + u[6:] @ twist, rel=1e-6)


def test_leg_signals_are_those_of_the_motion(plant):
    first, e = plant.state(AXES[0]), 1e-6
    x = plant.start.copy()
    x[first : first + 6], x[first + 6 :] = TURNED, np.array([0.3, -0.2, 0.4, 0.2, 0.3, -0.5])
    rates, u = np.array(plant.f(x, np.zeros(12), plant.p)).ravel(), np.zeros(12)
    y = plant.observe(x, u)[0]
    after, before = (plant.observe(x + h * rates, u)[0] for h in (e, -e))
    for name, slope in (("position", "velocity"), ("velocity", "acceleration")):
        for leg in ("leg1", "leg5"):
            found = (after - before)[plant.output(f"{leg}.{name}")] / (2 * e)
            assert found == pytest.approx(y[plant.output(f"{leg}.{slope}")], rel=1e-5)
    lengths = leg_lengths(HEXAPOD.geometry, TURNED) - HEXAPOD.middle
    assert [y[plant.output(f"leg{i + 1}.position")] for i in range(6)] == pytest.approx(lengths, abs=1e-12)


@pytest.mark.parametrize("pose", [np.zeros(6), TURNED], ids=["home", "turned"])
def test_an_equilibrium_holds_payload_and_legs_in_any_pose(plant, pose):
    rest = platform_equilibrium(plant, pose)
    rates = np.array(plant.f(rest.x, rest.u, plant.p)).ravel()
    assert np.abs(rates[plant.state(AXES[0]) :]).max() < 1e-6
    y = plant.observe(rest.x, rest.u)[0]
    forces = [y[plant.output(f"leg{i + 1}.jack_force")] for i in range(6)]
    assert forces == pytest.approx(static_forces(HEXAPOD, pose), rel=1e-6)
    lower = np.linalg.norm(forces) * 1e-5
    assert np.ptp(forces) < lower or pose is TURNED


def test_what_the_jacks_cannot_hold_is_refused(plant):
    with pytest.raises(InputError, match="no equilibrium"):
        platform_equilibrium(plant, force_z=-1e6)


def modes_of(platform):
    plant = build_platform(platform)
    smooth = plant.without_dry_friction()
    return platform_modes(platform, plant, platform_equilibrium(plant, p=smooth), smooth)


def test_modes_of_the_known_case():
    """4 t, 3.5, 3.5 and 4.5 t m2, radii 2.4 and 1.6 m, legs of 2.31 m without inertia."""
    modes = modes_of(MASSLESS)
    assert [mode.hz for mode in modes] == pytest.approx([16.0, 16.0, 23.2, 30.0, 30.0, 36.5], abs=0.1)
    assert all(0.015 < mode.zeta < 0.034 for mode in modes)
    largest = [AXES[int(np.argmax(np.abs(mode.shape)))] for mode in modes]
    assert sorted(largest[:2]) == ["surge", "sway"]
    assert sorted(largest[3:5]) == ["pitch", "roll"]
    assert largest[2] == "heave"
    assert largest[5] == "yaw"
    surge = modes[largest.index("surge")].shape
    assert abs(surge[AXES.index("pitch")]) > 0.4
    assert abs(surge[AXES.index("sway")]) < 1e-6


def test_symmetric_payload_gives_pairs_and_an_offset_parts_them():
    modes = modes_of(HEXAPOD)
    for i in (0, 3):
        assert modes[i].hz == pytest.approx(modes[i + 1].hz, rel=1e-5)
    moved = modes_of(HEXAPOD.with_values(cx=0.2))
    assert moved[1].hz - moved[0].hz > 0.01
    assert max(abs(mode.shape[2]) for mode in modes[:2]) < 1e-6
    assert max(abs(mode.shape[2]) for mode in moved[:2]) > 0.05


def test_heave_is_six_oil_springs_under_the_mass():
    steep = leg_speeds(MASSLESS.geometry, np.zeros(6))[:, 2]
    stiffness = sum(oil_stiffness(leg.rig) for leg in MASSLESS.legs) * np.mean(steep**2)
    hz = np.sqrt(stiffness / MASSLESS["mass"]) / (2 * np.pi)
    heave = next(mode for mode in modes_of(MASSLESS) if abs(mode.shape[2]) == 1.0)
    assert heave.hz == pytest.approx(hz, rel=2e-3)


def test_modal_masses_are_those_of_the_modes(plant):
    smooth = plant.without_dry_friction()
    rest = platform_equilibrium(plant, p=smooth)
    directions, masses = decoupling(plant, rest, smooth)
    assert directions.T @ directions == pytest.approx(np.eye(6), abs=1e-12)
    springs = oil_stiffness(HEXAPOD.legs[0].rig)
    modes = platform_modes(HEXAPOD, plant, rest, smooth)
    assert np.sqrt(springs / masses) / (2 * np.pi) == pytest.approx([mode.hz for mode in modes], rel=4e-3)


def test_legs_may_differ():
    first = HEXAPOD.legs[0]
    softer = first.rig.with_values(beta=0.6e9)
    uneven = replace(HEXAPOD, legs=(replace(first, rig=softer), *HEXAPOD.legs[1:]))
    assert modes_of(uneven)[2].hz < modes_of(HEXAPOD)[2].hz - 0.2


def test_the_linearisation_is_exact(plant):
    rest = platform_equilibrium(plant, TURNED)
    a = np.array(plant.slopes(rest.x, rest.u, plant.p)[0])
    for name in ("heave", "roll", "turning_y", "leg2.P1", "leg6.v3"):
        i = plant.state(name)
        e = 1e-6 * plant.scale[i]
        ahead, behind = (np.array(plant.f(rest.x + h * np.eye(plant.n)[i], rest.u, plant.p)).ravel() for h in (e, -e))
        scale = np.maximum(np.abs(a).max(axis=1), 1e-9)
        assert (ahead - behind) / (2 * e) / scale == pytest.approx(a[:, i] / scale, abs=2e-5)


def test_machine_code_runs_as_the_interpreter_does(plant):
    rest = platform_equilibrium(plant)
    t, u = np.arange(11) * 1e-3, np.tile(rest.u, (10, 1))
    u[:, 0] += 0.02
    u[:, 8] = -2e3
    runs = [Engine(plant, back_end=way, brief=True).run(rest.x, t, u) for way in ("compiled", "interpreted")]
    assert runs[0].x / plant.scale == pytest.approx(runs[1].x / plant.scale, abs=1e-10)
    assert runs[0]["leg1.position"][-1] > runs[0]["leg1.position"][0]
    assert runs[0].units["pitch"] == "rad"


def test_reach_keeps_the_limits_and_goes_no_further():
    ends = reach(HEXAPOD)
    for i, axis in enumerate(AXES):
        low, high = ends[axis]
        assert low < 0 < high
        for end, outward in ((low, -1), (high, 1)):
            poses = np.zeros((2, 6))
            poses[:, i] = end, end + outward * 1e-3
            assert check_poses(HEXAPOD, poses).allowed.tolist() == [True, False]
    x, y = outline(HEXAPOD, "surge", "heave", 8)
    assert x[0] == pytest.approx(ends["surge"][1], abs=1e-6)
    assert y[2] == pytest.approx(ends["heave"][1], abs=1e-6)


def test_the_worst_pose_has_the_worst_value():
    box, twist = np.full(6, 0.05), np.array([0.5, 0.5, 0.5, 0.0, 0.0, 0.0])
    worst = {found.name: found for found in worst_poses(HEXAPOD, box, twist, draws=50)}
    stroke = worst["stroke used"]
    assert stroke.value == pytest.approx(100 * check_poses(HEXAPOD, stroke.pose).stroke.max())
    assert np.abs(stroke.pose) == pytest.approx(box)
    slopes = leg_speeds(HEXAPOD.geometry, worst["flow of a leg"].pose)
    signs = ((1, 1, 1), (1, -1, 1), (-1, 1, 1), (-1, -1, 1))
    speeds = [np.abs(slopes @ (twist * np.append(sign, np.zeros(3)))).max() for sign in signs]
    assert worst["flow of a leg"].value == pytest.approx(6e4 * max(speeds) * HEXAPOD.legs[0].rig["Aj"])


def written(tmp_path: Path, change) -> Path:
    text = (Path(__file__).parents[1] / "workbench/rigs/platform/hexapod.toml").read_text()
    path = tmp_path / "own.toml"
    path.write_text(change(text))
    return path


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text.replace("mass = {value = 4,", "mass = {value = -4,", 1), "payload.mass"),
        (lambda text: text.replace("[payload]", "[payload]\nmas = 1"), "unknown key"),
        (lambda text: text[: text.rindex("[[leg]]")], "has 5 tables"),
        (lambda text: text.replace(", 0.0]", "]", 1), "three coordinates"),
        (lambda text: text.replace("at = [2.376643", "at = [1e6", 1), "outside -100 to 100 m"),
        (lambda text: text.replace('rig = "jack-10t"', 'rig = "jack-11t"'), "no bundled rig"),
        (lambda text: text.replace("[[leg]]", "[[leg]]\njack = {beta = 3}", 1), "leg.1.jack.beta"),
        (lambda text: text.replace('unit = "m", source = "radius 2.4', 'unit = "s", source = "radius 2.4', 1), "unit"),
    ],
)
def test_platform_files_are_read_strictly(tmp_path, change, said):
    with pytest.raises(InputError, match=said):
        load_platform(written(tmp_path, change))


def test_a_leg_may_have_numbers_of_its_own(tmp_path):
    own = '[[leg]]\nrod_mass = {value = 70, unit = "kg"}\njack = {b = {value = 900, unit = "N s/m"}}'
    platform = load_platform(written(tmp_path, lambda text: text.replace("[[leg]]", own, 1)))
    assert [leg.numbers["rod_mass"].value for leg in platform.legs] == [70, 55, 55, 55, 55, 55]
    assert [leg.rig["b"] for leg in platform.legs[:2]] == [900, 500]


def test_a_platform_is_no_jack_rig_and_says_so():
    with pytest.raises(InputError, match="platform on six jacks"):
        load_rig("hexapod")
    with pytest.raises(InputError, match="did you mean"):
        load_platform("hexapd")
    with pytest.raises(InputError, match='no number "mas"'):
        HEXAPOD.with_values(mas=1.0)
