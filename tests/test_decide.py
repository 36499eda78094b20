"""The rule that names an effect, with numbers."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from workbench.identify.data.noise_floor import noise_floor
from workbench.identify.trace import rule as decide
from workbench.identify.trace.rule import Judgement, accident, bic_fall, chance, explained, gate, misfit, named
from workbench.records import Campaign, Record

GOOD = Judgement("jack.friction", "coulomb", 0.95, 1.03, 1, "", "jack.friction")


def test_the_gate_is_5_percent_or_four_deviations_of_chi2_itself():
    assert gate(0.0) == pytest.approx(1.05)
    assert gate(0.02) == pytest.approx(1.08)
    assert not misfit(1.05, 0.0)
    assert misfit(1.051, 0.0)


@pytest.mark.parametrize(("rho", "still"), [(0.0, 200), (0.0, 2000), (0.9, 2000)])
def test_chi2_of_noise_scatters_as_the_floor_says(rho, still):
    """Two signals of white or coloured noise, sigma from a record at rest of 0.2 or 2 s, chi2 of 6 s: z of the exact
    model has deviation 1, and the gate, four of them, stays shut. With the floor taken as exact it opened on 29 % of
    the shortest ones."""
    z, opened = [], 0
    for seed in range(100):
        floor = noise_floor(made_noise(still, rho, seed))
        errors = {name: coloured(6000, rho, 7 * seed + 1 + k) for k, name in enumerate(("pa", "pb"))}
        chi2 = float(np.mean([np.mean((errors[name] / floor.sigma[name]) ** 2) for name in errors]))
        deviation = floor.deviation(dict.fromkeys(errors, 6000))
        z.append((chi2 - 1) / deviation)
        opened += misfit(chi2, deviation)
    assert np.std(z) == pytest.approx(1.0, abs=0.25)
    assert opened == 0


def test_what_is_left_is_the_formula_s_where_no_later_effect_would_count():
    assert decide.complete(11.0, 0.0) == pytest.approx(1.3)  # and no more of the noise, however large the misfit was
    assert decide.complete(2.0, 0.0) == pytest.approx(1.1)
    assert decide.complete(1.2, 0.0) == gate(0.0)
    assert decide.complete(2.0, 0.04) == gate(0.04)


def test_a_name_that_leaves_twice_the_noise_must_explain_as_much_as_a_pair():
    """Of the wrong names of the study of rigs by datasheet all but one explained 86 to 95 % of a large misfit."""
    for left, share in ((3.9, 0.8), (4.1, 0.95)):
        before = 1 + (left - 1) / (1 - share)
        assert decide.confirmed(100 * before * 1.01, 100 * left, 100, 0.0)
        assert not decide.confirmed(100 * before * 0.99, 100 * left, 100, 0.0)
    assert decide.confirmed(500.0, 100.0, 100, 0.0)


def test_names_of_several_must_take_from_records_not_seen_what_one_of_two_would():
    assert decide.confirmed(1000.0, 700.0, 100, 0.0, several=True)  # 33 %, and more may be missing
    assert not decide.confirmed(1000.0, 700.0, 100, 0.0)
    assert not decide.confirmed(1000.0, 800.0, 100, 0.0, several=True)
    assert not decide.confirmed(500.0, 2600.0, 100, 0.0, several=True)
    assert decide.confirmed(100.0, 104.0, 100, 0.0, several=True)  # nothing is missing there


def made_noise(rows: int, rho: float, seed: int) -> Campaign:
    signals = {name: coloured(rows, rho, 10**6 + 2 * seed + k) for k, name in enumerate(("pa", "pb"))}
    still = Record("static", np.arange(rows) * 1e-3, {"command": np.zeros(rows), **signals})
    return Campaign(Path("here"), "jack-10t", (still,), (), ())


def coloured(rows: int, rho: float, seed: int) -> np.ndarray:
    """Unit variance, autocorrelation rho^k."""
    white = np.random.default_rng(seed).standard_normal(rows + 100)
    return lfilter([np.sqrt(1 - rho**2)], [1.0, -rho], white)[100:]


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
    assert not accident(2000, 1000, 10.1, 1.0, 39)
    assert accident(2000, 1000, 9.9, 1.0, 39)
    assert accident(2000, 1000, 10.1, 2.0, 39)  # coloured noise: half the independent samples


def test_the_chance_counts_every_candidate_and_coloured_noise():
    """One candidate gains 6.6 from noise once in two hundred times; the best of 39 needs 12."""
    assert chance(100.0, 93.4, 1.0, 1) == pytest.approx(0.005, abs=2e-4)
    assert chance(100.0, 93.4, 1.0, 39) == pytest.approx(39 * chance(100.0, 93.4, 1.0, 1))
    assert chance(100.0, 100.0, 1.0, 39) == 1.0
    assert accident(100.0, 93.4, 1e3, 1.0, 39)
    assert not accident(100.0, 86.0, 1e3, 1.0, 39)
    assert accident(100.0, 86.0, 1e3, 2.0, 39)


def test_what_harms_or_fails_never_passes():
    assert accident(1000, 1001, 1e6, 1.0, 1)
    assert accident(1000, np.inf, 1e6, 1.0, 1)


def test_an_effect_is_named_from_80_percent_or_at_the_noise():
    assert named([GOOD]) == [GOOD]
    assert named([replace(GOOD, explained=0.80, chi2=3.0)])
    assert not named([replace(GOOD, explained=0.79, chi2=3.0)])
    assert named([replace(GOOD, explained=0.5, chi2=1.04)])  # a faint misfit: what is left is noise
    assert not named([replace(GOOD, against="by chance")])
    assert named([]) == []


def test_of_equals_the_one_with_the_fewest_numbers_comes_first():
    lugre = replace(GOOD, formula="lugre", explained=0.958, numbers=5)
    assert named([lugre, GOOD]) == [GOOD]


def test_effects_within_one_percent_tie():
    bias = replace(GOOD, name="load.bias", kin="load.bias", formula="weight", explained=0.955)
    spring = replace(GOOD, name="load.spring", kin="load.spring", formula="linear", explained=0.93)
    assert named([GOOD, bias, spring]) == [bias, GOOD]
    assert named([GOOD, replace(bias, explained=0.93 + decide.TIED), spring])[0] == GOOD


def test_a_lead_that_noise_gives_names_nothing():
    """With a misfit of 1000 in squares 39 candidates differ by 12 from noise alone once in a hundred times."""
    lead = decide.lead_by_noise(1000.0, 1.0, 39)
    assert chance(100.0, 100.0 - 1000.0 * lead, 1.0, 39) == pytest.approx(decide.CHANCE)
    bias = replace(GOOD, name="load.bias", kin="load.bias", formula="weight", explained=GOOD.explained - 0.02)
    assert named([GOOD, bias]) == [GOOD]
    assert named([GOOD, bias], lead=decide.lead_by_noise(400.0, 1.0, 39)) == [GOOD, bias]


def test_a_neighbour_is_excluded_where_it_leaves_twice_what_the_name_leaves():
    """What is left shows that the formula is not the rig's: another one of a neighbour might do as well."""
    lag = Judgement("drive.lag", "two poles", 0.95, 1.2, 2, "", "drive timing")
    delay = Judgement("drive.delay", "shift", 0.91, 1.4, 1, "", "drive timing")
    assert named([lag, delay]) == [lag, delay]  # the better one first, although it has more numbers
    assert named([lag, replace(delay, explained=0.89)]) == [lag]
    assert named([lag, replace(delay, kin="another")]) == [lag]
    assert named([lag, replace(delay, against="by chance")]) == [lag]
    exact = replace(lag, explained=1.0)  # nothing is left: the likelihood decides
    assert named([exact, replace(delay, explained=0.98)]) == [exact]


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
