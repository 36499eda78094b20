"""Stamps in MATLAB, HDF5 and Parquet files, in one column or two, and counts of more digits than a double has."""

from datetime import datetime, timedelta

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from made_recordings import clock
from scipy.io import savemat

from workbench.records.foreign import column, open_foreign, write_parts

SECOND = 10**9
EARLY = datetime(2025, 3, 11, 23, 59, 59, 950000)
STEPS = np.arange(100) * 1_000_000  # ns


def stamp_cells(*forms):
    """Cells of each form, a row every ms; midnight is between them."""
    moments = [EARLY + timedelta(milliseconds=k) for k in range(100)]
    return [[moment.strftime(form) for moment in moments] for form in forms]


def saved_mat(path, tree):
    savemat(path, {name: np.array(part, object) if isinstance(part, list) else part for name, part in tree.items()})


def saved_hdf5(path, tree):
    with h5py.File(path, "w") as file:
        for name, part in tree.items():
            file[name] = part


SAVED = pytest.mark.parametrize(("save", "suffix"), [(saved_mat, "mat"), (saved_hdf5, "h5")])


def chars(path, tree):
    """Text as a matrix of characters, one row a line."""
    savemat(path, {name: np.array(part) if isinstance(part, list) else part for name, part in tree.items()})


def table_73(path, tree):
    """A compound data set, as of PyTables: text is of bytes."""
    columns = {name: np.array(part, "S") if isinstance(part, list) else part for name, part in tree.items()}
    table = np.empty(100, [(name, part.dtype) for name, part in columns.items()])
    for name, part in columns.items():
        table[name] = part
    with h5py.File(path, "w") as file:
        file["table"] = table


def cell_table(path, tree):
    """A table in cells, with its header."""
    columns = [
        np.array([name, *(part if isinstance(part, list) else part.tolist())], object) for name, part in tree.items()
    ]
    savemat(path, {"table": np.array(columns, object).T})


@pytest.mark.parametrize(
    ("save", "suffix"),
    [
        (saved_mat, "mat"),
        (chars, "mat"),
        (cell_table, "mat"),
        (saved_hdf5, "h5"),
        (saved_hdf5, "mat"),
        (table_73, "h5"),
    ],
)
@pytest.mark.parametrize(
    "forms",
    [("%Y-%m-%d %H:%M:%S.%f",), ("%d.%m.%Y", "%H:%M:%S.%f"), ("%m/%d/%Y %I:%M:%S.%f %p",), ("%H:%M:%S.%f",)],
)
def test_stamps_as_text_in_matlab_and_hdf5_files_are_clocks(tmp_path, save, suffix, forms):
    cells = dict(zip(("when", "daytime"), stamp_cells(*forms), strict=False))
    save(tmp_path / f"a.{suffix}", {**cells, "x": np.arange(100.0) ** 2})
    np.testing.assert_allclose(clock(tmp_path / f"a.{suffix}"), 1e-9 * STEPS, atol=1e-12)
    source = open_foreign(tmp_path / f"a.{suffix}")
    assert len(source.headings) == 2
    assert any("read as seconds from the first row" in note for note in source.notes)


@SAVED
@pytest.mark.parametrize("name", ["t", "timestamp", "utc_ns"])
@pytest.mark.parametrize("unit", [1, 100, 1000])
def test_whole_counts_of_matlab_and_hdf5_files_lose_no_digit(tmp_path, save, suffix, name, unit):
    """A double of ns since 1970 is 256 ns apart from the next; of 100 ns since 1601, 1600 ns."""
    epoch = 134774 * 86400 * SECOND if unit == 100 else 0
    ns = 1_741_737_599_950_000_100 + 7_900 * np.arange(100)
    save(tmp_path / f"a.{suffix}", {name: (ns // unit + epoch // unit).astype(np.int64), "x": np.arange(100.0) ** 2})
    expected = unit * (ns // unit - ns[0] // unit)
    np.testing.assert_allclose(clock(tmp_path / f"a.{suffix}"), 1e-9 * expected, rtol=0, atol=1e-13)


def test_groups_with_stamps_of_their_own_lie_where_these_say(tmp_path):
    """Text in one, counts in the other, of another length: it begins 20 ms later."""
    (cells,) = stamp_cells("%Y-%m-%d %H:%M:%S.%f")
    start = (EARLY - datetime(1970, 1, 1)) // timedelta(microseconds=1) * 1000 + 20_000_000
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["a/when"], file["a/x"] = cells, np.arange(100.0) ** 2
        file["b/timestamp"], file["b/y"] = start + 2_000_000 * np.arange(40), 20.5 + 2.0 * np.arange(40)
    source = open_foreign(tmp_path / "a.h5")
    (part,) = write_parts(source, tmp_path / "a.h5", tmp_path, "made")
    y = column(tmp_path / part.file, next(h.cell for h in part.headings if h.cell.startswith("b.y")))
    assert np.flatnonzero(np.isfinite(y)).tolist() == list(range(20, 99))
    assert y[20:99] == pytest.approx(20.5 + np.arange(79))


def test_a_time_series_with_a_clock_of_counts_or_text_has_it(tmp_path):
    (cells,) = stamp_cells("%Y-%m-%d %H:%M:%S.%f")
    for when in (np.array(cells, object), 1_741_737_599_950_000_100 + STEPS):
        savemat(tmp_path / "a.mat", {"weg": {"time": when, "data": np.arange(100.0)}})
        np.testing.assert_allclose(clock(tmp_path / "a.mat"), 1e-9 * STEPS, atol=1e-12)


@pytest.mark.parametrize("date", ["text", "date32", "timestamp"])
@pytest.mark.parametrize("time", ["text", "time32", "time64"])
def test_a_date_beside_a_time_of_day_in_parquet_is_one_clock(tmp_path, date, time):
    moments = [EARLY + timedelta(milliseconds=k) for k in range(100)]
    days, times = [m.date() for m in moments], [m.time() for m in moments]
    dates = {
        "text": lambda: pa.array([f"{day:%d.%m.%Y}" for day in days]), "date32": lambda: pa.array(days, pa.date32()),
        "timestamp": lambda: pa.array(days, pa.date32()).cast(pa.timestamp("us")),
    }  # fmt: skip
    daytimes = {
        "text": lambda: pa.array([f"{t:%H:%M:%S.%f}" for t in times]),
        "time32": lambda: pa.array(times, pa.time32("ms")), "time64": lambda: pa.array(times, pa.time64("us")),
    }  # fmt: skip
    table = {"Zeit": daytimes[time](), "x": np.arange(100.0) ** 2, "Datum": dates[date]()}
    pq.write_table(pa.table(table), tmp_path / "a.parquet")
    np.testing.assert_allclose(clock(tmp_path / "a.parquet"), 1e-9 * STEPS, atol=1e-12)
    assert len(open_foreign(tmp_path / "a.parquet").headings) == 2


def test_a_time_of_day_alone_goes_on_over_midnight(tmp_path):
    times = [(EARLY + timedelta(milliseconds=k)).time() for k in range(100)]
    pq.write_table(pa.table({"t": pa.array(times, pa.time64("us")), "x": np.arange(100.0)}), tmp_path / "a.parquet")
    np.testing.assert_allclose(clock(tmp_path / "a.parquet"), 1e-9 * STEPS, atol=1e-12)


def test_text_that_is_no_stamp_names_the_numbers_beside_it(tmp_path):
    saved_mat(
        tmp_path / "a.mat",
        {"labels": ["u", "x"], "m": np.random.default_rng(1).random((50, 2)), "t": STEPS[:50] * 1e-9},
    )
    assert [heading.cell for heading in open_foreign(tmp_path / "a.mat").headings] == ["u", "x", "t"]


def test_the_day_of_a_recording_and_its_beginning_and_end_are_no_clocks(tmp_path):
    t, x = 1e-3 * np.arange(100), np.arange(100.0) ** 2
    day = pa.array([EARLY.date()] * 100, pa.date32())
    pq.write_table(pa.table({"day": day, "t [s]": t, "x": x}), tmp_path / "a.parquet")
    saved_mat(tmp_path / "a.mat", {"span": ["2025-03-11 10:00:00", "2025-03-11 11:00:00"], "fs": 1000.0, "x": x})
    for path in (tmp_path / "a.parquet", tmp_path / "a.mat"):
        assert clock(path) == pytest.approx(t)
