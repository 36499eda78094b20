"""What reference and position say of the loop of a maker, by fit and trace, and what they do not tell."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from made_inner_loops import campaign, played, press

from workbench.cli import main
from workbench.commands.fit import study
from workbench.commands.fit.remains import _with_load, remains_sentence
from workbench.commands.trace.told import told_section, told_sentence
from workbench.engine import Engine
from workbench.identify.fit.initial_states import predicted_states
from workbench.identify.fit.model import Model
from workbench.identify.fit.rests import growing_pole
from workbench.identify.found.fitted import fitted_rig
from workbench.identify.found.untold import without_untold
from workbench.identify.trace import refit
from workbench.identify.trace.findings import Trace
from workbench.identify.trace.problem import EstimationProblem, estimation_problem
from workbench.identify.trace.refit import fit_rig
from workbench.identify.trace.told import ToldEffects, told_effects
from workbench.linear import equilibrium
from workbench.plant import build
from workbench.plant.effects.declared import effects_for
from workbench.report import Table
from workbench.rigs.driven import load_driven
from workbench.rigs.number import Number
from workbench.rigs.rig import Rig

TOLD = {"load.bias", "main.deadband", "main.asymmetry", "drive.lag"}


@pytest.fixture(scope="module")
def rig(tmp_path_factory) -> Rig:
    return press(tmp_path_factory.mktemp("closed"))


def test_gain_and_delay_of_a_loop_are_found_from_reference_and_position(rig, tmp_path, monkeypatch):
    true = rig.with_values(loop_gain=75.0, loop_delay=6e-3, z0=0.004)
    folder = campaign(tmp_path / "c", rig, played(true))
    monkeypatch.chdir(tmp_path)
    assert main(["fit", str(folder), "--out", "f", "--starts", "1"]) == 0
    found = json.loads(Path("f/metrics.json").read_text())
    for name, value in (("loop_gain [1/m]", 75.0), ("loop_delay [s]", 6e-3), ("z0 [1]", 0.004)):
        best, low, high = found["parameters"][name]
        assert low - 0.5 * (high - low) <= value <= high + 0.5 * (high - low), (name, best, low, high)
    assert found["chi2"]["heldout"] < 1.1
    shares = found["shares"]
    assert shares["left"] == pytest.approx(shares["noise"], rel=0.1)
    assert shares["load"] is None
    assert shares["moves"] > 0.5
    ladder = found["ladder"]
    first, second, plant = (rung["left"] for rung in ladder["rungs"])
    assert ladder["bears"] == "this plant"  # whose lands bend, and which a servo is not
    assert min(first, second) > 1.5 * plant
    assert plant == shares["left"]


def test_what_remains_in_one_run_is_told_by_drift_frequency_and_load(rig, tmp_path, monkeypatch):
    """The held-out part has an offset of 0.05 mm and a tone of 7 Hz, 0.04 mm RMS, that nothing explains."""
    offset, tone = 5e-5, 4e-5

    def off(signals):
        t = np.linspace(0, 10.0, signals["position"].size, endpoint=False)
        signals["position"] += (t >= 6.0) * (offset + np.sqrt(2) * tone * np.sin(2 * np.pi * 7.0 * t))

    folder = campaign(tmp_path / "c", rig, played(rig), off)
    monkeypatch.chdir(tmp_path)
    assert main(["fit", str(folder), "--out", "f", "--starts", "1"]) == 0
    found = json.loads(Path("f/metrics.json").read_text())["remains"]
    assert found["drift"] == pytest.approx(1e3 * offset, rel=0.2)
    assert found["left"] == pytest.approx(1e3 * np.hypot(offset, tone), rel=0.1)
    assert found["below_hz"] == pytest.approx(7.0, abs=0.6)
    assert found["with_load"] is None
    assert "of which 0.048" in remains_sentence(found)
    assert "goes with the measured load" in remains_sentence({**found, "with_load": 0.3})


def test_a_share_goes_with_the_load_or_its_rate():
    random = np.random.default_rng(2)
    load = np.cumsum(random.standard_normal(4000))
    load -= load.mean()
    rest = 0.3 * load + random.standard_normal(4000)
    assert _with_load(rest, load) == pytest.approx(float(0.09 * load @ load), rel=0.05)
    assert _with_load(rest, None) == 0
    assert _with_load(random.standard_normal(4000), load) < 40


def test_a_pressure_makes_the_numbers_of_a_loop_sharper_and_the_page_says_by_how_much(rig, tmp_path, monkeypatch):
    folder = campaign(tmp_path / "c", rig, played(rig, 2e4))
    monkeypatch.chdir(tmp_path)
    assert main(["fit", str(folder), "--out", "f", "--starts", "1"]) == 0
    tells = json.loads(Path("f/metrics.json").read_text())["tells"]
    alone = dict(zip(tells["numbers"], tells["alone"]["position"], strict=True))
    assert min(alone["M"], alone["b"]) > 1.2
    told = [f"{alone[name]:.2g}" for name in ("loop_gain", "loop_delay", "b", "M")]
    said = f"the intervals of loop_gain, loop_delay, b and M would be {', '.join(told[:3])} and {told[3]} times as long"
    assert said in Path("f/report.html").read_text()


@pytest.mark.parametrize("pinned", [False, True])
def test_what_a_loop_hides_is_said_before_any_effect_is_tried(rig, tmp_path, pinned):
    """A lag of the drive is as good as a later reference, which nobody knows; unequal lands are as good as a bias."""
    numbers = {**rig.numbers, "loop_delay": Number("loop_delay", 2e-3, "s", "s", "measured")} if pinned else rig.numbers
    own = Rig(**{**vars(rig), "numbers": numbers})
    records, own = load_driven(campaign(tmp_path / "c", own, played(own)))
    problem = estimation_problem(records, own)
    told = told_effects(problem, fit_rig(problem), [e for e in effects_for(own) if e.name in TOLD])
    assert set(told.shown) | set(told.hidden) == TOLD
    assert ("drive.lag" in told.shown) == pinned
    assert told.alike == [["main.asymmetry", "load.bias"]]


def test_the_page_of_a_trace_says_what_a_loop_lets_through():
    told = ToldEffects(
        ["load.bias", "main.asymmetry", "main.deadband"], ["drive.lag"], [["load.bias", "main.asymmetry"]]
    )
    named = SimpleNamespace(candidate=SimpleNamespace(effect=SimpleNamespace(name="main.asymmetry")))
    trace = cast(Trace, SimpleNamespace(told=told, effects=(named,)))
    said = told_sentence(trace)
    assert "Of 4 effects these records of a closed loop could show 3" in said
    assert "They do not tell main.asymmetry from load.bias." in said
    (section,) = told_section(trace)
    (table,) = section.items
    assert isinstance(table, Table)
    assert ["load.bias", True, "main.asymmetry"] in table.rows
    assert ["drive.lag", False, ""] in table.rows
    open_loop = cast(Trace, SimpleNamespace(told=None, effects=()))
    assert told_sentence(open_loop) == ""
    assert told_section(open_loop) == []


@pytest.fixture(scope="module")
def problem(rig, tmp_path_factory) -> EstimationProblem:
    true = rig.with_values(loop_gain=75.0, z0=0.004, V0=2 * rig["V0"], beta=8e8, b=0.5 * rig["b"])
    records, own = load_driven(campaign(tmp_path_factory.mktemp("fitted") / "c", rig, played(true)))
    return estimation_problem(records, own)


def test_what_records_do_not_tell_stays_in_the_rig_file_as_it_was(rig, problem):
    found = fit_rig(problem)
    as_fitted, untold = fitted_rig(problem, found), without_untold(problem, found)[1]
    assert {"V0"} <= set(untold) < set(rig.numbers)
    for name in untold:
        before, after = rig.numbers[name], as_fitted.numbers[name]
        assert replace(after, source=before.source) == before  # value, bounds and no interval
        assert after.source == f"c does not tell it; {before.source}"
    told = as_fitted.numbers["loop_gain"]
    assert told.interval is not None
    assert told.interval[0] <= 75.0 <= told.interval[1]
    # the others were fitted beside them: the rig that is left follows the records as the fit does
    chi2 = [
        float(predicted_states(found.model, problem.train, p)[1].sum()) / problem.train.samples
        for p in (found.fit.p, build(as_fitted).p)
    ]
    assert chi2[1] == pytest.approx(chi2[0], rel=0.002)


def test_a_loop_that_grows_is_known_by_its_pole_and_does_so(rig):
    stiff = rig.with_values(loop_gain=3000.0)
    assert growing_pole(Model(build(rig), ("position",)), build(rig).p) is None
    plant = build(stiff)
    pole = growing_pole(Model(plant, ("position",)), plant.p)
    assert pole is not None
    rest, t = equilibrium(plant).x, np.arange(0, 6 / pole.real, 1e-4)
    moved = rest + 1e-9 * plant.scale * (np.arange(rest.size) == plant.state("x"))
    x = Engine(plant).run(moved, t, np.zeros((t.size, len(plant.inputs)))).x[:, plant.state("v")]
    late = np.abs(x[t > 3 / pole.real]).max() / np.abs(x[(t > 1.5 / pole.real) & (t < 3 / pole.real)]).max()
    assert late > np.exp(2.0)


def test_a_fit_that_ends_on_an_unstable_loop_starts_elsewhere(problem, monkeypatch):
    poles, said = [30 + 400j, None], list[str]()
    monkeypatch.setattr(refit, "growing_pole", lambda *_: poles.pop(0))
    fit_rig(problem, 1, said.append)
    assert [line.endswith(", unstable") for line in said] == [True, False]
    monkeypatch.setattr(refit, "growing_pole", lambda *_: 30 + 400j)
    said.clear()
    fit_rig(problem, 1, said.append)
    assert len(said) == 3  # a few places more, and the answer says it


def test_a_fit_says_that_its_loop_is_unstable(rig, tmp_path, monkeypatch):
    folder = campaign(tmp_path / "c", rig, played(rig))
    monkeypatch.setattr(study, "growing_pole", lambda *_: 30 + 400j)
    monkeypatch.chdir(tmp_path)
    assert main(["fit", str(folder), "--out", "f", "--starts", "1"]) == 0
    assert json.loads(Path("f/metrics.json").read_text())["growing_pole"] == pytest.approx([30, 400 / (2 * np.pi)])
    assert "unstable at rest (it grows by 30 1/s at 63.7 Hz)" in Path("f/report.html").read_text()
