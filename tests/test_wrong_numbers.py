"""A wrong number or a missing effect: candidates that shift described numbers, judged beside the effects."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from workbench.commands.trace.effect_words import ALL_EFFECTS
from workbench.identify.fit.determined import FreeParameter
from workbench.identify.fit.solver import Fit
from workbench.identify.found.wrong_numbers import corrected, wrong_numbers
from workbench.plant.effects import known_effects, number_effects
from workbench.rigs.rig_file import load_rig


@pytest.fixture(scope="module")
def rig():
    return load_rig("pump-rig").with_corrector("speed")


def shifting(rig, name):
    (candidate,) = [effect for effect in number_effects(rig) if effect.shifts == name]
    return candidate


def fit(rig, own, shift, scatter):
    """A fit whose AB is `own` and its shift `shift`, each known to `scatter` [m^2]."""
    number, effect = rig.numbers["AB"], shifting(rig, "AB")
    free = (
        FreeParameter("AB", number.value, number.low, number.high, 1e-4, "range"),
        FreeParameter(effect.key("by"), 0.0, -1e-3, 1e-3, 1e-4, "range"),
    )
    x = np.array([(own - number.value) / 1e-4, shift / 1e-4])
    covariance = np.eye(2) * (scatter / 1e-4) ** 2
    return cast(Fit, SimpleNamespace(free=free, x=x, covariance=covariance))


def test_a_contradicted_number_is_named_with_what_the_records_say(rig):
    (wrong,) = wrong_numbers(rig, fit(rig, 16.2e-4, -2.8e-4, 0.05e-4), [shifting(rig, "AB")])
    assert wrong.json()["name"] == "AB [cm^2]"
    described, found, low, high = (wrong.json()[key] for key in ("described", "found", "low", "high"))
    assert described == pytest.approx(16.493)
    assert found == pytest.approx(13.4)
    assert (high - low) / 2 == pytest.approx(1.96 * 0.05 * np.sqrt(2))
    assert wrong.beyond == pytest.approx((16.2 - high) / 0.6)
    assert "AB is described as 16.49 cm^2, and the records say 13.4" in wrong.text


def test_a_number_that_stays_within_its_trust_is_no_contradiction(rig):
    assert wrong_numbers(rig, fit(rig, 16.2e-4, -0.05e-4, 0.05e-4), [shifting(rig, "AB")]) == []


def test_the_rig_as_found_has_the_number_itself(rig):
    numbers = corrected(rig, fit(rig, 16.2e-4, -2.8e-4, 0.05e-4), [shifting(rig, "AB")], "records")
    found = replace(rig, numbers={**rig.numbers, **numbers})
    assert found["AB"] == pytest.approx(13.4e-4)
    assert numbers["AB"].source.startswith("fitted to records, which contradicts 16.49 cm^2; it was: published")


def test_there_are_words_for_every_effect_and_no_other():
    assert set(ALL_EFFECTS) == {effect.name for effect in known_effects()}
