"""Files as labs leave them become a campaign that `residual` takes; what is not told is left out, and said."""

import json
from pathlib import Path

import numpy as np
import pytest
from made_recordings import columns, text

from workbench.cli import main
from workbench.commands.import_.page import bars

UNITS = {"t": "ms", "command": "1", "reference": "mm", "spool": "um", "pa": "bar", "pb": "MPa", "position": "mm",
         "acceleration": "m/s^2"}  # fmt: skip
HEADER = ["Zeit;Ventil Soll;Weg Soll;Schieberweg;Druck A;p_B;Weg;Beschl.;Öltemperatur",
          "ms;V;mm;µm;bar;MPa;mm;m/s²;°C"]  # fmt: skip


def german(path, name, volts=10.0, sign=1.0, from_end=250.0, swapped=False):
    """A record of the sample in a file with a preamble, units under the header, decimal commas, Latin letters."""
    table = columns(name, UNITS)
    table["command"] *= volts
    table["position"] = sign * table["position"] + from_end
    table["reference"] += from_end
    if swapped:
        table["pa"], table["pb"] = table["pb"] * 10, table["pa"] / 10
    table["temperature"] = 40 + 0 * table["t"]
    lines = ["Prüfstand 3; Bediener Müller", "Datum: 24.12.2025", "", *HEADER]
    path.write_bytes(text(lines, list(table.values()), ";", ",").encode("cp1252"))
    return str(path)


def imported(tmp_path, files, *more, rig="jack-10t"):
    assert main(["import", *files, "--rig", rig, "--out", str(tmp_path / "out"), *more]) == 0
    return json.loads((tmp_path / "out" / "metrics.json").read_text())


@pytest.fixture(scope="module")
def german_campaign(tmp_path_factory):
    folder = tmp_path_factory.mktemp("german")
    files = [german(folder / f"{name}.csv", name) for name in ("static", "steps", "triangle", "multisine")]
    return folder, imported(folder, files)


def test_a_german_laboratory(german_campaign):
    _, metrics = german_campaign
    assert {name: entry["column"] for name, entry in metrics["signals"].items()} == {
        "t": "Zeit", "command": "Ventil Soll", "reference": "Weg Soll", "spool": "Schieberweg", "pa": "Druck A",
        "pb": "p_B", "position": "Weg", "acceleration": "Beschl.",
    }  # fmt: skip
    assert metrics["signals"]["t"]["unit"] == "ms"
    assert metrics["signals"]["command"] == {
        "column": "Ventil Soll",
        "unit": "V",
        "scale": 0.1,
        "to": "1",
        "offset": 0.0,
    }
    assert metrics["signals"]["position"] == {"column": "Weg", "unit": "mm", "scale": 1.0, "to": "mm", "offset": -250.0}
    assert list(metrics["left_out"]) == ["Öltemperatur"]
    assert metrics["ready"]


def test_roles_are_proposed(german_campaign):
    _, metrics = german_campaign
    roles = metrics["records"]
    assert roles["static"] == ["static.parquet"]
    assert len(roles["train"]) == 2
    assert len(roles["heldout"]) == 1


def test_residual_takes_it_as_it_takes_the_original(german_campaign):
    folder, metrics = german_campaign
    (heldout,) = metrics["records"]["heldout"]
    assert main(["residual", str(folder / "out"), "--out", str(folder / "residual")]) == 0
    rows = json.loads((folder / "residual" / "metrics.json").read_text())["rows"]
    assert {row["signal"] for row in rows} == {"spool", "pa", "pb", "position", "acceleration"}
    assert {row["record"] for row in rows} == {heldout.removesuffix(".parquet")}


def test_a_position_that_runs_the_other_way_is_turned(tmp_path):
    metrics = imported(tmp_path, [german(tmp_path / "steps.csv", "steps", sign=-1.0)])
    assert metrics["signals"]["position"] == {"column": "Weg", "unit": "mm", "scale": -1.0, "to": "mm", "offset": 250.0}
    assert metrics["ready"]


def test_pressures_that_changed_places_are_exchanged(tmp_path):
    metrics = imported(tmp_path, [german(tmp_path / "steps.csv", "steps", swapped=True)])
    assert metrics["signals"]["pa"]["column"] == "p_B"
    assert metrics["signals"]["pb"]["column"] == "Druck A"
    assert metrics["ready"]


def test_pressures_that_changed_places_beside_a_turned_position_are_said_to_have_done_so(tmp_path):
    """The spool tells that from a turned command; without one a jack whose ends are alike may be either, and both are
    said."""
    metrics = imported(tmp_path, [german(tmp_path / "triangle.csv", "triangle", sign=-1.0, swapped=True)])
    assert [metrics["signals"][name]["column"] for name in ("pa", "pb")] == ["p_B", "Druck A"]
    assert [metrics["signals"][name]["scale"] for name in ("command", "spool", "position")] == [0.1, 1.0, -1.0]
    said = "pa and pb look swapped, and the sign of position wrong"
    assert said in guess(metrics, "Weg")["reason"]
    table = columns("triangle", {"t": "s", "command": "1", "pa": "bar", "pb": "bar", "position": "mm"})
    names = "t", "command", "pb", "pa", "position"
    rows = [-table[name] if name == "position" else table[name] for name in names]
    (tmp_path / "few.csv").write_text(text(["t [s],u [-],p1 [bar],p2 [bar],Weg [mm]"], rows))
    (tmp_path / "more").mkdir()
    few = imported(tmp_path / "more", [str(tmp_path / "few.csv")])
    assert f"the sign of command looks wrong, or as well {said}" in guess(few, "u [-]")["reason"]
    assert few["signals"]["command"]["scale"] == -1.0


def guess(metrics, cell):
    return next(row for row in metrics["columns"] if row["column"] == cell)


@pytest.mark.usefixtures("right_columns")
def test_what_is_ambiguous_is_left_out_with_the_line_to_add(tmp_path):
    table = columns("steps", {"t": "s", "command": "1", "pa": "bar", "pb": "bar", "position": "mm"})
    header = "t [s],u [-],Druck A [bar],Pression A [bar],Weg [mm],x [mm],f [1/min],p"
    rows = [*(table[name] for name in ("t", "command", "pa", "pb", "position", "position")), table["t"], table["pa"]]
    (tmp_path / "a.csv").write_text(text([header], rows))
    metrics = imported(tmp_path, [str(tmp_path / "a.csv")])
    assert set(metrics["signals"]) == {"t", "command", "position"}
    assert metrics["signals"]["position"]["column"] == "Weg [mm]"
    for cell in ("Druck A [bar]", "Pression A [bar]"):
        assert "may also be" in guess(metrics, cell)["reason"]
        assert metrics["left_out"][cell].startswith("pa = {column = ")
    assert "more clearly position" in guess(metrics, "x [mm]")["reason"]
    assert guess(metrics, "p")["signal"] is None
    written = (tmp_path / "out" / "campaign.toml").read_text()
    assert all(f"# {line}" in written for line in metrics["left_out"].values())


def test_what_does_not_fit_the_rig_is_said(tmp_path):
    table = columns("steps", {"t": "s", "command": "1", "pa": "bar", "pb": "bar", "position": "mm"})
    table["position"] += 900
    table["command"] *= 30
    table["pa"] *= 1.4
    (tmp_path / "a.csv").write_text(text(["t [s],u,p_a [bar],p_b [bar],x [mm]"], list(table.values())))
    metrics = imported(tmp_path, [str(tmp_path / "a.csv")])
    assert not metrics["ready"]
    assert "what is full command?" in guess(metrics, "u")["reason"]
    misfits = " ".join(metrics["misfits"])
    assert "the rig's stroke is from -250 to 250 mm" in misfits
    assert "and the supply has 210 bar" in misfits


@pytest.mark.usefixtures("right_columns")
def test_a_column_called_like_a_signal_that_it_cannot_be_is_renamed(tmp_path):
    table = columns("steps", {"t": "s", "command": "1", "pa": "bar", "position": "mm"})
    (tmp_path / "a.csv").write_text(
        text(
            ["t [s],command [1],current [count],position [mm]"], [table[n] for n in ("t", "command", "pa", "position")]
        )
    )
    metrics = imported(tmp_path, [str(tmp_path / "a.csv")])
    assert metrics["ready"]
    assert list(metrics["left_out"]) == ["current as recorded [count]"]


@pytest.mark.usefixtures("right_columns")
def test_a_file_without_a_clock_has_the_rate_that_stands_above_its_table(tmp_path):
    table = columns("steps", {"command": "1", "pa": "bar", "position": "mm"})
    (tmp_path / "a.csv").write_text(text(["Abtastrate: 1000 Hz", "u [-],pa [bar],x [mm]"], list(table.values())))
    assert imported(tmp_path, [str(tmp_path / "a.csv")])["ready"]
    assert 't = {period = "0.001 s"}' in (tmp_path / "out" / "campaign.toml").read_text()


@pytest.mark.usefixtures("right_columns")
def test_a_rig_file_comes_along(tmp_path):
    assert main(["show", "jack-10t", "--out", str(tmp_path / "mine.toml")]) == 0
    metrics = imported(tmp_path, [german(tmp_path / "steps.csv", "steps")], rig=str(tmp_path / "mine.toml"))
    assert metrics["ready"]
    assert (tmp_path / "out" / "rig.toml").exists()
    assert main(["residual", str(tmp_path / "out"), "--out", str(tmp_path / "residual")]) == 0


@pytest.mark.usefixtures("right_columns")
def test_a_rig_file_comes_along_whatever_it_is_called(tmp_path, monkeypatch):
    """A rig.toml of the folder one works in has the name that the campaign's own copy has."""
    monkeypatch.chdir(tmp_path)
    assert main(["show", "jack-10t", "--out", "rig.toml"]) == 0
    assert main(["import", german(tmp_path / "steps.csv", "steps"), "--rig", "rig.toml", "--out", "lab"]) == 0
    assert main(["residual", "lab", "--out", "residual"]) == 0


def test_a_force_that_the_rig_cannot_have_is_left_out_with_the_reason(tmp_path):
    table = columns("steps", {"t": "s", "command": "1", "pa": "bar", "pb": "bar", "position": "mm",
                              "acceleration": "m/s^2"})  # fmt: skip
    header = ["t [s],command [1],pa [bar],pb [bar],position [mm],force [kN]"]
    (tmp_path / "a.csv").write_text(text(header, list(table.values())))
    metrics = imported(tmp_path, [str(tmp_path / "a.csv")])
    assert metrics["ready"]
    assert "force" not in metrics["signals"]
    (left,) = [each for each in metrics["columns"] if each["column"].startswith("force")]
    assert "jack-10t has nothing that a load cell feels" in left["reason"]
    assert main(["residual", str(tmp_path / "out"), "--out", str(tmp_path / "residual")]) == 0


@pytest.mark.parametrize("content", ["", "no table\n", "t;u\n0;1\n1;2\n2;3\n3;oops\n"])
def test_bad_input_leaves_nothing(tmp_path, capsys, content):
    good, bad = german(tmp_path / "steps.csv", "steps"), tmp_path / "bad.csv"
    bad.write_text(content)
    assert main(["import", good, str(bad), "--rig", "jack-10t", "--out", str(tmp_path / "out")]) == 2
    captured = capsys.readouterr()
    assert captured.err.splitlines()[-1].startswith("jackbench: ")
    assert not list(tmp_path.glob("out*"))


@pytest.mark.parametrize("files", [["nothere.csv"], ["a.bin"], ["a.csv", "a.csv"], ["."]])
def test_files_that_cannot_be_read_are_refused(tmp_path, monkeypatch, capsys, files):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.bin").write_text("x")
    (tmp_path / "a.csv").write_text("t,u\n0,1\n1,2\n2,3\n3,4\n")
    assert main(["import", *files, "--rig", "jack-10t"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


DATA = Path(__file__).parents[1] / ".." / "shared" / "data"


@pytest.mark.skipif(not DATA.is_dir(), reason="measured data is not beside the repository")
def test_recordings_of_a_real_rig(tmp_path):
    files = [str(DATA / f"festo_tp511/p{side}_{volts}V_01.csv.gz") for side in "ab" for volts in (1, 3, 5)]
    metrics = imported(tmp_path, files, rig="festo-tp511")
    assert metrics["ready"]
    assert set(metrics["signals"]) == {"t", "command", "pa", "pb", "position"}
    assert metrics["signals"]["command"]["scale"] == 0.1
    assert metrics["records"]["heldout"] == ["pa_3V_01.parquet", "pb_3V_01.parquet"]


@pytest.mark.usefixtures("right_columns")
def test_a_file_without_a_clock_is_no_campaign_yet(tmp_path):
    table = columns("steps", {"command": "1", "pa": "bar", "position": "mm"})
    (tmp_path / "a.csv").write_text(text(["u [-],pa [bar],x [mm]"], list(table.values())))
    metrics = imported(tmp_path, [str(tmp_path / "a.csv")])
    assert not metrics["ready"]
    assert metrics["problem"].startswith("no column is read as a clock; export the time in seconds, or write t = ")
    campaign = tmp_path / "out" / "campaign.toml"
    campaign.write_text(campaign.read_text().replace("# t = ", "t = "))
    assert main(["residual", str(tmp_path / "out"), "--out", str(tmp_path / "residual")]) == 0


def test_numbers_near_the_largest_have_a_picture():
    assert bars(np.array([-1.7e308, np.nan, 1.7e308])) == "▁ █"


@pytest.mark.usefixtures("right_columns")
def test_what_was_left_out_is_said_on_the_screen_and_on_the_page(tmp_path, capsys):
    from scipy.io import savemat

    table = columns("steps", {"command": "1", "pa": "bar", "pb": "bar", "position": "mm"})
    savemat(tmp_path / "a.mat", {"fs": 1000.0, "gain": 3.0, **table})
    metrics = imported(tmp_path, [str(tmp_path / "a.mat")])
    assert metrics["ready"]
    assert set(metrics["signals"]) == {"t", "command", "pa", "pb", "position"}
    said = 'a.parquet: "fs" = 1000 is the clock: 0.001 s from row to row', "a.parquet: left out, no signals: gain = 3"
    assert set(said) <= set(capsys.readouterr().out.splitlines())
    assert "left out, no signals: gain = 3" in (tmp_path / "out" / "report.html").read_text()


def test_a_robot_s_recording(tmp_path):
    """A clock in ns since 1970, units glued on names and in a row of their own, pressures under a group's name."""
    table = columns("steps", {"t": "ns", "command": "1", "current": "mA", "pa": "bar", "pb": "bar", "position": "mm"})
    stamps = [f"{1_760_000_000 * 10**9 + round(t)}" for t in table.pop("t").tolist()]
    head = ["header.stamp,command,servo_current_mA,A,B,pos_mm", "ns,-,mA,bar,bar,mm"]
    rows = text([], list(table.values())).splitlines()
    lines = [",,,Pressures,,", *head, *(f"{stamp},{row}" for stamp, row in zip(stamps, rows, strict=True)), ""]
    (tmp_path / "a.csv").write_text("\n".join(lines))
    metrics = imported(tmp_path, [str(tmp_path / "a.csv")])
    assert set(metrics["signals"]) == {"t", "command", "current", "pa", "pb", "position"}
    assert metrics["ready"]
