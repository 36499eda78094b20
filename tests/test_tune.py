"""A search for a controller's numbers, tiny, on the 10 t rig: what it may leave, how it resumes, what it refuses."""

import json

import pytest

from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.common.step_experiment import StepConfig
from workbench.commands.run.options import load_config
from workbench.commands.tune.options import load_tune
from workbench.commands.tune.study import run_tune
from workbench.loop.tuning.goals import Goals
from workbench.loop.tuning.search import nearest_trial, search
from workbench.rigs.rig_file import load_rig, save_rig

CONFIG = """
experiment = "tune"
rig = "jack-10t"
rigs = ["nominal", "mass-50"]
scenarios = ["position-1mm"]
designs = 5
seed = 3
[weights]
settling_s = 10
ms = 0.2
[controllers.p-dp]
use = "controllers.p:P"
gain = {value = 2, low = 0.5, high = 20, unit = "1/m", log = true}
[[controllers.p-dp.compensators]]
use = "controllers.pressure:PressureFeedback"
gain = {low = 1e-4, high = 2e-4, unit = "1/bar"}
corner = {value = 1, unit = "Hz"}
column = {value = 314, unit = "mm"}
[[controllers.p-dp.compensators]]
use = "controllers.lap_inverse:LapInverse"
excess = {value = 1.6e-3, unit = "1"}
width = {value = 2.1e-3, unit = "1"}
[bode]
low_hz = 5
high_hz = 20
points = 3
amplitudes_mm = [1]
"""


def written(folder, text=CONFIG):
    path = folder / "tune_thin.toml"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    return load_tune(written(tmp_path_factory.mktemp("tune")))


@pytest.fixture(scope="module")
def outcome(config):
    return run_tune(config, no_checkpoint, lambda _: None)


def test_the_first_trial_is_the_start_and_the_best_is_no_worse(outcome):
    first, best = outcome.metrics["trials"][0], outcome.metrics["best"]
    assert len(outcome.metrics["trials"]) == 5
    assert first["numbers"]["gain"] == {"value": 2.0, "unit": "1/m"}
    assert first["numbers"]["compensators.1.gain"]["value"] == pytest.approx(1.5e-4)
    assert first["cost"] is None or best["cost"] <= first["cost"]
    assert [(row["rig"], row["scenario"]) for row in best["rows"]] == [
        ("nominal", "position-1mm"),
        ("mass-50", "position-1mm"),
    ]


def test_the_best_meets_every_hard_goal_and_a_design_that_misses_one_has_no_cost(outcome):
    best = outcome.metrics["best"]
    assert best["ms"] <= 2
    assert best["gain_margin_db"] >= 6
    for row in best["rows"]:
        assert row["stable"]
        assert row["tripped"] is None
        assert row["residual_oscillation"] < 0.002
    for trial in outcome.metrics["trials"]:
        assert (trial["cost"] is None) == (trial["missed"] is not None) == (trial["miss"] > 0)


def test_the_tuned_file_is_a_step_experiment_of_the_very_numbers(outcome, tmp_path):
    (tmp_path / "tuned.toml").write_text(outcome.files["tuned.toml"])
    tuned = load_config(tmp_path / "tuned.toml")
    assert isinstance(tuned, StepConfig)
    (chosen,) = tuned.controllers
    numbers = outcome.metrics["best"]["numbers"]
    assert chosen.design.gain == numbers["gain"]["value"]
    assert chosen.compensators[0].design.gain == pytest.approx(
        numbers["compensators.1.gain"]["value"] * 1e-5, rel=1e-12
    )


def test_a_rig_of_a_file_goes_with_the_tuned_file(tmp_path):
    save_rig(load_rig("jack-10t").with_values(M=1100.0), tmp_path / "mine.toml")
    text = (
        CONFIG.replace('"jack-10t"', '"mine.toml"')
        .replace("value = 2,", "value = 1,")
        .replace("designs = 5", "designs = 1")
    )
    files = run_tune(load_tune(written(tmp_path, text)), no_checkpoint, lambda _: None).files
    there = tmp_path / "elsewhere"
    there.mkdir()
    for name, content in files.items():
        (there / name).write_text(content)
    assert load_config(there / "tuned.toml").rig["M"] == 1100.0


class Killed(Exception):
    pass


def test_a_search_that_was_killed_goes_on_as_if_it_was_not(config, outcome):
    kept, computed = {}, []

    def stage(name, compute):
        if name not in kept:
            if len(kept) == 3 and not computed:
                computed.append("killed")
                raise Killed
            kept[name] = compute()
        return kept[name]

    with pytest.raises(Killed):
        run_tune(config, stage, lambda _: None)
    assert len(kept) == 3
    assert run_tune(config, stage, lambda _: None).metrics == outcome.metrics


DRAWN = 60
DRAW = CONFIG.replace("[weights]", "[within]\nM = [0.5, 1.5]\n[weights]").replace("designs = 5", "designs = 10")


@pytest.fixture
def few_drawn(monkeypatch):
    monkeypatch.setattr("workbench.loop.envelope.DRAWN", DRAWN)


def test_the_best_meets_every_hard_goal_on_all_drawn_plants_and_the_first_of_its_kind_counted(tmp_path, few_drawn):
    problem = load_tune(written(tmp_path, DRAW)).problem
    best = nearest_trial(search(problem, no_checkpoint, lambda _: None))
    goals = Goals(problem)
    everywhere = goals.judge(best.values, tuple(range(DRAWN)))
    assert best.drawn < DRAWN
    assert everywhere.missed is None
    limited = [(goal.name, goal.value, goal.where) for goal in everywhere.goals if goal.name.startswith("Ms")]
    assert limited == [(goal.name, goal.value, goal.where) for goal in best.verdict.goals if goal.name.startswith("Ms")]


def test_leading_designs_are_judged_on_the_plants_that_count_at_the_end(tmp_path, few_drawn):
    trials = search(load_tune(written(tmp_path, DRAW)).problem, no_checkpoint, lambda _: None)
    assert [trial.number for trial in trials] == list(range(10))
    assert len({trial.drawn for trial in trials}) == 1  # so few that all lead


def test_a_search_on_drawn_plants_that_was_killed_goes_on_as_if_it_was_not(tmp_path, few_drawn):
    problem, stored, limit = load_tune(written(tmp_path, DRAW)).problem, {}, 4

    def stage(name, compute):
        if name not in stored:
            if len(stored) == limit:
                raise Killed
            stored[name] = compute()
        return stored[name]

    for limit in (4, 9, 1000):
        try:
            trials = search(problem, stage, lambda _: None)
        except Killed:
            assert len(stored) == limit
    assert trials == search(problem, no_checkpoint, lambda _: None)


def test_where_no_design_meets_the_goals_the_verdict_says_which_and_there_is_no_best(tmp_path, capsys):
    text = CONFIG.replace("low = 0.5, high = 20", "low = 30, high = 60").replace("value = 2,", "value = 40,")
    assert main(["tune", str(written(tmp_path, text)), "--out", str(tmp_path / "out")]) == 0
    found = json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert found["best"] is None
    assert found["missed"] == "stable on every plant"
    assert found["missed"] in capsys.readouterr().out
    assert not (tmp_path / "out" / "tuned.toml").exists()


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ('"tune"', '"step"', 'experiment: "step" is not "tune"; jackbench run takes it'),
        ('"mass-50"', '"mass50"', 'rigs: no rig "mass50" in the set; did you mean "mass'),
        ('["nominal", "mass-50"]', '["mass-50"]', 'rigs: must be a list of different names, "nominal" first'),
        ("designs = 5", "designs = 0", "designs = 0: must be a whole number, 1 or more"),
        ("seed = 3", "seed = 0.5", "seed = 0.5: must be a whole number, 0 or more"),
        ("settling_s = 10", "setling_s = 10", 'weights.setling_s: unknown key; did you mean "settling_s"?'),
        ("settling_s = 10", "settling_s = -1", "settling_s = -1: must be a positive number, in 1/s"),
        ("low = 0.5, high = 20", "low = 0.5, high = 5000", "gain: 5000 1/m is outside 0.001 to 1000 1/m"),
        ("low = 0.5, high = 20", "low = 20, high = 0.5", "gain: low must be below high, and above 0 for log"),
        ("value = 2,", "value = 30,", "gain: value 30 must be from low to high"),
        (
            "value = 2, low = 0.5, high = 20",
            "low = 0.5",
            "gain.high: missing",
        ),
        ('gain = {low = 1e-4, high = 2e-4, unit = "1/bar"}', 'gain = {low = 1, high = 2, unit = "mm"}', 'unit "mm"'),
        ("position-1mm", "position-2mm", 'no scenario "position-2mm"'),
        ("[bode]", "[bod]", 'bod: unknown key; did you mean "bode"?'),
    ],
)
def test_bad_input_is_refused_by_name(tmp_path, old, new, complaint):
    path = written(tmp_path, CONFIG.replace(old, new, 1))
    with pytest.raises(InputError) as refused:
        load_tune(path)
    assert complaint in str(refused.value)


def test_what_is_to_be_searched_must_be_said(tmp_path):
    text = CONFIG.replace("value = 2, low = 0.5, high = 20", "value = 2").replace(", log = true", "")
    text = text.replace("low = 1e-4, high = 2e-4", "value = 2e-4")
    with pytest.raises(InputError, match="nothing is searched; give a number low and high"):
        load_tune(written(tmp_path, text))


def test_a_search_is_over_rigs_of_the_experiment_s_own_too(tmp_path):
    save_rig(load_rig("jack-10t").with_values(M=1100.0), tmp_path / "mine.toml")
    own = "[variation.soft]\nfactors = {beta = 0.7}\n[weights]"
    text = CONFIG.replace('"mass-50"]', '"soft", "mine.toml"]').replace("[weights]", own)
    config = load_tune(written(tmp_path, text))
    assert {name: (rig["M"], rig["beta"]) for name, rig in config.rigs.items()} == {
        "nominal": (1000.0, 1e9),
        "soft": (1000.0, pytest.approx(0.7e9)),
        "mine": (1100.0, 1e9),
    }
    save_rig(load_rig("festo-tp511"), tmp_path / "festo.toml")
    with pytest.raises(InputError, match="festo differs in more than numbers"):
        load_tune(written(tmp_path, text.replace("mine.toml", "festo.toml")))
    with pytest.raises(InputError, match=r"variation\.soft: is not in the list"):
        load_tune(written(tmp_path, text.replace('"soft", ', "")))
