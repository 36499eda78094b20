"""The report of a trace: what is wrong, how sure that is, what to record next, in words, tables and figures."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_campaigns import LIBRARY, found, named, none, rubbing, unknown

from workbench.base.signals import MEASURED
from workbench.commands.common.error_page import error_figure, error_table
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.trace import words as words
from workbench.commands.trace.effect_words import ALL_EFFECTS, EFFECT
from workbench.commands.trace.metrics import compared, labels, more_json, trace_json
from workbench.commands.trace.next_record import EQUATION, HOW, next_records
from workbench.commands.trace.page import _shape, _where, shape_tables, telling, trace_page
from workbench.commands.trace.reasons import reason
from workbench.commands.trace.tables import base_table, candidates_table, rule_table, unseen_signals, untested_table
from workbench.identify.found.detectability import undetectable
from workbench.identify.found.missing_shape import UnexplainedDisturbance, missing_shape
from workbench.identify.plan.advice import Advice
from workbench.identify.trace.findings import Trace
from workbench.plant.effects import EQUATIONS, LIBRARY as WHOLE, find, known_effects
from workbench.plant.effects.declared import effects_for
from workbench.report import Curve, Figure, Page, Panel, Section, Table, page_looks, render
from workbench.report.chart import chart
from workbench.report.still import still_picture
from workbench.rigs.rig import EffectUse
from workbench.rigs.valve import VALVES

APART = {"jack.friction": Advice(("jack.friction", "load.bias"), "triangle-slow", 0.2, "spool", "pa", 12.3)}
SPRING = Advice(("load.spring",), "steps-position", 50.0, "", "position", 3.5)


def sections(page: Page) -> dict[str, Section]:
    return {section.title: section for section in page.sections}


def tables(section: Section) -> dict[str, Table]:
    return {item.title: item for item in section.items if isinstance(item, Table)}


def figures(section: Section) -> dict[str, Figure]:
    return {item.title: item for item in section.items if isinstance(item, Figure)}


def altered(**changes) -> Trace:
    return replace(found(), **changes)


# --- the verdict


def test_a_named_effect_is_told_in_plain_words():
    said = named().page.verdict
    assert said.startswith("The jack rubs: jack.friction (coulomb) explains 100.0 % of what")
    assert "times the noise" in said
    assert re.search(
        r"To pin the numbers down, record a? ?[a-z]+ of the command .*: jack.friction changes the "
        r"(pressure pa|pressure pb|position|spool) there by about [0-9.]+ times its noise\.$",
        said,
    )


def test_numbers_for_whole_records_are_offered_where_windows_gave_them():
    offered = sections(named().page)["What it buys"].items
    assert any("fit CAMPAIGN --rig rig.toml --free-run" in str(item) for item in offered)
    assert not any("--free-run" in str(item) for item in sections(none().page)["What it buys"].items)


def test_an_unknown_names_equation_signal_and_what_to_record():
    said = unknown().page.verdict
    start = "Something is missing in the motion of the load that no effect that was tried explains"  # one is left out
    assert said.startswith(start)
    assert "The missing force on the load goes with " in said
    assert re.search(r"To learn more, record .*: known effects in the motion of the load change the", said)


def test_nothing_missing_is_said_without_a_doubt_where_there_is_none():
    said = none().page.verdict
    assert said.startswith("Nothing is missing that these recordings could show")
    assert "1.00" in said or "0.99" in said


def test_what_could_not_be_seen_is_said():
    said = words.verdict(altered(verdict="none", effects=(), evidence=()), None, ["load.spring", "oil.air"], {})
    assert said.endswith("They could not have shown a typical load.spring or oil.air.")


def tied() -> Trace:
    """Friction as it was found, and load.bias as if it had explained as much."""
    (each,) = found().passes
    friction = replace(each.accepted[0], tied=("load.bias",))
    bias = replace(friction, candidate=replace(friction.candidate, effect=find("load.bias", "weight")))
    return altered(verdict="tied", effects=(friction,), passes=(replace(each, accepted=(friction, bias)),))


def test_effects_that_tie_are_told_with_what_splits_them():
    said = words.verdict(tied(), None, None, APART)
    assert said.startswith("Either the jack rubs or a constant force pushes the jack: these records cannot tell")
    assert said.endswith(
        "To tell them apart, record triangles of the command up to 20 % and back, 3 s each, with the spool recorded "
        "too: jack.friction and load.bias differ there by about 12 times the noise of the pressure pa."
    )
    assert [about for about, _ in next_records(tied(), APART)] == ["jack.friction or load.bias"]
    nothing = {"jack.friction": Advice(("jack.friction", "load.bias"))}
    said = words.verdict(tied(), None, None, nothing)
    assert said.endswith("No record that was simulated tells jack.friction from load.bias.")
    assert "To tell them apart" not in said


def test_a_second_effect_that_ties_is_said_to_tie():
    (friction,) = tied().effects
    spring = replace(friction, candidate=replace(friction.candidate, effect=find("load.spring", "linear")), tied=())
    trace = replace(tied(), effects=(spring, friction))
    said = words.verdict(trace, None, None, {**APART, "load.spring": SPRING})
    assert "Either" not in said
    assert "To tell them apart, record" in said
    assert "In the place of jack.friction, load.bias explains as much: these records cannot tell them apart." in said
    abouts = [about for about, _ in next_records(trace, {**APART, "load.spring": SPRING})]
    assert abouts == ["load.spring", "jack.friction or load.bias"]
    answer = trace_json(trace)
    assert (answer["verdict"], answer["effects"]) == ("tied", ["load.spring", "jack.friction", "load.bias"])
    assert more_json(trace)["tied"] == {"jack.friction": ["load.bias"]}


def test_neighbours_that_tie_by_what_their_formulas_leave_are_told_with_both_shares():
    (each,) = tied().passes
    friction, bias = each.accepted
    less = replace(bias, judgement=replace(bias.judgement, name="load.bias", explained=0.9))
    friction = replace(friction, judgement=replace(friction.judgement, explained=0.95))
    both = replace(tied(), effects=(friction,), passes=(replace(each, accepted=(friction, less)),))
    said = words.verdict(both, None, None, {})
    assert "they explain 95.0 % and 90.0 %, and other formulas might as much, of what the model misses" in said
    assert "each explains" not in said
    assert "each explains" in words.verdict(tied(), None, None, {})


def test_an_effect_that_was_added_ties_with_none():
    (friction,) = tied().effects
    bias = replace(friction, candidate=replace(friction.candidate, effect=find("load.bias", "weight")), tied=())
    trace = altered(verdict="named", effects=(friction, bias))
    assert trace.tied == ()
    assert "tell them apart" not in words.verdict(trace, None, None, {})


def test_an_unfinished_effect_says_that_more_is_missing_and_where():
    before, after, _ = found().heldout
    for chi2, left in ((1.5, "something else is missing too"), (1.06, "6.0 % of the noise's variance is left")):
        rest = replace(after, squares=after.squares * chi2 / after.chi2)
        trace = altered(verdict="incomplete", heldout=(before, rest, rest))
        said = words.verdict(trace, UnexplainedDisturbance("flow"), None, {})
        assert left in said
        assert "most likely in the flows" in said
        assert ("only falls" in said) == (chi2 > 1.3)


def test_a_name_whose_formula_is_not_the_rigs_own_says_how_much_is_left():
    before, after, _ = found().heldout
    rest = replace(after, squares=after.squares * 1.29 / after.chi2)
    said = words.verdict(altered(heldout=(before, rest, rest)), None, None, {})
    assert "29.0 % of the noise's variance is left, by its formula perhaps." in said
    assert "of the noise's variance is left" not in words.verdict(found(), None, None, {})
    by_numbers = words.verdict(altered(heldout=(before, rest, rest), by_numbers=True), None, None, {})
    assert "Its numbers fitted to all records leave nothing" in by_numbers


@pytest.mark.parametrize(
    ("numbers", "says"), [(1, "The interval is that of a model"), (2, "The intervals are those of a model")]
)
def test_contradicted_numbers_of_a_model_that_misses_more_are_not_told_as_sure(monkeypatch, numbers, says):
    wrong = [SimpleNamespace(number=SimpleNamespace(name=name), text=f"{name} is another") for name in "AB"[:numbers]]
    monkeypatch.setattr(words, "numbers_of", lambda _: wrong)
    monkeypatch.setattr(words, "explain_alike", lambda *_: [])
    assert says in words.verdict(altered(verdict="incomplete"), None, None, {})
    assert says not in words.verdict(found(), None, None, {})


def test_a_number_that_left_its_range_is_a_warning():
    """Unless the rig file has it there, as it has the leakage Cl. What could not give way stands beside it."""
    assert "Careful" not in named().page.verdict
    fit = replace(found().final.fit, at_bounds=("K3", "Cl", "jack.friction.Fc"))
    said = words.verdict(altered(final=replace(found().final, fit=fit)), None, None, {})
    assert said.endswith(
        "Careful: K3 went to the end of what the rig file allows. zeta, AA and AB are pinned: without bounds no fit "
        "moves them."
    )
    assert "pinned" not in named().page.verdict
    assert "pinned" in unknown().page.verdict


def test_a_late_command_may_be_a_filter_of_the_logger_unless_that_is_declared():
    late = replace(found().effects[0], candidate=replace(found().effects[0].candidate, effect=find("drive.delay", "")))
    said = words.verdict(altered(effects=(late,)), None, None, {})
    assert "a low pass of the logger delays all that is measured (sensor.filter)" in said
    assert "Loop the command back into the logger" in said
    assert "sensor.filter" not in named().page.verdict
    declared = replace(found().problem.rig, effects=(EffectUse("sensor.filter", "bessel 4", {}),))
    known = altered(effects=(late,), problem=replace(found().problem, rig=declared))
    assert "sensor.filter" not in words.verdict(known, None, None, {})


def test_an_effect_s_number_at_its_end_is_a_warning():
    """Not at its off: there it is none."""
    one, fit = found().effects[0], found().named.fit
    name = one.candidate.effect.fitted[0].name
    pushed = replace(fit, at_bounds=(one.candidate.effect.key(name),))
    said = words.verdict(altered(named=replace(found().named, fit=pushed)), None, None, {})
    assert f"is fitted with {name} at " in said
    assert "the end of its range: the rig may be beyond it." in said
    assert "the end of its range" not in words.verdict(found(), None, None, {})


def test_a_name_that_leaves_too_much_is_said_with_what_it_leaves():
    before, left = (replace(found().heldout[0], squares=np.array([chi2]), samples=1) for chi2 in (91.0, 10.0))
    nothing = {"verdict": "unknown", "effects": (), "named": found().base, "refuted": found().effects}
    nothing["heldout"] = (before, before, before)
    said = words.verdict(altered(**nothing, refuted_errors=left), None, None, {})
    assert " takes away 90.0 % of it and leaves 3.16 times the noise (with so much left 95 % would name it)" in said
    assert "bear it out" in words.verdict(altered(**nothing, refuted_errors=before), None, None, {})


def test_what_explains_only_with_numbers_at_their_ends_says_so():
    """A name that is not given may lack room in the rig file, and nothing else: the answer says where."""
    one, number = found().effects[0], found().named.fit.free[0]
    own = one.candidate.effect.key(one.candidate.effect.fitted[0].name)
    fit = replace(
        one.refitted.fit, at_bounds=(number.name, own), x=one.refitted.fit.x + np.eye(len(found().named.fit.x))[0]
    )
    pushed = replace(one, model_fit=replace(one.refitted, fit=fit))
    nothing = {"verdict": "unknown", "effects": (), "named": found().base}
    said = words.verdict(altered(**nothing, refuted=(pushed,)), None, None, {})
    assert f"(coulomb) with {number.name} and {own} at the ends of their ranges would explain the train records" in said
    assert "of their ranges" not in words.verdict(altered(**nothing, refuted=(one,)), None, None, {})
    half = replace(found().base.selection, squares=0.7 * found().base.selection.squares)
    weak = replace(pushed, model_fit=replace(one.refitted, fit=fit, selection=half))
    search = replace(found().passes[0], tried=(weak,), accepted=())
    said = words.verdict(altered(**nothing, passes=(search,)), None, None, {})
    assert f" % of it with {number.name} and {own} at the ends of their ranges (80 % would name it)" in said


def test_a_disturbance_in_no_equation_asks_for_a_better_noise_floor():
    said = words.verdict(altered(verdict="none", effects=()), None, None, {})
    assert "Check the noise floor" in said
    before = replace(found().heldout[0], squares=found().heldout[2].squares)
    said = words.verdict(altered(verdict="none", effects=(), heldout=(before,) * 3), None, None, {})
    assert "Check the noise floor" not in said  # they are at it
    assert "what more the other records leave" in said


def test_there_are_words_for_everything():
    assert set(EFFECT) == {effect.name for effect in WHOLE}
    assert set(EQUATION) == set(EQUATIONS)
    assert set(words.SIGNAL) == set(MEASURED)


def test_a_user_s_effect_needs_no_words_of_ours():
    mine = replace(LIBRARY[0], name="my.rub", formula="")
    one = replace(found().effects[0], candidate=replace(found().effects[0].candidate, effect=mine))
    assert words.verdict(altered(effects=(one,)), None, None, {}).startswith("My.rub acts: my.rub explains 100.0 %")


# --- tables


def test_candidates_are_ranked_with_what_the_rule_says():
    rows = candidates_table(found()).rows
    assert rows[0][:3] == ["jack.friction", "coulomb", "force"]
    assert rows[0][3] == pytest.approx(100, abs=1)
    assert rows[0][5] == "added"


@pytest.mark.parametrize(
    ("judged", "said"),
    [
        ({"explained": 0.5}, "real, but explains less than 80 %"),
        ({"explained": 0.9}, "another formula explains more"),
        ({"explained": 1.0}, "another formula explains as much with fewer numbers"),
        ({"against": "its fit takes it away again"}, "its fit takes it away again"),
    ],
)
def test_the_rule_says_why_not(judged, said):
    (each,) = found().passes
    one = each.accepted[0]
    other = replace(one, judgement=replace(one.judgement, chi2=2.0, **judged))
    assert reason(found(), each, other) == said


def test_an_effect_that_was_not_added_is_as_good_as_none():
    """The rule accepted it, and held-out records, another family or its size spoke against it."""
    (each,) = found().passes
    one = each.accepted[0]
    refuted = altered(verdict="unknown", effects=(), refuted=(one,))
    assert "the held-out records do not bear it out" in reason(refuted, each, one)
    nothing = altered(verdict="unknown", effects=())
    assert reason(nothing, each, one) == "real, but takes away too little of what the rig alone misses"
    said = words.verdict(nothing, None, None, {})
    assert "of it: real, but takes away too little" in said
    assert "only 100.0 %" not in said
    other = replace(one, judgement=replace(one.judgement, name="drive.delay", kin="drive timing"))
    alike = replace(each, accepted=(one, other), tried=(one, other))
    assert reason(nothing, alike, one) == "an effect of another family explains as much"


def test_only_what_the_user_took_out_is_said_to_be_taken_out():
    rig = found().problem.rig
    able = effects_for(rig)
    rows = dict(untested_table(found(), able).rows)
    assert rows
    assert rows.pop("sensor.filter") == "it looks much like a late command, and is tried where that leaves a misfit"
    assert all(why.startswith(f"a {rig.valve} valve has ") for why in rows.values())
    assert not {effect.name for effect in able} & set(rows)
    fewer = effects_for(rig, without=["jack.friction"])
    rows = dict(untested_table(found(), fewer).rows)
    assert [name for name, why in rows.items() if "--without" in why] == ["jack.friction"]


def test_the_rule_s_questions_are_answered():
    rows = {(row[0], row[1]): row for row in rule_table(found()).rows}
    misfit = rows["the fitted rig misses something", "chi2, not fitted"]
    assert misfit[2] == pytest.approx(found().base.chi2)
    assert rows["jack.friction is no accident", "chance, not fitted"][2] < 0.01
    assert rows["nothing else is missing", "held-out chi2"][2] < 1.05


def test_every_question_of_the_rule_is_answered_yes_or_no():
    table = rule_table(found())
    assert table.columns[-1] == "answer"
    assert [row[-1] for row in table.rows] == [True] * len(table.rows)
    near = altered(evidence=(("force", 900.0), ("sensor", 899.0)), parity_residuals={})
    answers = {row[0]: row[-1] for row in rule_table(near).rows}
    assert answers["it sits in an equation"] is True
    assert answers["which is one alone"] is False


def where(trace: Trace) -> tuple[str, Figure]:
    ((said, figure),) = [section.items for section in _where(trace)]
    assert isinstance(said, str)
    assert isinstance(figure, Figure)
    return said, figure


def test_no_equation_is_named_whose_next_is_not_clearly_behind():
    clear, _ = where(altered(evidence=(("force", 900.0), ("flow", 100.0)), parity_residuals={}))
    assert clear.startswith("A disturbance in the motion of the load explains most; the next, in the flows")
    near, _ = where(altered(evidence=(("force", 900.0), ("flow", 899.0), ("main", 10.0)), parity_residuals={}))
    assert "explains most" not in near
    assert "the motion of the load or the flows" in near
    assert "the main spool" not in near
    none, _ = where(altered(evidence=(("force", 5.0), ("flow", 4.0)), parity_residuals={}))
    assert none.startswith("A disturbance in no equation explains the errors")


def test_evidence_is_the_distance_to_the_best_beside_the_threshold():
    _, figure = where(altered(evidence=(("force", 900.0), ("flow", 100.0)), parity_residuals={}))
    (panel,) = figure.panels
    assert panel.curves[0].y[1] == pytest.approx(800)
    assert panel.curves[0].y[0] < panel.marks[0].value < 800


def test_a_shape_is_drawn_over_a_signal_only_where_that_is_a_clue():
    def items(share: float) -> list:
        shape = UnexplainedDisturbance(
            "force", "force on the load", "N", "velocity [m/s]", [["velocity [m/s]", share]],
            np.ones((2, 2)), np.ones((2, 2)), partner=["flow into chamber A", 0.1],
        )  # fmt: skip
        (section,) = _shape(shape, False)
        return list(section.items)

    assert isinstance(items(0.9)[0], Figure)
    assert items(0.2)[0].startswith("The missing force on the load goes with no signal")
    assert len(items(0.2)) == 2  # a partner that is another disturbance is no clue either


def test_base_numbers_are_shown_alone_and_with_the_effect():
    table = base_table(found(), True)
    assert table.columns[2:5] == ["rig file", "alone", "with effects"]
    rows = {row[0]: row for row in table.rows}
    assert float(rows["M"][4]) == pytest.approx(5, rel=0.05)
    assert float(rows["b"][3]) != pytest.approx(float(rows["b"][4]), rel=0.1)  # alone it stands in for the dry friction


def test_what_was_not_tried_is_listed_with_the_reason():
    table = untested_table(found(), [effect for effect in WHOLE if effect.name != "oil.air"])
    assert table is not None
    why = dict(table.rows)
    assert why["oil.air"] == "taken out by --without"
    assert why["pump.leakage"] == "a second-order valve has no pump in its place"
    assert "jack.friction" not in why
    declared = untested_table(replace(found(), problem=replace(found().problem, rig=rubbing())), WHOLE)
    assert declared is not None
    assert dict(declared.rows)["jack.friction"] == "the rig file declares it"


def test_signals_that_would_help_are_listed():
    table = unseen_signals(found())
    assert table is not None
    assert {row[0] for row in table.rows} == {"supply", "acceleration", "force"}


def test_sensors_that_are_off_are_told_by_offset_gain_and_lag():
    (table,) = shape_tables(UnexplainedDisturbance("sensor", sensors=[["pa", 0.3, 1.0, 2.0], ["pb", 0.0, 0.0, 2.0]]))
    assert table.columns == ["sensor", "offset [bar]", "gain [%]", "lag [ms]"]
    assert len(table.rows) == 2


def test_effects_hidden_at_typical_strength_are_told():
    rows = [{"effect": name, "strength": value} for name, value in (("a", 0.1), ("b", 1.5), ("c", None))]
    assert undetectable(rows) == ["b", "c"]


# --- figures and pages


def test_the_error_figure_compares_every_signal_with_its_floor():
    rms = trace_json(found())["rms"]
    figure = error_figure(rms, ["alone", "with"])
    assert list(figure.x_names) == ["spool", "pa", "pb", "position"]
    before, after, change = figure.panels[0].curves
    assert before.y[1] == pytest.approx(rms["pa [bar]"]["before"] / rms["pa [bar]"]["floor"])
    assert (after.y < 1.1).all()
    assert np.isnan(change.x[2::3]).all()
    assert len(error_table(rms, ["alone", "with"]).columns) == 6
    assert len(error_table(rms, ["fitted"]).columns) == 4


def test_the_telling_second_is_where_the_error_falls_most():
    pairs = list(zip(*compared(found()), strict=True))
    index, name, part = telling(pairs, found().problem.floor, True)
    before, after = pairs[index]
    sigma = found().problem.floor.sigma[name]
    gained = [float(np.nansum((one.error(name)[part] / sigma) ** 2)) for one in (before, after)]
    assert gained[0] > 5 * gained[1]
    assert part.stop - part.start == round(1.0 / before.record.period)


def test_a_named_page_has_what_a_person_asks_for():
    page = named().page
    titles = list(sections(page))
    assert titles[:3] == ["Held-out error", "What explains it", "What to record next"]
    assert "Every signal of sines" in titles
    assert {"Effects that were fitted", "Their numbers"} <= set(tables(sections(page)["What explains it"]))
    said, how = sections(page)["What to record next"].items
    assert said.startswith("jack.friction: ")
    assert "times its noise" in said
    assert how == HOW
    every = figures(sections(page)["Every signal of sines"])
    assert list(every) == ["sines: spool", "sines: pa", "sines: pb", "sines: position"]
    names = [curve.name for panel in every["sines: pa"].panels for curve in panel.curves]
    assert names[:3] == ["measured", "fitted rig alone", "with jack.friction"]
    assert "noise, 2 sigma" in names


def test_an_unknown_page_shows_the_shape_first():
    page = unknown().page
    assert list(sections(page))[1] == "What is missing in the motion of the load"
    shape = sections(page)["What is missing in the motion of the load"]
    (figure,) = figures(shape).values()
    assert figure.panels[0].y_label == "force on the load [N]"
    estimate, mean = figure.panels[0].curves
    assert len(estimate.x) <= 1000
    assert (np.diff(mean.x) > 0).all()


def test_the_missing_force_is_that_of_the_friction():
    """60 N against the motion, so that it falls by about 120 N from one direction to the other."""
    (table,) = tables(sections(unknown().page)["What is missing in the motion of the load"]).values()
    best = str(table.rows[0][0])
    assert best.split(" [")[0] in ("velocity", "spool", "command", "jack_force")
    assert table.rows[0][1] > 0.5


def test_a_page_of_nothing_says_what_would_have_shown():
    shown = tables(sections(none().page)["What could not be seen"])["What these records would have shown"]
    (row,) = shown.rows
    assert row[:4] == ["load.spring", "linear", "k", "kN/m"]
    assert 0 < row[4] < row[5]
    assert row[6] is True


@pytest.mark.parametrize("outcome", [named, unknown, none])
def test_pages_are_whole_and_their_pictures_are_drawn(outcome, tmp_path):
    page, picture = outcome().page, outcome().picture
    html = render(page)
    assert "NaN" not in html.split("</style>")[1].split("<script>/**")[0]
    still_picture(picture, tmp_path / "picture.svg", page_looks(page))
    assert (tmp_path / "picture.svg").stat().st_size > 5000
    for section in page.sections:
        for item in section.items:
            if isinstance(item, Figure):
                chart(item, page_looks(page))


def test_a_tied_page_names_what_to_record_for_each():
    page, _ = trace_page(tied(), trace_json(tied()), compared(tied()), LIBRARY, None, None, APART)
    first, how, plan = sections(page)["What to record next"].items
    assert first.startswith("jack.friction or load.bias: triangles of the command")
    assert (how, plan) == (HOW, words.PLAN)


def test_an_axis_may_have_names_instead_of_numbers():
    curve = Curve("a", np.array([1.0, np.nan, 3.0]), np.array([1.0, 2.0, 3.0]), "markers")
    figure = Figure("named", "signal", [Panel("y [1]", [curve])], x_names=["pa", "p<b", "spool"])
    page = Page("t", "v", [Section("s", [figure])])
    drawn = chart(figure, page_looks(page))
    assert drawn["data"][0]["x"] == ["pa", None, "spool"]
    assert drawn["layout"]["xaxis"]["type"] == "category"
    assert drawn["layout"]["xaxis"]["categoryarray"] == ["pa", "p&lt;b", "spool"]


def test_many_effects_are_counted_and_named_once():
    (friction,) = found().effects
    others = [("load.bias", "weight"), ("load.spring", "linear"), ("oil.air", "polytropic")]
    more = [replace(friction, candidate=replace(friction.candidate, effect=find(*key))) for key in others]
    trace = altered(verdict="incomplete", effects=(friction, *more))
    advice = {fit.candidate.effect.name: replace(SPRING, names=(fit.candidate.effect.name,)) for fit in trace.effects}
    said = words.verdict(trace, None, None, advice)
    assert said.startswith("4 effects act: jack.friction (coulomb), load.bias (weight), load.spring (linear) and oil.")
    assert "jack.friction changes the position there by about 3.5 times its noise; for the others see what" in said
    assert len(next_records(trace, advice)) == 4
    assert labels(trace) == ["fitted rig alone", "with all 4"]


def test_where_no_likelihood_tells_the_equation_nothing_is_said_of_it(monkeypatch):
    """As along a free run whose tangents explode."""
    nowhere = SimpleNamespace(evidence=[("force", 0.0), ("flow", 0.0)], parity_residuals={})
    monkeypatch.setattr("workbench.identify.found.missing_shape.locate_fault", lambda *_: nowhere)
    assert missing_shape(altered(verdict="incomplete"), no_checkpoint, lambda _: None) is None


LACKING = {
    "three-stage": ("direction valves",),
    "second-order": ("direction valves", "pilot", "current", "main spool", "the torque motor"),
    "pump": ("spool", "pilot", "current", "torque motor", "main spool"),
    "two-way-pump": ("spool", "pilot", "current", "torque motor", "direction valves"),
}  # what no rig of the kind has, or has a model of


@pytest.mark.parametrize("kind", VALVES)
def test_the_words_of_an_effect_speak_of_what_every_kind_of_valve_with_it_has(kind):
    """A proportional valve has a magnet and no torque motor; a pump drive has no spool."""
    said = {effect.name: ALL_EFFECTS[effect.name] for effect in known_effects() if kind in effect.valves}
    assert len(said) > 10
    assert not [words for words in said.values() if any(part in words for part in LACKING[kind])]
