"""From the name to the rig's own shape: what no formula of the library has is learned, by the rule that names."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from made_campaigns import campaign, named, none

from workbench.base.process_pool import one_blas_thread
from workbench.commands.common.outcome import Outcome, no_checkpoint
from workbench.commands.residual.study import run_residual
from workbench.commands.trace.study import run_trace
from workbench.identify.trace import verdict
from workbench.identify.trace.findings import LearnedShape
from workbench.identify.trace.problem import estimation_problem
from workbench.identify.trace.refit import fit_rig
from workbench.identify.trace.reshape import TIERS, offered
from workbench.identify.trace.samples import variable_samples
from workbench.identify.trace.tracer import trace
from workbench.plant.effects import find
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

RIG = load_rig("festo-tp511")


pytestmark = pytest.mark.usefixtures("right_columns")


@cache
def harder_out():
    """A campaign of the cylinder that rubs the more the farther out it is: 60 N at mid stroke."""
    formula = "coulomb; over position"
    numbers = {"Fc": Number("Fc", 60.0, "N", "N", "made up")}
    further = find("jack.friction", formula).numbers[1:]
    values = {n.name: 0.3 if n.off is not None else n.typical for n in further}
    numbers |= {n.name: Number(n.name, values[n.name], n.shown, n.si, "made up") for n in further}
    return campaign(replace(RIG, effects=(EffectUse("jack.friction", formula, numbers),)), 2.0)


@cache
def shaped() -> Outcome:
    return run_trace(harder_out(), RIG, [find("jack.friction", "coulomb")], no_checkpoint, lambda _: None)


def test_what_the_formula_misses_is_learned():
    """That friction goes with the position, which was on one side of mid stroke: a sign of it tells nothing."""
    answer = json.loads(shaped().files["trace.json"])
    assert (answer["verdict"], answer["effects"], answer["equation"]) == ("named", ["jack.friction"], "force")
    (learned,) = answer["learned"]
    assert list(learned) == ["slot", "kind", "variables", "chi2"]
    assert (learned["slot"], learned["kind"]) == ("friction", "dependence")
    assert learned["variables"] in (["position"], ["|position|"])
    assert learned["chi2"] == answer["chi2"]["after"] < 1.05
    assert answer["chi2"]["before"] > 10
    said = shaped().page.verdict
    assert "of the noise's variance is left, by its formula perhaps." in said
    assert "Its shape is learned: jack.friction goes with" in said


@pytest.mark.parametrize(
    ("formulas", "several", "says"),
    [(("coulomb",), False, "named"), (("coulomb",), True, "incomplete"), ((), False, "unknown")],
)
def test_no_learned_piece_says_in_which_equation(monkeypatch, formulas, several, says):
    """Whatever it is, and wherever it sits: the equation is that of the effect, or of the evidence, before it."""
    asked = []

    def elsewhere(_context, _starts, named, plain):
        asked.append(named)
        return named, plain, (LearnedShape(find("supply.sag", "laminar"), "spline of pressure", 1.0),)

    monkeypatch.setattr(verdict, "_shaped", elsewhere)
    library = [find("jack.friction", formula) for formula in formulas]
    with one_blas_thread():
        answer = trace(estimation_problem(harder_out(), RIG), library, no_checkpoint, lambda _: None, several)
    assert (answer.verdict, answer.equation, len(asked)) == (says, "force", 1)


def test_every_command_takes_the_rig_with_its_shape(tmp_path):
    (tmp_path / "found.toml").write_text(shaped().files["rig.toml"])
    rig = load_rig(tmp_path / "found.toml")
    chi2 = run_residual(harder_out(), rig, no_checkpoint, lambda _: None).metrics["chi2"]
    assert chi2 == pytest.approx(shaped().metrics["chi2"]["after"], rel=1e-3)


def test_nothing_is_learned_where_nothing_is_missing():
    for outcome in (none(), named()):
        assert outcome.metrics["learned"] == []


def test_the_cheapest_are_asked_first():
    problem = estimation_problem(harder_out(), RIG)
    base = fit_rig(problem)
    tiers = offered(problem, base, "drive")
    assert len(tiers) == len(TIERS)
    for tier, most in zip(tiers, TIERS, strict=True):
        assert tier
        assert all(len(each.further(base)) <= most for each in tier)
    names = [{each.candidate.effect.title for each in tier} for tier in tiers]
    assert not set.intersection(*names)


def test_samples_are_where_the_records_were():
    samples, record = variable_samples(RIG, harder_out().train), harder_out().train[0]
    middle = RIG.numbers["xmid"].value
    assert samples["position"].min() + middle >= min(r.signals["position"].min() for r in harder_out().train)
    assert np.abs(samples["velocity"]).max() < 1.0
    assert "acceleration" not in samples
    assert samples["drop"].size <= 4000 < 5 * record.t.size
