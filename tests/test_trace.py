"""Traces: of a small cylinder whose friction we know, of a slice of a practice campaign, of torn records."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_campaigns import (
    LIBRARY,
    SIGMA,
    campaign,
    commands,
    found,
    made,
    named,
    none,
    rubbing,
    rubbing_campaign,
    unknown,
    written,
)

from workbench.base.errors import InputError
from workbench.base.process_pool import one_blas_thread
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.common.run_folder import metrics_json
from workbench.commands.residual.study import run_residual
from workbench.commands.trace.answer import TraceAnswer
from workbench.commands.trace.metrics import trace_json
from workbench.commands.trace.study import identity, run_trace, trace_campaign, traced
from workbench.identify.fit.normal_equations import numbers_at
from workbench.identify.trace.problem import estimation_problem
from workbench.identify.trace.refit import fit_rig, heldout_errors, numbers_explain
from workbench.identify.trace.tracer import trace
from workbench.plant.effects import LIBRARY as WHOLE, find
from workbench.plant.effects.declared import effects_for
from workbench.records import Record, load_campaign
from workbench.report import render
from workbench.rigs.rig_file import load_rig, rig_text

ROOT = Path(__file__).parents[1]
SHARED = ROOT.parent / "shared" / "campaigns"
RIG = load_rig("festo-tp511")


# --- what is found


def test_friction_is_found_with_its_number():
    answer = json.loads(named().files["trace.json"])
    assert (answer["verdict"], answer["effects"], answer["equation"]) == ("named", ["jack.friction"], "force")
    value, low, high = answer["ranking"][0]["parameters"]["Fc [N]"]
    assert low < value < high
    assert abs(60 - value) < high - low
    assert answer["chi2"]["before"] > 5
    assert answer["chi2"]["after"] < 1.05


def test_the_answer_is_what_the_contract_says():
    answer = json.loads(named().files["trace.json"])
    assert list(answer) == ["verdict", "effects", "equation", "ranking", "chi2", "rms", "learned", "numbers"]
    assert answer["learned"] == answer["numbers"] == []
    assert list(answer["chi2"]) == ["before", "after"]
    for one in answer["ranking"]:
        assert list(one) == ["effect", "formula", "explained", "parameters"]
        assert all(len(interval) == 3 for interval in one["parameters"].values())
        assert 0 <= one["explained"] <= 1.05
    assert set(answer["rms"]) == {"spool [mm]", "pa [bar]", "pb [bar]", "position [mm]"}
    for row in answer["rms"].values():
        assert list(row) == ["before", "after", "floor"]
        assert 0 < row["after"] <= 1.1 * row["before"]
    assert answer["rms"]["pa [bar]"]["floor"] == pytest.approx(SIGMA["pa"] / 1e5, rel=0.1)
    metrics = json.loads(metrics_json(named().metrics))
    assert {key: metrics[key] for key in answer} == answer
    low, value, high = (metrics["base"]["M [kg]"][k] for k in (1, 0, 2))
    assert low < value < high
    assert metrics["evidence"]["force"] == max(metrics["evidence"].values())


def test_the_answer_in_python_says_the_sentence_and_writes_the_report(tmp_path):
    (tmp_path / "found.toml").write_text(named().files["rig.toml"])
    rig = load_rig(str(tmp_path / "found.toml"))
    answer = TraceAnswer(found(), rig, named(), identity(rubbing_campaign(), RIG, (), (), False))
    assert str(answer) == answer.sentence == named().page.verdict
    assert repr(answer).startswith(answer.sentence)
    assert "jack.friction" in repr(answer)
    assert (answer.verdict, answer.effects, answer.equation) == ("named", ("jack.friction",), "force")
    assert answer.ranking[0]["effect"] == "jack.friction"
    assert "<table>" in answer._repr_html_()
    page = answer.report(tmp_path / "out")
    assert page.is_file()
    assert json.loads((tmp_path / "out" / "trace.json").read_text())["verdict"] == "named"
    assert load_rig(str(tmp_path / "out" / "rig.toml")).effects == rig.effects
    with pytest.raises(InputError, match="exists already"):
        answer.report(tmp_path / "out")


def test_a_campaign_folder_is_traced_in_one_call(tmp_path):
    folder = written(rubbing_campaign(), tmp_path)
    others = [effect.name for effect in effects_for(RIG) if effect.name != "jack.friction"]
    answer = trace_campaign(folder, RIG, without=others)
    assert answer.effects == ("jack.friction",)
    assert [use.name for use in answer.rig.effects] == ["jack.friction"]


def test_a_later_fit_may_move_the_numbers_of_a_found_effect(tmp_path):
    """Within the effect's ranges, from where this one knows them."""
    (tmp_path / "found.toml").write_text(named().files["rig.toml"])
    rig = load_rig(tmp_path / "found.toml")
    (use,), (effect,) = rig.effects, found().final.effects
    for number in effect.fitted:
        own = use.numbers[number.name]
        assert (own.low, own.high) == pytest.approx((number.low, number.high))
        assert own.interval is not None
        assert own.interval[0] < own.value < own.interval[1]
    free = {parameter.name for parameter in estimation_problem(rubbing_campaign(), rig).free}
    assert {effect.key(number.name) for number in effect.fitted} <= free


def test_residual_of_the_rig_as_found_is_the_chi2_after(tmp_path):
    (tmp_path / "found.toml").write_text(named().files["rig.toml"])
    rig = load_rig(tmp_path / "found.toml")
    assert [use.name for use in rig.effects] == ["jack.friction"]
    assert "fitted to made" in rig.numbers["M"].source
    assert (rig.numbers["M"].low, rig.numbers["M"].high) == (RIG.numbers["M"].low, RIG.numbers["M"].high)
    chi2 = run_residual(rubbing_campaign(), rig, no_checkpoint, lambda _: None).metrics["chi2"]
    assert chi2 == pytest.approx(named().metrics["chi2"]["after"], rel=1e-4)
    assert rig_text(load_rig(tmp_path / "found.toml")) == named().files["rig.toml"]


def test_a_rig_that_declares_the_effect_lacks_nothing():
    """With friction in the rig file nothing is traced, and friction is not tried again."""
    assert "jack.friction" not in {effect.name for effect in effects_for(rubbing())}
    answer = none().metrics
    assert (answer["verdict"], answer["effects"], answer["equation"]) == ("none", [], None)
    assert answer["ranking"] == []
    assert answer["chi2"]["before"] == answer["chi2"]["after"] < 1.05


def test_without_the_effect_nothing_is_named_and_its_curve_is_learned():
    answer = unknown().metrics
    assert (answer["verdict"], answer["effects"], answer["equation"]) == ("unknown", [], "force")
    assert answer["failed"] == {}
    (learned,) = answer["learned"]
    assert (learned["slot"], learned["kind"], learned["variables"]) == ("friction", "curve", ["|velocity|"])
    assert answer["chi2"]["after"] == learned["chi2"] < 1.05


def test_a_user_s_own_effect_is_found_and_its_file_is_kept(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(
        "import casadi as ca\n"
        "from workbench.plant.effects import effect, number\n"
        '@effect("my.rub", "tanh", equation="force", slot="friction", source="ours", shows="reversals",\n'
        '        numbers=(number("F", 50.0, "N", low=0.0, high=500.0, off=0.0, meaning="rub"),))\n'
        "def rub(friction, s):\n"
        '    return friction + s.p("F") * ca.tanh(s["velocity"] / 2e-3)\n'
    )
    library = [effect for effect in effects_for(RIG, [file]) if effect.name == "my.rub"]
    outcome = run_trace(rubbing_campaign(), RIG, library, no_checkpoint, lambda _: None, [str(file)])
    assert outcome.metrics["effects"] == ["my.rub"]
    (tmp_path / "found.toml").write_text(outcome.files["rig.toml"])
    rig = load_rig(tmp_path / "found.toml")
    assert rig.effect_files == (str(file),)
    chi2 = run_residual(rubbing_campaign(), rig, no_checkpoint, lambda _: None).metrics["chi2"]
    assert chi2 == pytest.approx(outcome.metrics["chi2"]["after"], rel=1e-4)


@pytest.mark.skipif(not (SHARED / "p02").is_dir(), reason="the practice campaigns are not beside the project")
def test_a_slice_of_a_practice_campaign_is_traced():
    """p02 comes from another simulator, with Stribeck friction; a few seconds of it are enough."""
    whole = load_campaign(SHARED / "p02")
    steps, triangle = whole.train
    short = replace(
        whole, train=(steps.slice(0.0, 2.0), triangle.slice(0.0, 2.0)), heldout=(whole.heldout[0].slice(0.0, 2.0),)
    )
    library = [find("main.deadband", "smooth"), find("jack.friction", "stribeck")]
    answer = run_trace(short, load_rig("jack-10t"), library, no_checkpoint, lambda _: None).metrics
    assert answer["effects"] == ["jack.friction"]
    assert answer["chi2"]["after"] < 1.15 < answer["chi2"]["before"]


# --- which records may say what


@pytest.mark.usefixtures("right_columns")
def test_what_is_found_does_not_depend_on_the_held_out_records():
    """They are looked at when all is decided: other ones leave every fit and every choice as it is."""
    of = rubbing_campaign()
    other = replace(of, heldout=(made(rubbing(200.0), "other", 0.3 * commands(2.0)[2], 9),))
    with one_blas_thread():
        left = trace(estimation_problem(other, RIG), LIBRARY[:1], no_checkpoint, lambda _: None)
    assert left.passes[0].tried[0].judgement == found().passes[0].tried[0].judgement
    np.testing.assert_array_equal(left.passes[0].tried[0].refitted.fit.x, found().passes[0].tried[0].refitted.fit.x)
    assert left.chi2[0] != found().chi2[0]


@pytest.mark.usefixtures("right_columns")
def test_a_name_that_held_out_records_do_not_bear_out_is_not_given():
    """They come from a rig without friction: with it they are further off, whatever the train records say."""
    of = rubbing_campaign()
    smooth = replace(of, heldout=(made(RIG, "smooth", commands(2.0)[2], 9),))
    outcome = run_trace(smooth, RIG, LIBRARY[:1], no_checkpoint, lambda _: None)
    assert (outcome.metrics["verdict"], outcome.metrics["effects"]) == ("unknown", [])
    assert "the held-out records do not bear it out" in outcome.page.verdict
    assert outcome.metrics["chi2"]["after"] == outcome.metrics["chi2"]["before"]


@pytest.mark.usefixtures("right_columns")
def test_records_under_select_choose():
    """Selected by records without friction, friction is not even a candidate."""
    of = rubbing_campaign()
    with one_blas_thread():
        own = estimation_problem(replace(of, select=(made(rubbing(), "again", commands(2.0)[2], 8),)), RIG)
        left = trace(own, LIBRARY[:1], no_checkpoint, lambda _: None, learns=False)
        wrong = estimation_problem(replace(of, select=(made(RIG, "smooth", commands(2.0)[2], 8),)), RIG)
        right = trace(wrong, LIBRARY[:1], no_checkpoint, lambda _: None, learns=False)
    assert (left.verdict, left.final.samples) == ("named", own.select.samples)
    assert not right.effects


# --- verdicts as trace.json tells them


def test_tied_effects_are_listed_best_first():
    tied = replace(found().effects[0], tied=("load.bias", "load.spring"))
    answer = trace_json(replace(found(), verdict="tied", effects=(tied,)))
    assert answer["effects"] == ["jack.friction", "load.bias", "load.spring"]


def test_an_unfinished_effect_is_listed():
    assert trace_json(replace(found(), verdict="incomplete"))["effects"] == ["jack.friction"]


def test_nothing_is_listed_where_nothing_is_named():
    before = found().heldout[0]
    left = replace(
        found(), verdict="unknown", effects=(), final=found().base, named=found().base, heldout=(before,) * 3
    )
    answer = trace_json(left)
    assert answer["effects"] == []
    assert [one["effect"] for one in answer["ranking"]] == ["jack.friction"]
    assert answer["chi2"]["before"] == answer["chi2"]["after"]


def test_a_study_gets_the_answer_of_a_folder(tmp_path):
    """Without what is removed; with the fitted numbers of the rig beside the keys of trace.json."""
    folder = written(rubbing_campaign(), tmp_path / "camp")
    removed = tuple({effect.name for effect in WHOLE} - {"jack.friction"})
    answer = traced(folder, removed)
    assert answer["effects"] == ["jack.friction"]
    assert {one["effect"] for one in answer["ranking"]} == {"jack.friction"}
    assert "M [kg]" in answer["base"]


def test_every_sample_is_left_in_tables():
    (columns,) = named().tables.values()
    assert list(named().tables) == ["heldout-sines"]
    labels = ("measured", "fitted rig alone", "with jack.friction")
    assert {f"{label} pa [bar]" for label in labels} <= columns.keys()
    assert {len(column) for column in columns.values()} == {rubbing_campaign().heldout[0].t.size}
    (columns,) = none().tables.values()
    assert "fitted rig pa [bar]" in columns


def with_only(record: Record, *names: str) -> Record:
    return Record(record.name, record.t, {name: record.signals[name] for name in ("command", *names)})


def torn(record: Record) -> Record:
    """Without a few samples, as a busy logger leaves it."""
    keep = np.ones(record.t.size, bool)
    keep[[130, 131, 400, 401, 402, 700]] = False
    return Record(record.name, record.t[keep], {name: values[keep] for name, values in record.signals.items()})


@pytest.mark.parametrize("how", ["held out with less", "fitted with less", "no static", "torn"])
def test_records_need_not_be_whole_or_alike(how):
    of = rubbing_campaign()
    changed = {
        "held out with less": {"heldout": tuple(with_only(one, "pa", "pb") for one in of.heldout)},
        "fitted with less": {"train": tuple(with_only(one, "pa", "position") for one in of.train)},
        "no static": {"static": ()},
        "torn": {"train": tuple(map(torn, of.train)), "heldout": tuple(map(torn, of.heldout))},
    }[how]
    outcome = run_trace(replace(of, **changed), RIG, LIBRARY[:1], no_checkpoint, lambda _: None)
    assert outcome.metrics["effects"] == ["jack.friction"]
    carried = {name for one in changed.get("heldout", of.heldout) for name in one.signals} - {"command"}
    assert {name.split()[0] for name in outcome.metrics["rms"]} == carried
    assert "jack.friction" in render(outcome.page)


@pytest.mark.parametrize(("force", "numbers_alone"), [(0.0, True), (60.0, False)])
def test_numbers_explain_what_numbers_miss_and_no_friction(force, numbers_alone):
    """A fit whose numbers are off misses the held-out record; so does one without the friction of the rig."""
    problem = estimation_problem(campaign(rubbing(force) if force else RIG), RIG)
    fit = fit_rig(problem)
    x = fit.fit.x + (0.0 if force else 0.3)
    moved = replace(fit, fit=replace(fit.fit, x=x, p=numbers_at(fit.model, fit.fit.free, x, fit.fit.p)))
    errors = heldout_errors(problem, moved)
    assert problem.misses(errors.chi2, errors.samples)
    assert numbers_explain(problem, moved, errors) is numbers_alone
