"""Mutated rigs, experiments, campaigns, records and sheets: every one is read, or refused in one line at once.

`make fuzz` tries far more of them, and says which lines refused.
"""

from collections import Counter
from itertools import count

import pytest
from hypothesis import given, settings, strategies as st
from judged_reading import TooSlow, bad_message, limited, unbounded
from mutants import LONG
from mutated_inputs import KINDS, examine, prepare, seeded

INPUTS = 150  # of a kind


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return prepare(tmp_path_factory.mktemp("fuzz") / "experiments")


@pytest.mark.parametrize("kind", KINDS)
def test_a_mutated_input_is_read_or_refused_in_one_line(kind, folder):
    outcomes = Counter()

    @settings(max_examples=INPUTS, derandomize=True, database=None)
    @given(st.integers(0, 2**32 - 1))
    def attempt(seed):
        result = examine(kind, seeded(kind, seed), folder)
        if result.failure.startswith("TooSlow"):  # the first that needs a library waits for its import
            result = examine(kind, seeded(kind, seed), folder)
        assert result.failure == ""
        outcomes[result.outcome] += 1

    attempt()
    assert min(outcomes["valid"], outcomes["refused"]) > 0.02 * outcomes.total()  # else it tries nothing


def test_a_seed_makes_the_same_input_again(folder):
    first, again = (examine("experiment", seeded("experiment", 7), folder) for _ in range(2))
    assert first == again


@pytest.mark.parametrize("message", ["", "a.csv: two\nlines", f"a.csv: {LONG}"])
def test_a_bad_message_is_seen(message):
    assert bad_message(message)


def test_what_takes_too_long_is_stopped():
    with pytest.raises(TooSlow), limited(0.05):
        any(number < 0 for number in count())


def test_a_number_without_end_is_seen():
    assert unbounded({"a": [1.0, {"b": float("nan")}]}) == ".a.1.b not finite"
