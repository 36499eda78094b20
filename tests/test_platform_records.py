"""Records of a platform: axes that can be told apart, columns that are legs, a leg cut out by its measured force."""

import os
import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from workbench import InputError
from workbench.cli import main
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.fit.platform import legs_sentence, shared_numbers
from workbench.commands.record.platform import MOTIONS, identity, platform_plan, run_platform_record
from workbench.commands.residual.platform import run_platform_residual
from workbench.commands.trace.payload import payload_numbers, payload_sentence
from workbench.commands.trace.platform import leg_effects
from workbench.identify.data.noise_floor import noise_floor
from workbench.identify.data.scored_floor import scored_floor
from workbench.identify.fit.predict import predict_whole, predict_windows
from workbench.identify.wrench.balance import NUMBERS
from workbench.identify.wrench.fitted import fit_payload, wrench_problem
from workbench.identify.wrench.leg_cut import cut_legs, whole_campaigns
from workbench.identify.wrench.rod import rod_burden
from workbench.loop.platform import platform_setup
from workbench.loop.platform.excitation import six_sines
from workbench.plant import build
from workbench.plant.build import build_force_port
from workbench.plant.platform import TWIST, build_platform
from workbench.records import load_campaign
from workbench.rigs.number import Number
from workbench.rigs.platform import AXES, LEGS, load_platform
from workbench.rigs.platform.kinematics import pose_rates
from workbench.rigs.platform.platform_file import platform_text
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import rig_text

PLATFORM = load_platform("hexapod")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A recorded campaign."""
    out = tmp_path_factory.mktemp("records")
    outcome = run_platform_record(platform_plan("hexapod", 0), no_checkpoint, lambda _: None)
    for name, text in outcome.files.items():
        (out / name).write_text(text)
    return out


@pytest.fixture(scope="module")
def legs(folder):
    """Its legs."""
    return cut_legs(PLATFORM, whole_campaigns(folder))


def test_each_frequency_of_a_motion_moves_one_axis():
    setup, motion = platform_setup(PLATFORM), replace(MOTIONS[0], seconds=4.0)
    pose = six_sines(setup, motion)
    moving = pose[500:4500] - pose[500:4500].mean(axis=0)
    power = np.abs(np.fft.rfft(moving * np.hanning(4000)[:, None], axis=0)) ** 2
    other = power.sum(axis=1) - power.max(axis=1)
    peaks = power.max(axis=0) / power.sum(axis=0)
    assert np.linalg.matrix_rank(moving) == LEGS
    assert np.all(peaks > 0.1)
    assert np.abs(np.corrcoef(moving.T) - np.eye(LEGS)).max() < 0.1
    assert other.sum() < power.sum()


def test_the_columns_of_a_record_are_legs(folder):
    campaigns = [load_campaign(folder, leg) for leg in (1, 4)]
    for campaign in campaigns:
        assert [record.name for record in campaign.records] == ["static", "fast", "slow", "mixed"]
        assert {"command", "spool", "pa", "pb", "position", "force"} <= set(campaign.train[0].names)
    first, fourth = (campaign.train[0].signals["position"] for campaign in campaigns)
    assert not np.allclose(first, fourth)
    with pytest.raises(InputError, match=r"leg7\.command"):
        load_campaign(folder, 7)


def far_from_one(squares: float, floor, samples: dict[str, int]) -> float:
    """A mean square over what it is to be, 1, in its deviations."""
    return (squares / sum(samples.values()) - 1.0) / floor.deviation(samples)


def test_a_leg_under_its_measured_force_moves_as_it_did_on_the_platform(legs):
    """The platform, its payload and five legs are gone; the declared jack does what the leg did, to the noise of its
    sensors and of the load cell that drives it: chi2 is 1 within its scatter, in all and signal by signal. In one run
    through a record the load cell's noise lets the position walk; it walks no further than it does with noise anew."""
    campaign, rig = legs[3].campaign, legs[3].rig
    floor, plant = scored_floor(campaign, rig), build(rig)
    for record in (*campaign.train, *campaign.heldout):
        windows, whole = (each(plant, record, floor) for each in (predict_windows, predict_whole))
        squares = {name: float(np.nansum((windows.error(name) / floor.sigma[name]) ** 2)) for name in windows.signals}
        samples = {name: int(np.isfinite(windows.error(name)).sum()) for name in windows.signals}
        assert abs(far_from_one(sum(squares.values()), floor, samples)) < 3
        for name, square in squares.items():
            assert abs(far_from_one(square, floor, {name: samples[name]})) < 4, name
            free = float(np.nansum((whole.error(name) / floor.sigma[name]) ** 2))
            walked = walk(plant, record, floor, campaign) if name == "position" else 0.0
            assert abs(far_from_one(free - samples[name] * walked, floor, {name: samples[name]})) < 4, name


def walk(plant, record, floor, campaign) -> float:
    """What the noise of the load cell adds to chi2 of the position in one run, at most: the largest of four draws."""
    (noise,) = campaign.input_noise.values()
    random, (before, after) = np.random.default_rng(5), noise.weights
    still, largest = predict_whole(plant, record, floor).signals["position"], 0.0
    for _ in range(4):
        drawn = noise.sigma * random.standard_normal(record.t.size + 1)
        load = record.signals["disturbance"] + before * drawn[:-1] + after * drawn[1:]
        again = predict_whole(plant, replace(record, signals={**record.signals, "disturbance": load}), floor)
        largest = max(largest, float(np.mean((again.signals["position"] - still) ** 2)))
    return largest / floor.sigma["position"] ** 2


def test_what_a_rod_bears_is_what_the_platform_says():
    """A turning leg: its jack's force less the rod's inertia, weight and centripetal force is the load cell's."""
    plant, t = build_platform(PLATFORM), np.array([-1e-4, 0.0, 1e-4])
    pose, twist = np.array([0.1, -0.05, 0.08, 0.1, -0.12, 0.15]), np.array([0.4, 0.3, -0.2, 0.5, 0.6, -0.4])
    x, u = plant.start.copy(), np.zeros(len(plant.inputs))
    places = {state.name: i for i, state in enumerate(plant.states)}
    for name, value in zip((*AXES, *TWIST), (*pose, *twist), strict=True):
        x[places[name]] = value
    y = dict(zip(plant.outputs, plant.h(x, u, plant.p).full().ravel(), strict=True))
    burden = rod_burden(PLATFORM, t, pose + np.outer(t, pose_rates(pose) @ twist))[1]
    for leg, own in enumerate(PLATFORM.legs):
        name, port = f"leg{leg + 1}", build_force_port(own.rig)
        states = [x[places[f"{name}.{state.name}"]] for state in port.states]
        given = {"position": y[f"{name}.position"], "velocity": y[f"{name}.velocity"]}
        told = port.h(states, [given.get(each.name, 0.0) for each in port.inputs], port.p).full()
        inertia = own.numbers["rod_mass"].value * y[f"{name}.acceleration"]
        assert told[port.output("force"), 0] - inertia == pytest.approx(y[f"{name}.force"] + burden[leg], abs=0.01)


def packs():
    """Six effects a platform, one a leg, until each formula that a leg can lack had its leg."""
    effects = [e for e in leg_effects(PLATFORM.legs[0].rig) if not (e.delay or e.shifts or e.kin == "spool stick")]
    return [effects[first : first + LEGS] for first in range(0, len(effects), LEGS)]


@pytest.mark.skipif("FUZZ_LEGS" not in os.environ, reason="half a minute a platform: `make fuzz`")
@pytest.mark.parametrize("pack", packs())
def test_legs_with_effects_and_delays_are_predicted_to_their_noise(pack, tmp_path):
    """All commands are late, and each leg has an effect; of a spool that sticks no sample tells where its force is."""
    (late,) = (e for e in leg_effects(PLATFORM.legs[0].rig) if e.delay and e.formula == "shift")
    uses = [(used(late, delay=4e-4), used(effect)) for effect in pack]
    uses += [(used(late, delay=4e-4),)] * (LEGS - len(pack))
    pairs = zip(PLATFORM.legs, uses, strict=True)
    made = replace(PLATFORM, legs=tuple(replace(leg, rig=with_effects(leg.rig, own)) for leg, own in pairs))
    plan = replace(platform_plan("hexapod", 4), platform=made)
    for name, text in run_platform_record(plan, no_checkpoint, lambda _: None).files.items():
        (tmp_path / name).write_text(text)
    for own, leg in zip(uses, cut_legs(made, whole_campaigns(tmp_path)), strict=True):
        campaign, rig = leg.campaign, leg.rig
        floor, record = scored_floor(campaign, rig), campaign.heldout[0]
        windows = predict_windows(build(rig), record, floor)
        errors = {name: windows.error(name) / floor.sigma[name] for name in windows.signals}
        samples = {name: int(np.isfinite(each).sum()) for name, each in errors.items()}
        squares = sum(float(np.nansum(each**2)) for each in errors.values())
        assert abs(far_from_one(squares, floor, samples)) < 4, own[-1]


def with_effects(rig, uses):
    """The rig with effects; its guard does not hold an overlap or friction for a broken position sensor."""
    doubt = Number("flow_error", 10.0, "1", "1", "made here")
    return replace(rig, effects=uses, limits={**rig.limits, "flow_error": doubt})


def used(effect, **values: float) -> EffectUse:
    """An effect as a rig declares it, at its typical numbers but for some."""
    values = {n.name: n.typical for n in effect.numbers} | values
    numbers = {n.name: Number(n.name, values[n.name], n.si, n.si, "made here") for n in effect.numbers}
    return EffectUse(effect.name, effect.formula, numbers)


def test_the_noise_of_a_load_cell_comes_out_in_the_pressures(legs):
    """Twice the noise in the measured force: four times the variance in the floor, and in what the model misses."""
    campaign, rig = legs[3].campaign, legs[3].rig
    (noise,) = campaign.input_noise.values()
    assert noise.sigma == pytest.approx(PLATFORM.legs[3].rig.sensors["force"].noise, rel=0.05)
    silent, known = noise_floor(campaign), scored_floor(campaign, rig)
    louder = replace(campaign, input_noise={"disturbance": replace(noise, sigma=2 * noise.sigma)})
    doubled = scored_floor(louder, rig)
    for name in ("pa", "pb"):
        carried, twice = (floor.sigma[name] ** 2 - silent.sigma[name] ** 2 for floor in (known, doubled))
        assert carried > 0.1 * silent.sigma[name] ** 2
        assert twice == pytest.approx(4 * carried, rel=0.1)
    assert doubled.sigma["spool"] == pytest.approx(silent.sigma["spool"], rel=1e-3)


def test_without_a_pressure_no_leg_is_cut(folder, tmp_path):
    for file in folder.iterdir():
        (tmp_path / file.name).write_text(file.read_text().replace("leg4.pb [bar]", "other [bar]"))
    with pytest.raises(InputError, match=r"leg4\.pb"):
        cut_legs(PLATFORM, whole_campaigns(tmp_path))


@pytest.mark.usefixtures("right_columns")
def test_the_leg_that_differs_has_the_largest_residual(folder):
    """The declared platform beside records of one with another leg 4: that leg is told, the others stay near 1."""
    made = PLATFORM.legs[3].rig.with_values(Cl=6e-12)
    declared = tuple(replace(leg, rig=made) if i == 3 else leg for i, leg in enumerate(PLATFORM.legs))
    other = replace(PLATFORM, legs=declared)
    legs = cut_legs(other, whole_campaigns(folder))
    outcome = run_platform_residual(other, legs, no_checkpoint, lambda _: None)
    chi2 = [each["chi2"] for each in outcome.metrics["legs"]]
    assert max(chi2[:3] + chi2[4:]) < 1.2 < chi2[3]
    assert {"leg1.pa", "leg6.position"} <= {row["signal"] for row in outcome.metrics["rows"]}
    assert outcome.page.verdict.startswith("Leg 4 ")


def payload(platform, folder):
    """As its legs' records say."""
    return fit_payload(wrench_problem(platform, whole_campaigns(folder)))


def test_the_payload_is_told_by_the_forces_of_the_legs(folder):
    """Mass, centre and inertia within their intervals; a payload that a file has off the middle is contradicted."""
    fit = payload(PLATFORM, folder)
    true = np.array([PLATFORM[name] for name in NUMBERS])
    assert np.all(np.abs(fit.values - true) < 1.6 * fit.halves)
    assert fit.halves[0] < 0.001 * PLATFORM["mass"]
    assert np.all(fit.halves[1:4] < 0.001)
    assert np.all(fit.halves[4:] < 0.003 * PLATFORM["Ixx"])
    assert np.all(fit.left < 0.03 * fit.wrench)
    assert payload_numbers(PLATFORM, fit) == []
    other = PLATFORM.with_values(cx=0.1, mass=4400.0)
    wrong = payload_numbers(other, payload(other, folder))
    assert [row["name"] for row in wrong] == ["payload.mass [kg]", "payload.cx [m]"]
    assert "cx [m] is" in payload_sentence(wrong)


def test_legs_with_another_weight_across_leave_more_of_the_wrench(folder):
    """The legs' own weight and inertia, which no load cell measures, are in the balance: without them it does not
    close."""
    with_legs, without = (payload(each, folder) for each in (PLATFORM, PLATFORM.without_leg_inertia()))
    assert np.all(with_legs.left <= without.left)
    assert abs(without.values[0] - PLATFORM["mass"]) > 10 * with_legs.halves[0]


POSES = "t [s],heave [mm],pitch [deg]\n0.0,0.0,0.0\n0.4,6.0,0.3\n0.8,0.0,0.0\n"


def test_a_file_of_poses_is_played_and_logged_as_the_own_motions_are(folder, tmp_path):
    """The columns are those of any record of a platform, and it goes about where the file has it."""
    (tmp_path / "nod.csv").write_text(POSES)
    plan = platform_plan("hexapod", 0, [tmp_path / "nod.csv"])
    files = run_platform_record(plan, no_checkpoint, lambda _: None).files
    assert set(files) == {"campaign.toml", "static.csv", "nod.csv"}
    header, own = files["nod.csv"].splitlines()[0], (folder / "mixed.csv").read_text().splitlines()[0]
    assert header == own
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    legs = [load_campaign(tmp_path, leg + 1).heldout[0] for leg in range(LEGS)]
    poses = PLATFORM.poses(np.column_stack([leg.signals["position"] for leg in legs]))
    assert poses[:, 2].max() == pytest.approx(6e-3, rel=0.4)
    assert np.degrees(poses[:, 4]).max() == pytest.approx(0.3, rel=0.4)
    assert identity(plan) != identity(platform_plan("hexapod", 0))


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("far", POSES.replace("6.0", "900.0"), r"--play far: record: leg \d, \w+"),
        ("static", POSES, "static is taken"),
        ("bow", POSES.replace("heave", "bow"), 'column "bow": no axis'),
    ],
)
def test_a_motion_that_no_platform_can_play_is_refused_in_one_line(name, text, said, tmp_path, capsys):
    (tmp_path / f"{name}.csv").write_text(text)
    out = str(tmp_path / "out")
    assert main(["record", "hexapod", "--play", str(tmp_path / f"{name}.csv"), "--out", out]) == 2
    (line,) = [each for each in capsys.readouterr().err.splitlines() if " s  " not in each]
    assert re.search(said, line)


def test_a_platform_file_is_read_back(tmp_path):
    for i, leg in enumerate(PLATFORM.legs, 1):
        (tmp_path / f"leg{i}.toml").write_text(rig_text(leg.rig))
    (tmp_path / "found.toml").write_text(platform_text(PLATFORM, [f"leg{i}.toml" for i in range(1, LEGS + 1)]))
    again, own = load_platform(tmp_path / "found.toml").table(), PLATFORM.table()
    assert again["numbers"] == own["numbers"]
    for leg, declared in zip(again["legs"], own["legs"], strict=True):
        assert {**leg, "rig": None} == {**declared, "rig": None}


def test_numbers_that_legs_share_are_told_from_those_of_a_leg():
    legs: list[Mapping[str, list[float | None]]] = [
        {"beta [Pa]": [1e9 + 1e5 * i, 9.9e8, 1.01e9], "Cl [1]": [2.0, 1.9, 2.1], "M [kg]": [55.0, 54.0, 56.0]}
        for i in range(6)
    ]
    legs[3] = {**legs[3], "Cl [1]": [3.0, 2.9, 3.1]}
    shared = shared_numbers(legs)
    assert {name: each["alike"] for name, each in shared.items()} == {"beta [Pa]": True, "Cl [1]": False}
    value, low, high = shared["beta [Pa]"]["value"]
    assert high - low == pytest.approx(2e7 / np.sqrt(6))
    assert low < value < high


def test_a_leg_that_does_not_follow_its_records_is_named():
    """Its numbers say what it lacks, so that they are no part of what legs share."""
    legs = [{"leg": i, "chi2": {"heldout": 61.0 if i == 3 else 1.01}, "follows": i != 3} for i in range(1, 7)]
    said = legs_sentence(legs, {"beta [Pa]": {"alike": True}, "Cl [1]": {"alike": False}})
    assert said.startswith("Not following their records: leg 3 (chi2 61);")
    assert said.endswith(" The others differ in Cl.")
    assert legs_sentence([legs[0]] * 6, {"beta [Pa]": {"alike": True}}) == "No number differs between legs."
    assert shared_numbers([{"beta [Pa]": [1e9, 9.9e8, 1.01e9]}]) == {}
