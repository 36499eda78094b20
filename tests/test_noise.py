"""The noise floor: known noise comes back as it was made, and motion, drift and hum are told from it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.signal import lfilter

from workbench import identify
from workbench.base.errors import InputError
from workbench.identify.data.noise_floor import noise_floor
from workbench.identify.data.rounding import rounded_sigma
from workbench.identify.data.signal_noise import RepeatedRun, signal_noise
from workbench.records import Campaign, Record, load_campaign

SHARED = Path(__file__).parents[2] / "shared"
PRACTICE = ["p01", "p02", "p03", "p04", "p05", "p06", "p07"]
needs_campaigns = pytest.mark.skipif(not (SHARED / "campaigns").is_dir(), reason="no practice campaigns here")
PERIOD = 1e-3


def white(rows, seed=1):
    return np.random.default_rng(seed).normal(size=rows)


def ar1(rows, rho, seed=1):
    """Unit variance, autocorrelation rho^k, so kappa = (1 + rho)/(1 - rho)."""
    return lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], white(rows + 500, seed))[500:]


def record(name="static", command=None, **signals):
    rows = next(iter(signals.values())).size
    return Record(
        name, np.arange(rows) * PERIOD, {"command": np.zeros(rows) if command is None else command, **signals}
    )


def campaign(*static, heldout=()):
    return Campaign(Path("here"), "jack-10t", static, (), tuple(heldout))


def run(error):
    return RepeatedRun(error, np.ones(error.size, dtype=bool), PERIOD)


@settings(max_examples=20, deadline=None)
@given(st.floats(1e-7, 1e7), st.integers(0, 10**6))
def test_white_noise_comes_back_at_any_scale(sigma, seed):
    floor = noise_floor(campaign(record(pa=3.0 * sigma + sigma * white(2000, seed))))
    assert floor.sigma["pa"] == pytest.approx(sigma, rel=0.08)
    assert 1.0 <= floor.kappa["pa"] < 1.8
    assert floor.source["pa"] == "static record"


@pytest.mark.parametrize("rho", [0.3, 0.6, 0.8, 0.9])
def test_autocorrelated_noise_has_the_kappa_of_its_formula(rho):
    found = [signal_noise([run(ar1(2000, rho, seed))]) for seed in range(8)]
    assert np.mean([noise.sigma for noise in found]) == pytest.approx(1.0, rel=0.06)
    assert np.mean([noise.kappa for noise in found]) == pytest.approx((1 + rho) / (1 - rho), rel=0.15)


def test_kappa_never_falls_below_one():
    alternating = ar1(2000, -0.5)
    assert signal_noise([run(alternating)])[1] == 1.0


def test_runs_are_pooled_and_invalid_samples_do_not_count():
    error = white(2000)
    valid = np.ones(2000, dtype=bool)
    valid[::50] = False
    spoilt = np.where(valid, error, 1e3)
    assert signal_noise([replace(run(spoilt), valid=valid)])[0] == pytest.approx(np.std(error[valid]), rel=1e-2)
    assert signal_noise([run(error), run(3.0 * error)])[0] == pytest.approx(np.sqrt(5.0) * np.std(error), rel=1e-2)


def test_drift_is_no_noise():
    t = np.linspace(0.0, 1.0, 100)  # a tenth of a second of a pump that was just started
    floor = noise_floor(campaign(record(pb=40e5 - 2.5e5 * t**1.3 + 0.25e5 * white(100))))
    assert floor.sigma["pb"] == pytest.approx(0.25e5, rel=0.2)


def test_a_long_static_record_is_cut_before_its_drift_is_taken_off():
    t = np.arange(20000) * PERIOD
    floor = noise_floor(campaign(record(pa=1e5 * np.sin(2 * np.pi * 0.05 * t) + 1e3 * white(20000))))
    assert floor.sigma["pa"] == pytest.approx(1e3, rel=0.03)


def hum(rows):
    return np.sqrt(2.0) * np.sin(2 * np.pi * 50.0 * PERIOD * np.arange(rows) + 0.3)


def test_mains_hum_counts_in_sigma_and_moves_no_mean():
    floor = noise_floor(campaign(record(spool=2e-6 * white(2000) + 1e-6 * hum(2000))))
    assert floor.sigma["spool"] == pytest.approx(np.sqrt(5.0) * 1e-6, rel=0.05)
    assert floor.kappa["spool"] < 1.5


def ringing(command, frequency=26.0, damping=0.02):
    """Unit rms answer of a mode to the command."""
    pole = np.exp(2 * np.pi * frequency * PERIOD * (1j * np.sqrt(1 - damping**2) - damping))
    answer = np.asarray(lfilter([0.0, 1.0], [1.0, -2 * pole.real, abs(pole) ** 2], command))
    return answer / np.std(answer)


def test_the_rigs_own_answer_to_the_command_is_no_noise():
    command = np.rint(0.6 * white(2500, 5)) * 3.05e-5
    own = ringing(command)[500:]
    pa, pb = (1.5e4 * (white(2000, seed) + 1.2 * sign * own) for seed, sign in ((6, 1.0), (7, -1.0)))
    floor = noise_floor(campaign(record(command=command[500:], pa=pa, pb=pb, spool=2e-6 * white(2000, 8))))
    for name, sigma in (("pa", 1.5e4), ("pb", 1.5e4), ("spool", 2e-6)):
        assert floor.sigma[name] == pytest.approx(sigma, rel=0.05)
        assert floor.kappa[name] < 1.6


def test_noise_that_a_loop_writes_into_the_command_stays_noise():
    position = 4e-5 * (ar1(2000, 0.8) + 0.5 * hum(2000))
    command = np.rint(-position / 3e-5) * 3.05e-5
    pa = 1.5e4 * (white(2000, 3) + 0.7 * hum(2000))
    floor = noise_floor(campaign(record(command=command, position=position, pa=pa)))
    assert floor.sigma["position"] == pytest.approx(np.std(position), rel=0.02)
    assert floor.sigma["pa"] == pytest.approx(np.std(pa), rel=0.02)


def test_a_signal_stuck_at_one_code_has_the_noise_of_its_quantisation():
    code = 0.25e5
    moving = code * np.rint(40.0 * np.sin(np.arange(3000) / 200.0))
    floor = noise_floor(campaign(record(pa=np.full(1000, 5 * code)), heldout=[record("multisine", pa=moving)]))
    assert floor.sigma["pa"] == pytest.approx(code / np.sqrt(12.0))
    assert (floor.kappa["pa"], floor.source["pa"]) == (1.0, "quantisation")


def test_a_stuck_signal_does_not_disturb_its_neighbours():
    command = np.rint(0.6 * white(2000, 5)) * 3.05e-5
    pa = 1.5e4 * (white(2000, 6) + 1.2 * ringing(command))
    static = record(command=command, pa=pa, supply=np.full(2000, 2.07e7), spool=np.full(2000, 0.1))
    moving = [record("steps", supply=2.07e7 + 1e4 * np.rint(3 * white(500)), spool=np.arange(500) % 2 * 1e-6)]
    floor = noise_floor(campaign(static, heldout=moving))
    assert floor.sigma["pa"] == pytest.approx(1.5e4, rel=0.05)
    assert floor.source == {"spool": "quantisation", "pa": "static record", "supply": "quantisation"}


def test_a_very_short_static_record_is_enough():
    error = 1e3 * white(25)
    fast = Record("static", 1e-5 * np.arange(25), {"command": np.zeros(25), "pa": 1e7 + error})
    assert noise_floor(campaign(fast)).sigma["pa"] == pytest.approx(np.std(error), rel=0.25)


def test_quantised_noise_keeps_its_own_spread():
    coarse = np.rint(white(2000)) * 1e4
    floor = noise_floor(campaign(record(pa=coarse)))
    assert floor.sigma["pa"] == pytest.approx(np.std(coarse), rel=0.02)
    assert floor.source["pa"] == "static record"


def test_without_a_static_record_the_floor_is_estimated_and_said():
    moving = 50e5 * np.sin(2 * np.pi * 3.0 * np.arange(6000) * PERIOD)
    moving[3000:] += 20e5
    floor = noise_floor(campaign(heldout=[record("steps", pa=moving + 1.5e4 * white(6000))]))
    assert floor.sigma["pa"] == pytest.approx(1.5e4, rel=0.05)
    assert (floor.kappa["pa"], floor.source["pa"]) == (1.0, "estimated from the records")


def test_a_signal_that_no_static_record_has_is_estimated_beside_those_that_one_has():
    other = record("steps", pa=white(1000, 2), pb=white(1000, 3))
    floor = noise_floor(campaign(record(pa=white(1000)), heldout=[other]))
    assert floor.source == {"pa": "static record", "pb": "estimated from the records"}


def test_a_dead_channel_is_refused_by_name():
    with pytest.raises(InputError, match="supply: one value in every record"):
        noise_floor(campaign(record(supply=np.full(500, 2.1e7), pa=white(500))))


# read off the static records: std over scale is the same in all seven, once hum is left in and ringing out
SIGMA = {
    "current": 2e-5,
    "spool": 2e-6,
    "pa": 1.5e4,
    "pb": 1.5e4,
    "position": 4e-5,
    "acceleration": 0.3,
    "supply": 1.5e4,
}


def truth(name):
    table = json.loads((SHARED / "campaigns" / "truth.json").read_text())["campaigns"]
    return next(entry for entry in table if entry["id"] == name)


@needs_campaigns
@pytest.mark.parametrize("name", PRACTICE)
def test_practice_campaigns_have_the_noise_they_were_given(name):
    """The true sigma is the practice set's scale times one figure a signal; coloured noise has kappa well above 1."""
    floor = noise_floor(load_campaign(SHARED / "campaigns" / name))
    told = truth(name)
    for signal, sigma in floor.sigma.items():
        assert sigma == pytest.approx(SIGMA[signal] * told["scale"][signal], rel=0.06), signal
        assert floor.source[signal] == "static record"
    assert min(floor.kappa.values()) >= 1.0
    assert (np.median(list(floor.kappa.values())) > 3.0) == (told["noise"] == "coloured")
    assert set(floor.sigma) == set(told["scale"]) - (set() if told["supply"] else {"supply"})


@needs_campaigns
@pytest.mark.parametrize("name", PRACTICE)
def test_an_estimate_without_the_static_record_comes_near(name):
    """Independent of the above: other records, another method. It misses part of coloured noise, adds fast motion."""
    found = load_campaign(SHARED / "campaigns" / name)
    measured, estimated = noise_floor(found), noise_floor(replace(found, static=()))
    for signal, sigma in measured.sigma.items():
        assert 0.7 < estimated.sigma[signal] / sigma < 1.25, signal


@pytest.mark.skipif(not (SHARED / "data" / "festo_tp511").is_dir(), reason="no recordings of the Festo rig here")
def test_the_festo_rig_at_rest_and_in_motion_agree():
    found = load_campaign(SHARED / "data" / "festo_tp511")
    measured, estimated = noise_floor(found), noise_floor(replace(found, static=()))
    assert measured.sigma == pytest.approx(estimated.sigma, rel=0.2)
    assert 0.1e-3 < measured.sigma["position"] < 0.5e-3
    assert 0.1e5 < measured.sigma["pa"] < 0.5e5


def test_the_room_has_every_name_that_it_exports():
    assert dir(identify) == identify.__all__
    assert all(getattr(identify, name).__doc__ for name in identify.__all__)
    assert not hasattr(identify, "nothere")


@pytest.mark.parametrize("noise", [0.1, 0.2, 0.35, 0.6, 1.0])
def test_readings_in_motion_have_the_noise_that_rounding_hides_at_rest(noise):
    """Of steps of 1 at rest anywhere between two levels: the mean square of what is off in motion."""
    random, floors = np.random.default_rng(4), []
    for place in random.uniform(0, 1, 20):
        rest = np.round(place + noise * random.standard_normal(2000))
        floors.append(rounded_sigma([rest], 1.0) ** 2)
    moving = random.uniform(0, 100, 100_000)
    off = np.round(moving + noise * random.standard_normal(moving.size)) - moving
    assert np.mean(floors) == pytest.approx(np.mean(off**2), rel=0.12)
