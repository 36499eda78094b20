"""What to record next: a tie that one-way moves leave, the record that a plan asks for, and the trace with it."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.made_campaigns import LIBRARY, PERIOD, SIGMA, campaign, made, rubbing, rubbing_campaign, written
from workbench.base.errors import InputError
from workbench.base.process_pool import one_blas_thread
from workbench.cli import main
from workbench.commands.common.outcome import Outcome, no_checkpoint
from workbench.commands.plan import study
from workbench.commands.plan.study import run_plan
from workbench.commands.trace.study import run_trace
from workbench.identify.fit.free_parameters import Candidate, at_strength
from workbench.identify.plan.family import SECONDS, family, planned
from workbench.identify.trace.information import cosines, effect_information, effects_alone, sharpened
from workbench.identify.trace.problem import EstimationProblem, estimation_problem
from workbench.identify.trace.record_gain import ALIKE
from workbench.identify.trace.refit import FittedModel, fit_rig
from workbench.identify.trace.score import NuisanceProjection, effect_change
from workbench.loop.drive_simulation import drive, play, trouble
from workbench.plant.effects import find
from workbench.plant.effects.declared import effects_for
from workbench.records import Campaign, Record
from workbench.records.excitation import read_excitation
from workbench.report import render
from workbench.rigs.rig_file import load_rig, rig_text

_BIAS = find("load.bias", "weight")
SMALL_BIAS = replace(_BIAS, numbers=(replace(_BIAS.numbers[0], typical=50.0, low=-500.0, high=500.0),))
ALTERNATIVES = (LIBRARY[0], SMALL_BIAS)
COMMANDS = {
    "up": (0.05, 0.1, 0.025, 0.15, 0.075, 0.05, 0.125, 0.05),
    "up again": (0.025, 0.15, 0.05, 0.1, 0.05, 0.15, 0.1, 0.025),
    "up at last": (0.1, 0.05, 0.15, 0.025, 0.125, 0.05, 0.075, 0.1),
}


@cache
def one_way() -> Campaign:
    """The cylinder that rubs, while it extends: Coulomb friction is then a constant force."""
    rows = round(2.2 / PERIOD / 8)
    records = [
        _moving(made(rubbing(), name, np.repeat(levels, rows), seed))
        for seed, (name, levels) in enumerate(COMMANDS.items(), 1)
    ]
    still = made(rubbing(), "still", np.zeros(round(1.0 / PERIOD)), 4)
    return Campaign(Path("one way"), "festo-tp511", (still,), (records[0], records[1]), (records[2],))


def _moving(record: Record) -> Record:
    """Without its start from rest."""
    rows = round(0.1 / PERIOD)
    return Record(record.name, record.t[rows:] - record.t[rows], {n: v[rows:] for n, v in record.signals.items()})


@cache
def plan() -> Outcome:
    return run_plan(one_way(), load_rig("festo-tp511"), no_checkpoint, lambda _: None, ALTERNATIVES)


@cache
def fitted() -> tuple[EstimationProblem, FittedModel]:
    with one_blas_thread():
        problem = estimation_problem(one_way(), load_rig("festo-tp511"))
        return problem, fit_rig(problem)


def _recorded(text: str, folder: Path) -> Record:
    """What the rig that rubs records of a file of the plan."""
    (folder / "planned.csv").write_text(text)
    rig = rubbing()
    wave = read_excitation(folder / "planned.csv", rig.period.value, rig["xmid"])
    run, random = play(drive(rig), wave), np.random.default_rng(9)
    assert run.tripped is None
    signals = {n: run.record.signals[n] + s * random.standard_normal(run.record.t.size) for n, s in SIGMA.items()}
    return Record("planned", run.record.t, {"command": run.record.signals["command"], **signals})


def test_effects_that_look_alike_are_split_by_the_record_that_is_planned():
    (pair,) = plan().metrics["pairs"]
    assert set(pair["effects"]) == {"jack.friction", "load.bias"}
    assert pair["cosine"] > 0.99
    assert pair["after"][pair["best"]] < 0.5
    first, second = pair["effects"]
    assert pair["played"]["cosine"] < ALIKE
    assert pair["played"][first] > 0.98 > 0.8 > pair["played"][second]


def test_records_come_best_first_as_files_that_the_rig_takes(tmp_path: Path):
    records = plan().metrics["records"]
    assert records
    assert {pair["best"] for pair in plan().metrics["pairs"]} <= {row["record"] for row in records}
    assert [row["information"] for row in records] == sorted((row["information"] for row in records), reverse=True)
    assert set(plan().files) == {row["file"] for row in records}
    rig = load_rig("festo-tp511")
    for row in records:
        (tmp_path / row["file"]).write_text(plan().files[row["file"]])
        wave = read_excitation(tmp_path / row["file"], rig.period.value, rig["xmid"])
        assert wave.t[-1] == pytest.approx(SECONDS, rel=1e-3)
        assert trouble(play(drive(rig), wave)) is None


def test_a_trace_with_the_planned_record_breaks_the_tie(tmp_path: Path):
    rig, best = load_rig("festo-tp511"), plan().metrics["pairs"][0]["best"]
    before = run_trace(one_way(), rig, ALTERNATIVES, no_checkpoint, lambda _: None)
    assert before.metrics["verdict"] == "tied"
    assert set(before.metrics["effects"]) == {"jack.friction", "load.bias"}
    assert "jackbench plan CAMPAIGN" in render(before.page)
    more = replace(one_way(), train=(*one_way().train, _recorded(plan().files[f"{best}.csv"], tmp_path)))
    after = run_trace(more, rig, ALTERNATIVES, no_checkpoint, lambda _: None)
    assert (after.metrics["verdict"], after.metrics["effects"]) == ("named", ["jack.friction"])


def test_the_report_says_which_record_splits_which_pair():
    text, row = render(plan().page), plan().metrics["records"][0]
    assert row["file"] in plan().page.verdict
    assert "Cosine after each record" in text
    assert "Effects as they are compared" in text


def test_cosines_of_the_information_are_those_of_the_score_test():
    problem, model_fit = fitted()
    candidates = [Candidate(LIBRARY[0], {"Fc": 60.0}), Candidate(SMALL_BIAS, {"F": 50.0})]
    effects = effect_information(problem, model_fit, candidates)
    fit, windows = model_fit.fit, problem.train
    plain = model_fit.model.errors(windows, fit.x0, fit.p)
    rest, shapes = NuisanceProjection(model_fit.model, windows, fit), []
    for model, each in zip(effects.models, candidates, strict=True):
        change = effect_change(model, model_fit.model, windows, fit, each.effect, each.start, plain)
        assert change is not None
        shapes.append(rest(change))
    direct = shapes[0] @ shapes[1] / np.linalg.norm(shapes[0]) / np.linalg.norm(shapes[1])
    assert cosines(effects_alone(effects.of_fit(windows), fit))[0, 1] == pytest.approx(abs(direct), abs=0.01)


def test_further_information_only_shortens_intervals():
    problem, model_fit = fitted()
    effects, fit = effect_information(problem, model_fit, ()), model_fit.fit
    more = effects.of_further(problem.heldout)
    sharper = sharpened(fit, more, problem.kappa)
    assert np.all(np.diag(sharper.covariance) <= np.diag(fit.covariance) * (1 + 1e-9))
    assert np.all(np.linalg.eigvalsh(more) > -1e-6 * np.abs(more).max())


def test_every_design_of_the_family_fits_the_rig():
    rig = load_rig("jack-10t")
    ready = drive(rig)
    for name in ("steps-position", "triangle-creep", "multisine-fast"):
        record = planned(ready, name, family(rig)[name])
        assert record is not None
        assert trouble(play(ready, record.played)) is None


def test_a_rig_without_position_sensor_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    rig = load_rig("festo-tp511")
    sensors = {name: sensor for name, sensor in rig.sensors.items() if name != "position"}
    folder = written(rubbing_campaign(), tmp_path / "made", "rig.toml")
    (folder / "rig.toml").write_text(rig_text(replace(rig, sensors=sensors)))
    assert main(["plan", str(folder), "--out", str(tmp_path / "out")]) == 2
    assert "[sensors.position]" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_what_a_campaign_tells_apart_needs_no_record():
    outcome = run_plan(
        campaign(load_rig("festo-tp511")), load_rig("festo-tp511"), no_checkpoint, lambda _: None, ALTERNATIVES
    )
    assert outcome.metrics["pairs"] == []
    assert all(row["splits"] == [] for row in outcome.metrics["records"])


def test_an_effect_with_which_a_rig_has_no_rest_ends_no_plan(monkeypatch):
    def restless(_):
        raise InputError("no equilibrium there")

    rig = load_rig("jack-10t")
    wave = planned(drive(rig), name := next(iter(family(rig))), family(rig)[name])
    assert wave is not None
    monkeypatch.setattr(study, "drive", restless)
    assert study._JackPlayer(rig, ("position",)).log(wave) is None


def test_the_drive_of_a_valve_with_play_is_that_of_the_valve_without():
    """Its slope at null is 0: what a moving jack gains from its command is the gain."""
    rig = load_rig("festo-tp511")
    slack = next(effect for effect in effects_for(rig) if effect.title == "pilot.hysteresis magnet play")
    worn = study.with_effect(rig, Candidate(slack, at_strength(slack, 3.0)))
    assert drive(worn).loop.design.gain == pytest.approx(drive(rig).loop.design.gain, rel=0.1)
