"""Training: what an experiment says is searched, and what a run leaves."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.base.checkpoint import no_checkpoint
from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.run.options import load_config
from workbench.commands.train.options import load_train
from workbench.commands.train.unseen import unseen_rows
from workbench.control.network import read_network
from workbench.loop import envelope
from workbench.loop.hard_goals import largest_ms
from workbench.loop.tuning.goals import tuning_envelope

EXPERIMENTS = Path(__file__).parents[1] / "experiments"


def written(folder: Path, *changes: tuple[str, str]) -> Path:
    """The shipped experiment, changed: a few designs on the nominal rig alone."""
    text = (EXPERIMENTS / "train_p_dp.toml").read_text()
    text = re.sub(r"designs = \d+", "designs = 6", text).replace("seeds = [1, 2, 3]", "seeds = [1, 2]")
    before, _, after = text.partition("# plants are drawn")
    text = before + "[goals]" + after.partition("[goals]")[2]
    text = text.replace('rigs = ["nominal", "mass-50", "mass+50", "beta-50", "supply-20"]', 'rigs = ["nominal"]')
    text = text.replace('scenarios = ["position-10mm", "position-load-20kn"]', 'scenarios = ["position-10mm"]')
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "mine.toml").write_text(text)
    return folder / "mine.toml"


def start(config):
    return config.problem.design({number.name: number.start for number in config.searched})


def test_a_training_leaves_what_run_takes(tmp_path, monkeypatch, capsys):
    """Six designs: p-dp alone is the start, and the answer where none is better."""
    monkeypatch.chdir(tmp_path)
    written(tmp_path)
    assert main(["train", "mine.toml", "--jobs", "1", "--out", "out"]) == 0
    assert "policy" in capsys.readouterr().out
    metrics = json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert metrics["evaluations"] == 12
    (trained,) = load_config(tmp_path / "out" / "trained.toml").controllers
    assert trained.compensators[-1].design.network.numbers.tolist() == metrics["best"]["weights"]
    assert main(["run", "out/trained.toml", "--out", "run"]) == 0
    head, _, _ = (EXPERIMENTS / "robustness.toml").read_text().partition("[from]")
    (tmp_path / "robust.toml").write_text(head + '[from]\n"out/trained.toml" = ["p-dp"]\n')
    assert main(["robustness", "robust.toml", "--plants", "20", "--out", "robust"]) == 0
    (row,) = json.loads((tmp_path / "robust" / "metrics.json").read_text())["rows"]
    assert row["unstable"] == row["tripped"] == 0


def test_the_start_is_the_law_itself(tmp_path):
    config = load_train(written(tmp_path))
    assert len(config.searched) == 36
    assert all(number.is_weight and number.start == 0 for number in config.searched)
    assert config.trained({number.name: number.start for number in config.searched}) == config.network


def test_a_network_with_a_history_has_its_further_low_passes_and_what_it_remembers(tmp_path):
    """Nine inputs, each with a weight and a gate in six units; the start still is the law itself."""
    text = '[network]\nfurther = [1, 10]\nremembers = {value = 5, unit = "s"}\n'
    config = load_train(written(tmp_path, ("[network]\n", text)))
    assert config.network.layers[0][0].shape == config.network.memory.V.shape == (6, 9)
    assert config.network.memory.forgets == pytest.approx(1e-3 / 5)
    assert len(config.searched) == 6 * 9 + 6 + 6 * 9
    values = {number.name: (number.low + 3 * number.high) / 4 for number in config.searched}
    assert config.trained(values).memory.V.tolist() == np.full((6, 9), 1.5).tolist()
    with pytest.raises(InputError, match="8 corners at most"):
        load_train(written(tmp_path, ("[network]\n", "[network]\nfurther = [0]\n")))


def test_biases_are_searched_where_it_need_not_stay_odd(tmp_path):
    config = load_train(written(tmp_path, ("[network]\n", "[network]\nodd = false\n")))
    assert len(config.searched) == 36 + 7


def test_numbers_of_the_law_are_searched_with_the_weights(tmp_path):
    ends = '{value = 5.061, low = 2, high = 10, unit = "1/m"}'
    config = load_train(written(tmp_path, ('{value = 5.061, unit = "1/m"}', ends)))
    assert [number.name for number in config.searched if not number.is_weight] == ["gain"]
    table = config.step_table({number.name: number.start for number in config.searched}, "jack-10t")
    assert table["controllers"]["p-dp"]["gain"] == {"value": 5.061, "unit": "1/m"}
    assert table["controllers"]["p-dp"]["compensators"][-1]["network"] == "policy.npz"


def test_a_policy_by_itself_is_trained_too(tmp_path):
    path = written(tmp_path)
    head, _, rest = path.read_text().partition("[controllers.p-dp]")
    alone = '[controllers.alone]\nuse = "controllers.policy:Policy"\n'
    path.write_text(head + alone + "[network]" + rest.partition("[network]")[2])
    assert start(load_train(path)).design.network.layers[0][0].shape == (6, 5)


def test_a_training_goes_on_from_a_file(tmp_path):
    first = load_train(written(tmp_path)).network
    weights = np.where(first.are_biases, 0.0, 0.1)
    (tmp_path / "before.npz").write_bytes(first.with_numbers(weights).packed())
    path = written(tmp_path)
    head, _, rest = path.read_text().partition("[network]")
    table = rest.partition("[bode]")[2]
    path.write_text(head.replace('rig = "jack-10t"\n', 'rig = "jack-10t"\nnetwork = "before.npz"\n') + "[bode]" + table)
    config = load_train(path)
    assert start(config).compensators[-1].design.network == read_network(tmp_path / "before.npz")
    assert len(config.searched) == 36


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('"train"', '"tune"', '"tune" is not "train"; jackbench tune takes it'),
        ('"train"', '"paper"', '"paper" is not "train"; jackbench run takes it'),
        ("seeds = [1, 2]", "seeds = [1, 1]", "seeds"),
        ("hidden = [6]", "hidden = [6.5]", "hidden"),
        ("hidden = [6]", "hidden = [6]\nunits = 3", "unknown key"),
        ('limit = {value = 0.1, unit = "1"}', 'limit = {value = 2, unit = "1"}', "outside"),
        ("gain = {value = 5.061", 'stiffness = "10 kN/mm"\ngain = {value = 5.061', "take stiffness out"),
    ],
)
def test_what_no_training_is_is_refused_in_one_line(tmp_path, old, new, says):
    with pytest.raises(InputError, match=says) as error:
        load_train(written(tmp_path, (old, new)))
    assert "\n" not in str(error.value)


def test_start_and_trained_are_judged_on_plants_that_no_run_has_seen(tmp_path, monkeypatch):
    """Twelve plants by another seed than those of the search; the same row for the same design."""
    draw = ("[goals]", "[within]\nM = [0.5, 1.5]\n[goals]")
    config = load_train(written(tmp_path, draw))
    monkeypatch.setattr("workbench.loop.envelope.DRAWN", 12)
    values = {number.name: number.start for number in config.searched}
    first, second = unseen_rows(config.problem, {"start": values, "trained": values}, no_checkpoint)
    assert (first["design"], second["design"]) == ("start", "trained")
    assert {**first, "design": ""} == {**second, "design": ""}
    assert first["plants"] == 12
    assert first["unstable"] == first["tripped"] == 0
    assert 0.05 < first["settling_p50_s"] <= first["settling_p99_s"] <= first["settling_worst_s"] < 0.2
    seen, unseen = (tuning_envelope(replace(config.problem, seed=seed)).drawn for seed in (1, 2))
    assert seen is not None
    assert unseen is not None
    assert first["ms_worst"] == largest_ms(unseen, start(config).build(1e-3)).max()
    assert not np.array_equal(unseen.p, seen.p)


def test_what_a_history_remembers_of_a_move_tells_mass_and_oil(monkeypatch):
    """Energies of what the network is shown, over one move: a quadratic of their logarithms, on plants it was not
    fitted to."""
    monkeypatch.setattr(envelope, "DRAWN", 160)
    problem = load_train(EXPERIMENTS / "train_history.toml").problem
    lanes = tuning_envelope(problem).drawn
    law = problem.design({n.name: n.start for n in problem.searched}).build(problem.rig.period.value)
    kept = envelope.steps(lanes, law, problem.scenarios[0], 1, 1.0).remembered
    shares = np.log(kept + 1e-6) - np.log(kept.sum(axis=1, keepdims=True))
    told = np.column_stack((np.ones(len(shares)), shares, shares**2))
    for name, left in (("M", 0.05), ("beta", 0.1)):
        true = np.log(lanes.p[:, lanes.engine.plant.parameters.index(name)])
        weights = np.linalg.lstsq(told[:120], true[:120], rcond=None)[0]
        assert np.std(true[120:]) > 0.2
        assert np.std(true[120:] - told[120:] @ weights) < left
