"""Foreign formats, each made by its own library or by hand, are read with their names, units, clocks and gaps."""

import importlib.util
import re
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from workbench.base import contained
from workbench.base.errors import InputError
from workbench.records.foreign import column, open_foreign, write_parts
from workbench.records.foreign.csv_text import read_csv
from workbench.records.foreign.open import READERS
from workbench.records.foreign.unit_names import heading_of, name_of

T = np.arange(400) * 1e-3
X = 50 + 20 * np.cos(30 * T)
U = np.sin(30 * T)


def table(path, most=None):
    """Cells with units, numbers by cell, notes, of a file converted in its folder."""
    source = open_foreign(path)
    parts = write_parts(source, path, path.parent, "made", *([most] if most else []))
    numbers = {
        heading.cell: np.concatenate([column(path.parent / part.file, heading.cell) for part in parts])
        for heading in parts[0].headings
    }
    return {heading.cell: heading.unit for heading in parts[0].headings}, numbers, parts


def lines(separator, decimal=".", digits=4):
    return "".join(
        separator.join(f"{value:.{digits}f}".replace(".", decimal) for value in row) + "\n"
        for row in zip(T, U, X, strict=True)
    )


@pytest.mark.parametrize(
    ("head", "separator", "decimal", "encoding"),
    [
        ("Zeit;Soll;Weg\ns;V;mm\n", ";", ",", "utf-8"),
        ("Prüfstand 7\nBediener: Müller; Schmidt\n\nZeit;Soll;Weg\ns;V;mm\n", ";", ",", "cp1252"),
        ("Zeit [s]\tSoll [V]\tWeg [mm]\n", "\t", ",", "utf-16"),
        ("Zeit (s),Soll (V),Weg (mm)\n", ",", ".", "utf-8-sig"),
        ("# Zeit[s] Soll[V] Weg[mm]\n", "   ", ".", "utf-8"),
        ("Zeit/s|Soll/V|Weg/mm\n", "|", ".", "latin-1"),
    ],
    ids=["units row", "preamble", "utf-16", "bom", "blanks", "bars"],
)
def test_text_of_any_layout(tmp_path, head, separator, decimal, encoding):
    (tmp_path / "a.csv").write_bytes((head + lines(separator, decimal)).encode(encoding))
    units, numbers, _ = table(tmp_path / "a.csv")
    assert list(units.values()) == ["s", "V", "mm"]
    assert [name_of(cell) for cell in units] == ["Zeit", "Soll", "Weg"]
    for values, expected in zip(numbers.values(), (T, U, X), strict=True):
        np.testing.assert_allclose(values, expected, atol=1e-4)


def test_small_chunks_and_parts_give_the_same_numbers(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("t;u;x\n" + lines(";", ","))
    whole = np.column_stack([np.concatenate(block) for block in zip(*read_csv(path).blocks, strict=True)])
    small = np.column_stack([np.concatenate(block) for block in zip(*read_csv(path, chunk=700).blocks, strict=True)])
    assert np.array_equal(whole, small)
    _, numbers, parts = table(path, most=8 * 3 * 150)
    assert [part.rows for part in parts] == [150, 150, 100]
    assert np.array_equal(np.column_stack(list(numbers.values())), whole)


def test_european_stamps_count_from_the_first_row_and_over_midnight(tmp_path):
    text = "Datum;Uhrzeit;Weg [mm]\n"
    for i in range(40):
        day, clock, second = ("31.12.2025", "23:59", 58 + i / 10) if i < 20 else ("01.01.2026", "00:00", i / 10 - 2)
        text += f"{day};{clock}:{second:06.3f};{i}\n".replace(f"{second:06.3f}", f"{second:06.3f}".replace(".", ","))
    (tmp_path / "a.csv").write_text(text)
    _, numbers, parts = table(tmp_path / "a.csv")
    np.testing.assert_allclose(numbers["Datum Uhrzeit"], np.arange(40) / 10, atol=1e-9)
    assert any("seconds from the first row" in note for note in parts[0].notes)


def test_times_of_day_alone_go_on_after_midnight(tmp_path):
    text = "Uhrzeit\tWeg\n" + "".join(
        f"{'23:59' if i < 20 else '00:00'}:{(58 + i / 10 if i < 20 else i / 10 - 2):06.3f}\t{i}\n" for i in range(40)
    )
    (tmp_path / "a.txt").write_text(text)
    _, numbers, _ = table(tmp_path / "a.txt")
    np.testing.assert_allclose(numbers["Uhrzeit"], np.arange(40) / 10, atol=1e-9)


STAMPS = [f"2025-03-21 10:00:00.{i:03d}" for i in range(40)]


@pytest.mark.parametrize("separator", ["\t", ";", ",", "|", " "])
@pytest.mark.parametrize("columns", [1, 3])
def test_a_date_and_its_time_in_one_cell_count_once(tmp_path, separator, columns):
    head = separator.join(["Datum Zeit", *(f"x{i}" for i in range(columns))])
    rows = [separator.join([stamp, *(f"{i}.5" for _ in range(columns))]) for i, stamp in enumerate(STAMPS)]
    (tmp_path / "a.txt").write_text("\n".join([head, *rows]))
    _, numbers, _ = table(tmp_path / "a.txt")
    assert list(numbers) == ["Datum Zeit", *(f"x{i}" for i in range(columns))]
    np.testing.assert_allclose(numbers["Datum Zeit"], np.arange(40) / 1000, atol=1e-9)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"], ids=["LF", "CRLF", "CR"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_lines_break_where_the_parser_breaks_them(tmp_path, end, encoding):
    feeds = "\x0b\x0c\x1c\x1d\x1e\x85\u2028"
    head = [f"page{feeds}of a printer", 'Operator;"Bob', "", '"Zeit\n[s]";"Weg\nder Stange\n[mm]";"Bemerkung"']
    remarks = ['"two\nlines"' if i % 7 == 3 else "-x-" for i in range(40)]
    rows = [f"{chr(12) if i % 10 == 5 else ''}{i / 100};{i / 2};{remark}" for i, remark in enumerate(remarks)]
    (tmp_path / "a.csv").write_bytes("\n".join([*head, *rows, ""]).replace("\n", end).encode(encoding))
    units, numbers, parts = table(tmp_path / "a.csv")
    assert units == {"Zeit [s]": "s", "Weg der Stange [mm]": "mm"}
    np.testing.assert_allclose(numbers["Zeit [s]"], np.arange(40) / 100)
    assert any("left out, no numbers: Bemerkung" in note for note in parts[0].notes)


def test_gaps_broken_rows_and_a_rate_above_the_table_are_said(tmp_path):
    rows = lines(";").splitlines()
    rows[5], rows[9] = rows[9].rsplit(";", 1)[0] + ";NaN", "broken"
    (tmp_path / "a.csv").write_text("Abtastrate: 1000 Hz\nZeit;Soll;Weg\n" + "\n".join(rows) + "\n")
    _, numbers, parts = table(tmp_path / "a.csv")
    assert numbers["Weg"].size == 399
    assert np.isnan(numbers["Weg"]).sum() == 1
    assert parts[0].period == pytest.approx(1e-3)
    assert any("1 row left out" in note for note in parts[0].notes)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t;u\n0;1\n1;2\n2;3\n3;oops\n", 'column "u": "oops" is not a number'),
        ("nothing here\nat all\n", "no table of numbers"),
        ("t,u\n0,1,2,3\n0,2,2,4\n0,3,2,5\n", "commas both in numbers"),
        ("", "empty"),
    ],
)
def test_text_that_is_no_table_is_refused_with_its_place(tmp_path, text, message):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(InputError, match=message):
        table(tmp_path / "a.csv")


def test_matlab_structures_of_version_5(tmp_path):
    from scipy.io import savemat

    record = {
        "t": T,
        "p_A": X,
        "info": "none",
        "slow": {"time": T[::10], "data": U[::10], "name": "Kraft", "units": "kN"},
    }
    savemat(tmp_path / "a.mat", {"record": record, "gain": 3.0})
    units, numbers, parts = table(tmp_path / "a.mat")
    assert units == {"record.t": None, "record.p_A": None, "Kraft": "kN", "Kraft, held": "kN"}
    np.testing.assert_allclose(numbers["Kraft"][:391], np.interp(T[:391], T[::10], U[::10]))
    assert np.isnan(numbers["Kraft"][391:]).all()
    assert any("resampled from 100 Hz to 1000 Hz" in note for note in parts[0].notes)


def test_a_structure_with_time_of_simulink(tmp_path):
    from scipy.io import savemat

    signals = [{"values": X, "label": "Weg", "dimensions": 1}, {"values": U, "label": "Ventil", "dimensions": 1}]
    savemat(tmp_path / "a.mat", {"out": {"time": T, "signals": signals, "blockName": "model/scope"}})
    units, numbers, _ = table(tmp_path / "a.mat")
    assert list(units) == ["t", "Weg", "Ventil"]
    np.testing.assert_allclose(numbers["Weg"], X)
    np.testing.assert_allclose(numbers["t"], T)


def cells(*parts):
    array = np.empty(len(parts), object)
    array[:] = parts
    return array


def paired(*pairs):
    array = np.empty((len(pairs), 2), object)
    for row, pair in zip(array, pairs, strict=True):
        row[:] = pair
    return array


MATRIX = np.column_stack((T, U, X))
SHEET = np.vstack([np.array([["Zeit [s]", "Soll [V]", "Weg [mm]"]], object), MATRIX.astype(object)])
REMARKS = np.array([["Remark"], *(["good"] for _ in T)], object)
NAMES, UNITS = cells("Zeit", "Soll", "Weg"), cells("s", "V", "mm")


@pytest.mark.parametrize(
    "variables",
    [
        {"data": MATRIX, "names": NAMES, "units": UNITS},
        {"A": {"data": MATRIX, "colheaders": cells("Zeit [s]", "Soll [V]", "Weg [mm]")}},
        {"y": MATRIX.T, "labels": np.array(["Zeit (s)", "Soll (V)", "Weg (mm)"])},
        {"log": {"c": cells(T, U, X), "channels": NAMES, "einheiten": UNITS}},
        {"log": paired(("Zeit [s]", T), ("Soll [V]", U), ("Weg [mm]", X))},
        {"raw": SHEET},
        {"raw": np.hstack((SHEET, REMARKS))},
        {"a": MATRIX[:, :1], "b": MATRIX[:, 1:], "b_names": NAMES[1:], "b_units": UNITS[1:], "note": "a day"},
    ],
    ids=["matrix", "importdata", "letters", "cells", "pairs", "a sheet", "remarks", "two matrices"],
)
@pytest.mark.parametrize("version", ["5", "7.3"])
def test_what_stands_beside_numbers_names_them(tmp_path, variables, version):
    from scipy.io import savemat

    if version == "5":
        savemat(tmp_path / "a.mat", variables)
    else:
        save_7_3(tmp_path / "a.mat", variables)
    units, numbers, _ = table(tmp_path / "a.mat")
    assert [name_of(cell) for cell in units] in (["Zeit", "Soll", "Weg"], ["a", "Soll", "Weg"])
    assert list(units.values())[1:] == ["V", "mm"]
    for values, expected in zip(numbers.values(), (T, U, X), strict=True):
        np.testing.assert_array_equal(values, expected)


def save_7_3(path, variables):
    """As MATLAB does: dimensions from the last to the first, cells as references, letters as numbers."""
    import h5py

    def put(group, name, value):
        if isinstance(value, dict):
            inside = group.create_group(name)
            for key, part in value.items():
                put(inside, key, part)
            return
        value = np.asarray(value)
        if value.dtype.kind == "U":
            lines = value.reshape(-1).tolist()
            letters = np.array([[ord(letter) for letter in line.ljust(max(map(len, lines)))] for line in lines], "u2")
            group.create_dataset(name, data=letters.T).attrs["MATLAB_class"] = np.bytes_("char")
        elif value.dtype.kind == "O":
            store = file.require_group("#refs#")
            references = np.empty(np.atleast_2d(value).shape, h5py.ref_dtype)
            for place, part in zip(np.ndindex(references.shape), value.ravel(), strict=True):
                key = f"r{len(store)}"
                put(store, key, part)
                references[place] = store[key].ref
            group.create_dataset(name, data=references.T, dtype=h5py.ref_dtype)
        else:
            group[name] = np.atleast_2d(value).T

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in variables.items():
            put(file, name, value)


@pytest.mark.parametrize(
    ("scalar", "period"),
    [
        ({"fs": 500.0}, 2e-3), ({"SampleRate": 500}, 2e-3), ({"sampling_frequency_kHz": 0.5}, 2e-3),
        ({"dt": 2e-3}, 2e-3), ({"Ts_ms": 2.0}, 2e-3), ({"Abtastrate": 500}, 2e-3),
    ],
)  # fmt: skip
@pytest.mark.parametrize("place", ["beside", "structure", "attribute"])
def test_a_sample_rate_is_the_clock(tmp_path, scalar, period, place):
    import h5py
    from scipy.io import savemat

    if place == "attribute":
        with h5py.File(tmp_path / "a.h5", "w") as file:
            file["r/u"], file["r/x"] = U, X
            file["r"].attrs.update(scalar)
    else:
        channels = {"u": U, "x": X, "calibration": np.arange(7.0)}
        savemat(tmp_path / "a.mat", channels | scalar if place == "beside" else {"r": channels | scalar})
    _, numbers, parts = table(next(tmp_path.glob("a.*")))
    np.testing.assert_allclose(numbers["t"], period * np.arange(T.size))
    assert len(numbers) == 3
    assert any("is the clock: 0.002 s from row to row" in note for note in parts[0].notes)


def test_what_is_neither_a_signal_nor_said_of_one_is_named(tmp_path):
    from scipy.io import savemat

    others = {
        "gain": 3.0,
        "fs": 1000.0,
        "image": np.ones((90, 80)),
        "people": cells("Ann", "Bob"),
        "empty": np.zeros(0),
    }
    savemat(tmp_path / "a.mat", {"t": T, "x": X, **others})
    units, _, parts = table(tmp_path / "a.mat")
    assert list(units) == ["t", "x"]
    (note,) = parts[0].notes
    assert all(name in note for name in ("gain = 3", '"fs" = 1000 (there is a clock)', "image", "people", "empty"))


def test_matlab_structures_of_version_7_3(tmp_path):
    import h5py

    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        group = file.create_group("data")
        group["time"], group["Weg"] = T[None], X[None]
        label = file.create_dataset("data/label", data=np.array([[ord(c)] for c in "x"], dtype="u2"))
        label.attrs["MATLAB_class"] = np.bytes_("char")
    units, numbers, _ = table(tmp_path / "a.mat")
    assert list(units) == ["data.Weg", "data.time"]
    np.testing.assert_allclose(numbers["data.Weg"], X)


def test_hdf5_with_units_tables_and_matrices(tmp_path):
    import h5py

    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["run/time"], file["run/pos"] = T, X
        file["run/pos"].attrs["units"] = "mm"
        file["run/raw"] = np.column_stack((U, -U))
        file["run/raw"].attrs["columns"] = ["soll", "ist"]
    units, numbers, _ = table(tmp_path / "a.h5")
    assert units == {"run.pos": "mm", "soll": None, "ist": None, "run.time": None}
    np.testing.assert_allclose(numbers["ist"], -U)


def test_tdms_channels_with_clocks_of_their_own(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    fast = {"wf_start_offset": 0.0, "wf_increment": 1e-3, "unit_string": "mm"}
    slow = {"wf_start_offset": 0.0, "wf_increment": 1e-2, "unit_string": "kN"}
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        channels = [("Messung", "Weg", X, fast), ("Langsam", "Kraft", U[::10], slow)]
        writer.write_segment([nptdms.ChannelObject(*channel) for channel in channels])
    units, numbers, parts = table(tmp_path / "a.tdms")
    assert units == {"t": "s", "Weg": "mm", "Kraft": "kN", "Kraft, held": "kN"}
    np.testing.assert_allclose(numbers["t"], T)
    np.testing.assert_allclose(numbers["Kraft"][:391], np.interp(T[:391], T[::10], U[::10]))
    assert any("Kraft: resampled from 100 Hz to 1000 Hz, on straight lines" in note for note in parts[0].notes)


def test_mdf_groups_with_clocks_of_their_own(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(X, T, unit="mm", name="Weg"), asammdf.Signal(U, T, unit="V", name="Soll")])
        file.append([asammdf.Signal(U[::10], T[::10], unit="kN", name="Kraft")])
        file.save(tmp_path / "a.mf4")
    units, numbers, parts = table(tmp_path / "a.mf4")
    assert units == {"t": "s", "Weg": "mm", "Soll": "V", "Kraft": "kN", "Kraft, held": "kN"}
    np.testing.assert_allclose(numbers["Weg"], X)
    assert any("resampled" in note for note in parts[0].notes)


def test_a_workbook_with_lines_above_the_table(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["Prüfstand 7"])
    book.active.append(["Zeit [s]", "Weg [mm]", "Bemerkung"])
    for t, x in zip(T, X, strict=True):
        book.active.append([float(t), float(x), "gut"])
    book.create_sheet("leer")
    book.save(tmp_path / "a.xlsx")
    units, numbers, parts = table(tmp_path / "a.xlsx")
    assert units == {"Zeit [s]": "s", "Weg [mm]": "mm"}
    np.testing.assert_allclose(numbers["Weg [mm]"], X, rtol=1e-14)
    assert any('sheet "Sheet" is read, of 2' in note for note in parts[0].notes)


def test_typed_cells_of_a_workbook_are_what_they_are(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["Zeit", "Dauer", "Weg\n[mm]", "Kraft [kN]", 'das "alte" Rohr', "gut"])
    start = datetime(2025, 3, 4, 23, 59, 59, 980_000)
    for i in range(40):
        book.active.append(
            [start + timedelta(milliseconds=i), timedelta(milliseconds=i), i / 8, f"{i},25", '5" lang', i > 3]
        )
    book.save(tmp_path / "a.xlsx")
    units, numbers, _ = table(tmp_path / "a.xlsx")
    assert list(units) == ["Zeit", "Dauer", "Weg [mm]", "Kraft [kN]", "gut"]
    np.testing.assert_allclose(numbers["Dauer"], np.arange(40) / 1000, atol=1e-9)
    np.testing.assert_array_equal(numbers["Weg [mm]"], np.arange(40) / 8)
    np.testing.assert_array_equal(numbers["Kraft [kN]"], np.arange(40) + 0.25)
    assert numbers["gut"].sum() == 36


@pytest.mark.parametrize(
    ("suffix", "module", "group"),
    [("tdms", "nptdms", "tdms"), ("mf4", "asammdf", "mdf"), ("xlsx", "openpyxl", "xlsx"), ("unv", "pyuff", "uff")],
)
def test_a_missing_library_is_asked_for_by_its_group(tmp_path, monkeypatch, suffix, module, group):
    (tmp_path / f"a.{suffix}").write_bytes(b"x" * 100)
    (tmp_path / f"{module}.py").write_text("raise ImportError")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(contained, "_idle", [])
    with pytest.raises(InputError, match=rf"pip install 'jackbench\[{group}\]'"):
        open_foreign(tmp_path / f"a.{suffix}")
    contained._end_all()


@pytest.mark.parametrize("suffix", ["mat", "h5", "parquet", "tdms", "mf4", "xlsx", "uff", "rsp", "csv.gz"])
def test_a_broken_file_is_refused_in_one_line(tmp_path, suffix):
    module = {"tdms": "nptdms", "mf4": "asammdf", "xlsx": "openpyxl", "uff": "pyuff"}.get(suffix)
    if module and importlib.util.find_spec(module) is None:
        pytest.skip(f"{module} is not installed")
    (tmp_path / f"a.{suffix}").write_bytes(b"\x1f\x8bno such thing" * 50)
    with pytest.raises(InputError) as refused:
        table(tmp_path / f"a.{suffix}")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("cell", "name", "unit"),
    [
        ("Druck A [bar]", "Druck A", "bar"), ("Weg in mm", "Weg", "mm"), ("F / kN", "F", "kN"),
        ("p_A_bar", "p_A", "bar"), ("Beschl. (m/s²)", "Beschl.", "m/s^2"), ("u [-]", "u", "1"),
        ("Temp. (°C)", "Temp.", "degC"), ("x1_dot", "x1_dot", None), ("p_rod (gauge)", "p_rod (gauge)", None),
        ("Zeit[sek]", "Zeit", "s"), ("current [count]", "current", "count"),
    ],
)  # fmt: skip
def test_units_in_header_cells(cell, name, unit):
    assert heading_of(cell).unit == unit
    assert name_of(cell) == name


# --- clocks since 1970, and names in groups

BEGAN = 1_760_000_000  # s since 1970


@pytest.mark.parametrize(
    ("cell", "unit", "size"),
    [
        ("header.stamp [ns]", "ns", 10**9),
        ("timestamp", None, 10**9),
        ("stamp [us]", "us", 10**6),
        ("time [ms]", "ms", 10**3),
    ],
)
def test_a_clock_since_1970_is_counted_from_the_first_row(tmp_path, cell, unit, size):
    rows = (f"{BEGAN * size + round(t * size)},{u:.5f}" for t, u in zip(T, U, strict=True))
    (tmp_path / "a.csv").write_text(f"{cell},u [V]\n" + "\n".join(rows) + "\n")
    units, numbers, parts = table(tmp_path / "a.csv")
    clock = f"{name_of(cell)} [s]"
    assert units == {clock: "s", "u [V]": "V"}
    np.testing.assert_allclose(numbers[clock], T, rtol=0, atol=1e-12)
    assert any("since 1970" in note and "2025-10-09" in note for note in parts[0].notes)


def test_seconds_and_nanoseconds_are_one_clock(tmp_path):
    ns = np.round((T + 0.9) * 1e9).astype(np.int64)  # over a whole second
    rows = (f"{BEGAN + n // 10**9},{n % 10**9},{u:.5f}" for n, u in zip(ns.tolist(), U, strict=True))
    (tmp_path / "a.csv").write_text("header.stamp.sec,header.stamp.nanosec,u [V]\n" + "\n".join(rows) + "\n")
    units, numbers, _ = table(tmp_path / "a.csv")
    assert list(units) == ["header.stamp [s]", "u [V]"]
    np.testing.assert_allclose(numbers["header.stamp [s]"], T, atol=1e-9)


@pytest.mark.parametrize("cell", ["counter", "energy [J]", "t [s]"])
def test_no_other_large_number_is_a_clock(tmp_path, cell):
    values = (BEGAN + 1000 * T if cell != "t [s]" else T).tolist()
    rows = (f"{value:.6f},{u:.5f}" for value, u in zip(values, U, strict=True))
    (tmp_path / "a.csv").write_text(f"{cell},u [V]\n" + "\n".join(rows) + "\n")
    units, numbers, _ = table(tmp_path / "a.csv")
    assert list(units) == [cell, "u [V]"]
    np.testing.assert_allclose(numbers[cell], values, rtol=1e-9)


@pytest.mark.parametrize(
    ("head", "cells"),
    [
        (",,Pressures,,\nt,u,A,B,x\ns,V,bar,bar,mm\n", ["t", "u", "Pressures A", "Pressures B", "x"]),
        (",,Druck,,\nt [s],u [V],A,B,x [mm]\n", ["t [s]", "u [V]", "Druck A", "Druck B", "x [mm]"]),
        ("Bench,7,,,\nt,u,A,B,x\ns,V,bar,bar,mm\n", ["t", "u", "Bench A", "Bench B", "x"]),
        ("a,b,c,d,e\nt,u,A,B,x\ns,V,bar,bar,mm\n", ["t", "u", "A", "B", "x"]),
    ],
)
def test_a_group_s_name_goes_before_a_side_alone(tmp_path, head, cells):
    rows = zip(T, U, X, X, X, strict=True)
    (tmp_path / "a.csv").write_text(head + "".join(",".join(f"{v:.4f}" for v in row) + "\n" for row in rows))
    assert list(table(tmp_path / "a.csv")[0]) == cells


def test_the_page_names_every_suffix_that_is_read():
    page = (Path(__file__).parents[1] / "docs" / "how" / "campaign.md").read_text()
    assert set(READERS) <= set(re.findall(r"(?<= )\.[\w.]+", page))
