"""Made rigs that wear: what grows and how, forecasts of drawn wears, and the table of those that were watched."""

import re
from pathlib import Path

import pytest

from experiments.studies import kept
from experiments.studies.watch.courses import coverage
from experiments.studies.watch.made_rig import SUPPLY, WEARS, MadeRig, drawn_rigs, worn
from experiments.studies.watch.page import names, page
from experiments.studies.watch.study import _is_right, _is_wrong, summary
from workbench.identify.watch.healthy_rate import poisson_rate
from workbench.identify.watch.history import FEWEST
from workbench.plant.effects import known_effects

HERE = Path(__file__).parent
WATCHED = kept("watch/rigs").table
RESULTS = HERE.parent / "docs" / "results"
PAGE = (RESULTS / "watch.md").read_text()
HEALTHY = (RESULTS / "watch_healthy.md").read_text()


def test_a_third_of_the_rigs_is_healthy_and_every_wear_has_its_turn_after_enough_sessions():
    rigs = drawn_rigs(15, 7, 14)
    assert sum(rig.wear is None for rig in rigs) == 5
    assert [rig.wear.name for rig in rigs if rig.wear] == [wear.name for wear in WEARS]
    assert {rig.growth for rig in rigs if rig.wear} == {"slow", "jump", "steps"}
    for rig in rigs:
        assert rig.begins >= FEWEST
        shares = [rig.share(session) for session in range(rig.sessions)]
        assert shares == sorted(shares)
        assert not any(shares[: rig.begins])
        assert (shares[-1] > 0) == (rig.wear is not None)


def test_effects_wear_in_formulas_that_the_library_lacks():
    library = {(effect.name, effect.formula) for effect in known_effects()}
    assert not [wear for wear in WEARS if wear.formula and (wear.name, wear.formula) in library]


def test_unsteady_rigs_differ_in_their_supply_and_in_who_writes_down_the_oil():
    rigs = drawn_rigs(16, 7, 14, unsteady=True)
    assert all(SUPPLY[0] < rig.supply < SUPPLY[1] for rig in rigs)
    assert len({rig.supply for rig in rigs}) == 16
    assert sum(rig.thermometer for rig in rigs) == 8
    assert {rig.supply for rig in drawn_rigs(16, 7, 14)} == {SUPPLY[0]}


def test_a_number_wears_to_so_many_times_what_it_was():
    leak = next(wear for wear in WEARS if wear.name == "Cl")
    numbers, mix = worn(MadeRig(1, leak), {"Cl": 2e-12, "b": 500.0}, 29)
    assert numbers == pytest.approx({"Cl": leak.most * 2e-12, "b": 500.0})
    assert mix == {}


def test_of_what_the_library_has_no_name_for_the_right_answer_is_unknown():
    assert not any(wear.is_unnamed for wear in WEARS)
    rig = next(rig for rig in drawn_rigs(17, 7, 14, unsteady=True) if rig.wear and rig.wear.is_unnamed)
    unknown, other = {"effect": None, "among": ["Kp"]}, {"effect": "Kp", "among": ["Kp"]}
    assert _is_right(rig, [unknown])
    assert not _is_right(rig, [other])
    assert [_is_wrong(rig, each) for each in (unknown, other)] == [False, True]
    assert not _is_right(MadeRig(1, None), [unknown])


def test_of_two_wears_both_have_to_be_told():
    rig = next(each for each in drawn_rigs(12, 7, 20, two=True) if each.wear)
    names = [wear.name for wear in rig.wears]
    assert len(set(names)) == 2
    first, second = ({"effect": name, "among": [name]} for name in names)
    either = {"effect": names[0], "among": names}
    assert _is_right(rig, [first, second])
    assert not _is_right(rig, [first])
    assert not _is_wrong(rig, first)
    assert not _is_right(rig, [either])
    assert _is_right(rig, [second, either])


def test_eighty_percent_intervals_of_forecasts_hold_the_day_seven_to_nine_times_in_ten():
    for pace, each in coverage(60, 0).items():
        assert each["forecasts"] > 50
        assert 0.7 <= each["held"] <= 0.9, pace


def test_no_alarm_in_two_hundred_years_bounds_the_rate():
    """Garwood's interval of a count of 0: chi2 with two degrees of freedom at 97.5 %, halved, is 3.69."""
    none = poisson_rate(0, 200)
    assert (none.value, none.low) == (0.0, 0.0)
    assert none.high == pytest.approx(3.689 / 200, rel=1e-3)


def test_the_table_of_made_rigs_is_that_of_those_that_were_watched():
    table = [line for line in PAGE.splitlines() if line.startswith("| ") and "-70" in line]
    lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in table]
    rows = WATCHED["rows"]
    assert len(lines) == len(rows)
    assert f"These are {len(rows)} of the 45 rigs" in PAGE
    for cells, row in zip(lines, rows, strict=True):
        numbers = [_cell(row[key], digits) for key, digits in (("share", 2), ("lost_db", 2), ("hurt", 0))]
        shown = [row["id"], row["noise"], _cell(row["begins"], 0), _cell(row["told"], 0)]
        shown += [names(row["alarms"]) or "-", *numbers]
        assert cells == [*shown, f"{row['cpu_s']:.0f}"]
    told = summary(rows)
    for name in ("worn", "told", "told_too_soon", "right", "before_hurt", "healthy", "false_alarms"):
        assert re.search(rf"\| {name.replace('_', ' ')} \| {told[name]} \|", PAGE), name


def test_the_table_of_mended_rigs_is_that_of_those_that_were_watched():
    table = [line for line in PAGE.splitlines() if line.startswith("| ") and "-80" in line]
    lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in table]
    rows = WATCHED["mended"]
    assert lines == [
        [row["id"], row["noise"], *(_cell(row[key], 0) for key in ("begins", "told", "mended", "gone")),
         names(row["alarms"])]
        for row in rows
    ]  # fmt: skip
    assert rows


def test_the_table_of_two_wears_is_that_of_those_that_were_watched():
    lines = [line for line in PAGE.splitlines() if re.match(r"\| [\w.]+\+", line)]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    rows = WATCHED["two"]
    assert cells == [
        [f"{row['wear']}+{row['beside']}", row["noise"], _cell(row["told"], 0), names(row["alarms"])] for row in rows
    ]
    both = sum(row["right"] for row in rows)
    assert (both, len(rows)) == (3, 5)
    assert "Both are told on three of five" in PAGE
    assert not any(row["wrong"] for row in rows)


def test_the_page_states_the_rate_and_the_forecasts_that_were_measured():
    forecasts = WATCHED["forecasts"]
    drawn = [
        of[name] for of in (WATCHED["healthy"], WATCHED["unsteady"]["healthy"]) for name in ("resampled", "other_laws")
    ]
    lines = [line for line in HEALTHY.splitlines() if re.search(r"\| (as its|by other)", line)]
    for line, each in zip(lines, drawn, strict=True):
        value, low, high = each["a_year"]
        assert f"| {each['alarms']} | {value:.2f} ({low:.2f} to {high:.2g}) |" in line
    for pace, each in forecasts.items():
        assert re.search(rf"\| {pace} \| {each['forecasts']} \| {100 * each['held']:.0f} \|", PAGE), pace


def test_the_page_states_what_unsteady_rigs_leave_before_they_wear():
    for row in WATCHED["unsteady"]["rows"]:
        assert f"`{row['id']}`, with {100 * row['supply']:.1f} %" in HEALTHY
        assert f"more than {max(row['chi2'][: row['begins']]):.2f}" in HEALTHY


def test_the_report_of_a_study_has_its_rigs_and_its_rates():
    drawn, _ = page({**WATCHED, "summary": summary(WATCHED["rows"])})
    assert "wears are told" in drawn.verdict


def _cell(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
