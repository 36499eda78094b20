"""Rig files: the bundled ones carry the published and declared numbers, and every mistake is named where it is."""

import re
from dataclasses import FrozenInstanceError, replace
from importlib.resources import files

import numpy as np
import pytest
from hypothesis import given, strategies as st

from workbench.base.errors import InputError
from workbench.base.signals import SIGNALS
from workbench.base.units import to_si
from workbench.rigs import schema as rig_schema
from workbench.rigs.jack import JACKS
from workbench.rigs.rig import number_specs
from workbench.rigs.rig_file import bundled, load_rig, save_rig
from workbench.rigs.valve import VALVES

BUNDLED = ("festo-tp511", "jack-10t", "jack-10t-rounded")

# The paper's table 1 and operating point, and what was declared or fitted beside it, SI.
PUBLISHED = {
    "L": 31.2e-3, "l": 10.5e-3, "Dbuse": 0.18e-3, "Sbuse": 2.54e-8, "xo": 55e-6, "Kbuse": 0.039, "K1": 1.5e-9,
    "Kf2": 5.15e-12, "Vo2": 19.5e-9, "S2": 3.38e-5, "J": 4e-7, "phi": 9e-4, "Kr2": 2100, "M2": 9e-3, "psi2": 6,
    "K2": 6e-4, "eps": 3.7e-6, "Kf3": 1e-12, "S3": 5e-4, "Vo3": 8.6e-6, "M3": 0.276, "psi3": 1000, "Ps": 210e5,
    "imax": 20e-3, "n": 2,
}  # fmt: skip
FITTED = {
    "Km": 0.9985, "Knet": 0.4336, "kstop": 2.468e4, "cff2": 0.01077, "Pr": 4.355e5, "Kp": 0.5987, "z3max": 2.29e-3,
    "beta": 1e9, "Fs1": 0, "Fs2": 0, "Fs3": 0, "isat": 1, "Aj": 4.67e-3, "S": 0.5, "V0": 0.3e-3, "M": 1000, "b": 500,
    "Cl": 2e-12, "ke": 2e8, "ce": 4e5, "ks": 0, "cs": 0, "z2max": 0.4e-3, "z3over": 1.15,
}  # fmt: skip
ROUNDED = {
    "J": 3.56e-7, "phi": 8.5e-4, "K1": 1.45e-9, "xo": 54.5e-6, "Kbuse": 0.0385, "psi2": 6.46, "Km": 0.9938,
    "Knet": 0.2737, "cff2": 0.0135, "kstop": 2.19e4, "Pr": 8e5, "Kp": 0.613, "z3max": 2.298e-3, "Fs1": 1.3e-4,
    "Fs2": 1.6,
}  # fmt: skip
# How far a fit may move a number: factors of its value.
RANGES = {
    "beta": (0.85, 1.15), "Cl": (0.5, 2), "b": (0.5, 2), "M": (0.9, 1.1), "V0": (0.9, 1.1), "K3": (0.95, 1.05),
    "Kp": (0.9, 1.1), "Ps": (0.97, 1.03), "Km": (0.97, 1.03), "psi3": (0.8, 1.2), "eps": (0.75, 1.25),
}  # fmt: skip


def changed(folder, old, new, count=1):
    """A copy of the 10 t rig's file with something changed, and the row of the change."""
    text = (files("workbench") / "rigs" / "jack-10t.toml").read_text(encoding="utf-8")
    assert old in text
    path = folder / "mine.toml"
    path.write_text(text.replace(old, new, count), encoding="utf-8")
    return path, text[: text.index(old)].count("\n") + 1


def test_the_bundled_rigs_are_found():
    assert set(BUNDLED) <= set(bundled())


@pytest.mark.parametrize("name", bundled())
def test_every_number_of_a_bundled_rig_has_a_source_and_lies_inside_its_bounds(name):
    rig = load_rig(name)
    assert rig.name == name
    assert rig.source
    assert set(rig.numbers) == set(number_specs(rig.valve, rig.corrector, rig.jack, rig.load))
    assert set(rig.sensors) <= set(SIGNALS)
    for number in (*rig.numbers.values(), *rig.limits.values(), rig.period):
        assert number.source, number.name
        assert (number.low is None) == (number.high is None)
        if number.low is not None and number.high is not None:
            assert number.low <= number.value <= number.high


@pytest.mark.parametrize(
    ("name", "numbers"), [("jack-10t", PUBLISHED | FITTED), ("jack-10t-rounded", PUBLISHED | FITTED | ROUNDED)]
)
def test_the_rig_carries_the_published_numbers(name, numbers):
    rig = load_rig(name)
    for key, value in numbers.items():
        assert rig[key] == pytest.approx(value, rel=1e-12), key
    assert rig["K3"] == pytest.approx(0.01 / np.sqrt(35e5) / (rig["z3max"] + rig["eps"]), rel=1e-6)
    assert rig["rff3"] == pytest.approx(0.43 / 0.0297, rel=1e-6)


@pytest.mark.parametrize("name", ["jack-10t", "jack-10t-rounded"])
def test_a_fit_may_move_the_uncertain_numbers_and_no_others(name):
    rig = load_rig(name)
    assert {key for key, number in rig.numbers.items() if number.low is not None} == set(RANGES)
    for key, (low, high) in RANGES.items():
        number = rig.numbers[key]
        assert (number.low, number.high) == pytest.approx((low * number.value, high * number.value), rel=1e-3), key


def test_numbers_are_si_inside_and_shown_in_their_own_unit(rig):
    assert (rig["z3max"], rig.numbers["z3max"].unit) == (pytest.approx(2.29e-3), "mm")
    assert rig.numbers["z3max"].shown == pytest.approx(2.29)
    assert rig.limit("force") == pytest.approx(90e3)
    assert rig.period.value == pytest.approx(1e-3)
    assert rig.sensors["pa"].noise == pytest.approx(0.16e5)


@given(st.floats(50, 400), st.sampled_from(["bar", "MPa", "Pa", "psi"]))
def test_a_number_may_be_written_in_any_unit_of_its_kind(tmp_path_factory, bar, unit):
    shown = to_si(bar, "bar", "Pa") / to_si(1.0, unit, "Pa")
    path, _ = changed(
        tmp_path_factory.mktemp("rig"),
        '{value = 210, unit = "bar", source = "paper, operating point", bounds = [203.7, 216.3]}',
        f'{{value = {float(shown)!r}, unit = "{unit}", source = "here"}}',
    )
    rig = load_rig(path)
    assert rig["Ps"] == pytest.approx(bar * 1e5, rel=1e-9)
    assert rig.numbers["Ps"].shown == pytest.approx(shown, rel=1e-9)


MASS = 'M = {value = 1000, unit = "kg", source = "paper: 1 t dynamic", bounds = [900, 1100]}'
AT_ROW = [
    ("Aj = {", "Ajj = {", 'jack.Ajj: unknown key; did you mean "Aj"?'),
    (MASS, 'M = {value = 1000, unit = "bar"}', 'load.M.unit: unit "bar" cannot be converted to "kg"'),
    (MASS, 'M = {value = 1000, unit = "quux"}', 'load.M.unit: unknown unit "quux"'),
    (MASS, "M = {value = 1000}", "load.M.unit: no unit"),
    (MASS, "M = 1000", 'load.M: write {value = ..., unit = "kg"'),
    (MASS, 'M = {value = "1000", unit = "kg"}', 'load.M.value = "1000": must be a finite number'),
    (MASS, 'M = {value = true, unit = "kg"}', "load.M.value = True: must be a finite number"),
    (MASS, 'M = {unit = "kg"}', "load.M.value: missing"),
    (MASS, 'M = {value = nan, unit = "kg"}', "load.M.value = nan: must be a finite number"),
    (MASS, 'M = {value = inf, unit = "kg"}', "load.M.value = inf: must be a finite number"),
    (MASS, 'M = {value = -5, unit = "kg"}', "load.M: -5 kg is outside 0.01 to 1e+06 kg"),
    (MASS, 'M = {value = 0, unit = "kg"}', "load.M: 0 kg is outside"),
    (
        MASS,
        'M = {value = 1000, unit = "kg", bounds = [1100, 1200]}',
        "load.M.bounds: the value is outside",
    ),
    (
        MASS,
        'M = {value = 1000, unit = "kg", bounds = [nan, nan]}',
        "load.M.bounds = [nan, nan]: must be a list",
    ),
    (MASS, 'M = {value = 1000, unit = "kg", bounds = [900]}', "load.M.bounds: must be two numbers, [low, high]"),
    (
        MASS,
        'M = {value = 1000, unit = "kg", bound = [900, 1100]}',
        'load.M.bound: unknown key; did you mean "bounds"',
    ),
    ('kind = "three-stage"', 'kind = "three-stages"', 'valve.kind = "three-stages": did you mean "three-stage"?'),
    ('corrector = "p" ', 'corrector = "pd" ', 'valve.corrector = "pd"'),
    ('kind = "double-rod"', 'kind = "double"', 'jack.kind = "double": did you mean "double-rod"?'),
    ("stroke = {", "strok = {", 'limits.strok: unknown key; did you mean "stroke"?'),
    ("noise = {value = 0.02,", "noise = {value = -0.02,", "sensors.current.noise: -2e-05 A is outside"),
]


@pytest.mark.parametrize(("old", "new", "message"), AT_ROW, ids=[new for _, new, _ in AT_ROW])
def test_a_mistake_is_named_with_file_and_row(tmp_path, old, new, message):
    path, row = changed(tmp_path, old, new)
    with pytest.raises(InputError, match=re.escape(f"mine.toml: line {row}: {message}")) as caught:
        load_rig(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[oil]", "[oils]", 'oils: unknown key; did you mean "oil"?'),
        ("[load]\n" + MASS, "[load]", "load.M: missing (moving mass, in kg)"),
        ("[sensors.current]", "[sensors.curent]", 'sensors.curent: unknown key; did you mean "current"?'),
        ("[sensors.pa]\nnoise", "[sensors.pa]\nnois", 'sensors.pa.nois: unknown key; did you mean "noise"?'),
        ("period = {", "perod = {", 'control.perod: unknown key; did you mean "period"?'),
        ("[control]", '[[effects]]\nformula = "coulomb"\n\n[control]', 'effects.1.name: missing; write name = "..."'),
        (
            "[control]",
            '[[effects]]\nname = "jack.friction"\nFc = 800\n\n[control]',
            "effects.1.Fc: must be a number with its unit; write Fc = {value = ..., unit = ...}",
        ),
        (
            "[control]",
            '[[effects]]\nname = "jack.friction"\nvariant = "stribeck"\n\n[control]',
            "a text is only in name and formula",
        ),
        ("[control]", "[[control]]", "must be a table; write [control]"),
        ("[control]", "[control", ": line"),
    ],
)
def test_a_mistake_is_named_with_its_file(tmp_path, old, new, message):
    path, _ = changed(tmp_path, old, new)
    with pytest.raises(InputError) as caught:
        load_rig(path)
    assert "mine.toml" in str(caught.value)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("table", ["supply", "oil", "valve", "jack", "load", "limits", "control"])
def test_a_missing_table_is_named(tmp_path, table):
    text = (files("workbench") / "rigs" / "jack-10t.toml").read_text(encoding="utf-8")
    path = tmp_path / "mine.toml"
    path.write_text(re.sub(rf"\n\[{table}\]\n(?:[^\[\n].*\n)*", "\n", text), encoding="utf-8")
    with pytest.raises(InputError, match=rf"mine\.toml: {table}: missing; add a table \[{table}\]"):
        load_rig(path)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("bounds = [900, 1100]", "bounds = 5"),
        ('kind = "double-rod"', 'kind = ["double-rod"]'),
        ('kind = "double-rod"', "kind = {}"),
        ("[sensors.pa]\n", "[sensors]\npa = 3\n[sensors.current2]\n"),
        ('name = "jack-10t"', 'name = "jack-10t"\neffects = 5'),
    ],
)
def test_a_value_of_a_wrong_type_is_refused(tmp_path, old, new):
    path, _ = changed(tmp_path, old, new)
    with pytest.raises(InputError, match=r"mine\.toml: line \d+: ") as caught:
        load_rig(path)
    assert "\n" not in str(caught.value)


def test_an_unknown_rig_names_the_nearest_and_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match='no bundled rig "jack-10"; did you mean "jack-10t"'):
        load_rig("jack-10")
    with pytest.raises(InputError, match="no such file"):
        load_rig(tmp_path / "absent.toml")
    with pytest.raises(InputError, match="no such file"):
        load_rig("absent.toml", beside=tmp_path)


def test_a_rig_file_lies_beside_what_names_it(tmp_path):
    changed(tmp_path, 'name = "jack-10t"', 'name = "ours"')
    assert load_rig("mine.toml", beside=tmp_path).name == "ours"


def test_an_effect_is_read_with_its_numbers(tmp_path):
    entry = '[[effects]]\nname = "jack.friction"\nformula = "stribeck"\nFc = {value = 0.8, unit = "kN"}\n\n[control]'
    (use,) = load_rig(changed(tmp_path, "[control]", entry)[0]).effects
    assert (use.name, use.formula) == ("jack.friction", "stribeck")
    assert use.numbers["Fc"].shown == pytest.approx(0.8)


def test_with_values_is_a_copy(rig):
    heavier = rig.with_values(M=1500.0, Ps=1e7)
    assert (heavier["M"], heavier["Ps"], rig["M"]) == (1500.0, 1e7, 1000.0)
    assert heavier.numbers["M"].unit == "kg"
    assert {k: v for k, v in heavier.numbers.items() if k not in ("M", "Ps")} == {
        k: v for k, v in rig.numbers.items() if k not in ("M", "Ps")
    }
    with pytest.raises(FrozenInstanceError):
        rig.name = "other"


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"Mass": 1.0}, 'no number "Mass"'),
        ({"M": -1.0}, "M: -1 kg is outside"),
        ({"M": float("nan")}, "M: nan"),
        ({"Ps": 1e5}, "rig jack-10t: Ps: 1 bar is not above the return pressure, 4.355 bar"),
        ({"Ps": 4e6, "Pr": 5e6}, "rig jack-10t: Ps: 40 bar is not above the return pressure, 50 bar"),
        ({"S": 0.4}, "rig jack-10t: stroke: 240 mm to each side of mid stroke is beyond the end stops, 200 mm"),
    ],
)
def test_with_values_refuses_what_cannot_be(rig, values, message):
    with pytest.raises(InputError, match=re.escape(message)):
        rig.with_values(**values)


def test_a_session_and_a_change_of_each_number_are_checked_as_a_file_is(rig):
    low = replace(rig.numbers["Ps"], value=1e5)
    with pytest.raises(InputError, match="Ps: 1 bar is not above the return pressure"):
        replace(rig, sessions={"cold": {"Ps": low}}).in_session("cold")
    with pytest.raises(InputError, match="is not above the return pressure"):
        rig.with_each_number(lambda number: low if number.name == "Ps" else number)


@pytest.mark.parametrize("name", bundled())
def test_a_saved_rig_reads_back_the_same(tmp_path, name):
    rig = load_rig(name)
    save_rig(rig, tmp_path / "again.toml")
    again = load_rig(tmp_path / "again.toml")
    save_rig(again, tmp_path / "third.toml")
    assert (tmp_path / "third.toml").read_bytes() == (tmp_path / "again.toml").read_bytes()
    assert (again.name, again.title, again.source, again.sensors) == (rig.name, rig.title, rig.source, rig.sensors)
    for key, number in {**rig.numbers, **rig.limits}.items():
        other = {**again.numbers, **again.limits}[key]
        assert (other.unit, other.source) == (number.unit, number.source)
        assert other.value == pytest.approx(number.value, rel=1e-13, abs=0)


def test_a_saved_rig_keeps_its_effects(tmp_path, with_effect):
    rig = with_effect("jack.friction", "coulomb", Fc=(0.8, "kN"))
    save_rig(rig, tmp_path / "again.toml")
    (use,) = load_rig(tmp_path / "again.toml").effects
    assert (use.name, use.formula) == ("jack.friction", "coulomb")
    assert (use.numbers["Fc"].shown, use.numbers["Fc"].unit) == (pytest.approx(0.8), "kN")


def test_bounds_go_with_a_value_that_leaves_them(rig):
    mass = rig.with_values(M=2000.0).numbers["M"]
    assert (mass.low, mass.high) == pytest.approx((1800, 2200))
    inside = rig.with_values(M=1050.0).numbers["M"]
    assert (inside.low, inside.high) == pytest.approx((900, 1100))


def test_an_interval_of_a_fit_is_kept_goes_with_the_value_and_is_what_is_uncertain(tmp_path, rig):
    number = rig.numbers["M"]
    known = replace(number, interval=(0.9 * number.value, 1.2 * number.value))
    assert (known.uncertain, replace(known, interval=None).uncertain) == (known.interval, (number.low, number.high))
    fitted = replace(rig, numbers={**rig.numbers, "M": known})
    save_rig(fitted, tmp_path / "fitted.toml")
    assert load_rig(tmp_path / "fitted.toml").numbers["M"].interval == pytest.approx(known.interval)
    heavier = fitted.with_values(M=2 * number.value).numbers["M"]
    assert heavier.interval == pytest.approx((1.8 * number.value, 2.4 * number.value))


def test_a_value_outside_its_interval_is_refused(tmp_path, rig):
    number = rig.numbers["M"]
    known = replace(number, interval=(1.1 * number.value, 1.2 * number.value))
    save_rig(replace(rig, numbers={**rig.numbers, "M": known}), tmp_path / "fitted.toml")
    with pytest.raises(InputError, match=r"load\.M\.interval: the value is outside its own interval"):
        load_rig(tmp_path / "fitted.toml")


def test_a_changed_rig_can_be_saved(tmp_path, rig):
    save_rig(rig.with_values(M=1500.0), tmp_path / "heavy.toml")
    assert load_rig(tmp_path / "heavy.toml")["M"] == 1500.0


def test_every_schema_entry_says_what_it_is():
    tables = (rig_schema.SUPPLY, rig_schema.OIL, rig_schema.LOAD, rig_schema.LIMITS, rig_schema.CONTROL)
    valves = [valve.schema(corrector) for valve in VALVES.values() for corrector in (*valve.correctors, "")]
    kinds = (*valves, *(jack.numbers for jack in JACKS.values()))
    for table in (*tables, *kinds):
        for spec in table.values():
            assert spec.meaning
            assert spec.low < spec.high
            assert to_si(1.0, spec.unit, spec.unit) == 1.0


def test_a_rig_shows_itself_in_three_lines_and_as_a_table(rig):
    lines = repr(rig).splitlines()
    assert lines[0].startswith("<Rig jack-10t: 10 t test-rig jack")
    assert lines[1:] == [
        " 2 three-stage valves, p spool loop, double-rod jack",
        " M 1000 kg, S 0.5 m, Ps 210 bar, period 1 ms>",
    ]
    table = rig._repr_html_()
    assert table.count("<tr>") == len(rig.numbers) + 1
    assert "<td>Ps</td><td>210</td><td>bar</td><td>203.7 to 216.3</td><td>supply pressure, absolute</td>" in table


def test_an_unknown_number_names_its_neighbour(rig):
    with pytest.raises(KeyError, match='no number of rig jack-10t "betta"; did you mean "beta"'):
        rig["betta"]
