"""Mutated rigs, experiments, campaigns, records and sheets: every one is read, or refused in one line at once.

`make fuzz` tries far more of them, and says which lines refused.
"""

from itertools import count

import pytest
from judged_reading import TooSlow, bad_message, limited, unbounded
from mutants import LONG
from mutated_inputs import examine, prepare

COUNTS = {
    **dict.fromkeys(("rig", "experiment", "campaign", "parquet", "mat", "sheet"), 500),
    "csv": 1000,
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return prepare(tmp_path_factory.mktemp("fuzz") / "experiments")


@pytest.mark.parametrize("kind", COUNTS)
def test_a_mutated_input_is_read_or_refused_in_one_line(kind, folder):
    results = {seed: examine(kind, seed, folder) for seed in range(COUNTS[kind])}
    assert {seed: result.failure for seed, result in results.items() if result.failure} == {}
    outcomes = [result.outcome for result in results.values()]
    assert min(outcomes.count("valid"), outcomes.count("refused")) > 0.02 * len(outcomes)  # else it tries nothing


def test_a_seed_makes_the_same_input_again(folder):
    first, again = (examine("experiment", 7, folder) for _ in range(2))
    assert first == again


@pytest.mark.parametrize("message", ["", "a.csv: two\nlines", f"a.csv: {LONG}"])
def test_a_bad_message_is_seen(message):
    assert bad_message(message)


def test_what_takes_too_long_is_stopped():
    with pytest.raises(TooSlow), limited(0.05):
        max(count())


def test_a_number_without_end_is_seen():
    assert unbounded({"a": [1.0, {"b": float("nan")}]}) == ".a.1.b not finite"
