"""Files as labs leave them become a campaign that `residual` takes; what is not told is left out, and said."""

import json

import pytest
from made_recordings import columns, text

from workbench.cli import main

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
