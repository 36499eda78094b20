"""A rig from a datasheet: closed form for two orders, a fit for three stages, and honesty about what is not known."""

import json
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st
from made_campaigns import LIBRARY, commands, made

from workbench.base.errors import InputError
from workbench.base.units import from_si, to_si, usual_unit
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.common.run_folder import metrics_json
from workbench.commands.new_rig import study as new_rig
from workbench.commands.new_rig.study import run_new_rig
from workbench.commands.trace.study import run_trace
from workbench.identify.datasheet import valve_fit as fitting
from workbench.identify.datasheet.corners import FigureErrors
from workbench.identify.datasheet.valve_fit import fit_three_stage, second_order_numbers, source_of, unknowns
from workbench.identify.fit.determined import FIGURE_ERROR, FreeParameter, determine
from workbench.linear import equilibrium
from workbench.plant import build
from workbench.records import Campaign
from workbench.rigs.datasheet import DatasheetResponse, build_rig, load_datasheet
from workbench.rigs.datasheet_keys import figures
from workbench.rigs.jack import JACKS
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig, save_rig
from workbench.rigs.schema import LOAD, SUPPLY
from workbench.rigs.tolerances import EXACT, TOLERANCES, with_tolerance
from workbench.rigs.valve import VALVES

SERVO = """
experiment = "new-rig"
name = "servo"
[supply]
Ps = {value = 210, unit = "bar"}
Pr = {value = 2, unit = "bar"}
[valve]
kind = "second-order"
rated_flow = {value = 40, unit = "l/min"}
rated_drop = {value = 70, unit = "bar"}
leakage = {value = 1, unit = "l/min"}
leakage_drop = {value = 210, unit = "bar"}
n = {value = 1, unit = "1"}
[[valve.response]]
stage = "main"
amplitude = {value = 100, unit = "%"}
reference = {value = 2, unit = "Hz"}
f3db = {value = 60, unit = "Hz"}
f90 = {value = 80, unit = "Hz"}
[jack]
kind = "differential"
AA = {value = 20, unit = "cm^2"}
AB = {value = 10, unit = "cm^2"}
S = {value = 300, unit = "mm"}
[load]
M = {value = 200, unit = "kg"}
"""

THREE_STAGE = """
experiment = "new-rig"
[supply]
Ps = {value = 210, unit = "bar"}
[valve]
kind = "three-stage"
like = "jack-10t"
rated_flow = {value = 600, unit = "l/min"}
rated_drop = {value = 70, unit = "bar"}
pilot_flow = {value = 20, unit = "l/min"}
imax = {value = 20, unit = "mA"}
n = {value = 2, unit = "1"}
[[valve.response]]
stage = "pilot"
amplitude = {value = 100, unit = "%"}
reference = {value = 10, unit = "Hz"}
f3db = {value = 115, unit = "Hz"}
f90 = {value = 180, unit = "Hz"}
[[valve.response]]
stage = "main"
amplitude = {value = 100, unit = "%"}
reference = {value = 5, unit = "Hz"}
f3db = {value = 70, unit = "Hz"}
f90 = {value = 73, unit = "Hz"}
[valve.rounding]
J = {value = 0.5e-7, unit = "kg m^2"}
[jack]
kind = "double-rod"
Aj = {value = 46.7, unit = "cm^2"}
S = {value = 0.5, unit = "m"}
[load]
M = {value = 1000, unit = "kg"}
"""


def sheet_of(folder, text):
    path = folder / "sheet.toml"
    path.write_text(text)
    return load_datasheet(path)


@pytest.fixture(scope="module")
def servo(tmp_path_factory):
    return sheet_of(tmp_path_factory.mktemp("servo"), SERVO)


@pytest.fixture(scope="module")
def outcome(servo):
    return run_new_rig(servo, no_checkpoint, lambda _: None)


@pytest.fixture(scope="module")
def three_stage(tmp_path_factory):
    return sheet_of(tmp_path_factory.mktemp("three"), THREE_STAGE)


def test_a_second_order_valve_has_its_datasheet_s_figures(outcome):
    rows = {row["id"]: row for row in outcome[0].metrics["rows"]}
    assert rows.keys() == {"main_100_f3db", "main_100_f90", "main_flow"}
    for row in rows.values():
        assert list(row) == ["id", "value", "unit", "datasheet", "error_percent", "estimate"]
        assert abs(row["error_percent"]) < 0.5
    assert "figures within 0." in outcome[0].page.verdict


def test_its_leakage_at_null_is_that_of_the_datasheet(outcome):
    """Closed ports at half of the drop: the flow from the supply goes through two lands of eps each."""
    rig = outcome[1]
    leakage = 2 * rig["K3"] * rig["eps"] * np.sqrt(210e5 / 2)
    assert leakage == pytest.approx(float(to_si(1, "l/min", "m^3/s")), rel=1e-9)


def test_every_number_of_a_datasheet_has_a_tolerance_and_its_source_says_which(outcome, tmp_path):
    """What is pinned is a count, a scale, or what the rig has none of."""
    rig = outcome[1]
    assert {name for name, n in rig.numbers.items() if n.low is None} == {"n", "z3max", "xmid", "ks", "cs"}
    mass, friction = rig.numbers["M"], rig.numbers["b"]
    assert (mass.low, mass.high, mass.source) == (190, 210, f"datasheet; +-5 %: {TOLERANCES['M'].why}")
    assert (friction.low, friction.high) == pytest.approx((friction.value / 10, friction.value * 10))
    assert friction.source.endswith(f"0.1 to 10 times: {TOLERANCES['b'].why}")
    assert all(n.low < n.value < n.high for n in rig.numbers.values() if n.low is not None)
    exact = {name: rig.numbers[name].source.partition("; exact: ")[2] for name in ("n", "z3max", "xmid", "ks", "cs")}
    assert exact == {name: EXACT[name] for name in exact}
    open_tank = with_tolerance(replace(rig.numbers["Pr"], value=0.0, low=None, source="datasheet"), SUPPLY["Pr"])
    assert open_tank.source == "datasheet; exact: stated as 0, which no factor moves"
    specimen = with_tolerance(replace(rig.numbers["ks"], value=1e6, low=None, source="datasheet"), LOAD["ks"])
    assert (specimen.low, specimen.high) == (5e5, 2e6)
    own = SERVO.replace('M = {value = 200, unit = "kg"}', 'M = {value = 200, unit = "kg", bounds = [199, 230]}')
    own = own.replace('{value = 40, unit = "l/min"}', '{value = 40, unit = "l/min", bounds = [38, 44]}')
    sheet = sheet_of(tmp_path, own)
    stated = build_rig(sheet, second_order_numbers(sheet)).numbers
    assert (stated["M"].low, stated["M"].high) == (199, 230)
    assert (stated["K3"].low, stated["K3"].high) == pytest.approx((0.95 * rig["K3"], 1.1 * rig["K3"]))


def test_a_trace_names_friction_on_a_rig_whose_numbers_are_off_as_datasheets_are(outcome):
    """Pinned at the sheet's values, they push each other to their ends and the answer is unknown, or another effect."""
    off = {"M": 1.04, "Ps": 0.96, "Pr": 2.2, "K3": 1.06, "f0": 0.85, "zeta": 0.7, "eps": 1.8, "b": 0.3, "beta": 0.8}
    rig = outcome[1]
    true = rig.with_values(**{name: factor * rig[name] for name, factor in off.items()})
    friction = EffectUse("jack.friction", "coulomb", {"Fc": Number("Fc", 800.0, "N", "N", "made up")})
    rubbing, plant = replace(true, effects=(friction,)), build(true)
    null = float(equilibrium(plant).u[0])
    sigma = {"pa": 1e4, "pb": 1e4, "position": 2e-5}
    played = {"still": np.zeros(500), **dict(zip(("steps", "triangle", "sines"), commands(2.0), strict=True))}
    still, steps, triangle, sines = (
        made(rubbing, name, null + command, seed, sigma) for seed, (name, command) in enumerate(played.items())
    )
    campaign = Campaign(Path("made"), "servo", (still,), (steps, triangle), (sines,))
    metrics = run_trace(campaign, rig, LIBRARY, no_checkpoint, lambda _: None).metrics
    assert (metrics["verdict"], metrics["effects"]) == ("named", ["jack.friction"])
    assert metrics["chi2"]["after"] < 1.2
    assert metrics["ranking"][0]["parameters"]["Fc [N]"][0] == pytest.approx(800, rel=0.02)
    assert metrics["base"]["M [kg]"][0] == pytest.approx(1.04 * 200, rel=0.01)
    assert metrics["pinned"] == []


def test_the_rig_can_be_saved_loaded_and_used(outcome, tmp_path):
    rig = outcome[1]
    save_rig(rig, tmp_path / "rig.toml")
    again = load_rig(tmp_path / "rig.toml")
    for name, number in rig.numbers.items():
        assert again[name] == pytest.approx(number.value, rel=1e-12)
        assert again.numbers[name].source == number.source != ""
    assert all(sensor.sources.keys() == {"noise", "resolution"} for sensor in again.sensors.values())
    assert again.sensors.keys() == rig.sensors.keys() >= {"position", "pa", "pb", "spool"}
    assert rig.numbers["M"].source.startswith("datasheet; ")
    assert rig.numbers["V0A"].source.startswith("estimate")
    full = equilibrium(build(again), command=1.0)
    assert full.speed == pytest.approx(again.limit("speed") / 1.1, rel=0.05)


@given(st.floats(5, 500), st.floats(0.2, 3))
def test_corners_of_any_second_order_valve_give_its_numbers_back(servo, f0, zeta):
    half = 1 - 2 * zeta**2
    f3db = f0 * np.sqrt(half + np.sqrt(half**2 + 1))
    found = second_order_numbers(replace(servo, responses=(DatasheetResponse("main", 1.0, 0.01, f3db, f0),)))
    assert found["f0"].value == pytest.approx(f0)
    assert found["zeta"].value == pytest.approx(zeta, rel=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('f90 = {value = 80, unit = "Hz"}', 'f90 = {value = 30, unit = "Hz"}', ["no second-order valve", "30"]),
        ("leakage = {value = 1,", "leakage = {value = 39,", ["leakage", "of the rated flow"]),
        ("leakage = {value = 1,", "leakage = {value = 1e-5,", ["eps", "outside"]),
    ],
)
def test_figures_that_no_valve_has_are_refused(tmp_path, old, new, words):
    sheet = sheet_of(tmp_path, SERVO.replace(old, new))
    with pytest.raises(InputError) as caught:
        build_rig(sheet, second_order_numbers(sheet))
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('experiment = "new-rig"', "", ["experiment"]),
        ('"second-order"', '"second order"', ["valve.kind", 'did you mean "second-order"']),
        ('Ps = {value = 210, unit = "bar"', 'Ps = {value = 210, unit = "kg"', ["supply.Ps", "converted"]),
        ("Pr = ", "Pt = ", ["missing: supply.Pr"]),
        ("AB = {", "Ab = {", ["missing: jack.AB"]),
        ("M = {value = 200", "m = 3\nM = {value = 200", ["load.m: unknown key"]),
        ("M = {value = 200", "M = {value = -200", ["load.M", "outside"]),
        ('M = {value = 200, unit = "kg"}', "", ["missing: load.M", "moving mass"]),
        ('stage = "main"', 'stage = "pilot"', ["missing", "[[valve.response]]", "main"]),
        ('f90 = {value = 80, unit = "Hz"}\n', "", ["missing: f90 of", "main"]),
        ("reference = {value = 2,", "reference = {value = 70,", ["response.1.reference", "below f3db"]),
        ("S = {value = 300", "S = {value = true", ["jack.S", "must be a finite number"]),
        ('unit = "mm"}', 'unit = "mm", bound = 3}', ["jack.S.bound"]),
        ("[load]", "[mass]", ["mass: unknown key"]),
    ],
)
def test_a_bad_datasheet_is_refused_in_one_line(tmp_path, old, new, words):
    assert old in SERVO
    with pytest.raises(InputError) as caught:
        sheet_of(tmp_path, SERVO.replace(old, new))
    for word in ("sheet.toml", *words):
        assert word in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("valve", "least"), [("second-order", 15), ("three-stage", 17)])
def test_all_that_is_missing_is_named_at_once(tmp_path, valve, least):
    """What the complaint names is what the sheet needs: with it, nothing is missing."""
    with pytest.raises(InputError) as caught:
        sheet_of(tmp_path, f'experiment = "new-rig"\nvalve.kind = "{valve}"\njack.kind = "differential"')
    named = str(caught.value)
    wanted = figures(VALVES[valve], JACKS["differential"])
    assert len(wanted) >= least
    assert all(figure.key in named for figure in wanted)
    assert "\n" not in named
    assert len(named) < 1000


@given(st.floats(1e-12, 1e12), st.sampled_from(["m", "m^2", "m^3", "m^3/s", "Pa", "N", "s", "A", "kg", "N/m"]))
def test_people_s_units_keep_numbers_readable(value, si):
    unit = usual_unit(value, si)
    shown = float(from_si(value, unit, si))
    assert float(to_si(shown, unit, si)) == pytest.approx(value, rel=1e-12)
    assert not 1e-4 <= value <= 1e4 or 1e-9 < shown < 1e12


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('like = "jack-10t"', "", ["missing: valve.like"]),
        ('like = "jack-10t"', 'like = "festo-tp511"', ["no three-stage valve"]),
        ("[valve.rounding]\nJ", "[valve.rounding]\nj", ["valve.rounding", "j: unknown key"]),
        ("0.5e-7", "5e-7", ["valve.rounding", "J", "outside"]),
        ('stage = "main"', 'stage = "pilot"', ["response"]),
    ],
)
def test_a_bad_three_stage_datasheet_is_refused(tmp_path, old, new, words):
    with pytest.raises(InputError) as caught:
        sheet_of(tmp_path, THREE_STAGE.replace(old, new))
    for word in words:
        assert word in str(caught.value)


def test_the_estimates_know_nothing_of_the_geometry_s_fitted_numbers(three_stage):
    """From scratch: unpublished numbers of the rig that lends its geometry leave no trace."""
    other = three_stage.geometry.with_values(
        Km=0.3, Knet=-3.0, kstop=1e3, cff2=0.5, Pr=2e5, Kp=9.0, z3max=1e-3, K3=1e-3, Fs1=0.01, Fs2=9.0
    )
    assert unknowns(replace(three_stage, geometry=other)) == unknowns(three_stage)


def test_estimates_are_in_their_ranges_and_of_the_right_size(three_stage):
    published = load_rig("jack-10t")
    for free in unknowns(three_stage):
        assert free.low <= free.start <= free.high
        assert free.value(free.normalised(free.high)) == pytest.approx(free.high)
        assert free.low <= published[free.name] <= free.high, free.name


def test_what_a_maker_says_of_a_three_stage_valve_s_loop_bounds_the_friction_in_it(three_stage, tmp_path):
    """Friction of the pilot makes its current's loop twice as wide, which the gain of the spool loop makes narrower."""
    found = {}
    for stated in (1.0, 3.0):
        widths = f'hysteresis = {{value = {stated}, unit = "%"}}\nthreshold = {{value = 0.5, unit = "%"}}\nimax ='
        sheet = sheet_of(tmp_path, THREE_STAGE.replace("imax =", widths))
        free = {each.name: each for each in unknowns(sheet)}
        torque = free["Km"].start * sheet.valve["imax"]
        assert 2 * free["Fs1"].high / torque / free["Kp"].start == pytest.approx((stated + 0.5) / 100)
        assert "by the stated hysteresis and threshold" in free["Fs2"].reason
        found[stated] = free
    assert [found[3.0][name].high / found[1.0][name].high for name in ("Fs1", "Fs2")] == pytest.approx([7 / 3, 7 / 3])
    plain = {each.name: each for each in unknowns(three_stage)}
    assert {name for name in plain if plain[name] != found[1.0][name]} == {"Fs1", "Fs2"}


def test_a_stated_number_is_not_fitted(tmp_path):
    sheet = sheet_of(tmp_path, THREE_STAGE.replace("[valve]\n", 'Pr = {value = 3, unit = "bar"}\n[valve]\n'))
    assert "Pr" not in {free.name for free in unknowns(sheet)}


def test_figure_errors_are_those_of_the_published_rig(three_stage):
    """119.1/115, 180.4/180, 70.2/70, 70.5/73 and 20.12/20 on jack-10t."""
    sheet, rig = three_stage, load_rig("jack-10t")
    found = FigureErrors(sheet, lambda _: rig, np.zeros(1))
    assert found.names == ["pilot_100_f3db", "pilot_100_f90", "main_100_f3db", "main_100_f90", "pilot_flow"]
    wanted = np.log([119.1 / 115, 180.4 / 180, 70.3 / 70, 70.5 / 73, 20.12 / 20])
    np.testing.assert_allclose(found.at(np.zeros(1)), wanted, atol=3e-3)


def free_numbers(*scales):
    return tuple(
        FreeParameter(name, 1.0, 0.5, 1.5, scale, "guess") for name, scale in zip("abcd", scales, strict=False)
    )


def test_one_figure_of_a_product_determines_the_product_alone():
    found = determine(np.array([[1.0, 1.0]]), free_numbers(None, None))
    first, second = found.combinations
    assert found.count == 1
    assert first.weights == pytest.approx({"a": 2**-0.5, "b": 2**-0.5})
    assert first.interval == pytest.approx(1.96 * FIGURE_ERROR / np.sqrt(2))
    assert not second.determined
    assert found.conditional["a"] < 0.1 < found.marginal["a"]


def test_what_the_figures_do_not_see_keeps_its_range():
    found = determine(np.array([[1.0, 0.0]]), free_numbers(None, 1.0))
    assert found.marginal["b"] == pytest.approx(1.96 * 0.5 / np.sqrt(3))
    assert source_of(free_numbers(None, 1.0)[0], found) == "fitted to the datasheet"
    assert source_of(free_numbers(None, 1.0)[1], found).startswith("not determined")


def test_a_printed_number_s_rounding_loosens_what_is_determined():
    slopes = np.array([[1.0, 1.0]])
    a, b = free_numbers(1.0, 1.0)
    loose = determine(slopes, (a, replace(b, printed=True, low=0.9, high=1.1)))
    assert list(loose.combinations[0].weights) == ["a"]
    assert loose.combinations[0].interval == pytest.approx(1.96 * np.hypot(FIGURE_ERROR, 0.1 / np.sqrt(3)))


class _StandIn:
    """Figures that are linear in the distances, in place of simulated ones."""

    names = ("f1", "f2", "f3")
    calls = 0

    def __init__(self, _sheet, _family, first):
        random = np.random.default_rng(0)
        self.matrix = random.normal(size=(3, len(first)))
        self.offset = np.array([0.3, -0.2, 0.25])

    def at(self, x):
        return self.matrix @ x + self.offset

    def slopes(self, _x, _steps):
        type(self).calls += 1
        return self.matrix


def test_a_fit_that_arrives_stops_and_says_where_each_number_is_from(three_stage, monkeypatch):
    monkeypatch.setattr(fitting, "FigureErrors", _StandIn)
    fit = fit_three_stage(three_stage, 3, 0.02, no_checkpoint, lambda _: None)
    assert fit.start == 0
    assert max(abs(error) for error in fit.errors.values()) < 0.02
    for free in fit.free:
        number = fit.rig.numbers[free.name]
        assert free.low <= number.low <= number.value <= number.high <= free.high
        assert "determine" in number.source or number.source == "fitted to the datasheet"
    for number in fit.rig.numbers.values():
        assert number.source
        exact = EXACT.get(number.name, "none") in number.source and number.low is None
        assert exact or number.low <= number.value <= number.high, number.name
    assert {name for name, number in fit.rig.numbers.items() if number.low is None} == {"imax", "n", "xmid", "ks", "cs"}
    assert fit.rig.numbers["S2"].source.startswith("lent by jack-10t: paper")
    rated = fit.rig["K3"] * (fit.rig["z3max"] + fit.rig["eps"]) * np.sqrt(35e5)
    assert rated == pytest.approx(0.01)


def test_a_fit_that_does_not_arrive_tries_other_starts_and_resumes_from_what_is_kept(three_stage, monkeypatch):
    monkeypatch.setattr(fitting, "FigureErrors", _StandIn)
    kept = {}

    def keep(name, compute):
        return kept[name] if name in kept else kept.setdefault(name, compute())

    fit = fit_three_stage(three_stage, 2, 1e-9, keep, lambda _: None)
    assert {name.partition(" step")[0] for name in kept} == {"start 0", "start 1", "determination"}
    before = _StandIn.calls
    again = fit_three_stage(three_stage, 2, 1e-9, keep, lambda _: None)
    assert _StandIn.calls == before
    assert again.errors == fit.errors


def test_the_page_of_a_fit_shows_figures_combinations_and_numbers_in_their_units(three_stage, monkeypatch):
    monkeypatch.setattr(fitting, "FigureErrors", _StandIn)
    monkeypatch.setattr(new_rig, "POINTS", 4)
    outcome, rig = run_new_rig(three_stage, no_checkpoint, lambda _: None)
    rows = {row["id"]: row for row in outcome.metrics["rows"]}
    assert rows.keys() == {*FigureErrors(three_stage, lambda _: rig, np.zeros(1)).names, "main_flow"}
    assert abs(rows["main_flow"]["error_percent"]) < 0.5
    assert rows["pilot_flow"]["estimate"] is not None
    value, low, high = outcome.metrics["parameters"]["Pr [Pa]"]
    assert low <= value == rig["Pr"] <= high
    assert outcome.metrics["determined"]["count"] == sum(
        part["determined"] for part in outcome.metrics["determined"]["combinations"]
    )
    sections = {section.title: section.items for section in outcome.page.sections}
    numbers = {row[0]: row for row in sections["What the figures determine"][1].rows}
    assert numbers["Pr"][1:3] == ["bar", pytest.approx(rig["Pr"] / 1e5)]
    assert numbers["Pr"][3] == pytest.approx(5)
    assert f"{outcome.metrics['determined']['count']} combinations" in outcome.page.verdict
    assert json.loads(metrics_json(outcome.metrics))


def test_a_number_as_far_away_as_a_fit_may_look_has_a_value_without_a_warning():
    number = FreeParameter("K3", 2.0, 1.0, 4.0, None, "guess")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert number.value(1e4) > number.value(10.0) == 2.0 * np.exp(10.0)
        assert 0 <= number.value(-1e4) < 1e-300
