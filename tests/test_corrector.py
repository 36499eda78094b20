"""Correctors in the spool loop: the maker's resonance, what hunts at null is refused, bad experiment files."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.base.checkpoint import no_checkpoint
from workbench.base.errors import InputError
from workbench.commands.run.corrector import run_corrector
from workbench.commands.run.options import CorrectorConfig, load_config
from workbench.identify.datasheet import corrector
from workbench.identify.datasheet.corrector import Maker, SpoolLoop
from workbench.linear import equilibrium, linearise
from workbench.linear.equilibria import equilibria, slopes
from workbench.plant import build_valve_bench
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

EXPERIMENT = Path(__file__).parents[1] / "experiments" / "corrector.toml"
MAKER = Maker(70.0, 85.0, (1.0, 2.0))
OVERDRIVEN = {
    "Kp": 0.638,
    "drive.corrector.ki": 1 / 12.1e-3,
    "drive.corrector.Td": 0.633e-3,
    "drive.corrector.tf": 0.548e-3,
}
HUNTING = {
    "Kp": 2.43,
    "drive.corrector.ki": 1 / 5.9e-3,
    "drive.corrector.Td": 0.93e-3,
    "drive.corrector.tf": 0.44e-3,
}


@pytest.fixture(scope="module")
def rig():
    return load_rig("jack-10t-rounded")


@pytest.fixture(scope="module")
def pi_lead(rig):
    return SpoolLoop(rig.with_values(isat=1.5), "pi-lead")


def test_pi_lead_with_a_pilot_that_may_be_overdriven_has_the_makers_resonance(pi_lead):
    """71.2 Hz, 84.9 Hz, +1.5 dB, damping 0.33 at null: found once by another search on the same equations."""
    found = pi_lead.shown(OVERDRIVEN, 30)
    assert found.f3db == pytest.approx(71.2, abs=0.3)
    assert found.f90 == pytest.approx(84.9, abs=0.3)
    assert found.peak == pytest.approx(1.5, abs=0.1)
    assert found.null_zeta == pytest.approx(0.33, abs=0.01)
    assert not np.any(found.sine.saturated & (found.sine.f < 20))


def test_without_overdrive_the_makers_curve_costs_stability_at_null(rig):
    hunting = SpoolLoop(rig.with_values(z3max=3.18e-3), "pi-lead")
    assert hunting.null_zeta(HUNTING) < 0


def test_the_loop_of_the_rig_itself_is_the_papers(rig):
    plain = SpoolLoop(rig, None)
    assert list(plain.ranges) == ["Kp"]
    found = plain.shown({}, 25)
    assert (found.f3db, found.f90) == pytest.approx((70.1, 71.7), abs=0.2)
    assert found.peak < 0.05


@pytest.mark.parametrize("command", [0.0, 0.4])
def test_operating_points_of_correctors_in_lanes_are_those_one_by_one(rig, command):
    effect = EffectUse("drive.corrector", "pi-lead", {})
    plant = build_valve_bench(replace(rig.with_values(isat=1.5), effects=(effect,)))
    p = np.array([plant.parameter_values(None, **numbers) for numbers in (OVERDRIVEN, HUNTING, {})])
    points = equilibria(plant, p, command=command)
    assert points.ok.all()
    for lane in range(len(p)):
        alone = equilibrium(plant, command=command, p=p[lane])
        assert points.x[lane] / plant.scale == pytest.approx(alone.x / plant.scale, abs=1e-9)
        assert points.u[lane] == alone.u
        model = linearise(plant, alone, ("command",), ("flow",), p[lane])
        a = slopes(plant, points.x, points.u, p)[0][lane]
        assert np.abs(a - model.A).max() < 1e-6 * np.abs(model.A).max()


def test_a_fit_keeps_its_distance_from_hunting(rig, monkeypatch):
    """However short the search, what it gives is damped at null as was asked."""
    monkeypatch.setattr(corrector, "_POPULATION", 4)
    monkeypatch.setattr(corrector, "_GENERATIONS", 3)
    loop = SpoolLoop(rig.with_values(isat=1.5), "lead")
    numbers = loop.fitted(MAKER, 0.3)
    assert all(low <= numbers[name] <= high for name, (low, high) in loop.ranges.items())
    assert loop.null_zeta(numbers) >= 0.3
    assert numbers == loop.fitted(MAKER, 0.3)  # the same from the same seed


def test_the_study_reports_every_loop_beside_the_maker(rig, monkeypatch):
    monkeypatch.setattr(SpoolLoop, "fitted", lambda self, *_: {k: v for k, v in OVERDRIVEN.items() if k in self.ranges})
    config = CorrectorConfig(rig=rig, maker=MAKER, current_limit=1.5, least_damping=0.15, points=20)
    outcome = run_corrector(config, no_checkpoint, lambda _: None)
    rows = {row["id"]: row for row in outcome.metrics["rows"]}
    assert list(rows) == ["maker", "paper_p", "p_lead", "pi_lead"]
    assert all(set(row) == {"id", "f3db", "f90", "peak_db", "null_zeta"} for row in rows.values())
    assert rows["maker"]["null_zeta"] is None
    assert rows["pi_lead"]["peak_db"] > rows["p_lead"]["peak_db"] + 1
    assert "The error of the phase corner goes from -1" in outcome.page.verdict
    assert outcome.metrics["refused"] == []


WRONG = {
    'rig = "jack-10t-rounded"': ('rig = "festo-tp511"', "no three-stage valve"),
    "peak_db = [1.0, 2.0]": ("peak_db = [2.0, 1.0]", r"line \d+: maker.peak_db: write the least"),
    "current_limit = 1.5": ("current_limit = 0", "current_limit = 0: must be a positive number"),
    'f90 = {value = 85, unit = "Hz"}': (
        'f90 = {value = 85, unit = "bar"}',
        r"line \d+: maker.f90.unit: unit .bar. cannot",
    ),
}


@pytest.mark.parametrize("key", WRONG)
def test_a_bad_experiment_is_refused(key, tmp_path):
    text = EXPERIMENT.read_text(encoding="utf-8")
    assert key in text
    changed, message = WRONG[key]
    path = tmp_path / "corrector.toml"
    path.write_text(text.replace(key, changed), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        load_config(path)
