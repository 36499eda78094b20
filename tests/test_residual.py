"""Prediction in windows and the residual study: on records that our own plant made, and on real ones where they are."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.residual.study import chi2, run_residual
from workbench.engine import Engine
from workbench.identify.data.noise_floor import NoiseFloor
from workbench.identify.fit.predict import predict_free, predict_windows
from workbench.linear import equilibrium
from workbench.plant import build
from workbench.records import Campaign, Record, load_campaign
from workbench.records.campaign import FREE_RUN
from workbench.records.fingerprint import fingerprint
from workbench.rigs.rig_file import load_rig

SHARED = Path(__file__).parents[2] / "shared"
SIGMA = {"pa": 3e4, "pb": 3e4, "position": 3e-4}


@pytest.fixture(scope="module")
def festo():
    rig = load_rig("festo-tp511")
    return rig, Engine(build(rig))


def made_record(engine: Engine, seed: int, seconds: float = 1.2) -> Record:
    """What the rig's own model would record with white sensor noise."""
    random = np.random.default_rng(seed)
    t = np.arange(0, seconds, 1e-3)
    u = np.zeros((len(t), len(engine.plant.inputs)))
    u[:, 0] = 0.3 * np.sign(np.sin(2 * np.pi * 1.7 * t))
    x = engine.run(equilibrium(engine.plant).x, t, u).x
    y = engine.plant.observe(x, u)
    signals = {name: y[:, engine.plant.output(name)] + s * random.standard_normal(len(t)) for name, s in SIGMA.items()}
    return Record("made", t, {"command": u[:, 0], **signals})


def floor() -> NoiseFloor:
    return NoiseFloor(SIGMA, dict.fromkeys(SIGMA, 1.0), dict.fromkeys(SIGMA, "static record"))


def test_a_true_model_is_at_the_noise_floor(festo):
    _, engine = festo
    found = predict_windows(engine.plant, made_record(engine, 1), floor())
    assert found.failed == ()
    assert chi2([found], floor()) == pytest.approx(1, abs=0.06)


def test_a_wrong_model_is_not(festo):
    rig, engine = festo
    wrong = build(rig.with_values(K3=1.1 * rig["K3"]))
    value = chi2([predict_windows(wrong, made_record(engine, 1), floor())], floor())
    assert value is not None
    assert value > 1.5


def test_what_is_not_to_be_compared_does_not_count(festo):
    _, engine = festo
    record = made_record(engine, 2)
    spoilt = record.signals["pa"].copy()
    spoilt[300:400] += 5e5
    hidden = np.ones(len(record.t), bool)
    hidden[300:400] = False
    record = Record("spoilt", record.t, {**record.signals, "pa": spoilt}, {"pa": hidden})
    assert chi2([predict_windows(engine.plant, record, floor())], floor()) == pytest.approx(1, abs=0.06)


def test_a_free_run_drifts_where_windows_do_not(festo):
    rig, engine = festo
    record = made_record(engine, 3)
    wrong = build(rig.with_values(K3=1.02 * rig["K3"]))
    free = predict_free(wrong, record, floor()).error("position")
    windows = predict_windows(wrong, record, floor()).error("position")
    assert np.sqrt(np.mean(free**2)) > np.sqrt(np.nanmean(windows**2))


def test_a_dropped_sample_changes_nothing(festo):
    _, engine = festo
    record = made_record(engine, 4)
    keep = np.ones(len(record.t), bool)
    keep[251] = False  # its command was that of its neighbours
    thinned = Record("thin", record.t[keep], {n: v[keep] for n, v in record.signals.items()})
    assert chi2([predict_windows(engine.plant, thinned, floor())], floor()) == pytest.approx(1, abs=0.06)


def test_the_study_reports_every_signal_with_its_floor(festo):
    rig, engine = festo
    still = Record("still", *_rest(engine))
    campaign = Campaign(Path("made"), rig.name, (still,), (), (made_record(engine, 5),))
    outcome = run_residual(campaign, rig, no_checkpoint, lambda _: None)
    assert [list(row) for row in outcome.metrics["rows"]] == [["record", "signal", "unit", "rms", "floor", "ratio"]] * 3
    for row in outcome.metrics["rows"]:
        assert row["ratio"] == pytest.approx(row["rms"] / row["floor"])
        assert row["ratio"] == pytest.approx(1, abs=0.1)
    assert outcome.metrics["chi2"] == pytest.approx(1, abs=0.1)


def test_a_campaign_is_known_by_its_numbers(festo):
    _, engine = festo
    one = Campaign(Path("made"), "festo-tp511", (), (), (made_record(engine, 6),))
    other = replace(one, heldout=(made_record(engine, 7),))
    assert fingerprint(one) == fingerprint(replace(one))
    assert fingerprint(one) != fingerprint(other)
    assert fingerprint(one) != fingerprint(replace(one, score=FREE_RUN))


def _rest(engine: Engine) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    random = np.random.default_rng(8)
    t = np.arange(0, 1, 1e-3)
    rest = equilibrium(engine.plant)
    y = engine.plant.observe(rest.x, rest.u)[0]
    signals = {n: y[engine.plant.output(n)] + s * random.standard_normal(len(t)) for n, s in SIGMA.items()}
    return t, {"command": np.zeros(len(t)), **signals}


@pytest.mark.skipif(
    not (SHARED / "data/festo_tp511").is_dir(), reason="the Festo recordings are not beside the project"
)
def test_the_real_recordings_read_and_leave_an_honest_residual(festo):
    """Hand-set symmetric valve, no friction: several times the sensor noise, and far below the signals themselves."""
    rig, _ = festo
    campaign = load_campaign(SHARED / "data/festo_tp511")
    short = replace(campaign, heldout=(campaign.heldout[0].slice(0.0, 2.5),))
    outcome = run_residual(short, rig, no_checkpoint, lambda _: None)
    rows = {row["signal"]: row for row in outcome.metrics["rows"]}
    assert 0.5 < rows["pa"]["rms"] < 8  # of 44 bar
    assert 0.5 < rows["position"]["rms"] < 8  # of 200 mm
    assert outcome.metrics["chi2"] > 4


@pytest.mark.skipif(not (SHARED / "campaigns/p05").is_dir(), reason="the practice campaigns are not beside the project")
def test_an_independent_simulator_agrees_with_the_plant():
    """p05 has no effect in it: with its own true parameters the plant is at the noise floor."""
    import json

    truth = json.loads((SHARED / "campaigns/truth.json").read_text())["campaigns"]
    true = next(entry for entry in truth if entry["id"] == "p05")
    rig = load_rig("jack-10t").with_values(**{name: true["true"][name] for name in true["ratio"]})
    campaign = load_campaign(SHARED / "campaigns/p05")
    short = replace(campaign, heldout=(campaign.heldout[0].slice(0.0, 1.0),))
    outcome = run_residual(short, rig, no_checkpoint, lambda _: None)
    assert outcome.metrics["chi2"] == pytest.approx(1, abs=0.08)
