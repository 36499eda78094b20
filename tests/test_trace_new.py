"""A valve's sheet when new against the same valve now: what has worn is told, with its interval, and nothing else."""

import json
from dataclasses import replace

import pytest

from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.trace.study import trace_answer
from workbench.commands.trace.when_new import SinceNew, beside_new, sentence
from workbench.identify.acceptance.exact import exact_lines
from workbench.identify.acceptance.when_new import NewRig, rig_when_new
from workbench.records import load_campaign
from workbench.rigs.rig_file import load_rig, rig_text

RIG, WORN = load_rig("festo-tp511"), 2.5  # times the underlap
SHARES = {"K3": 0.002, "eps": 0.02, "f0": 0.004, "z0": 0.0}


def within(rig, **halves):
    """The rig whose valve's numbers have these ranges, and no others."""
    kept = {name: replace(number, low=None, high=None) for name, number in rig.numbers.items() if name in SHARES}
    ranged = {name: replace(kept[name], low=rig[name] - half, high=rig[name] + half) for name, half in halves.items()}
    return replace(rig, numbers={**rig.numbers, **kept, **ranged})


def test_numbers_that_play_a_sheet_come_back_from_its_lines():
    own = within(RIG, K3=0.1 * RIG["K3"], eps=0.5 * RIG["eps"])
    made = own.with_values(K3=1.03 * RIG["K3"], eps=0.8 * RIG["eps"])
    rows = {
        id: {"value": v, "low": v - 1e-3 * abs(v), "high": v + 1e-3 * abs(v)} for id, v in exact_lines(made).items()
    }
    found = rig_when_new(own, rows, "new.json")
    assert set(found.names) == {"K3", "eps"}
    for name in found.names:
        number = found.rig.numbers[name]
        assert number.value == pytest.approx(made[name], rel=2e-3)
        assert number.low is not None
        assert number.high is not None
        assert number.low < made[name] < number.high
        assert number.high - number.low < 0.05 * number.value
    with pytest.raises(InputError, match="1 lines that"):
        rig_when_new(own, {"lap": rows["lap"]}, "new.json")


def test_a_number_that_no_line_tells_stays_as_declared():
    own = within(RIG, K3=0.1 * RIG["K3"], f0=10.0)
    rows = {id: {"value": v, "low": v, "high": v} for id, v in exact_lines(RIG).items() if not id.startswith("main_")}
    assert rig_when_new(own, rows, "new.json").names == ("K3",)


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """What is said of a rig whose lands have worn, against the rig as its sheet had it when it was new."""
    folder = tmp_path_factory.mktemp("worn")
    (folder / "worn.toml").write_text(rig_text(RIG.with_values(eps=WORN * RIG["eps"])))
    assert main(["record", str(folder / "worn.toml"), "--out", str(folder / "records")]) == 0
    halves = {name: share * RIG[name] or 5e-4 for name, share in SHARES.items()}
    new, campaign = NewRig(within(RIG, **halves), tuple(halves), 1.0, 9), load_campaign(folder / "records")
    arguments = (no_checkpoint, lambda _: None, (), (), True, 1)
    answer = trace_answer(campaign, new.rig, (), *arguments, suspects=new.names)
    lap = {"value": -0.4, "low": -0.42, "high": -0.38}
    return beside_new(answer, campaign, new, {"lap": lap}).outcome


def test_the_number_that_has_worn_is_told_and_no_other(told):
    rows = {row["number"]: row for row in told.metrics["since_new"]["numbers"]}
    assert [name for name, row in rows.items() if row["changed"]] == ["eps"]
    assert rows["eps"]["now_low"] < 1e6 * WORN * RIG["eps"] < rows["eps"]["now_high"]
    assert rows["eps"]["new"] == pytest.approx(1e6 * RIG["eps"])


def test_so_is_the_line_of_the_sheet_that_it_changed(told):
    (line,) = told.metrics["since_new"]["lines"]
    assert line["changed"]
    assert line["now_low"] < -0.4 * WORN < line["now_high"]


def test_the_report_begins_with_what_has_changed(told):
    page = told.page
    assert page.verdict.startswith("Against the sheet when new: eps was 2.000 (1.960 to 2.040) and is")
    assert page.verdict.count("changed") == 1
    assert page.sections[0].title == "Since the valve was new"


def test_no_number_is_called_as_new_where_a_misfit_is_left():
    same = {"number": "eps", "changed": False, "perhaps": False, "alike": []}
    assert "1 number of the valve is as when new" in sentence(SinceNew([same], [], "", 1.0, False))
    assert "as when new" not in sentence(SinceNew([same], [], "", 1.0, True))


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["sample", "--new", "none.json"], "none.json: no sheet of valve-test"),
        (["sample", "--new", "few.json"], "few.json: 1 lines"),
    ],
)
def test_bad_input_is_one_line(words, told, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    row = {"id": "lap", "value": -0.3, "low": -0.4, "high": -0.2}
    (tmp_path / "few.json").write_text(json.dumps({"rows": [row]}))
    assert main(["trace", *words, "--out", "out"]) == 2
    assert told in capsys.readouterr().err.strip().splitlines()[-1]
    assert not (tmp_path / "out").exists()
