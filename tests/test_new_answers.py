"""`new --ask` checks answers against each other, and asks again for what is in doubt, and for nothing else."""

import tomllib
from io import StringIO

import pytest

from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.new.ask import asked_datasheet

SHEET = {
    "jack": "differential",
    "Ps": "210 bar",
    "Pr": "2 bar",
    "rated_flow": "40 l/min",
    "rated_drop": "70 bar",
    "n": "1",
    "leakage": "1 l/min",
    "leakage_drop": "210 bar",
    "amplitude": "100 %",
    "reference": "5 Hz",
    "f3db": "60 Hz",
    "f90": "80 Hz",
    "AA": "50 mm",
    "AB": "50 x 36 mm",
    "S": "500 mm",
    "M": "200 kg",
    "hysteresis": "",
    "threshold": "",
    "hose": "",
}  # in the order in which they are asked for
DOUBLE_ROD = {**SHEET, "jack": "double-rod", "Aj": "100 x 63 mm", "AB": None, "AA": None}


def answered(lines, build=tomllib.loads):
    """The datasheet, what is built of it, and every line that the questions began with."""
    left, shown = list(lines), []

    def ask(prompt):
        shown.append(prompt)
        if not left:
            raise EOFError
        return left.pop(0)

    return *asked_datasheet("two-stage", "mine", build, ask), shown


def lines(**answers):
    """The lines of SHEET, where one answer is several lines."""
    return [line for key, usual in SHEET.items() for line in answers.get(key, usual).split("|")]


@pytest.mark.parametrize(
    ("answers", "said"),
    [
        ({"AB": "25 cm^2||50 x 36 mm"}, "the rod side, AB 25 cm^2, is not below that of the bore side, AA 19.64 cm^2"),
        ({"n": "1.5|1"}, "1.5 is no number of valves; write a whole one, such as 1"),
        (
            {"Ps": "20 bar", "Pr": "30 bar|210 bar|2 bar"},
            "a supply pressure of 20 bar is not above the return pressure, 30 bar",
        ),
        ({"f3db": "5 Hz||60 Hz"}, "reference, 5 Hz, must be below f3db"),
        ({"f90": "30 Hz||80 Hz"}, "no second-order valve has -3 dB at 60 Hz and -90 deg at 30 Hz"),
        ({"leakage_drop": "0.2 bar||||210 bar"}, "the leakage is"),
        ({"hose": "500 mm x 2 m|"}, "a hose of 392.7 l holds more than 10 times the 981.8 cm^3 that the piston sweeps"),
        ({"amplitude": "200 %|100 %"}, "200 % is outside 0.1 to 100 %"),
        ({"amplitude": "2|1"}, "2 is outside 0.001 to 1"),
        ({"AB": "36 mm x 50 mm|50 x 36 mm"}, "a rod of 50 mm is no thinner than a bore of 36 mm; write bore x rod"),
        ({"AB": "36 mm|50 mm x 36 mm"}, "36 mm: write bore x rod"),
        ({"AA": "50 mm x 36 mm|50 mm"}, "50 mm x 36 mm: write the bore"),
        ({"AB": "50 x 36|50 x 36 mm"}, "50 x 36: write bore x rod"),
    ],
)
def test_what_is_impossible_is_asked_for_again_in_one_line(answers, said):
    """An empty line keeps an answer that was in doubt with another."""
    sheet, _, shown = answered(lines(**answers))
    complaints = [prompt.splitlines()[:-1] for prompt in shown if "\n" in prompt]
    assert [len(complaint) for complaint in complaints] == [1]
    assert said in complaints[0][0]
    assert "outside 1e-05" not in complaints[0][0]
    plain = answered(lines())[1]
    assert {**tomllib.loads(sheet), "valve": 0} == {**plain, "valve": 0}


def test_only_the_answers_in_doubt_are_asked_for_again():
    _, sheet, shown = answered(lines(f90="30 Hz|20 Hz|25 Hz"))
    assert [prompt.count("[") for prompt in shown if "(f3db)" in prompt or "(f90)" in prompt] == [0, 0, 1, 1]
    assert [sheet["valve"]["response"][0][key]["value"] for key in ("f3db", "f90")] == [20, 25]
    assert len(shown) == len(SHEET) + 2


@pytest.mark.parametrize(
    ("told", "source"),
    [
        ("100 x 63 mm", "datasheet: bore and rod, 100 mm x 63 mm"),
        ("100 mm x 63", "datasheet: bore and rod, 100 mm x 63 mm"),
        ("100mm / 6.3 cm", "datasheet: bore and rod, 100mm x 6.3 cm"),
    ],
)
def test_a_unit_may_be_written_once(told, source):
    typed = [line for key, line in DOUBLE_ROD.items() if line is not None and key != "Aj"]
    _, sheet, _ = answered([*typed[:12], told, *typed[12:]])
    assert sheet["jack"]["Aj"] == {"value": 47.367, "unit": "cm^2", "source": source}


@pytest.mark.parametrize("told", ["19 mm x 2 m", "2 m x 19 mm"])
def test_a_hose_is_understood_by_size(told):
    _, sheet, _ = answered(lines(hose=told))
    assert sheet["jack"]["hose"] == {"value": 0.56706, "unit": "l", "source": "datasheet: a hose, 19 mm x 2 m"}


def test_what_nothing_can_be_built_of_is_asked_for_again_and_the_rest_is_kept():
    def build(text):
        sheet = tomllib.loads(text)
        if sheet["jack"]["S"]["value"] == 500:
            raise InputError("such a jack: S is too long")
        if sheet["load"]["M"]["value"] == 200:
            raise InputError("nothing comes of it")
        return sheet

    again = ["100 kg" if key == "M" else "" for key in SHEET if key != "jack"]
    _, sheet, shown = answered([*lines(), "400 mm", *again], build)
    assert (sheet["jack"]["S"]["value"], sheet["load"]["M"]["value"]) == (400, 100)
    assert [prompt.splitlines()[0] for prompt in shown if "\n" in prompt] == [
        "such a jack: S is too long",
        "nothing comes of it",
    ]


def test_a_late_error_where_the_answers_end_is_one_line_and_names_no_file(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    typed = "\n".join(lines(AA="1.5 m", AB="1 m^2", S="10 mm"))
    for answers, said in ((typed, "ke"), ("\n".join(lines(f90="30 Hz")[:12]), "no second-order valve")):
        monkeypatch.setattr("sys.stdin", StringIO(answers))
        assert main(["new", "mine", "--ask", "two-stage"]) == 2
        complaint = capsys.readouterr().err
        assert complaint.count("\n") == 1
        assert said in complaint
        assert str(tmp_path.parent) not in complaint
        assert "/tmp" not in complaint
    assert not list(tmp_path.iterdir())


def test_a_three_stage_valve_is_asked_for_hysteresis_and_threshold():
    """At most 2 %: half of it, and all up to it allowed."""
    said = {**SHEET, "jack": "double-rod", "Aj": "100 x 63 mm", "pilot_flow": "20 l/min", "imax": "20 mA"}
    said |= {"hysteresis": "at most 2 %", "threshold": "0.5 %"}

    def ask(prompt):
        return next((answer for key, answer in said.items() if f"({key})" in prompt), said["jack"])

    _, sheet = asked_datasheet("three-stage", "mine", tomllib.loads, ask)
    hysteresis, threshold = sheet["valve"]["hysteresis"], sheet["valve"]["threshold"]
    assert (hysteresis["value"], hysteresis["bounds"], threshold["value"]) == (1.0, [0.0, 2.0], 0.5)
