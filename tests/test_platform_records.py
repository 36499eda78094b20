"""Records of a platform: axes that can be told apart, columns that are legs, a leg cut out by its measured force."""

from dataclasses import replace

import numpy as np
import pytest

from workbench import InputError
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.record.platform import MOTIONS, platform_plan, run_platform_record
from workbench.commands.residual.platform import leg_campaigns, run_platform_residual
from workbench.identify.data.leg_cut import leg_campaign, leg_rig
from workbench.identify.data.noise_floor import noise_floor
from workbench.identify.data.scored_floor import scored_floor
from workbench.identify.fit.predict import predict_whole, predict_windows
from workbench.loop.platform import platform_setup
from workbench.loop.platform.excitation import six_sines
from workbench.plant import build
from workbench.records import load_campaign
from workbench.rigs.platform import LEGS, load_platform

PLATFORM = load_platform("hexapod")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A recorded campaign."""
    out = tmp_path_factory.mktemp("records")
    outcome = run_platform_record(platform_plan("hexapod", 0), no_checkpoint, lambda _: None)
    for name, text in outcome.files.items():
        (out / name).write_text(text)
    return out


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
    assert not np.allclose(*(campaign.train[0].signals["position"] for campaign in campaigns))
    with pytest.raises(InputError, match=r"leg7\.command"):
        load_campaign(folder, 7)


@pytest.mark.parametrize("leg", [0, 3])
def test_a_leg_under_its_measured_force_moves_as_it_did_on_the_platform(folder, leg):
    """The platform, its payload and five legs are gone; the declared jack does what the leg did, to the noise of its
    sensors and of the load cell that drives it: chi2 is 1 within its scatter, in all and signal by signal. In one run
    through a record the position alone drifts, by what the weight of a rod that turns is off."""
    campaign, rig = leg_campaign(folder, PLATFORM, leg), leg_rig(PLATFORM, leg)
    floor, plant = scored_floor(campaign, rig), build(rig)
    for record in (*campaign.train, *campaign.heldout):
        windows, whole = (each(plant, record, floor) for each in (predict_windows, predict_whole))
        squares = {name: float(np.nansum((windows.error(name) / floor.sigma[name]) ** 2)) for name in windows.signals}
        samples = {name: int(np.isfinite(windows.error(name)).sum()) for name in windows.signals}
        near = 3 * floor.deviation(samples)
        assert sum(squares.values()) / sum(samples.values()) == pytest.approx(1.0, abs=near)
        for name, square in squares.items():
            near = 4 * floor.deviation({name: samples[name]})
            assert square / samples[name] == pytest.approx(1.0, abs=near), name
            if name != "position":
                free = float(np.nanmean((whole.error(name) / floor.sigma[name]) ** 2))
                assert free == pytest.approx(1.0, abs=near), name
        assert np.sqrt(np.nanmean(whole.error("position") ** 2)) < 0.15e-3


def test_the_noise_of_a_load_cell_comes_out_in_the_pressures(folder):
    """Twice the noise in the measured force: four times the variance in the floor, and in what the model misses."""
    campaign, rig = leg_campaign(folder, PLATFORM, 3), leg_rig(PLATFORM, 3)
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


def test_without_a_load_cell_no_leg_is_cut(folder, tmp_path):
    for file in folder.iterdir():
        (tmp_path / file.name).write_text(file.read_text().replace("leg4.force [kN]", "cell [kN]"))
    with pytest.raises(InputError, match=r"leg4\.force"):
        leg_campaign(tmp_path, PLATFORM, 3)


def test_the_leg_that_differs_has_the_largest_residual(folder):
    """The declared platform beside records of one with another leg 4: that leg is told, the others stay near 1."""
    made = PLATFORM.legs[3].rig.with_values(Cl=6e-12)
    legs = tuple(replace(leg, rig=made) if i == 3 else leg for i, leg in enumerate(PLATFORM.legs))
    campaigns = leg_campaigns(folder, PLATFORM, ())
    outcome = run_platform_residual(replace(PLATFORM, legs=legs), campaigns, no_checkpoint, lambda _: None)
    chi2 = [each["chi2"] for each in outcome.metrics["legs"]]
    assert max(chi2[:3] + chi2[4:]) < 1.2 < chi2[3]
    assert {"leg1.pa", "leg6.position"} <= {row["signal"] for row in outcome.metrics["rows"]}
    assert outcome.page.verdict.startswith("Leg 4 ")
