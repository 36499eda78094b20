"""Records: what is read is what was logged, in SI; blemishes are mended and said, or refused by place."""

import gzip
import time
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings, strategies as st
from scipy.io import savemat

from workbench.base.errors import InputError
from workbench.records import ColumnMap, Record, block_mean, read_record, write_csv, write_parquet

SHARED = Path(__file__).parents[2] / "shared"
FESTO = SHARED / "data" / "festo_tp511"
needs_festo = pytest.mark.skipif(not FESTO.is_dir(), reason="no recordings of the Festo rig here")

HEADER = "t [s],command [1],pa [bar]"


def rows(count=20):
    return [f"{k / 1000:.3f},{0.01 * k:g},{100 + k}" for k in range(count)]


def csv(folder, lines, header=HEADER, name="a.csv"):
    path = folder / name
    path.write_text("\n".join([header, *lines]) + "\n")
    return path


def a_record(count=50):
    t = np.arange(count) * 1e-3
    signals = {"command": np.sin(t), "position": 0.1 * t, "pa": 1e5 * (1.0 + t)}
    return Record("a", t, signals, {"pa": np.arange(count) != 7})


# what is read


def test_units_come_from_the_header_and_end_in_si(tmp_path):
    lines = [f"{k},{k},{k},{k},{k},{k}" for k in range(12)]
    header = "position [mm],pa [psi],t [ms],command [%],current [mA],acceleration [m/s2]"
    record = read_record(csv(tmp_path, lines, header))
    k = np.arange(12.0)
    assert record.t == pytest.approx(k * 1e-3)
    assert record.signals["command"] == pytest.approx(k / 100)
    assert record.signals["position"] == pytest.approx(k * 1e-3)
    assert record.signals["pa"] == pytest.approx(k * 6894.757293)
    assert record.signals["current"] == pytest.approx(k * 1e-3)
    assert record.signals["acceleration"] == pytest.approx(k)
    assert record.notes == ()
    assert record.name == "a"
    assert record.period == pytest.approx(1e-3)


def test_columns_come_in_any_order_and_unknown_ones_are_noted_even_when_they_hold_text(tmp_path):
    lines = [f"ok,{k},{k / 1000},{k / 100}" for k in range(12)]
    record = read_record(csv(tmp_path, lines, "remark,oil [degC],t [s],command [1]"))
    assert record.names == ("command",)
    assert record.notes == ('a.csv: not used: "remark", "oil [degC]"',)


def test_scale_turns_a_foreign_unit_into_si_and_a_fitting_one_by_a_factor(tmp_path):
    path = csv(tmp_path, [f"{k},{k},{k},{k}" for k in range(12)], "t [s],u [V],x [V],pa [bar]")
    mapping = {
        "command": ColumnMap("u [V]", scale=0.1),
        "position": ColumnMap("x", unit="V", scale=0.02),
        "pa": ColumnMap(scale=-1.0),
    }
    record = read_record(path, mapping)
    assert record.signals["command"][10] == pytest.approx(1.0)
    assert record.signals["position"][10] == pytest.approx(0.2)
    assert record.signals["pa"][10] == pytest.approx(-1e6)


def test_a_mapped_unit_overrules_the_header(tmp_path):
    record = read_record(csv(tmp_path, rows()), {"pa": ColumnMap("pa [bar]", unit="MPa")})
    assert record.signals["pa"][0] == pytest.approx(100e6)


def test_clipped_samples_are_kept_and_not_compared(tmp_path):
    record = read_record(csv(tmp_path, rows()), {"pa": ColumnMap(clip=(100.0, 118.0))})
    assert record.valid["pa"].tolist() == [False, *[True] * 17, False, False]
    assert record.signals["pa"][0] == pytest.approx(100e5)


def test_a_slice_is_half_open(tmp_path):
    record = read_record(csv(tmp_path, rows(40)), start=0.010, stop=0.030)
    assert record.t == pytest.approx(np.arange(10, 30) * 1e-3)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_line_ends_byte_order_marks_and_blank_lines_do_not_matter(tmp_path, end):
    lines = rows()
    lines.insert(3, "")
    path = tmp_path / "a.csv"
    path.write_bytes(b"\xef\xbb\xbf" + end.join([HEADER, *lines, "  ", ""]).encode())
    assert read_record(path).t.size == 20
    lines[5] = lines[5].replace("104", "x")
    path.write_bytes(end.join([HEADER, *lines]).encode())
    with pytest.raises(InputError, match='row 7, column "pa \\[bar\\]": "x" is not a number'):
        read_record(path)


@pytest.mark.parametrize("name", ["a.csv", "a.csv.gz", "a.parquet"])
def test_what_is_written_reads_back(tmp_path, name):
    record = a_record()
    (write_parquet if name.endswith("parquet") else write_csv)(record, tmp_path / name)
    again = read_record(tmp_path / name)
    assert set(again.names) == set(record.names)
    for signal, values in record.signals.items():
        assert again.valid[signal].tolist() == record.valid[signal].tolist()
        assert again.signals[signal] == pytest.approx(values, rel=1e-9)
    assert again.t == pytest.approx(record.t)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(-1e6, 1e6).map(lambda x: round(x, 30)), min_size=10, max_size=40), st.floats(1e-4, 0.1))
def test_any_numbers_survive_a_csv_file(tmp_path_factory, values, period):
    path = tmp_path_factory.mktemp("csv") / "a.csv"
    record = Record("a", period * np.arange(len(values)), {"command": np.zeros(len(values)), "force": np.array(values)})
    write_csv(record, path)
    assert read_record(path).signals["force"] == pytest.approx(record.signals["force"], rel=1e-9, abs=1e-12)


def test_the_same_record_writes_the_same_bytes(tmp_path):
    for name in ("a.csv.gz", "b.csv.gz"):
        write_csv(a_record(), tmp_path / name)
    assert (tmp_path / "a.csv.gz").read_bytes() == (tmp_path / "b.csv.gz").read_bytes()


def test_matlab_files_of_both_kinds_read_alike(tmp_path):
    t = np.arange(30) * 1e-3
    table = {"t": t, "u": 10 * np.sin(t), "p": 1.0 + t}
    savemat(
        tmp_path / "five.mat", {name: values[:, None] for name, values in table.items()} | {"setup": "rig 1", "n": 3}
    )
    with h5py.File(tmp_path / "seven.mat", "w", userblock_size=512) as file:
        for name, values in table.items():
            file[name] = values[None, :]
    mapping = {"command": ColumnMap("u", "V", 0.1), "pa": ColumnMap("p", "MPa")}
    five, seven = (read_record(tmp_path / name, mapping) for name in ("five.mat", "seven.mat"))
    for record in (five, seven):
        assert record.t == pytest.approx(t)
        assert record.signals["command"] == pytest.approx(np.sin(t))
        assert record.signals["pa"] == pytest.approx(1e6 * (1.0 + t))


def test_a_long_file_reads_fast(tmp_path):
    values = np.random.default_rng(1).normal(size=(20000, 8))
    names = ("command", "current", "spool", "pa", "pb", "position", "acceleration", "force")
    write_csv(Record("a", np.arange(20000) * 1e-3, dict(zip(names, values.T, strict=True))), tmp_path / "a.csv")
    read_record(tmp_path / "a.csv")
    spent = []
    for _ in range(3):
        start = time.process_time()
        read_record(tmp_path / "a.csv")
        spent.append(time.process_time() - start)
    assert min(spent) < 0.2


# what is mended


def test_empty_measured_cells_are_filled_and_not_compared(tmp_path):
    lines = rows()
    lines[4] = "0.004,0.04,NaN"
    lines[9] = "0.009,0.09,"
    record = read_record(csv(tmp_path, lines))
    assert np.flatnonzero(~record.valid["pa"]).tolist() == [4, 9]
    assert record.signals["pa"][4] == pytest.approx(104e5)
    assert record.notes == ('a.csv: column "pa [bar]", rows 6, 11: empty, not compared',)


def test_an_empty_command_is_held_and_before_the_first_one_there_is_no_record(tmp_path):
    lines = rows()
    lines[0] = "0.000,,100"
    lines[5] = "0.005,nan,105"
    record = read_record(csv(tmp_path, lines))
    assert record.t[0] == pytest.approx(0.001)
    assert record.signals["command"][4] == record.signals["command"][3] == pytest.approx(0.04)
    assert record.notes == (
        'a.csv: row 2 left out: no command in column "command [1]" yet',
        'a.csv: column "command [1]", row 7: empty, held',
    )


def test_dropped_samples_leave_a_gap_and_are_noted(tmp_path):
    lines = rows()
    del lines[5:7]
    record = read_record(csv(tmp_path, lines))
    assert record.t.size == 18
    assert record.notes == ("a.csv: 2 samples dropped before row 7; the command is held there",)


def test_a_jittering_clock_is_kept_as_recorded_and_noted(tmp_path):
    t = np.arange(40) * 1e-3 + 1e-4 * (np.arange(40) % 2)
    record = read_record(csv(tmp_path, [f"{value:.6f},0,100" for value in t]))
    assert record.t == pytest.approx(t)
    assert "jitters by up to" in record.notes[0]


@pytest.mark.parametrize(
    ("low", "says"),
    [(-0.1, ()), (-0.9, ("if it is gauge pressure, add its 1.013 bar",)), (-3, ("put its zero right",))],
)
def test_a_pressure_below_none_is_noted_with_what_to_do(tmp_path, low, says):
    lines = [*rows(), f"0.02,0,{low}"]
    notes = read_record(csv(tmp_path, lines)).notes
    assert len(notes) == len(says)
    for note, said in zip(notes, says, strict=True):
        assert f'a.csv: column "pa [bar]" goes down to {low:g} bar, and pressures are absolute; {said}' in note
        assert "under [signals.pa]" in note


def test_a_few_bad_time_stamps_lose_their_rows_and_many_are_refused(tmp_path):
    lines = rows(400)
    lines[100] = lines[99]
    lines[200] = "0.150,0,0"
    lines[300] = ",0,0"
    record = read_record(csv(tmp_path, lines))
    assert record.t.size == 397
    assert record.notes[0].startswith("a.csv: rows 102, 202, 302 left out: 3 of 400 time stamps")
    with pytest.raises(InputError, match=r"a\.csv: row 3: .* repeat or run backwards"):
        read_record(csv(tmp_path, [f"{(k // 2) ** 2},0,{k}" for k in range(40)]))


# what is refused


@pytest.mark.parametrize(
    ("header", "lines", "message"),
    [
        ("", [], "the file is empty"),
        (HEADER, [], "a header but no rows"),
        (HEADER, rows(3), "only 3 rows"),
        ("time,command [1]", ["0,0"] * 20, 'no column "t [s]"'),
        ("t [s],pa [bar]", ["0,0"] * 20, "the command is the model's input"),
        ("t [s];command [1]", ["0;0"] * 20, "not separated by commas"),
        ("t [s],command [1],pa", rows(), 'column "pa": no unit; write "pa [bar]"'),
        ("t [s],command [1],pa [mm]", rows(), 'column "pa [mm]": unit "mm" is not one of pa'),
        ("t [s],command [1],pa [barr]", rows(), 'column "pa [barr]": unknown unit "barr"'),
        ("t [s],command [1],command [%]", rows(), '"command [1]", "command [%]" are all "command"'),
        (HEADER, [*rows(), "0.020,0.2"], "row 22: 2 cells under a header of 3"),
        (HEADER, [*rows(), "0.020,0.2,abc"], 'row 22, column "pa [bar]": "abc" is not a number'),
        (HEADER, [*rows(), "0.020,1_0,1"], 'row 22, column "command [1]": "1_0" is not a number'),
        (HEADER, [*rows(), "0.020,inf,1"], 'row 22, column "command [1]": infinite'),
        (HEADER, [*rows(), "inf,0,1"], 'row 22, column "t [s]": infinite'),
        (HEADER, [line.rsplit(",", 1)[0] + "," for line in rows()], 'column "pa [bar]": every cell is empty'),
        (HEADER, rows(8) + [f"{k},0,nan" for k in range(1, 5)], "4 of 12 cells are empty, the first in row 10"),
    ],
)
def test_a_bad_table_is_refused_in_one_line_that_says_where(tmp_path, header, lines, message):
    path = csv(tmp_path, lines, header) if header else tmp_path / "a.csv"
    path.touch()
    with pytest.raises(InputError) as caught:
        read_record(path)
    assert message in str(caught.value)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.csv.gz", gzip.compress(b"t [s],command [1]\n" + b"0,0\n" * 999, mtime=0)[:-9], "broken or truncated gzip"),
        ("a.csv.gz", b"t [s],command [1]\n0,0\n", "broken or truncated gzip"),
        ("a.csv", b"t [s],command [1],\xb5 [1]\n0,0,0\n", "row 1: the header is not UTF-8"),
        ("a.csv", b'"t\n[s]",command [1]\n0,0\n', "row 1: a cell in quotes goes on in the next line"),
        ("a.parquet", b"PAR1 and no more", "broken parquet"),
        ("a.mat", b"MATLAB 5.0 MAT-file" + b" " * 600, "broken mat"),
        ("a.mat", b" " * 512 + b"\x89HDF and no more", "broken mat"),
        ("a.mat", b"x", "broken mat"),
        ("a.xls", b"x", "not a known kind of record"),
    ],
)
def test_a_broken_file_is_refused(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=message) as caught:
        read_record(tmp_path / name)
    assert "\n" not in str(caught.value)


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"b\.csv: no such file"):
        read_record(tmp_path / "b.csv")
    with pytest.raises(InputError, match="is a folder"):
        read_record(tmp_path)


def test_text_in_a_parquet_column_and_unequal_matlab_vectors_are_refused(tmp_path):
    pq.write_table(pa.table({"t [s]": np.arange(20.0), "command [1]": ["0"] * 20}), tmp_path / "a.parquet")
    with pytest.raises(InputError, match='column "command \\[1\\]": holds string'):
        read_record(tmp_path / "a.parquet")
    savemat(tmp_path / "a.mat", {"t": np.arange(20.0), "u": np.zeros(19)})
    with pytest.raises(InputError, match='variable "u": 19 samples but 20 in "t"'):
        read_record(tmp_path / "a.mat", {"command": ColumnMap("u", "1")})


def test_a_slice_without_rows_says_how_long_the_record_is(tmp_path):
    with pytest.raises(InputError, match=r"the record runs from 0 to 0\.019 s"):
        read_record(csv(tmp_path, rows()), start=1.0)


def test_a_record_is_consistent_or_not_made():
    record = a_record()
    with pytest.raises(ValueError, match="strictly increasing"):
        replace(record, t=record.t[::-1])
    with pytest.raises(ValueError, match="50 samples"):
        replace(record, signals={"command": np.zeros(3)}, valid={})
    with pytest.raises(ValueError, match="finite"):
        replace(record, signals={"command": np.full(50, np.nan)}, valid={})
    with pytest.raises(ValueError, match="read-only"):
        record.t[0] = 1.0


# means over blocks


def test_block_means_keep_the_command_of_their_first_row_and_forget_no_invalid_sample():
    record = a_record(55)
    mean = block_mean(record, 10)
    assert mean.t == pytest.approx(record.t[:50:10])
    assert mean.signals["command"] == pytest.approx(record.signals["command"][:50:10])
    assert mean.signals["position"][1] == pytest.approx(record.signals["position"][10:20].mean())
    assert mean.valid["pa"].tolist() == [False, True, True, True, True]


RAW = {
    "command": ColumnMap("w_verdadero2", "V", 0.1),
    "position": ColumnMap("poloha_bez_filtr2", "V", 0.02),
    "pa": ColumnMap("pressure_bez_filtr1", "MPa"),
}


@needs_festo
def test_the_raw_matlab_file_holds_what_the_csv_says():
    raw = block_mean(read_record(FESTO / "raw_pa_3V_01.mat", RAW), 10)
    printed = read_record(FESTO / "pa_3V_01.csv.gz", {"command": ColumnMap("command [V]", scale=0.1)})
    assert raw.t == pytest.approx(printed.t)
    assert raw.signals["command"] == pytest.approx(printed.signals["command"])
    for name in ("position", "pa"):  # five digits are printed
        assert raw.signals[name] == pytest.approx(printed.signals[name], rel=0.51e-4)
