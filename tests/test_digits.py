"""How many digits of a number a report shows: none that its interval or its sensor does not tell."""

import re

import pytest
from hypothesis import given, strategies as st

from workbench.report.digits import Known, four_digits, to_step, within
from workbench.report.table import Table, best_cells, folded, table_html

FINITE = st.floats(-1e9, 1e9).filter(lambda value: value == 0 or abs(value) > 1e-9)
STEP = st.floats(1e-6, 1e6)


@given(FINITE, STEP)
def test_a_number_is_within_a_step_of_what_is_shown(value, step):
    assert float(to_step(value, step)) == pytest.approx(value, rel=1e-14, abs=step)


@given(FINITE, STEP)
def test_no_digit_is_finer_than_the_step(value, step):
    text = to_step(value, step)
    digits, _, exponent = text.partition("e")
    zeros = 0 if "." in digits else len(digits) - len(digits.rstrip("0"))
    places = len(digits.partition(".")[2]) - zeros - int(exponent or 0)
    assert text == "0" or 10.0**-places > 0.0999 * step
    assert not re.match(r"-0(\.0*)?$", text)


@given(FINITE, st.floats(1e-5, 1e5))
def test_the_ends_of_an_interval_look_different(value, half):
    if half < 1e-6 * abs(value):
        return
    shown = [str(each) for each in within(value, value - half, value + half)]
    assert len(set(shown)) == 3
    assert float(shown[2]) - float(shown[1]) == pytest.approx(2 * half, rel=0.11)


def test_what_a_sensor_does_not_resolve_is_not_shown():
    assert str(Known(9.783e-11, 0.01)) == "0.00"
    assert str(Known(-9.783e-11, 0.01)) == "0.00"
    assert str(Known(0.0931, 0.001)) == "0.093"
    assert [str(each) for each in within(213.96, 213.92, 214.01)] == ["213.960", "213.920", "214.010"]
    assert str(Known(1.23456e9, 1e6)) == "1.235e9"
    assert str(Known(5.0, 0.0)) == four_digits(5.0) == "5"


def test_the_best_is_marked_within_its_group_as_far_as_it_is_shown():
    rows = [["step", 0.5], ["ramp", 0.0], ["step", 0.2], ["ramp", 0.0], ["step", None]]
    table = Table("T", ["scenario", "settling"], rows, best={"settling": "min"}, within="scenario")
    assert best_cells(table) == {(2, 1)}
    alike = Table("T", ["e"], [[Known(1.001, 0.1)], [Known(1.002, 0.1)], [Known(2, 0.1)]], best={"e": "min"})
    assert best_cells(alike) == {(0, 0), (1, 0)}
    assert "for each scenario" in table_html(table)
    with pytest.raises(ValueError, match="no column: rig"):
        Table("T", ["a"], [[1]], within="rig")


def test_what_never_settles_wins_nothing():
    rows = [["p", None, 0.0], ["pid", 0.3, 5.0], ["lqg", 0.2, 7.0]]
    table = Table("T", ["name", "settling", "overshoot"], rows, best={"settling": "min", "overshoot": "min"})
    assert best_cells(table) == {(2, 1), (1, 2)}
    nobody = [["p", None, 0.0], ["pid", None, 5.0]]
    table = Table("T", ["name", "settling", "overshoot"], nobody, best={"settling": "min", "overshoot": "min"})
    assert best_cells(table) == {(0, 2)}


def test_a_column_that_says_the_same_in_every_row_is_told_in_the_note():
    table = Table("T", ["a", "trip", "x"], [["p", "no", 1.0], ["q", "no", 2.0], ["r", "no", 3.0]], "Note.", fold=True)
    assert folded(table).columns == ["a", "x"]
    assert folded(table).note == "Note. In every row: trip: no."
    assert "<th" in table_html(table)
    assert table_html(table).count("<th scope") == 2
