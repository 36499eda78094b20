"""A fit of a declared effect finds the numbers that made a campaign, from others."""

from dataclasses import replace

import pytest
from made_campaigns import campaign, written

import workbench as wb
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.trace.study import run_trace
from workbench.plant.effects import LIBRARY, find
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

TRUE = (
    ("line.hose", "lumped", {"r": 0.5, "f": 60.0, "zeta": 0.3}),
    ("jack.friction", "pressed by the mean", {"Fc": 20.0, "Fp": 80.0}),
    ("oil.warming", "viscosity and gain", {"w": 3.0, "g": 0.5, "tau": 2.0}),
    ("sensor.bend", "position", {"e": 0.02}),
    ("sensor.bend", "pressures", {"a": 0.03, "b": -0.02}),
)


pytestmark = pytest.mark.usefixtures("right_columns")


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


def test_oil_that_warms_within_a_record_is_named_with_its_numbers():
    """Each of the others changes a flow too, but alike from a record's beginning to its end."""
    numbers = dict(zip(("w", "g", "tau"), (3.0, 0.5, 2.0), strict=True))
    made = campaign(declared("oil.warming", "viscosity and gain", numbers, (1.0, 1.0, 1.0)))
    library = [effect for effect in LIBRARY if effect.name in ("oil.warming", "oil.air", "main.asymmetry")]
    answer = run_trace(made, load_rig("festo-tp511"), library, no_checkpoint, lambda _: None).metrics
    assert (answer["verdict"], answer["effects"]) == ("named", ["oil.warming"])
    assert answer["ranking"][0]["formula"] == "viscosity and gain"
    for name, value in (("g [%]", 50.0), ("tau [s]", 2.0)):
        _, low, high = answer["ranking"][0]["parameters"][name]
        assert low < value < high
