"""The trace study: answers scored by hand, campaigns of a plan, resuming, workers, the page."""

import json
from collections import Counter
from dataclasses import asdict
from pathlib import Path

import pytest

from experiments.studies.trace.__main__ import main
from experiments.studies.trace.campaigns.draw import CampaignPlan
from experiments.studies.trace.given import given
from experiments.studies.trace.plan import default_plan
from experiments.studies.trace.score import confusion, failed, judged, odds, scores
from experiments.studies.trace.study import run_trace_study
from workbench.base.errors import InputError
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.common.run_folder import metrics_json, open_run
from workbench.plant.effects import LIBRARY
from workbench.report import render

QUIET = {"pa [bar]": {"before": 4.1, "after": 0.52, "floor": 0.50}}
LOUD = {"pa [bar]": {"before": 4.1, "after": 0.60, "floor": 0.50}}


def truth(kind="single", effects=("jack.friction",), equations=("force",), **more):
    return {"id": "c", "kind": kind, "effects": list(effects), "equations": list(equations), **more}


def answer(verdict, *effects, equation="force", ranking=None, before=11.0, after=1.2, rms=QUIET, **more):
    ranking = [{"effect": e, "formula": "coulomb", "explained": 0.9, "parameters": {}} for e in ranking or effects]
    chi2 = {"before": before, "after": after}
    return {"verdict": verdict, "effects": list(effects), "equation": None if verdict == "none" else equation,
            "ranking": ranking, "chi2": chi2, "rms": rms, **more}  # fmt: skip


PAIR = {"kind": "pair", "effects": ("jack.friction", "oil.air"), "equations": ("force", "flow")}
OFF = {"kind": "off", "effects": ("air drag",)}
JUDGED = {
    "named": ({}, ("named", "jack.friction"), "right"),
    "one of the tied": ({}, ("tied", "load.bias", "jack.friction"), "tied"),
    "said to be unfinished": ({}, ("incomplete", "jack.friction"), "incomplete"),
    "another name": ({}, ("named", "load.bias"), "wrong"),
    "one too many": ({}, ("named", "jack.friction", "oil.air"), "wrong"),
    "not among the tied": ({}, ("tied", "load.bias", "oil.air"), "wrong"),
    "unknown": ({}, ("unknown",), "unknown"),
    "not seen": ({}, ("none",), "missed"),
    "a quiet rig": ({"kind": "clean", "effects": (), "equations": ()}, ("none",), "right"),
    "a false alarm": ({"kind": "clean", "effects": (), "equations": ()}, ("unknown",), "wrong"),
    "off-library": (OFF, ("unknown",), "right"),
    "off-library, a name": (OFF, ("incomplete", "jack.friction"), "wrong"),
    "off-library, not seen": (OFF, ("none",), "missed"),
    "off-library, elsewhere": (OFF | {"equations": ("flow",)}, ("unknown",), "other equation"),
    "both": (PAIR, ("named", "oil.air", "jack.friction"), "both"),
    "one of two": (PAIR, ("incomplete", "oil.air"), "one, incomplete"),
    "one of two, as if it were all": (PAIR, ("named", "oil.air"), "one"),
    "one of two, tied": (PAIR, ("tied", "oil.air", "load.bias"), "one"),
    "neither": (PAIR, ("named", "oil.air", "load.bias"), "wrong"),
}


@pytest.mark.parametrize("what", JUDGED)
def test_an_answer_beside_the_truth(what):
    drawn, said, result = JUDGED[what]
    assert judged(truth(**drawn), answer(*said))["result"] == result


@pytest.mark.parametrize(
    ("said", "ties", "result"),
    [
        (("oil.air", "load.bias", "jack.friction"), {"load.bias": ["jack.friction"]}, "tied"),
        (("oil.air", "load.bias", "load.spring"), {"load.bias": ["load.spring"]}, "one"),
        (("supply.sag", "oil.air", "jack.friction"), {"oil.air": ["jack.friction"]}, "one"),
        (("oil.air", "jack.friction"), {"oil.air": ["jack.friction"]}, "one"),
        (("load.bias", "supply.sag", "load.spring"), {"load.bias": ["load.spring"]}, "wrong"),
    ],
)
def test_two_effects_of_which_one_ties(said, ties, result):
    assert judged(truth(**PAIR), answer("tied", *said, tied=ties))["result"] == result


def test_a_faint_effect_may_be_passed_over_but_not_misnamed():
    for said, result in ((("none",), "right"), (("named", "jack.friction"), "right"), (("named", "oil.air"), "wrong")):
        row = judged(truth(), answer(*said, before=1.19))
        assert (row["group"], row["result"]) == ("faint", result)
    assert judged(truth(), answer("none", before=1.21))["group"] == "single"
    assert judged(truth(few=True), answer("none"))["group"] == "few sensors"
    assert judged(truth(poor=True), answer("none"))["group"] == "poor excitation"
    assert judged(truth(expected_train=[1.04]), answer("none"))["group"] == "poor excitation"
    assert judged(truth(expected_train=[1.06]), answer("none"))["group"] == "single"


def by_id(rows):
    return {score.id: score for score in scores(rows)}


def test_rates_of_ten_single_effects_counted_by_hand():
    """Seven right, of which one tied and one incomplete; one in the right family; one unknown; one passed over."""
    rows = [judged(truth(), answer("named", "jack.friction", after=1.0 + 0.1 * k)) for k in range(5)]
    rows.append(judged(truth(), answer("tied", "load.bias", "jack.friction", rms=LOUD)))
    rows.append(judged(truth(), answer("incomplete", "jack.friction", rms=LOUD)))
    rows.append(judged(truth(effects=("main.stiction",)), answer("named", "pilot.hysteresis", equation="pilot")))
    rows.append(judged(truth(), answer("unknown", ranking=["oil.air", "load.bias", "jack.friction", "supply.sag"])))
    rows.append(judged(truth(), answer("none", ranking=["oil.air", "load.bias", "supply.sag", "jack.friction"])))
    found = by_id(rows)
    assert found["named_or_tied"].value == pytest.approx(0.7)
    assert found["right_family"].value == pytest.approx(0.8)
    assert found["first_three"].value == pytest.approx(0.8)
    assert found["named_or_tied"].met is False
    # (after - 1) / 10: 0, 0.01, 0.02, 0.03, 0.04 and twice 0.02
    assert found["misfit_left"].value == pytest.approx(0.02)
    assert found["misfit_left"].met is True
    assert found["at_floor_or_incomplete"].value == pytest.approx(6 / 7)
    assert found["false_alarms"].value is None
    assert found["false_alarms"].met is None


def test_an_interval_is_the_exact_binomial_one():
    """None of 60: (0, 1 - 0.025^(1/60))."""
    clean = truth("clean", (), ())
    found = by_id([judged(clean, answer("none"))] * 60)["false_alarms"]
    assert (found.value, found.n, found.met) == (0.0, 60, True)
    assert (found.low, found.high) == pytest.approx((0.0, 1 - 0.025 ** (1 / 60)))
    alarms = by_id([judged(clean, answer("none"))] * 58 + [judged(clean, answer("named", "oil.air"))] * 2)
    assert alarms["false_alarms"].value == pytest.approx(1 / 30)
    assert alarms["false_alarms"].met is False


def test_off_library_pairs_and_errors_are_counted():
    rows = [
        judged(truth(**OFF), answer("unknown")),
        judged(truth(**OFF), answer("named", "jack.friction")),
        judged(truth(**OFF), answer("unknown", equation="flow")),
        judged(truth(**PAIR), answer("named", "oil.air", "jack.friction")),
        judged(truth(**PAIR), answer("incomplete", "oil.air")),
        failed(truth(), "ValueError: no"),
    ]
    found = by_id(rows)
    assert found["off_library_named"].value == pytest.approx(1 / 3)
    assert found["off_library_equation"].value == pytest.approx(2 / 3)
    assert found["pair_both"].value == found["pair_one_incomplete"].value == 0.5
    assert found["errors"].value == pytest.approx(1 / 6)
    assert found["named_or_tied"].n == 0


def intervals(formula, cells, base=None):
    said = answer("named", "jack.friction", base=base or {})
    said["ranking"][0] |= {"formula": formula, "parameters": cells}
    return said


def test_intervals_are_held_against_the_drawn_numbers_in_their_own_unit():
    drawn = truth(
        formula=["stribeck"],
        numbers={"jack.friction.Fc": 800.0, "jack.friction.vs": 0.02},
        true={"beta": 9e8, "Ps": 2.1e7},
    )
    cells = {"Fc [kN]": [0.81, 0.79, 0.83], "vs [mm/s]": [12.0, 11.0, 19.0], "Fs [N]": [1.0, 0.0, 2.0]}
    base = {"beta [Pa]": [9.1e8, 8.9e8, 9.3e8], "Ps [bar]": [200.0, 199.0, 201.0]}
    row = judged(drawn, intervals("stribeck", cells, base))
    assert row["covers"] == {"effect": [True, False], "base": [True, False]}
    assert by_id([row])["intervals_cover"].value == 0.5
    other = judged(drawn, intervals("coulomb", cells, base))
    assert other["covers"] == {"effect": [], "base": []}


def test_the_confusion_matrix_has_truths_as_rows():
    rows = [
        judged(truth(), answer("named", "jack.friction")),
        judged(truth(), answer("named", "oil.air")),
        judged(truth("clean", (), ()), answer("none")),
        judged(truth(**OFF), answer("unknown")),
        failed(truth(), "ValueError: no"),
    ]
    table = confusion(rows)
    assert table["truths"] == ["jack.friction", "clean", "off-library: force"]
    assert set(table["answers"][:2]) == {"oil.air", "jack.friction"}
    assert table["answers"][2:] == ["error", "none", "unknown"]
    assert table["counts"] == [[1, 1, 1, 0, 0], [0, 0, 0, 1, 0], [0, 0, 0, 0, 1]]


def test_a_plan_has_its_shares_and_every_name():
    plan = default_plan(200, seed=4)
    assert Counter(case.kind for case in plan) == {"single": 110, "clean": 30, "off": 30, "pair": 30}
    assert len({case.id for case in plan}) == len({case.seed for case in plan}) == 200
    names = {effect.name for effect in LIBRARY if "three-stage" in effect.valves and not effect.alike}
    singles = [case.effects[0][:2] for case in (*plan, *default_plan(200, seed=5)) if case.kind == "single"]
    drawn = {name: {formula for effect, formula in singles if effect == name} for name in names}
    assert all(len(formulas) >= 2 for formulas in drawn.values())
    for case in plan:
        assert (len(case.effects), case.kind) in ((0, "clean"), (1, "single"), (1, "off"), (2, "pair"))
        assert (case.effects[0][0] in case.removed) == bool(case.removed) if case.effects else not case.removed
        assert case.kind != "off" or case.removed or case.effects[0][0] not in names
    assert default_plan(200, seed=4) == plan != default_plan(200, seed=5)
    assert [item.kind for item in default_plan(3, seed=4, kind="clean")] == ["clean"] * 3


def test_neighbours_are_drawn_in_formulas_that_the_library_lacks_and_traced_among_themselves():
    plan = default_plan(14, seed=4, kind="neighbours")
    own = {(effect.name, effect.formula) for effect in LIBRARY}
    kin = {effect.name: effect.kin for effect in LIBRARY if "three-stage" in effect.valves and not effect.alike}
    assert {case.effects[0][0] for case in plan} == {"drive.delay", "drive.lag", "pilot.hysteresis", "main.stiction"}
    for case in plan:
        assert case.kind == "single"
        assert case.effects[0] not in own
        kept = set(kin) - set(case.removed)
        assert {kin[name] for name in kept} == {kin[case.effects[0][0]]}
        assert len(kept) == 2


def test_the_odds_of_neighbours_count_names_and_what_the_other_one_leaves():
    def row(said, *shares, verdict="named"):
        ranking = [{"effect": name, "formula": "x", "explained": share, "parameters": {}} for name, share in shares]
        return judged(
            truth(effects=("drive.delay",), equations=("drive",)), answer(verdict, *said) | {"ranking": ranking}
        )

    rows = [
        row(["drive.delay"], ("drive.delay", 0.9), ("drive.delay", 0.8), ("drive.lag", 0.6)),
        row(["drive.delay", "drive.lag"], ("drive.lag", 0.95), ("drive.delay", 0.9), verdict="tied"),
        row(["drive.lag"], ("drive.lag", 0.9), ("drive.delay", 0.5)),
        row([], verdict="unknown"),
        judged(truth(), answer("named", "jack.friction")),
    ]
    (only,) = odds(rows)
    assert only["effect"] == "drive.delay"
    assert [only[how] for how in ("right", "tied", "wrong", "unnamed")] == [1, 1, 1, 1]
    assert only["leads"] == pytest.approx([3.0, -1.0, -4.0])


def folders(root: Path, count: int) -> Path:
    """Campaigns that are there already: some right, some wrong, one that cannot be traced."""
    listed = [truth(id=f"c{k}", equation="force", formula=["coulomb"]) for k in range(count)]
    for one in listed:
        (root / one["id"]).mkdir(parents=True)
    (root / "truth.json").write_text(json.dumps({"campaigns": listed}))
    return root


def by_number(folder: Path, removed: tuple[str, ...]) -> dict:
    """A tracer that is right of even campaigns, and fails at the third; it leaves a line each time it is asked."""
    with (folder / "asked").open("a") as file:
        file.write("x")
    number = int(folder.name[1:])
    if number == 3:
        raise ValueError("nothing to trace")
    return answer("named", "oil.air" if number % 2 else "jack.friction")


def told(outcome) -> dict:
    return {key: value for key, value in outcome.metrics.items() if key != "timing"}


def test_given_campaigns_are_scored_and_an_error_is_a_row(tmp_path):
    lines = []
    outcome = run_trace_study(given(folders(tmp_path, 5)), by_number, no_checkpoint, lines.append, jobs=1)
    assert [row["result"] for row in outcome.metrics["rows"]] == ["right", "wrong", "right", "error", "right"]
    assert outcome.metrics["rows"][3]["error"] == "ValueError: nothing to trace"
    assert lines[-1].startswith("5/5 c4: jack.friction -> jack.friction: right; so far error 0/1, single 3/4")
    assert [one["id"] for one in outcome.metrics["timing"]["campaigns"]] == ["c0", "c1", "c2", "c3", "c4"]
    strict = json.loads(metrics_json(outcome.metrics))
    assert strict["scores"][0] == {
        "id": "named_or_tied", "value": 0.75, "low": pytest.approx(0.194, abs=1e-3),
        "high": pytest.approx(0.994, abs=1e-3), "target": 0.85, "sense": "at least", "n": 4, "unit": "1",
    }  # fmt: skip
    page = render(outcome.page)
    assert "ValueError: nothing to trace" in page
    assert "Not met: named or tied 0.75 (at least 0.85)" in page


def test_workers_give_what_one_process_gives(tmp_path):
    plan = given(folders(tmp_path, 4))
    alone = run_trace_study(plan, by_number, no_checkpoint, lambda _: None, jobs=1)
    shared = run_trace_study(plan, by_number, no_checkpoint, lambda _: None, jobs=2)
    assert told(shared) == told(alone)


def test_a_study_that_was_killed_goes_on(tmp_path):
    plan, out = given(folders(tmp_path, 4)), tmp_path / "out"

    def killed(line: str) -> None:
        if line.startswith("2/4"):
            raise KeyboardInterrupt

    def study(progress):
        with open_run(out, {"command": "trace-study"}) as run:
            outcome = run_trace_study(plan, by_number, run.stage, progress, jobs=1)
            run.finish(outcome.metrics, "", {}, render(outcome.page))

    with pytest.raises(KeyboardInterrupt):
        study(killed)
    asked = [(item.folder / "asked").read_text() for item in plan if (item.folder / "asked").exists()]
    assert 2 <= len(asked) <= 3  # one more may have been under way
    study(lambda _: None)
    assert [(item.folder / "asked").read_text() for item in plan] == ["x"] * 4
    assert json.loads((out / "metrics.json").read_text())["rows"][3]["result"] == "error"


def test_drawn_campaigns_stay_with_their_truth_where_that_is_asked(tmp_path):
    """And can be given to a study again; the tracer is told what its library is to be without."""
    plan = [CampaignPlan(1, "clean"), CampaignPlan(2, "off", (("load.bias", "weight"),), removed=("load.bias",))]
    seen = []

    def trace(folder: Path, removed: tuple[str, ...]) -> dict:
        seen.append((folder.name, removed, (folder / "multisine.csv.gz").exists()))
        return answer("unknown" if removed else "none")

    drawn = run_trace_study(plan, trace, no_checkpoint, lambda _: None, jobs=1, keep=tmp_path)
    assert sorted(seen) == [("clean-1", (), True), ("off-2", ("load.bias",), True)]
    assert [row["result"] for row in drawn.metrics["rows"]] == ["right", "right"]
    assert drawn.metrics["items"] == [asdict(case) for case in plan]
    again = run_trace_study(given(tmp_path), trace, no_checkpoint, lambda _: None, jobs=1)
    assert again.metrics["rows"] == drawn.metrics["rows"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"campaigns": [{"id": "c0"}]}', 'a campaign without "kind"'),
        ('{"campaigns": [{"kind": "clean"}]}', "'id'"),
        ("[", "Expecting value"),
        (json.dumps({"campaigns": [truth(id="c9", equation=None)]}), "no folder"),
    ],
)
def test_a_truth_that_does_not_fit_is_refused(tmp_path, text, message):
    folders(tmp_path, 1)
    (tmp_path / "truth.json").write_text(text)
    with pytest.raises(InputError, match=message):
        given(tmp_path)
    with pytest.raises(InputError, match=r"truth.json: no such file"):
        given(tmp_path / "c0")


@pytest.mark.parametrize(("words", "learns"), [([], True), (["--names"], False)])
def test_names_alone_are_asked_for_by_an_option(words, learns, tmp_path, monkeypatch):
    """Shapes take most of the time and change no name."""
    asked = []

    def listening(plan, tracer, *_, **__):
        asked.append(getattr(tracer, "keywords", {}))
        raise InputError("enough")

    monkeypatch.setattr("experiments.studies.trace.study.run_trace_study", listening)
    assert main([*words, "--campaigns", str(folders(tmp_path, 1)), "--out", str(tmp_path / "out")]) == 2
    assert asked == [{} if learns else {"learns": False}]
