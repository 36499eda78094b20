"""Counts and ranges read as a sentence does: one rig, no range from a number to itself."""

import pytest

from workbench.base.words import agreed, counted, spanned


def test_one_of_a_thing_is_no_plural():
    assert [counted(n, "false trip") for n in (0, 1, 2)] == ["0 false trips", "1 false trip", "2 false trips"]
    assert [agreed("need", n) for n in (0, 1, 2)] == ["need", "needs", "need"]


@pytest.mark.parametrize(
    ("values", "said"),
    [([10.5], "10.5"), ([10.52, 10.48], "10.5"), ([10.5, 3.0, 7.0], "3 to 10.5"), ([1e-3, 2e3], "0.001 to 2e+03")],
)
def test_a_range_of_one_number_is_that_number(values, said):
    assert spanned(values) == said
