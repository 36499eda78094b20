"""A load cell's sheet: what was put into a played rig comes back, intervals hold it, bad records are refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.force_test.bench import SIZES, CellErrors, ForceBench
from workbench.commands.force_test.options import with_grips
from workbench.identify.acceptance.force_test import Reference, force_sheet
from workbench.linear import equilibrium
from workbench.loop.guard_numbers import guard_shape
from workbench.plant import build
from workbench.records import Record
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig, save_rig

KS, MG, SPAN, HYSTERESIS, ZERO = 1e7, 20.0, 0.004, 200.0, 150.0


@pytest.fixture(scope="module")
def rig():
    return load_rig("jack-10t").with_values(ks=KS)


@pytest.fixture(scope="module")
def records(rig):
    bench = ForceBench(with_grips(rig, MG), 3, CellErrors(SPAN, ZERO))
    lagging = replace(bench, cell=replace(bench.cell, hysteresis=HYSTERESIS))
    return [lagging.static_record(), *(bench.sine_record(size, i) for i, size in enumerate(SIZES))]


@pytest.fixture(scope="module")
def found(rig, records):
    sheet = force_sheet(records, rig, Reference(0.0, 0.01))
    return {row.id: row for row in sheet.rows}


def test_grips_add_their_inertia_to_what_the_cell_reads(rig):
    plant = build(with_grips(rig, MG))
    rest = equilibrium(plant)
    x = rest.x.copy()
    x[plant.state("P1")] += 1e5  # a push that nothing balances
    outputs = dict(zip(plant.outputs, plant.observe(x, rest.u)[0], strict=True))
    assert outputs["acceleration"] == pytest.approx(1e5 * rig["Aj"] / rig["M"])
    assert outputs["force"] - outputs["reference_force"] == pytest.approx(MG * outputs["acceleration"])


def test_a_cell_on_the_rod_reads_what_moves_and_lifts_the_mass_behind_it_and_loads_the_specimen(rig):
    """F = (M - Mr) a + specimen + weight, and the friction of the piston is none of it."""
    weight, before, x, v = 2e3, 30.0, 4e-3, 0.2
    rod = replace(rig, load="rod-cell", numbers={**rig.numbers, "Mr": Number("Mr", before, "kg", "kg", "")})
    weighed = EffectUse("load.bias", "weight", {"F": Number("F", weight, "N", "N", "")})
    rubbed = EffectUse("jack.friction", "coulomb", {})
    plant = build(replace(rod.with_values(cs=3e3), effects=(weighed, rubbed)))
    rest = equilibrium(plant, p=plant.without_dry_friction())
    state = rest.x.copy()
    state[plant.state("P1")] += 5e6
    state[[plant.state("x"), plant.state("v")]] = x, v
    outputs = dict(zip(plant.outputs, plant.observe(state, rest.u)[0], strict=True))
    specimen = KS * x + 3e3 * v
    moved = (rig["M"] - before) * outputs["acceleration"]
    assert outputs["reference_force"] == pytest.approx(specimen)
    assert outputs["force"] == pytest.approx(moved + specimen + weight)


def test_a_rig_file_says_that_its_cell_is_on_the_rod(rig, tmp_path):
    rod = replace(rig, load="rod-cell", numbers={**rig.numbers, "Mr": Number("Mr", 30.0, "kg", "kg", "drawing")})
    save_rig(rod, tmp_path / "rod.toml")
    assert load_rig(tmp_path / "rod.toml").numbers == rod.numbers
    text = (tmp_path / "rod.toml").read_text()
    (tmp_path / "heavy.toml").write_text(text.replace("Mr = {value = 30.0", "Mr = {value = 2000.0"))
    with pytest.raises(InputError, match=r"Mr.*2000 kg is part of M, 1000 kg"):
        load_rig(tmp_path / "heavy.toml")


def test_a_guard_takes_a_cell_on_the_rod_for_its_limit_and_for_no_push(rig):
    """What it reads moves the mass already, so the pressures less that would say that nothing does."""
    rod = replace(rig, load="rod-cell", numbers={**rig.numbers, "Mr": Number("Mr", 30.0, "kg", "kg", "")})
    shapes = [guard_shape(each, ("position", "pa", "pb", "force"), ("position",)) for each in (rig, rod)]
    assert [shape.balances for shape in shapes] == [True, False]
    assert all("force" in shape.read for shape in shapes)


def test_without_grips_a_plant_has_no_reference_force(rig):
    assert "reference_force" not in build(rig).outputs


def test_the_mass_between_cell_and_specimen_comes_back(found):
    row = found["mass"]
    assert row.value == pytest.approx(MG, rel=0.05)
    assert row.high - row.low < 0.2 * MG


def test_the_error_grows_with_the_square_of_the_frequency_over_the_specimen_s_stiffness(found):
    slow = next(row for id, row in found.items() if id.startswith("dynamic_error_1hz"))
    fast = [row for id, row in found.items() if id.startswith("dynamic_error_20hz")]
    assert slow.value == pytest.approx(100 * SPAN, abs=0.1)
    for row in fast:
        expected = (1 + SPAN) * (1 - MG * (2 * np.pi * 20) ** 2 / KS) - 1
        assert row.value == pytest.approx(100 * expected, abs=0.3)


def test_mass_times_acceleration_takes_the_inertia_off(found):
    for id, row in found.items():
        if id.startswith("compensated_error_20hz"):
            assert row.value == pytest.approx(100 * SPAN, abs=0.3)


def test_the_band_ends_where_span_and_inertia_come_to_one_percent(found):
    expected = np.sqrt((0.01 + SPAN) * KS / MG) / (2 * np.pi)
    assert found["band"].value == pytest.approx(expected, rel=0.05)


def test_at_rest_span_zero_and_hysteresis_come_back(found, rig):
    capacity = rig.limit("force")
    assert found["hysteresis"].value == pytest.approx(100 * HYSTERESIS / capacity, rel=0.15)
    assert found["zero"].value == pytest.approx(100 * ZERO / capacity, abs=100 * HYSTERESIS / capacity)
    last = [row for id, row in found.items() if id.startswith("static_error")][-1]
    force = float(last.meaning.split(" kN")[0].split()[-1]) * 1e3
    expected = SPAN + (ZERO - HYSTERESIS / 2) / force  # the way up lags behind by half of the hysteresis
    assert last.value == pytest.approx(100 * expected, abs=0.03)


def test_without_a_reference_cell_the_mass_of_the_rig_file_corrects(rig, records):
    blind = [replace(r, signals={n: v for n, v in r.signals.items() if n != "reference_force"}) for r in records]
    rows = {row.id: row for row in force_sheet(blind, with_grips(rig, MG), Reference(0.0, 0.01)).rows}
    fast = next(row for id, row in rows.items() if id.startswith("dynamic_error_20hz"))
    assert "mass times acceleration" in fast.meaning
    assert fast.value == pytest.approx(-100 * MG * (2 * np.pi * 20) ** 2 / KS, rel=0.1)
    assert rows["zero"].value is None
    assert "reference_force" in rows["zero"].reason


@pytest.mark.parametrize("kept", [("position",), ("pa", "pb")])
def test_without_an_accelerometer_position_or_pressures_say_the_acceleration(rig, records, kept):
    names = ("command", "force", "reference_force", *kept)
    fewer = [replace(r, signals={n: r.signals[n] for n in names}) for r in records]
    rows = {row.id: row for row in force_sheet(fewer, rig, Reference(0.0, 0.01)).rows}
    assert rows["mass"].low - 0.1 * MG < MG < rows["mass"].high + 0.1 * MG
    assert rows["compensation_noise"].value is None


def test_a_cell_that_moves_without_a_specimen_says_its_mass(rig):
    random, t = np.random.default_rng(2), np.arange(4000) * 1e-3
    a = 30 * np.sin(2 * np.pi * 7 * t)
    signals = {
        "command": 0.1 * np.sin(2 * np.pi * 7 * t),
        "acceleration": a + 0.3 * random.standard_normal(t.size),
        "force": MG * a + 30 * random.standard_normal(t.size),
    }
    free = rig.with_values(ks=0.0)
    rows = {row.id: row for row in force_sheet([Record("multisine", t, signals)], free, Reference(0.0, 0.01)).rows}
    assert rows["mass"].low < MG < rows["mass"].high


def test_a_reference_s_own_interval_is_in_every_error(rig, records, found):
    wider = {row.id: row for row in force_sheet(records, rig, Reference(0.002, 0.01)).rows}
    for id, row in wider.items():
        if id.startswith(("static_error", "dynamic_error")):
            reach = row.high - row.value
            assert reach == pytest.approx(np.hypot(found[id].high - found[id].value, 0.2))


def changed(record, name, values):
    return replace(record, signals={**record.signals, name: values})


def test_a_reference_cell_that_is_slower_than_the_rig_is_refused(rig, records):
    from scipy.signal import lfilter

    share = 1 - np.exp(-2 * np.pi * 30 * 1e-3)  # a lag of 30 Hz
    slow = changed(
        records[1], "reference_force", lfilter([share], [1, share - 1], records[1].signals["reference_force"])
    )
    with pytest.raises(InputError, match="slower than the rig"):
        force_sheet([slow], rig, Reference(0.0, 0.01))


def test_a_sine_that_is_no_sine_is_refused(rig, records):
    force = records[2].signals["force"]
    square = changed(records[2], "force", np.sign(force) * np.sqrt(np.abs(force * np.abs(force).max())))
    with pytest.raises(InputError, match="no sine"):
        force_sheet([square], rig, Reference(0.0, 0.01))


def test_levels_that_are_held_too_short_a_time_are_refused(rig, records):
    static = records[0]
    rows = slice(None, None, 8)  # the same levels, eight times as fast
    signals = {name: values[rows] for name, values in static.signals.items()}
    quick = Record(static.name, np.arange(static.t[rows].size) * 1e-3, signals)
    with pytest.raises(InputError, match=r"too short a dwell|still drifts"):
        force_sheet([quick], rig, Reference(0.0, 0.01))


def test_a_played_rig_leaves_its_sheet(tmp_path):
    out = tmp_path / "out"
    words = ["force-test", "jack-10t", "--specimen", "1e7 N/m", "--grips", "20 kg", "--out", str(out)]
    assert main(words) == 0
    rows = json.loads((out / "metrics.json").read_text())["rows"]
    verdicts = {row["id"]: row["pass"] for row in rows if row["id"].startswith("dynamic_error")}
    assert all(
        passed == (not id.startswith(("dynamic_error_15hz", "dynamic_error_20hz"))) for id, passed in verdicts.items()
    )
    assert "compensated" in (out / "report.html").read_text()


def test_records_without_a_load_cell_leave_a_page_that_says_what_they_lack(tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["force-test", "experiments/sample", "--out", str(out)]) == 0
    rows = json.loads((out / "metrics.json").read_text())["rows"]
    assert all(row["value"] is None and row["reason"] for row in rows)
    assert "No report" not in capsys.readouterr().out
    assert "no record force-static" in (out / "report.html").read_text()


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["jack-10t"], "no specimen"),
        (["jack-10t", "--specimen", "stiff"], "--specimen"),
        (["jack-10t", "--specimen", "1e7 N/m", "--grips", "2 t"], "moving mass"),
        (["jack-10t", "--within", "0"], "--within"),
        (["jack-10t", "--reference-within", "-1"], "--reference-within"),
        (["crane", "--specimen", "1e7 N/m"], "crane"),
    ],
)
def test_bad_input_is_one_line(arguments, word, tmp_path, capsys):
    assert main(["force-test", *arguments, "--out", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err.strip().splitlines()
    assert word in told[-1]
    assert sum(line.startswith("jackbench:") for line in told) == 1
    assert not (tmp_path / "out").exists()
