"""What is listed and shown: everything there is, and derived numbers that the model confirms."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from workbench.base.errors import InputError
from workbench.base.table import ConfigTable
from workbench.commands.list.catalogue import KINDS, listing, listing_text
from workbench.commands.show.describe import describe, describe_text
from workbench.control.controller_spec import controller_spec
from workbench.plant.effects import LIBRARY
from workbench.rigs.platform import bundled_platforms
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import bundled, load_rig


@pytest.fixture(scope="module")
def shown():
    return describe(load_rig("jack-10t"))


@pytest.fixture(scope="module")
def derived(shown):
    return {row["name"]: row["value"] for row in shown["derived"]}


def test_every_rig_and_effect_is_listed():
    assert [row["name"] for row in listing("rigs")] == [*bundled(), *bundled_platforms()]
    assert [(row["name"], row["formula"]) for row in listing("effects")] == [(e.name, e.formula) for e in LIBRARY]


def test_controllers_are_found_by_their_files_and_can_be_used():
    rows = {row["name"]: row for row in listing("controllers")}
    assert {name: rows[name]["kind"] for name in ("p", "pid-lead", "tvc", "pressure")} == {
        "p": "controller", "pid-lead": "controller", "tvc": "controller", "pressure": "compensator",
    }  # fmt: skip
    assert rows["pid-lead"]["use"] == "controllers.pid_lead:PidLead"
    for name, row in rows.items():
        assert row["summary"]
        for number in row["numbers"]:
            assert {"name", "unit", "low", "high", "meaning", "default"} <= number.keys()
        middle = {n["name"]: _possible(n) for n in row["numbers"] if n["default"] is None}
        given = {"use": row["use"], **middle}
        plain = {"use": "controllers.p:P", "gain": {"value": 1, "unit": "1/m"}, "compensators": [given]}
        assert controller_spec(name, ConfigTable(given if row["kind"] == "controller" else plain, "here")).name == name


def _possible(number: Mapping[str, Any]) -> Any:
    """The least value of a listed number, or the one file that ships for what has no bounds."""
    if number["low"] is None:
        assert "a .npz file" in number["meaning"]
        return str(Path(__file__).parents[1] / "experiments" / "position_policy.npz")
    return {"value": number["low"], "unit": number["unit"]}


def test_an_experiment_is_listed_with_its_first_comment(tmp_path):
    (tmp_path / "b.toml").write_text('# Which?\n# More.\nexperiment = "step"\n')
    (tmp_path / "a.toml").write_text('experiment = "step"\n')
    names = [str(tmp_path / name) for name in ("a.toml", "b.toml")]
    rows = listing("experiments", tmp_path)
    assert rows[:2] == [
        {"name": names[0], "summary": ""},
        {"name": names[1], "summary": "Which?"},
    ]
    assert {"paper", "position_step", "benchmark", "sample"} <= {row["name"] for row in rows[2:]}
    assert all(row["summary"] for row in rows[2:])
    assert listing("experiments", tmp_path / "none") == rows[2:]


def test_bad_asks_say_what_there_is():
    with pytest.raises(InputError, match='did you mean "rigs"'):
        listing("rig")


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "experiments"])
def test_lists_are_json_and_text_with_a_line_a_row(kind):
    rows = listing(kind)
    assert json.loads(json.dumps(rows)) == rows
    assert len(listing_text(rows).splitlines()) == len(rows)


def test_formula_and_model_agree_on_the_jack_s_mode(derived):
    for suffix in ("", ", linearised"):
        assert derived[f"natural frequency{suffix}"] == pytest.approx(27.4, abs=0.05)
        assert derived[f"damping{suffix}"] == pytest.approx(0.020, abs=0.0005)


def test_flow_speed_force_and_gain_are_those_of_the_plant(derived):
    assert derived["rated flow"] == pytest.approx(600, rel=1e-3)
    assert derived["rated flow, all valves"] == pytest.approx(1200, rel=1e-3)
    assert derived["stall force, extending"] == pytest.approx((210e5 - 4.355e5) * 4.67e-3 / 1e3, rel=1e-9)
    for way in ("extending", "retracting"):
        assert derived[f"no-load speed, {way}"] == pytest.approx(7.1, rel=0.02)
        assert derived[f"velocity gain, {way}"] == pytest.approx(7.1, rel=0.03)
    assert derived["velocity gain at null"] == pytest.approx(14.6, rel=0.005)


def test_a_differential_jack_differs_by_direction_and_its_formula_holds():
    found = {row["name"]: row["value"] for row in describe(load_rig("festo-tp511"))["derived"]}
    assert found["no-load speed, extending"] > 1.2 * found["no-load speed, retracting"]
    assert found["stall force, extending"] > 1.5 * found["stall force, retracting"]
    for name in ("natural frequency", "damping"):
        assert found[name] == pytest.approx(found[f"{name}, linearised"], rel=0.01)


def test_every_number_is_shown_with_unit_source_and_bounds(shown):
    rig = load_rig("jack-10t")
    rows = {row["name"]: row for row in shown["numbers"]}
    assert rows.keys() == {*rig.numbers, *rig.limits, "period", "computing_delay"}
    for name, number in rig.numbers.items():
        assert rows[name]["value"] == pytest.approx(number.shown)
        assert (rows[name]["unit"], rows[name]["source"]) == (number.unit, number.source)
    assert rows["Ps"]["bounds"] == [203.7, 216.3]
    assert rows["J"]["bounds"] is None
    assert json.loads(json.dumps(shown)) == shown


def test_the_text_names_every_number_and_effect(shown, with_effect):
    text = describe_text(shown)
    for row in (*shown["numbers"], *shown["derived"]):
        assert row["name"] in text
    assert all(line == line.rstrip() for line in text.splitlines())
    assert "Effect jack.friction coulomb" in describe_text(
        describe(with_effect("jack.friction", "coulomb", Fc=(800.0, "N")))
    )


@pytest.mark.parametrize("formula", ["play", "prandtl-ishlinskii", "bouc-wen"])
def test_a_rig_with_hysteresis_is_shown(formula):
    """A play has no slope inside its gap, so that nothing scales its rate where a search starts."""
    rig = replace(load_rig("jack-10t"), effects=(EffectUse("pilot.hysteresis", formula, {}),))
    names = [row["name"] for row in describe(rig)["derived"]]
    assert names == [row["name"] for row in describe(load_rig("jack-10t"))["derived"]]
