"""Plants with any numbers under any command: the engine's answer is finite or flagged, and oil and energy balance."""

from collections import Counter

import pytest
import random_plants
from random_plants import RIGS, examine_plant

PLANTS = 200


@pytest.fixture(scope="module")
def balances():
    return {seed: examine_plant(seed) for seed in range(PLANTS)}


def test_a_random_plant_keeps_oil_and_energy_or_is_flagged(balances):
    assert {seed: balance for seed, balance in balances.items() if balance.is_wrong} == {}


def test_nearly_all_of_them_are_judged(balances):
    outcomes = Counter(balance.outcome for balance in balances.values())
    assert outcomes["balanced"] > 0.9 * PLANTS
    assert {balance.what.split()[0] for balance in balances.values()} == set(RIGS)


@pytest.mark.parametrize("law", ["_root", "_lap"])
def test_a_wrong_law_would_be_seen(monkeypatch, law):
    """Flows that are five percent larger than the plant's."""
    right = getattr(random_plants, law)
    monkeypatch.setattr(random_plants, law, lambda *arguments: 1.05 * right(*arguments))
    assert sum(examine_plant(seed).is_wrong for seed in range(10)) > 5
