"""A fit of a rig: numbers with intervals, what the records do not see, what stands at an end, and the rig file."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from made_campaigns import campaign, rubbing, rubbing_campaign, written

from workbench.base.errors import InputError
from workbench.base.words import listed
from workbench.cli import main
from workbench.commands.common.outcome import Outcome, no_checkpoint
from workbench.commands.common.run_folder import metrics_json
from workbench.commands.fit.page import groups
from workbench.commands.fit.study import run_fit
from workbench.commands.residual.study import run_residual
from workbench.plant import build
from workbench.plant.effects import LIBRARY
from workbench.plant.effects.declared import _inside
from workbench.records import Campaign
from workbench.report import render
from workbench.rigs.rig import Rig
from workbench.rigs.rig_file import load_rig, save_rig

RIG = load_rig("festo-tp511")
TRUE = {"K3": 6.2e-5, "M": 7.0, "b": 120.0, "f0": 60.0}


@cache
def quiet() -> Campaign:
    """Records of the cylinder with other numbers, and nothing else missing."""
    return campaign(RIG.with_values(**TRUE))


def narrowed() -> Rig:
    """Two of its numbers that the records cannot find: an end stop that is never reached, a gain out of range."""
    numbers = dict(RIG.numbers)
    numbers["ke"] = replace(numbers["ke"], low=5e6, high=2e7)
    numbers["K3"] = replace(numbers["K3"], low=5e-5, high=6e-5)
    return replace(RIG, numbers=numbers)


@cache
def fitted(rig: str = "whole") -> Outcome:
    return run_fit(quiet(), RIG if rig == "whole" else narrowed(), 2, no_checkpoint, lambda _: None)


def test_the_metrics_are_what_the_contract_says():
    metrics = json.loads(metrics_json(fitted().metrics))
    assert {"parameters", "chi2", "unseen"} <= metrics.keys()
    assert list(metrics["chi2"]) == ["train", "heldout"]
    bounded = [number for number in RIG.numbers.values() if number.low is not None]
    assert list(metrics["parameters"]) == [f"{number.name} [{number.si}]" for number in bounded]
    for value, low, high in metrics["parameters"].values():
        assert low <= value <= high


def test_the_numbers_are_found():
    metrics = fitted().metrics
    assert metrics["chi2"]["heldout"] == pytest.approx(1.0, abs=0.06)
    true = RIG.with_values(**TRUE)
    held = {name.split()[0]: interval for name, interval in metrics["parameters"].items()}
    inside = [low <= true[name] <= high for name, (_, low, high) in held.items()]
    assert np.mean(inside) >= 0.8
    assert held["K3"][0] == pytest.approx(TRUE["K3"], rel=5e-3)
    assert metrics["at_an_end"] == []


def test_what_is_not_seen_and_what_is_at_an_end_is_said():
    outcome = fitted("narrowed")
    assert set(outcome.metrics["unseen"]) == {"S", "xmid", "ke"}  # where the end stops are, and how stiff
    assert "K3" in outcome.metrics["at_an_end"]
    assert outcome.metrics["chi2"]["heldout"] > 1.06
    page = render(outcome.page)
    for words in (
        "the model misses something",
        "At an end of its range: ",
        f"{listed(outcome.metrics['pinned'])} are pinned: without bounds no fit moves them.",
        "Not seen by these records: S, xmid, ke",
        "not seen",
    ):
        assert words in page


def test_correlations_are_those_of_the_numbers_in_order():
    correlations = fitted().metrics["correlations"]
    matrix = np.array(correlations["matrix"])
    assert correlations["names"] == [name.split()[0] for name in fitted().metrics["parameters"]]
    assert matrix == pytest.approx(matrix.T)
    assert np.diag(matrix) == pytest.approx(1.0)
    assert np.abs(matrix).max() < 1 + 1e-9


def test_the_errors_fall_from_those_of_the_rig_file():
    rms = fitted().metrics["rms"]
    assert set(rms) == {"spool [mm]", "pa [bar]", "pb [bar]", "position [mm]"}
    assert all(row["after"] < row["before"] for row in rms.values())
    assert all(row["after"] == pytest.approx(row["floor"], rel=0.15) for row in rms.values())


def test_the_rig_file_has_the_fitted_numbers(tmp_path):
    (tmp_path / "fitted.toml").write_text(fitted().files["rig.toml"])
    rig = load_rig(tmp_path / "fitted.toml")
    assert rig.numbers["K3"].source.startswith("fitted to made")
    assert (rig.numbers["K3"].low, rig.numbers["K3"].high) == pytest.approx((2e-5, 2e-4))
    assert rig.numbers["K3"].interval == pytest.approx(tuple(fitted().metrics["parameters"]["K3 [m^2/s/Pa^0.5]"][1:]))
    assert rig.numbers["z3max"] == RIG.numbers["z3max"]
    chi2 = run_residual(quiet(), rig, no_checkpoint, lambda _: None).metrics["chi2"]
    assert chi2 == pytest.approx(fitted().metrics["chi2"]["heldout"], rel=1e-4)


@pytest.mark.parametrize("effect", LIBRARY, ids=lambda effect: effect.title)
def test_a_number_at_an_end_of_its_range_survives_a_rig_file(effect):
    """What is written in the unit that people read must not come back beyond the range."""
    for number in effect.numbers:
        for end in (number.low, number.high):
            assert _inside(number, end) == pytest.approx(end, rel=1e-9, abs=1e-9 * (number.high - number.low))


# --- the command


def test_the_command_leaves_the_rig_where_it_is_told(tmp_path, capsys):
    folder = written(quiet(), tmp_path / "camp")
    out, rig = tmp_path / "out", tmp_path / "fitted.toml"
    assert main(["fit", str(folder), "--starts", "1", "--out", str(out), "--rig-out", str(rig)]) == 0
    assert "start 1" in capsys.readouterr().err
    assert rig.read_text() == (out / "rig.toml").read_text()
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["chi2"]["heldout"] == pytest.approx(1.0, abs=0.06)
    assert (out / "heldout-sines.parquet").exists()
    again = tmp_path / "again"
    assert_refused(
        ["fit", str(folder), "--out", str(again), "--rig-out", str(rig)], ["--rig-out", "--force"], again, capsys
    )


def test_a_free_run_may_be_asked_for_and_is_what_the_campaign_s_score_would_give(tmp_path):
    folder, chi2 = written(quiet(), tmp_path / "camp"), []
    for words in ([], ["--free-run"], []):
        if chi2[1:]:
            (folder / "campaign.toml").write_text('score = "free-run"\n' + (folder / "campaign.toml").read_text())
        out = tmp_path / str(len(chi2))
        assert main(["fit", str(folder), "--starts", "1", "--out", str(out), *words]) == 0
        chi2.append(json.loads((out / "metrics.json").read_text())["chi2"])
    windows, asked, scored = chi2
    assert asked == scored
    assert asked != windows


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["fit", "--starts", "0"], ["--starts 0"]),
        (["fit", "--rig-out", "nowhere/rig.toml"], ["--rig-out", "no folder"]),
        (["fit", "--rig", "bare.toml"], ["no number has bounds"]),
        (["fit", "--rig", "other.toml", "--starts", "1"], ["spool looks 25.4 times too small", "unit"]),
        (["trace", "--without", "jack.frction"], ["--without", 'did you mean "jack.friction"']),
        (["trace", "--effects", "mine.py"], ["mine.py", "no such file"]),
    ],
)
def test_bad_words_are_refused_in_one_line(tmp_path, capsys, words, said):
    folder, out = written(rubbing_campaign(), tmp_path / "camp"), tmp_path / "out"
    numbers = {name: replace(number, low=None, high=None) for name, number in RIG.numbers.items()}
    save_rig(replace(RIG, numbers=numbers), tmp_path / "bare.toml")
    save_rig(RIG.with_values(z3max=25.4e-3), tmp_path / "other.toml")
    words = [str(tmp_path / word) if word in ("bare.toml", "other.toml") else word for word in words]
    assert_refused([words[0], str(folder), *words[1:], "--out", str(out)], said, out, capsys)


def test_a_campaign_without_train_is_refused_in_one_line(tmp_path, capsys):
    folder, out = written(replace(rubbing_campaign(), train=()), tmp_path / "camp"), tmp_path / "out"
    assert_refused(["trace", str(folder), "--out", str(out)], ["no train record"], out, capsys)


def assert_refused(arguments: list[str], said: list[str], out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 2
    (line,) = capsys.readouterr().err.splitlines()
    for word in said:
        assert word in line
    assert not out.exists()
    assert not out.with_name(f"{out.name}.partial").exists()


def test_numbers_that_are_known_only_together_are_told_as_groups():
    matrix = np.eye(5)
    for i, j in ((0, 2), (2, 3)):
        matrix[i, j] = matrix[j, i] = -0.99
    matrix[1, 4] = matrix[4, 1] = 0.9
    assert groups({"names": ["beta", "M", "V0A", "V0B", "b"], "matrix": matrix.tolist()}) == [["beta", "V0A", "V0B"]]
    assert groups({"names": ["beta", "M"], "matrix": np.eye(2).tolist()}) == []


# --- numbers of an effect that the rig declares


def rubbing_within(low: float, high: float, start: float) -> Rig:
    """The cylinder with a friction to be found."""
    rig = rubbing(start)
    (use,) = rig.effects
    bounded = replace(use.numbers["Fc"], unit="kN", low=low, high=high)
    return replace(rig, effects=(replace(use, numbers={"Fc": bounded}),))


def test_a_declared_effect_with_bounds_is_fitted(tmp_path):
    outcome = run_fit(rubbing_campaign(), rubbing_within(0.0, 200.0, 20.0), 1, no_checkpoint, lambda _: None)
    value, low, high = outcome.metrics["parameters"]["jack.friction.Fc [N]"]
    assert low < value < high
    assert value == pytest.approx(60.0, rel=0.05)
    (tmp_path / "fitted.toml").write_text(outcome.files["rig.toml"])
    (use,) = load_rig(tmp_path / "fitted.toml").effects
    assert use.numbers["Fc"].value == pytest.approx(1e-3 * value)  # in kN, as it was declared
    assert (use.numbers["Fc"].low, use.numbers["Fc"].high) == pytest.approx((0.0, 0.2))
    assert "it was 0.02" in use.numbers["Fc"].source


def test_a_rig_with_effects_is_the_same_plant_before_and_after_its_file(tmp_path):
    save_rig(rubbing_within(0.0, 200.0, 20.0), tmp_path / "rig.toml")
    for rig in (rubbing_within(0.0, 200.0, 20.0), load_rig(tmp_path / "rig.toml")):
        plant = build(rig)
        assert plant.p[plant.parameters.index("jack.friction.Fc")] == pytest.approx(20.0)


def test_bounds_beyond_what_an_effect_can_be_are_refused():
    with pytest.raises(InputError, match=r"jack.friction: Fc = -5 N is outside 0 to"):
        build(rubbing_within(-5.0, 200.0, 20.0))
