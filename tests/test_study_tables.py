"""The site's tables of how often a trace is right are those of the campaigns that were traced."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest

from experiments.studies import kept
from experiments.studies.closed_loop.names import _lacking as lacking, _result as said_of
from experiments.studies.closed_loop.study import drawn_loop
from experiments.studies.trace.plan import SHARES
from experiments.studies.trace.score import FINE, HOW, odds, scores

HERE = Path(__file__).parent
ROWS = kept("trace/campaigns").rows
CLEAN_ROWS = kept("trace/clean_campaigns").rows
PLATFORM_ROWS = kept("trace/platforms").rows
JOINT_ROWS = kept("trace/joints").rows
PUMP_ROWS = kept("trace/pump_campaigns").rows
RESULTS = HERE.parent / "docs" / "results"
SECTION = "\n".join(
    (RESULTS / f"{name}.md").read_text() for name in ("trace_study", "trace_study_misses", "neighbours")
)
PUMP_PAGE = (RESULTS / "pump_study.md").read_text()
DATASHEET_ROWS = kept("trace/datasheet_campaigns").rows
DATASHEET_PAGE = (RESULTS / "datasheet_study.md").read_text()
STUDIES = {"three-stage": (ROWS, SECTION), "second-order": (DATASHEET_ROWS, DATASHEET_PAGE)}
GROUPS = {
    "one effect, well excited": "single",
    "one effect, poor excitation": "poor excitation",
    "one effect, few sensors": "few sensors",
    "two effects": "pair",
    "faint": "faint",
    "nothing missing": "clean",
    "off the library": "off",
}
COLUMNS = (
    {"right", "tied", "both"},
    {"incomplete", "one, incomplete", "one"},
    {"unknown", "missed", "other equation"},
    {"wrong", "error"},
)
RATES = {
    "named rightly, or tied, of one effect well excited": "named_or_tied",
    "among the first three": "first_three",
    "in the right family": "right_family",
    "named or called unknown where nothing is missing": "false_alarms",
    "named where the library has no such effect": "off_library_named",
    "the right equation, off the library": "off_library_equation",
    'right names whose error ends at the floor, or that say "incomplete"': "at_floor_or_incomplete",
    "intervals of the effect's numbers that cover the truth": "intervals_cover",
    "intervals of the rig's numbers that cover the truth": "base_intervals_cover",
    "both of two effects": "pair_both",
}


PUMP_GROUPS = {
    "one effect, on a pump drive": "single",
    "another number, on a pump drive": "number",
    "hard to see or faint, on a pump drive": ("poor excitation", "faint"),
    "nothing missing, on a pump drive": "clean",
    "off the library, on a pump drive": "off",
}


def table_rows(text=SECTION):
    return [
        [cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("| ")
    ]


def test_the_page_of_closed_loops_says_how_often_intervals_hold():
    rows = kept("closed_loop/loops").rows
    page = (RESULTS / "hidden_loops.md").read_text()
    loops, held = len({row["loop"] for row in rows}), sum(row["held"] for row in rows)
    assert (
        f"Over {loops} drawn loops with hidden numbers, {held} of {len(rows)} intervals of 95 % hold the truth" in page
    )
    off = [abs(row["value"] - row["truth"]) / (row["high"] - row["low"]) * 2 for row in rows]
    halves = [(row["high"] - row["low"]) / 2 / row["truth"] for row in rows if row["number"] == "loop_gain"]
    assert f"none is off by more than {max(off) + 0.05:.1f} of its half widths" in page
    assert f"typically {100 * np.median(halves):.2g} % of it" in page
    assert all(row["held"] == (row["low"] <= row["truth"] <= row["high"]) for row in rows)
    missing = kept("closed_loop/loops").table["missing"]
    for number in {row["number"] for row in missing}:
        one, none = (
            np.median([row[key] for row in missing if row["number"] == number])
            for key in ("without_pa", "without_both")
        )
        shown = f"{none:.2g}" if none < 100 else "over 100"
        assert re.search(rf"\| `{number}`, .* \| {one:.2g} \| {shown} \|", page)


def test_wrong_names_and_seconds_on_rigs_by_datasheet_are_those_of_the_campaigns():
    named = [row for row in DATASHEET_ROWS if row.get("named")]
    wrong = sum(row["result"] == "wrong" for row in named)
    seconds = [row["trace_s"] for row in DATASHEET_ROWS]
    refused = sum(row["group"] == "error" for row in DATASHEET_ROWS)
    words = " ".join(DATASHEET_PAGE.split())
    assert f"{wrong} of {len(named)} answers have a wrong name" in words
    assert f"took {np.median(seconds):.0f} CPU s at the median and {np.quantile(seconds, 0.95):.0f} at 95 %" in words
    assert f"| refused: {refused} |" in words


def times_typical(row):
    """How many times its typical size the effect has that a hidden loop lacks."""
    _, true = drawn_loop(row["loop"], 1)
    effect, numbers = lacking(row["lacks"], row["formula"], row["size"], true)
    return max(numbers[number.name] / number.typical for number in effect.numbers if number.off is not None)


@pytest.mark.parametrize(
    ("lacks", "label"),
    [
        ("jack.friction", "friction of the jack"),
        ("jack.external_leakage", "external leak"),
        ("load.backlash", "play of the load"),
        ("nothing", "nothing"),
    ],
)
def test_names_on_hidden_loops_are_counted_as_they_were_traced(lacks, label):
    rows = [row for row in kept("closed_loop/names").rows if row["lacks"] == lacks]
    cells = next(cells for cells in table_rows((RESULTS / "hidden_loops.md").read_text()) if cells[0] == label)
    named = sum(row["result"] in ("right", "tied") for row in rows)
    counts = [len(rows), sum(row["shown"] for row in rows), named, sum(row["result"] == "wrong" for row in rows)]
    assert [int(cell or 0) for cell in cells[1:]] == counts
    for row in (row for row in rows if row["result"] in ("right", "tied") and not row["shown"]):
        assert times_typical(row) > 2  # a typical one these records do not show, as the trace said


def test_a_wrong_name_beside_the_right_one_is_wrong_where_it_is_not_one_of_both():
    both = ["main.asymmetry", "jack.friction"]
    said = {
        verdict: said_of("jack.friction", {"verdict": verdict, "effects": both})
        for verdict in ("named", "incomplete", "tied")
    }
    assert said == {"named": "wrong", "incomplete": "wrong", "tied": "tied"}
    assert said_of("jack.friction", {"verdict": "named", "effects": ["jack.friction"]}) == "right"
    for row in kept("closed_loop/names").rows:
        if row["effects"]:
            assert said_of(row["lacks"], row) == row["result"], row["loop"]


@pytest.mark.parametrize("study", STUDIES)
@pytest.mark.parametrize("label", GROUPS)
def test_every_campaign_is_counted_as_it_was_traced(study, label):
    whole, page = STUDIES[study]
    rows = [row for row in whole if row["group"] == GROUPS[label]]
    stated = next((cells for cells in table_rows(page) if cells[0].startswith(f"{label}:")), [f"{label}: 0", *4 * " "])
    assert stated[0] == f"{label}: {len(rows)}"
    counts = [sum(row["result"] in results for row in rows) for results in COLUMNS]
    assert sum(counts) == len(rows)
    assert [int(cell.strip() or 0) for cell in stated[1:]] == counts


@pytest.mark.parametrize("study", STUDIES)
@pytest.mark.parametrize("label", RATES)
def test_every_rate_is_that_of_the_campaigns(study, label):
    whole, page = STUDIES[study]
    score = next(score for score in scores(whole) if score.id == RATES[label])
    stated = next(cells for cells in table_rows(page) if cells[0] == label)
    value, low, high = map(float, re.fullmatch(r"([\d.]+) \(([\d.]+) to ([\d.]+)\)", stated[1]).groups())
    assert (value, low, high) == tuple(round(number, 2) for number in (score.value, score.low, score.high))


def test_every_campaign_is_in_a_group():
    assert {row["group"] for row in (*ROWS, *DATASHEET_ROWS)} <= {*GROUPS.values(), "error"}
    assert {row["group"] for row in PUMP_ROWS} <= set(np.hstack(list(PUMP_GROUPS.values())))


def test_the_counts_below_the_tables_are_those_of_the_campaigns():
    named = [row for row in ROWS if row["named"]]
    wrong = [row for row in named if row["result"] == "wrong"]
    right = [row for row in named if row not in wrong]
    near = [row for row in right if row["chi2_after"] <= 1.10**2]
    unknown = [row for row in ROWS if row["verdict"] == "unknown"]
    off, others = ([row for row in unknown if (row["group"] == "off") is is_off] for is_off in (True, False))
    gone, gone_of_others = (sum(_half_is_gone(row) for row in rows) for rows in (off, others))
    poor = [row for row in others if row["group"] == "poor excitation"]
    words = " ".join(SECTION.split())
    for stated in (
        f"{len(wrong)} of {len(named)} answers have a wrong name",
        f"of {sum(row['group'] == 'clean' for row in ROWS)} clean campaigns none was named",
        f"of {len(right)} right names {len(near)} end within 1.10 times the noise",
        f"gone in {gone} of {len(off)} off the library and in {gone_of_others} of {len(others)} others",
        f"{len(others)} others, {len(poor)} of which hardly show",
    ):
        assert stated in words


def test_none_of_the_further_clean_campaigns_was_named():
    alarms = next(score for score in scores(CLEAN_ROWS) if score.id == "false_alarms")
    words = " ".join(SECTION.split())
    assert alarms.value == 0
    assert f"Nor was one of {alarms.n} more" in words
    assert f"at most {alarms.high:.2f} (95 %)" in words


def test_what_a_trace_takes_is_what_it_took():
    again = kept("trace/again").rows
    seconds = [row["trace_s"] for row in again]
    fine = sum(row["result"] in FINE for row in again)
    unknown, wrong = (sum(row["result"] == result for row in again) for result in ("unknown", "wrong"))
    words = " ".join(SECTION.split())
    assert f"{len(again)} campaigns of `python -m experiments.studies.trace" in words
    assert (
        f"took {np.median(seconds):.0f} CPU s at the median and {np.quantile(seconds, 0.95):.0f} CPU s at 95 %" in words
    )
    assert f"{max(seconds):.0f} CPU s at most" in words
    others = len(again) - fine - unknown - wrong
    assert f"answers {fine} are right" in words
    assert f'{unknown} "unknown", {others} in' in words
    assert f"{wrong} wrong." in words
    kinds = [row["id"].split("-")[0] for row in again]
    weights = np.array([SHARES[kind] / kinds.count(kind) for kind in kinds])
    order = np.argsort(seconds)
    median, most = np.array(seconds)[order][np.searchsorted(np.cumsum(weights[order]), [0.5, 0.95])]
    assert f"with the shares of all 200 it is {median:.0f} and {most:.0f} CPU s" in words
    before = {row["id"]: row["result"] for row in ROWS}
    single = [row for row in again if row["group"] == "single"]
    was = sum(before[row["id"]] == "incomplete" for row in single)
    now = sum(row["result"] == "incomplete" for row in single)
    assert f'{was} of them were "right, more is left" in the table; {now} is now' in words


def test_neighbours_are_counted_as_they_were_traced():
    rows = kept("trace/neighbours").rows
    table = {cells[0]: cells[1:] for cells in table_rows(SECTION) if cells[0].startswith(("drive.", "main.", "pilot."))}
    counted = {row["effect"]: [str(row[key]) for key in ("campaigns", *HOW)] for row in odds(rows)}
    assert table == counted
    alone = sum(row["right"] + row["wrong"] for row in odds(rows))
    wrong = sum(row["wrong"] for row in odds(rows))
    most = binomtest(wrong, alone).proportion_ci(0.95, "exact").high
    assert wrong == 0
    assert f"of {alone} names that were given alone, at most {most:.2f} (95 %)" in " ".join(SECTION.split())


def _half_is_gone(row):
    return row["chi2_before"] - row["chi2_after"] >= 0.5 * (row["chi2_before"] - 1)


@pytest.mark.parametrize("label", PUMP_GROUPS)
def test_every_campaign_on_a_pump_drive_is_counted_as_it_was_traced(label):
    groups = np.atleast_1d(PUMP_GROUPS[label])
    rows = [row for row in PUMP_ROWS if row["group"] in groups]
    stated = next(cells for cells in table_rows(PUMP_PAGE) if cells[0].startswith(f"{label}:"))
    assert stated[0] == f"{label}: {len(rows)}"
    assert [int(cell or 0) for cell in stated[1:]] == [
        sum(row["result"] in results for row in rows) for results in COLUMNS
    ]


def test_the_rates_on_a_pump_drive_are_those_of_the_campaigns():
    rates = {score.id: score for score in scores(PUMP_ROWS)}
    words = " ".join(PUMP_PAGE.split())
    for id in ("named_or_tied", "number_named", "false_alarms"):
        rate = rates[id]
        assert f"{rate.value:.2f} ({rate.low:.2f} to {rate.high:.2f}, n = {rate.n})" in words, id


@pytest.mark.parametrize(("page", "rows"), [("platform_study", PLATFORM_ROWS), ("joint_study", JOINT_ROWS)])
def test_a_table_of_platforms_is_that_of_the_platforms_that_were_traced(page, rows):
    text = (RESULTS / f"{page}.md").read_text()
    table = re.findall(r"^\| (.+?) \| (.+?) \| (.+?) \| ([\d.]+) \|$", text, re.MULTILINE)
    assert len(table) == len(rows)
    for (missing, said, result, chi2), row in zip(table, rows, strict=True):
        assert missing == (" and ".join(row["truth"]) or "nothing")
        assert set(re.split(" or | and ", said)) == set(row["named"] or [row["verdict"]])
        assert result == ("faint" if row["group"] == "faint" else row["result"])
        assert float(chi2) == float(f"{row['chi2_before']:.3g}")
        assert {name.partition(".")[0] for name in row["named"]} <= {name.partition(".")[0] for name in row["truth"]}
    wrong = sum(row["result"] in {"wrong", "missed"} for row in rows)
    counted = sum(row["result"] in {"right", "both", "tied", "incomplete"} for row in rows)
    assert f"{counted} of {len(rows)}" in text
    assert f"wrong: {wrong}" in text
