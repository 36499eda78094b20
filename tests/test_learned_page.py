"""How a trace shows what it learned: a curve with its band beside the library's formulas, and doubts about numbers."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from made_campaigns import found
from made_fits import fit_of
from test_learned_shapes import harder_out, shaped

from workbench.commands.trace import words
from workbench.identify.found.fitted import effect_covariance, effect_numbers, not_physical, number_remarks
from workbench.identify.found.law_curves import LawCurve, differences, gain_curve, law_curve, visited
from workbench.identify.plan.questions import EQUATIONS, questions
from workbench.identify.trace.localise import clear_evidence, equation_of, likely_equations
from workbench.identify.trace.samples import variable_samples
from workbench.plant.effects import find, refine
from workbench.plant.effects.natural import variable
from workbench.report import Figure, Section, Table
from workbench.rigs.rig_file import load_rig

pytestmark = pytest.mark.usefixtures("right_columns")


@cache
def section() -> Section:
    (learned,) = [each for each in shaped().page.sections if each.title == "What was learned of its shape"]
    return learned


# --- the picture


def test_the_learned_law_is_drawn_over_the_range_of_the_records():
    (figure,) = [item for item in section().items if isinstance(item, Figure)]
    assert (figure.title, figure.x_label) == ("jack.friction over position", "position [mm]")
    own, beside = figure.panels[0].curves
    assert own.name.startswith("as learned (coulomb; over ")
    assert beside.name == "jack.friction (coulomb)"
    where = 1e3 * variable_samples(load_rig("festo-tp511"), harder_out().train)["position"]
    assert (own.x.min(), own.x.max()) == pytest.approx((where.min(), where.max()))


def test_the_truth_is_within_the_band():
    """The rig rubs by 60 N at mid stroke, and 30 % more at the end of the law's usual range, 100 mm out."""
    (figure,) = [item for item in section().items if isinstance(item, Figure)]
    own = figure.panels[0].curves[0]
    assert own.band is not None
    low, high = own.band
    truth = 60 * (1 + 0.3 * own.x / 100)
    assert (truth > low - 0.5).all()
    assert (truth < high + 0.5).all()
    assert (high - low < 0.1 * truth).all()


def test_how_far_it_is_from_the_formula_is_said_in_numbers():
    said = section().items[0]
    assert isinstance(said, str)
    assert said.startswith("Against jack.friction (coulomb), jack.friction as learned is up to ")
    assert " % less at position " in said
    assert " % more at position " in said
    assert said in shaped().page.verdict


def test_the_numbers_of_the_learned_law_are_listed_without_those_that_are_given():
    (table,) = [item for item in section().items if isinstance(item, Table)]
    assert [row[2].partition("_over_")[0] for row in table.rows] == ["Fc", "Fc"]


def test_what_a_learned_shape_closes_is_missing_no_more():
    titles = [each.title for each in shaped().page.sections]
    assert not [title for title in titles if title.startswith("What is missing")]
    assert "something else is missing" not in shaped().page.verdict


def test_nothing_is_drawn_where_nothing_was_learned():
    assert "Its shape is learned" not in words.verdict(found(), None, None, {})


# --- laws and bands


def test_the_band_of_a_law_follows_from_the_covariance():
    """Coulomb friction is proportional to Fc: so is its band to the deviation of Fc."""
    effect = find("jack.friction", "coulomb")
    fit, at = fit_of(effect, {"Fc": 60.0}, 0.01), np.array([-0.1, 0.1])
    law = law_curve(effect, fit, "law", "velocity", at, {})
    assert law.unit == "N"
    assert law.values[:, 0] == pytest.approx([-60, 60])
    assert law.half[:, 0] == pytest.approx(1.96 * 0.01 * 800)


def test_a_relative_number_varies_with_its_value():
    effect = find("jack.friction", "stribeck")
    fit = fit_of(effect, {"Fc": 60.0, "Fs": 80.0, "vs": 0.02}, 0.1)
    fit = replace(fit, free=(*fit.free[:2], replace(fit.free[2], scale=None)))
    assert effect_numbers(effect, fit) == pytest.approx({"Fc": 60.0, "Fs": 80.0, "vs": 0.02})
    assert np.sqrt(np.diag(effect_covariance(effect, fit))) == pytest.approx([80, 120, 0.002])


def test_the_gain_of_a_lag_falls_with_its_band():
    effect = refine(find("learned.drive", "command; offset"), "pole")
    values = {n.name: n.off or 0.0 for n in effect.numbers} | {"pole_tau": 5e-3}
    gain, phase = gain_curve(effect, fit_of(effect, values, 0.1), np.array([0.1, 1 / (2 * np.pi * 5e-3)]))
    assert gain.values[:, 0] == pytest.approx([0, -3.01], abs=0.02)
    assert phase.values[1, 0] == pytest.approx(-45, abs=0.2)
    assert gain.half[0, 0] < 0.01 < gain.half[1, 0]
    assert phase.half[1, 0] == pytest.approx(np.rad2deg(1.96 * 0.1 * 2e-3 / 5e-3 / 2), rel=0.02)


def test_places_crowd_where_a_law_bends_and_reach_as_far_as_the_records():
    of = variable(find("jack.friction", "coulomb"), "velocity")
    at = visited(of, {"velocity": np.array([-0.2, 0.5])})
    assert (at.min(), at.max()) == (-0.2, 0.5)
    assert np.diff(at)[len(at) // 2] < 0.01 * np.diff(at)[-1]
    assert visited(of, {}).max() == of.reach


def test_differences_are_told_by_direction_and_only_beyond_the_band():
    at = np.linspace(-1, 1, 201)
    formula = LawCurve("formula", "N", np.sign(at)[:, None] * 100, np.zeros((201, 1)))
    law = replace(formula, values=np.where(at < 0, -80.0, 101.0)[:, None], half=np.full((201, 1), 2.0))
    (only,) = differences(law, formula, at, 0.05)
    assert at[only.place] < -0.05
    assert only.share == pytest.approx(-0.2)


def test_over_one_side_the_most_above_and_below_are_told():
    at = np.linspace(0, 1, 101)
    formula = LawCurve("formula", "N", np.full((101, 1), 100.0), np.zeros((101, 1)))
    law = replace(formula, values=(90 + 20 * at)[:, None])
    below, above = differences(law, formula, at, 0.05)
    assert (at[below.place], below.share) == pytest.approx((0.0, -0.1))
    assert (at[above.place], above.share) == pytest.approx((1.0, 0.1))


# --- doubts


def test_break_away_below_coulomb_friction_is_not_physical():
    effect = find("jack.friction", "stribeck")
    fit = fit_of(effect, {"Fc": 70.0, "Fs": 64.0, "vs": 0.02}, 1e-3)
    assert not_physical(effect, fit) == ["Fs"]
    assert number_remarks(effect, fit)["Fs"] == ["below Fc, not physical"]
    assert not_physical(effect, fit_of(effect, {"Fc": 60.0, "Fs": 64.0, "vs": 0.02}, 1e-3)) == []


def test_a_named_formula_with_such_numbers_is_a_warning():
    effect = find("jack.friction", "stribeck")
    named = replace(found().named, fit=fit_of(effect, {"Fc": 70.0, "Fs": 64.0, "vs": 0.02}, 1e-3))
    candidate = replace(found().effects[0].candidate, effect=effect)
    trace = replace(found(), named=named, effects=(replace(found().effects[0], candidate=candidate),))
    assert "fitted with Fs below Fc, which is not physical" in words.verdict(trace, None, None, {})


def test_a_number_that_the_records_do_not_tell_is_told_to_be_so():
    effect = find("load.compliance", "mount")
    values = {n.name: n.typical for n in effect.numbers}
    assert "not told" in number_remarks(effect, fit_of(effect, values, 30.0))["zeta"]
    assert number_remarks(effect, fit_of(effect, values, 1e-3))["zeta"] == []
    friction = find("jack.friction", "coulomb")
    assert number_remarks(friction, fit_of(friction, {"Fc": 5.0}, 0.1))["Fc"] == ["may be none"]


def test_equations_that_are_not_clearly_behind_are_named_too():
    evidence = [("main", 100.0), ("drive", 97.0), ("force", 20.0)]
    assert likely_equations(evidence, {}, 30.0) == ["main", "drive"]
    assert likely_equations(evidence, {}, 2.0) == ["main"]
    assert likely_equations(evidence, {"force": 5.0}, 30.0) == ["force"]
    assert likely_equations((), {}, 30.0) == []
    unclear = replace(
        found(), verdict="unknown", effects=(), equation="main", evidence=tuple(evidence), parity_residuals={}
    )
    said = words.verdict(unclear, None, None, {})
    assert said.startswith(
        "Something is missing in the main spool or the drive (amplifier and spool loop) (the records do not tell which)"
    )
    assert questions(unclear, ())[EQUATIONS].names == ("main", "drive")


def test_what_sits_before_a_spool_that_is_not_recorded_is_not_told_from_what_sits_in_the_flows():
    """A play of 2 % in front of the spool at 57,500 times the noise: the drive is 28,123 of 8e8 behind the flows."""
    evidence = (("flow", 827491855.0), ("drive", 827463732.0), ("force", 624876324.0), ("sensor", 5165424.0))
    clear = clear_evidence(evidence, 1.0)
    assert clear == pytest.approx(8e6, rel=0.05)
    assert likely_equations(evidence, {"force": 1.05}, clear) == ["flow", "drive"]
    assert likely_equations(evidence, {"force": 1.05, "drive": 1.02}, clear) == ["flow"]
    assert likely_equations((("drive", 80e3), ("flow", 73e3)), {}, 800.0) == ["drive", "flow"]
    assert likely_equations((("drive", 80e3), ("flow", 73e3)), {"drive": 9.0}, 800.0) == ["drive"]
    place = {"equation": "flow", "evidence": evidence, "parity_residuals": {"force": 1.05}}
    unknown = replace(found(), verdict="unknown", effects=(), **place)
    assert words.verdict(unknown, None, None, {}).startswith(
        "Something is missing between command and flow (the drive,"
    )


def test_a_cut_that_is_hardly_broken_does_not_overrule_the_evidence():
    """Of a supply that sags: the fitted mass followed it, and the equation of motion is broken by 1.22."""
    evidence = (("flow", 89030.0), ("sensor", 38827.0), ("drive", 24207.0), ("force", 20141.0))
    assert equation_of(evidence, {"drive": 1.0, "force": 1.22}) == "flow"
    assert equation_of(evidence, {"drive": 1.0, "force": 2.3}) == "sensor"
    near = (("flow", 89030.0), ("force", 88000.0), ("sensor", 38827.0))
    assert equation_of(near, {"force": 1.22}) == "force"
    assert equation_of(near, {"force": 1.1}) == "flow"
