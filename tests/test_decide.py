"""The rule that names an effect, with numbers."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.identify.trace import rule as decide
from workbench.identify.trace.rule import Judgement, bic_fall, chance, explained, gate, misfit, named, passes

GOOD = Judgement("jack.friction", "coulomb", 0.95, 1.03, 1, True)


def test_the_gate_is_5_percent_or_four_deviations_of_chi2_itself():
    assert gate(1_000_000, 1.0) == pytest.approx(1.05)
    assert gate(1000, 1.0) == pytest.approx(1 + 4 * np.sqrt(2 / 1000))
    assert gate(1000, 4.0) == pytest.approx(1 + 8 * np.sqrt(2 / 1000))
    assert not misfit(1.05, 1_000_000, 1.0)
    assert misfit(1.051, 1_000_000, 1.0)


def test_noise_alone_seldom_opens_the_gate():
    """Squares of 4000 samples of white noise are chi squared: the gate is at four of their deviations."""
    squares = np.random.default_rng(0).chisquare(4000, 5000) / 4000
    assert np.mean([misfit(value, 4000, 1.0) for value in squares]) < 1e-3


@pytest.mark.parametrize(
    ("before", "after", "share"),
    [(11_000, 1000, 1.0), (11_000, 6000, 0.5), (11_000, 11_000, 0.0), (11_000, 20_000, 0.0), (11_000, np.inf, 0.0)],
)
def test_the_explained_share_is_that_of_the_misfit_alone(before, after, share):
    assert explained(before, after, 1000) == pytest.approx(share)


def test_where_nothing_is_missing_nothing_is_explained():
    assert explained(990, 900, 1000) == 0.0


def test_more_numbers_have_to_earn_their_place():
    assert bic_fall(1000, 900, 0, 5000) == 100
    assert bic_fall(1000, 900, 3, 5000) == pytest.approx(100 - 3 * np.log(5000))
    assert passes(2000, 1000, 10.1, 1.0, 39)
    assert not passes(2000, 1000, 9.9, 1.0, 39)
    assert not passes(2000, 1000, 10.1, 2.0, 39)  # coloured noise: half the independent samples


def test_the_chance_counts_every_candidate_and_coloured_noise():
    """One candidate gains 6.6 from noise once in two hundred times; the best of 39 needs 12."""
    assert chance(100.0, 93.4, 1.0, 1) == pytest.approx(0.005, abs=2e-4)
    assert chance(100.0, 93.4, 1.0, 39) == pytest.approx(39 * chance(100.0, 93.4, 1.0, 1))
    assert chance(100.0, 100.0, 1.0, 39) == 1.0
    assert not passes(100.0, 93.4, 1e3, 1.0, 39)
    assert passes(100.0, 86.0, 1e3, 1.0, 39)
    assert not passes(100.0, 86.0, 1e3, 2.0, 39)


def test_what_harms_or_fails_never_passes():
    assert not passes(1000, 1001, 1e6, 1.0, 1)
    assert not passes(1000, np.inf, 1e6, 1.0, 1)


def test_an_effect_is_named_from_80_percent_or_at_the_noise():
    assert named([GOOD]) == [GOOD]
    assert named([replace(GOOD, explained=0.80, chi2=3.0)])
    assert not named([replace(GOOD, explained=0.79, chi2=3.0)])
    assert named([replace(GOOD, explained=0.5, chi2=1.04)])  # a faint misfit: what is left is noise
    assert not named([replace(GOOD, passes=False)])
    assert named([]) == []


def test_of_equals_the_one_with_the_fewest_numbers_comes_first():
    lugre = replace(GOOD, formula="lugre", explained=0.958, numbers=5)
    assert named([lugre, GOOD]) == [GOOD]


def test_effects_within_one_percent_tie():
    bias = replace(GOOD, name="load.bias", formula="weight", explained=0.955)
    spring = replace(GOOD, name="load.spring", formula="linear", explained=0.93)
    assert named([GOOD, bias, spring]) == [bias, GOOD]
    assert named([GOOD, replace(bias, explained=0.93 + decide.TIED), spring])[0] == GOOD


def test_a_name_stands_once():
    stribeck = replace(GOOD, formula="stribeck", numbers=3, explained=0.956)
    assert [one.formula for one in named([stribeck, GOOD])] == ["coulomb"]


def test_a_formula_that_explains_clearly_less_does_not_win_by_having_fewer_numbers():
    stribeck = replace(GOOD, formula="stribeck", numbers=3, explained=0.99)
    assert named([GOOD, stribeck]) == [stribeck]


def test_a_later_effect_takes_away_a_tenth_of_the_first_misfit():
    """A formula that is not quite the truth leaves a little, which another effect may mimic."""
    assert decide.worth_adding(fall=900.0, first=9000.0, samples=1000)
    assert not decide.worth_adding(fall=700.0, first=9000.0, samples=1000)
