"""Hidden rigs: what they lack, their noise, how what came out is judged, and the table of those commissioned."""

from pathlib import Path

import numpy as np
import pytest

from experiments.studies import kept
from experiments.studies.commission.benches import OTHERS
from experiments.studies.commission.colour import ColouredDraws
from experiments.studies.commission.page import page
from experiments.studies.commission.plan import OFF, STICKING, TRANSDUCER, hidden_plan, hidden_rig
from experiments.studies.commission.study import summary
from workbench.plant import build
from workbench.plant.effects import known_effects
from workbench.rigs.rig_file import load_rig

RIG = load_rig("jack-10t")
PLANS = [hidden_plan(RIG, number, 1) for number in range(20)]
HERE = Path(__file__).parent
COMMISSIONED = kept("commission/rigs").table
PAGE = (HERE.parent / "docs" / "results" / "commission.md").read_text()


def test_every_hidden_rig_has_numbers_within_half_its_bounds_and_formulas_that_the_library_lacks():
    library = {(effect.name, effect.formula) for effect in known_effects()}
    for plan in PLANS:
        truth = hidden_rig(RIG, plan)
        for name, number in RIG.numbers.items():
            if number.low is not None and number.high is not None:
                low, high = (number.value + OFF * (end - number.value) for end in (number.low, number.high))
                assert low <= truth[name] <= high
        assert plan.effects
        assert not library & {(effect.name, effect.formula) for effect in plan.effects}
        assert not any(number.uncertain for number in truth.numbers.values())
        assert plan == hidden_plan(RIG, plan.number, 1)
    assert {plan.trap for plan in PLANS} == {"", TRANSDUCER, STICKING}
    assert {len(plan.effects) for plan in PLANS} == {1, 2}
    assert {plan.coloured for plan in PLANS} == {True, False}


@pytest.mark.parametrize("number", [2, 7, 9])
def test_a_hidden_rig_can_be_built_and_differs_from_its_datasheet(number):
    plain, hidden = build(RIG), build(hidden_rig(RIG, PLANS[number]))
    assert set(hidden.parameters) > set(plain.parameters)


def test_coloured_noise_has_variance_one_and_goes_on_where_it_was():
    whole = ColouredDraws(3, 0, 1e-3).standard_normal((40_000, 2))
    np.testing.assert_allclose(whole.var(axis=0), 1.0, rtol=0.05)
    assert np.corrcoef(whole[:-1, 0], whole[1:, 0])[0, 1] > 0.3
    assert abs(np.corrcoef(whole.T)[0, 1]) < 0.25  # each channel hums with a phase of its own
    lines = np.abs(np.fft.rfft(whole[:, 0]))
    assert np.argmax(lines) == 2000  # 50 Hz


def row(**changes):
    whole = {
        "id": "rig-00", "truth": ["jack.friction"], "trap": "", "verdict": "named", "said": ["jack.friction"],
        "wrong": False, "trips": 0, "rig_seconds": 80.0, "ended": None, "error": None, "kept": "found",
        "settling_s": {"automatic": 0.1, "datasheet": 0.06, "found": 0.05, "known": 0.05},
        "predicted_s": {"found": 0.055},
    }  # fmt: skip
    return whole | changes


def test_a_rig_that_never_settles_is_no_good_answer_and_one_that_was_refused_is_not_counted():
    never = row(settling_s={"automatic": 0.1, "datasheet": None, "found": None, "known": 0.05})
    refused = row(error="it sticks", settling_s={"known": None}, predicted_s={}, rig_seconds=None)
    told = summary([row(), never, refused])
    assert (told["rigs"], told["commissioned"]) == (3, 2)
    assert told["within_1.15_of_known"] == 1
    assert told["predicted_within_15_percent"] == 1
    assert told["over_automatic"]["worst"] == np.inf
    better = row(settling_s={"automatic": 0.1, "found": 0.09, "datasheet": 0.05, "known": 0.05}, kept="datasheet")
    assert summary([better])["over_known"]["worst"] == 1.0  # what the command leaves is judged
    shown, _ = page({"rows": [row(), never, refused], "summary": told})
    assert "2 of 3 rigs were commissioned" in shown.verdict


def test_the_table_of_hidden_rigs_is_that_of_those_that_were_commissioned():
    lines = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in PAGE.splitlines() if line.startswith("| rig-")
    ]
    rows = COMMISSIONED["rows"]
    assert len(lines) == len(rows) == 20
    for cells, each in zip(lines, rows, strict=True):
        said = each["error"] or f"{each['verdict']}: {', '.join(each['said'])}".rstrip(": ")
        ways = [each["settling_s"].get(way) for way in ("automatic", "datasheet", "found", "known")]
        shown = [each["id"], " + ".join(each["truth"]), said, *map(seconds, ways), each["kept"] or "-"]
        shown += [seconds(each["predicted_s"].get(each["kept"])), f"{each['computing_seconds']:.0f}"]
        assert cells == shown
    told = summary(rows)
    for name in ("commissioned", "trips", "wrong_names", "within_1.15_of_known", "predicted_within_15_percent"):
        assert f"| {name.replace('_', ' ')} | {told[name]} |" in PAGE
    for name in ("over_known", "over_automatic"):
        assert f"| {name.replace('_', ' ')}, median | {told[name]['median']:.2f} |" in PAGE
    assert f"| most rig time [s] | {told['most_rig_seconds']:.0f} |" in PAGE


def test_the_table_of_other_benches_is_that_of_those_that_were_commissioned():
    lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in PAGE.splitlines()]
    shown = {cells[0]: cells[1:] for cells in lines if cells[0] in OTHERS}
    rows = kept("commission/others").rows
    assert shown.keys() == {each["id"] for each in rows}
    for each in rows:
        pairs = [pair for pair in each["steps"].values() if None not in pair]
        off = max((abs(told / did - 1) for told, did in pairs), default=None)
        times = [each["settling_s"].get(way) for way in ("automatic", "found")] + [
            each["predicted_s"].get(each["kept"])
        ]
        assert shown[each["id"]] == [
            str(each["trips"]), each["verdict"] if each["kept"] else "refused",
            *("-" if time is None else f"{time:.3g}" for time in times),
            "-" if off is None else f"{100 * off:.0f} %", f"{each['computing_seconds']:.0f}",
        ]  # fmt: skip
    assert not any(each["trips"] or each["said"] for each in rows)


def seconds(value):
    return "-" if value is None else f"{value:.3f}"
