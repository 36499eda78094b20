"""A fit of a declared effect finds the numbers that made a campaign, from others."""

from dataclasses import replace

import pytest
from made_campaigns import campaign, written

import workbench as wb
from workbench.plant.effects import find
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

TRUE = (
    ("line.hose", "lumped", {"r": 0.5, "f": 60.0, "zeta": 0.3}),
    ("jack.friction", "pressed by the mean", {"Fc": 20.0, "Fp": 80.0}),
    ("sensor.bend", "position", {"e": 0.02}),
    ("sensor.bend", "pressures", {"a": 0.03, "b": -0.02}),
)


def declared(effect, formula, values, factors):
    """The training cylinder with this effect, its numbers off by a factor each."""
    specs = {n.name: n for n in find(effect, formula).numbers}
    numbers = {
        name: Number(
            name, value * factor, specs[name].si, specs[name].si, "", low=specs[name].low, high=specs[name].high
        )
        for (name, value), factor in zip(values.items(), factors, strict=False)
    }
    return replace(load_rig("festo-tp511"), effects=(EffectUse(effect, formula, numbers),))


@pytest.mark.parametrize(("effect", "formula", "values"), TRUE, ids=lambda value: str(value).replace(" ", "-"))
def test_a_declared_effect_gets_the_numbers_that_made_the_records(effect, formula, values, tmp_path):
    folder = written(campaign(declared(effect, formula, values, (1.0, 1.0, 1.0))), tmp_path / "made")
    answer = wb.fit(folder, declared(effect, formula, values, (2.0, 0.5, 1.5)), starts=1)
    assert answer.chi2["heldout"] < 1.1
    for name, value in values.items():
        unit = next(n.si for n in find(effect, formula).numbers if n.name == name)
        found, low, high = answer.parameters[f"{effect}.{name} [{unit}]"]
        assert low <= value <= high or found == pytest.approx(value, rel=0.05)
