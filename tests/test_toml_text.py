"""What is written as TOML reads back equal, a number with its unit on one line."""

import math
import tomllib

import pytest
from hypothesis import given, strategies as st

from workbench.base.toml_text import toml_text
from workbench.rigs.rig_file import bundled, load_rig, rig_text

text = st.text(st.characters(exclude_categories=("Cs",)), max_size=12)
scalar = st.one_of(text, st.booleans(), st.integers(-(2**63), 2**63 - 1), st.floats(allow_nan=False))
value = st.recursive(
    scalar, lambda inside: st.one_of(st.lists(inside, max_size=3), st.dictionaries(text, inside, max_size=3))
)


@given(st.dictionaries(st.one_of(text, st.just("unit")), value, max_size=4))
def test_every_document_reads_back_equal(document):
    again = tomllib.loads(toml_text(document))
    assert again == document
    assert repr(again) == repr(reordered(document, again))


def reordered(document, like):
    """The document with the keys of each table in the order of another: values are written before tables."""
    if isinstance(document, dict):
        return {key: reordered(document[key], like[key]) for key in like}
    if isinstance(document, list):
        return [reordered(item, other) for item, other in zip(document, like, strict=True)]
    return document


@pytest.mark.parametrize("number", [math.inf, -0.0, 5e-324, 1e9, 0.1 + 0.2, 123456789.125])
def test_every_bit_of_a_number_is_kept(number):
    assert repr(tomllib.loads(toml_text({"a": number}))["a"]) == repr(number)


@pytest.mark.parametrize("name", bundled())
def test_a_rig_has_a_line_a_number(name):
    """No longer than the file that was written by hand, less its comments and blank lines."""
    lines = [line for line in rig_text(load_rig(name)).splitlines() if line]
    numbers = [line for line in lines if not line.startswith("[") and "unit = " in line]
    rig = load_rig(name)
    assert len(numbers) >= len(rig.numbers)
    assert all(line.startswith("[") or " = " in line for line in lines)
