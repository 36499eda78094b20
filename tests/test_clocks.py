"""Stamps of every format give the times that were written; clocks that were changed or rounded are mended, and said."""

import json
import re
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings, strategies as st
from made_recordings import clock, columns, text

from workbench.base.errors import InputError
from workbench.cli import main
from workbench.records import load_campaign, read_record
from workbench.records.foreign import column, open_foreign, write_parts
from workbench.records.foreign.stamps import stamp_of

CASES = Path(__file__).parents[2] / "shared" / "cases" / "import"
needs_cases = pytest.mark.skipif(not CASES.is_dir(), reason="the cases are not beside the repository")
SECOND = 10**9


pytestmark = pytest.mark.usefixtures("right_columns")


def imported(tmp_path, file, name="lab"):
    assert main(["import", str(file), "--rig", "jack-10t", "--out", str(tmp_path / name)]) == 0
    return json.loads((tmp_path / name / "metrics.json").read_text())


# --- any format, rate, origin and order

TEXTS = {
    "%d.%m.%Y %H:%M:%S.%f": 6, "%m/%d/%Y %I:%M:%S.%f %p": 6, "%Y-%m-%dT%H:%M:%S.%fZ": 6, "%d-%b-%Y %H:%M:%S.%f": 6,
    "%Y-%m-%dT%H:%M:%S.%f+05:30": 6, "%Y%m%d %H%M%S.%f": 6, "%y/%m/%d %H:%M:%S.%f": 6, "%d/%m/%y %H:%M:%S.%f": 6,
    "%b %d, %Y %H:%M:%S.%f": 6, "%j:%H:%M:%S.%f": 6, "%m-%d-%Y %H:%M:%S.%f": 6, "%a, %d %b %Y %H:%M:%S.%f +0100": 6,
}  # fmt: skip
COUNTS = {  # unit in ns, and s from its epoch to 1970
    "unix": (10**9, 0), "ms": (10**6, 0), "us": (10**3, 0), "ns": (1, 0), "1904": (10**9, 24107 * 86400),
    "filetime": (100, 134774 * 86400), "ticks": (100, 719162 * 86400), "excel": (86400 * 10**9, 25569 * 86400),
    "datenum": (86400 * 10**9, 719529 * 86400),
}  # fmt: skip
MOMENTS = st.datetimes(datetime(2001, 1, 1), datetime(2035, 12, 30))
PERIODS = st.sampled_from([100, 250, 500, 1000, 2000, 4000, 5000, 10000, 50000])  # us


def written(moments, kind):
    """Cells of moments in a format of TEXTS, or in a count of COUNTS to all the digits that its writers give."""
    if kind in TEXTS:
        return [moment.strftime(kind) for moment in moments]
    unit, epoch = COUNTS[kind]
    exact = [((m - datetime(1970, 1, 1)) // timedelta(microseconds=1) * 1000 + epoch * SECOND) for m in moments]
    if unit <= 1000:
        return [str(ns // unit) for ns in exact]
    return [f"{ns // unit}.{ns % unit * 10**12 // unit:012d}" for ns in exact]


@given(MOMENTS, PERIODS, st.sampled_from([*TEXTS, *COUNTS]), st.booleans())
def test_any_stamps_give_the_times_that_were_written(tmp_path_factory, start, period, kind, near_midnight):
    if near_midnight:
        start = start.replace(hour=23, minute=59, second=59, microsecond=990000)
    if kind.startswith("%j"):
        start = start.replace(month=1 + start.month % 11, day=1)  # a day of the year alone ends with the year
    moments = [start + timedelta(microseconds=period * k) for k in range(60)]
    path = tmp_path_factory.mktemp("stamps") / "a.csv"
    rows = [f"{cell};{0.1 * k:.3f};{k}" for k, cell in enumerate(written(moments, kind))]
    path.write_text("\n".join(["Time;u [V];x [mm]", *rows]) + "\n")
    digits = {"datenum": 1.2e-5, "unix": 1e-6, "ms": 1e-6, "1904": 1e-6, "excel": 1e-6}.get(kind, 1e-9)  # of a double
    np.testing.assert_allclose(clock(path), 1e-6 * period * np.arange(60), rtol=0, atol=digits)


@settings(max_examples=25, deadline=None)
@given(MOMENTS, PERIODS, st.sampled_from(["s", "us", "ns"]), st.sampled_from([None, "UTC", "America/New_York", "text"]))
def test_parquet_stamps_of_any_unit_and_zone_give_the_times_that_were_written(
    tmp_path_factory, start, period, unit, zone
):
    path = tmp_path_factory.mktemp("stamps") / "a.parquet"
    step = 10**6 if unit == "s" else period
    moments = [start.replace(microsecond=0) + timedelta(microseconds=step * k) for k in range(60)]
    if zone == "text":
        cells = pa.array([f"{moment:%Y-%m-%d %H:%M:%S.%f}" for moment in moments])
    else:
        cells = pa.array(moments, pa.timestamp(unit)).cast(pa.timestamp(unit, zone))
    pq.write_table(pa.table({"x [mm]": np.arange(60.0), "when": cells}), path)
    np.testing.assert_allclose(clock(path), 1e-6 * step * np.arange(60), rtol=0, atol=1e-12)


def test_durations_and_times_of_day_of_parquet_are_clocks(tmp_path):
    ms = np.arange(60) * 10
    for kind in (pa.duration("ms"), pa.time32("ms"), pa.time64("us")):
        cells = pa.array(ms, pa.int32() if kind == pa.time32("ms") else pa.int64())
        cells = cells.cast(kind) if kind != pa.time64("us") else pa.array(ms * 1000).cast(kind)
        pq.write_table(pa.table({"x": np.arange(60.0), "t": cells}), tmp_path / "a.parquet")
        np.testing.assert_allclose(clock(tmp_path / "a.parquet"), 1e-3 * ms, atol=1e-12)


@pytest.mark.parametrize(
    ("cell", "day", "second"),
    [
        ("24.12.2025 17:05:09,250", (24, 12, 2025), 61509.25), ("17:05:09:250", None, 61509.25),
        ("2025-12-24T17:05:09.25+01:00", 20446, 57909.25), ("Tue Mar 11 12:00:00 2025", 20158, 43200),
        ("11. März 2025 12:00:00", 20158, 43200), ("20250311T120000.125Z", 20158, 43200.125),
        ("2025-070T12:00:00", 20158, 43200), ("0 days 00:00:01.5", 0, 1.5), ("05:36.7", None, 336.7),
        ("2025-03-11T12:00:00+01:00[Europe/Berlin]", 20158, 39600), ("2025-03-11 12:00:00 CEST", 20158, 36000),
        ("4:05:36.674 p.m.", None, 57936.674), ("25:00:00.5", None, 90000.5), ("12/11/25", (12, 11, 25), None),
    ],
)  # fmt: skip
def test_a_cell_is_read(cell, day, second):
    stamp = stamp_of(cell)
    assert stamp is not None
    assert (stamp.day, stamp.ns) == (day, None if second is None else round(second * SECOND))


@pytest.mark.parametrize(
    "cell", ["3.5", "1e5", "2025", "abc", "31.02.2025", "", None, "nan", "12-14", "120000", "20250311", "Time", "12:71"]
)
def test_what_is_no_stamp_is_none(cell):
    assert stamp_of(cell) is None


# --- the order of day and month


def stamped(path, stamps):
    path.write_text("\n".join(["Time,x [mm]", *(f"{stamp},{k}" for k, stamp in enumerate(stamps))]) + "\n")
    return path


@pytest.mark.parametrize(
    ("before", "after", "order"),
    [
        ("03/11/2025", "03/12/2025", "month, day, year"), ("11/03/2025", "12/03/2025", "day, month, year"),
        ("25/03/11", "25/03/12", "year, month, day"), ("01/31/2025", "02/01/2025", ""),
        ("31.01.2025", "01.02.2025", ""),
    ],
)  # fmt: skip
def test_the_order_of_a_date_is_the_one_in_which_the_clock_goes_on(tmp_path, before, after, order):
    rows = [f"{before} 23:59:59.{k:03d}" for k in range(980, 1000)] + [f"{after} 00:00:00.{k:03d}" for k in range(20)]
    path = stamped(tmp_path / "a.csv", rows)
    assert clock(path) == pytest.approx(1e-3 * np.arange(40), abs=1e-12)
    (part,) = write_parts(open_foreign(path), path, tmp_path, "again")
    assert any(f"are {order}: in that order the clock goes on" in note for note in part.notes) == bool(order)


def test_the_order_is_one_for_the_whole_file(tmp_path):
    """The block of 1 MiB in which the day changes settles those that come after it, in which any order would do."""
    start = datetime(2025, 1, 12, 23, 59, 30)
    rows = [(start + timedelta(milliseconds=k)).strftime("%m/%d/%Y %H:%M:%S.%f") for k in range(60000)]
    path = stamped(tmp_path / "a.csv", rows)
    assert clock(path) == pytest.approx(1e-3 * np.arange(60000), abs=1e-9)


def test_dates_in_no_one_order_are_refused_by_name(tmp_path):
    path = stamped(tmp_path / "a.csv", [f"13/01/2025 00:00:0{k}" for k in range(9)] + ["01/13/2025 00:00:09"] * 3)
    with pytest.raises(InputError, match=r'column "Time": dates such as .* are in no one order'):
        clock(path)


def test_milliseconds_beside_whole_seconds_belong_to_the_clock(tmp_path):
    rows = [f"10:00:{k // 100:02d};{k % 100 * 10};{k}" for k in range(300)]
    (tmp_path / "a.csv").write_text("\n".join(["Time;ms;x [mm]", *rows]) + "\n")
    assert clock(tmp_path / "a.csv") == pytest.approx(0.01 * np.arange(300))


def test_a_second_clock_is_left_out_by_name(tmp_path):
    start = datetime(2025, 3, 11)
    rows = [f"{start + timedelta(seconds=k)},2025-01-01 00:00:00,{k}" for k in range(30)]
    (tmp_path / "a.csv").write_text("\n".join(["Device,Started,x [mm]", *rows]) + "\n")
    assert clock(tmp_path / "a.csv") == pytest.approx(np.arange(30))
    source = open_foreign(tmp_path / "a.csv")
    assert "left out, beside the clock: Started" in source.notes


# --- clocks that were changed, rounded, uneven


def record_of(tmp_path, t, header="t [s]"):
    u = np.sin(30 * np.arange(t.size) * 1e-3)
    rows = [f"{a:.6f},{b:.5f},{100 + c:.3f}" for a, b, c in zip(t, u, 5 * u, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join([f"{header},command [1],pa [bar]", *rows]) + "\n")
    return read_record(tmp_path / "a.csv")


@pytest.mark.parametrize(("jump", "word"), [(-3600.0, "back"), (3600.0, "on")])
def test_an_hour_is_a_change_of_the_clocks(tmp_path, jump, word):
    t = 7199.5 + 1e-3 * np.arange(1000)
    record = record_of(tmp_path, t + jump * (t >= 7200))
    assert record.t == pytest.approx(t)
    assert any(f"the clock goes {word} by an hour, a change of the clocks" in note for note in record.notes)


def test_a_pause_of_another_length_stays(tmp_path):
    t = 1e-3 * np.arange(1000)
    t[500:] += 3590.0
    assert record_of(tmp_path, t).t == pytest.approx(t)


@pytest.mark.parametrize(("period", "digits"), [(1e-3, 2), (5e-4, 3), (2e-3, 1), (7e-4, 3)])
def test_stamps_that_were_rounded_until_they_repeat_are_even_again(tmp_path, period, digits):
    t = period * np.arange(3000)
    record = record_of(tmp_path, np.round(t, digits))
    assert record.t == pytest.approx(t, abs=1e-6)
    assert any(f"they agree with a row every {period:g} s" in note for note in record.notes)


def test_stamps_that_repeat_in_no_even_way_are_refused_by_name(tmp_path):
    with pytest.raises(InputError, match=r'in column "t \[s\]" are missing, repeat or run backwards'):
        record_of(tmp_path, np.repeat(np.cumsum(np.tile([0.01, 0.01, 0.01, 1.0], 50)), 3))


def test_rows_at_no_even_pace_stay_as_they_are_recorded(tmp_path):
    t = 1e-3 * np.cumsum(np.random.default_rng(1).integers(18, 54, 300))
    record = record_of(tmp_path, t)
    assert record.t == pytest.approx(t, abs=1e-9)
    assert any(re.search(r"no period; rows come 1[89].* to 5[0-3].* ms apart", note) for note in record.notes)


# --- clocks that say no unit, and cells that cannot be read


@pytest.mark.parametrize(
    ("period", "unit"),
    [(0.001, "s"), (0.05, "s"), (0.0500001, "s"), (1.0, "ms"), (0.5, "ms"), (1000.0, "us"), (1e6, "ns")],
)
def test_a_clock_without_a_unit_is_held_against_the_rig_s_period(tmp_path, period, unit):
    table = columns("steps", {"t": "s", "command": "1", "pa": "bar", "position": "mm"}, rows=1500)
    table["t"] = period * np.arange(1500)
    (tmp_path / "a.csv").write_text(text(["t,u [-],pa [bar],x [mm]"], list(table.values())))
    assert imported(tmp_path, tmp_path / "a.csv")["signals"]["t"]["unit"] == unit


def test_of_two_clocks_that_are_as_clear_the_first_is_taken(tmp_path):
    table = columns("steps", {"t": "s", "command": "1", "pa": "bar", "position": "mm"}, rows=1500)
    rows = text([], list(table.values())).strip().splitlines()
    rows = [f"2025-03-11 10:00:00.{k % 1000:03d},{row}" if k < 1000 else f"2025-03-11 10:00:01.{k % 1000:03d},{row}"
            for k, row in enumerate(rows)]  # fmt: skip
    (tmp_path / "a.csv").write_text("\n".join(["Timestamp,Time [s],u [-],pa [bar],x [mm]", *rows]) + "\n")
    metrics = imported(tmp_path, tmp_path / "a.csv")
    assert metrics["ready"]
    assert metrics["signals"]["t"]["column"] == "Timestamp"
    assert metrics["left_out"]["Time [s]"].startswith("t = {")


def test_a_clock_that_cannot_be_read_is_said_with_its_form(tmp_path, capsys):
    table = columns("steps", {"command": "1", "pa": "bar", "position": "mm"}, rows=300)
    rows = text([], list(table.values())).strip().splitlines()
    rows = [f"{12 + k // 60}h{k % 60}min,{row}" for k, row in enumerate(rows)]
    (tmp_path / "a.csv").write_text("\n".join(["Zeit,u [-],pa [bar],x [mm]", *rows]) + "\n")
    metrics = imported(tmp_path, tmp_path / "a.csv")
    said = 'no column is read as a clock: left out, no numbers: Zeit ("12h0min")'
    assert metrics["problem"].startswith(said)
    assert said in capsys.readouterr().out


# --- the cases


@needs_cases
@pytest.mark.parametrize(
    "name",
    ["us_midnight_ambiguous.csv", "us_long.csv.gz", "iso_offset.csv", "tz_column.parquet", "filetime.csv",
     "excel_serial.csv", "dst_back.csv"],
)  # fmt: skip
def test_the_cases_of_stamps_have_rows_of_a_millisecond(tmp_path, name):
    metrics = imported(tmp_path, CASES / name)
    assert metrics["ready"]
    assert set(metrics["signals"]) == {"t", "command", "position", "pa", "pb"}
    (part,) = metrics["files"]
    mapping = load_campaign(tmp_path / "lab")
    rows = sorted((record for record in mapping.records), key=lambda record: record.t[0])
    assert rows[0].t[0] == pytest.approx(0.0)
    assert rows[-1].t[-1] == pytest.approx(1e-3 * (part["rows"] - 1), abs=2e-6)
    assert all(np.diff(record.t) == pytest.approx(1e-3, abs=2e-6) for record in rows)
    assert ("a change of the clocks" in " ".join(metrics["mended"])) == (name == "dst_back.csv")


@needs_cases
@pytest.mark.parametrize(
    ("name", "first", "last", "tolerance"),
    [("start_times.tdms", 0.35, 2.999, 0.0), ("start_times_same_length.tdms", 0.35, 2.649, 0.0),
     ("late_group.mf4", 0.7, 2.99, 2.0), ("many_repeats.mf4", 0.0, 2.995, 1.0), ("datetime.xlsx", 0.0, 1.499, 0.0),
     ("stamp_tabs.txt", 0.0, 1.499, 0.0)],
)  # fmt: skip
def test_the_cases_of_clocks_have_every_value_at_its_time(tmp_path, name, first, last, tolerance):
    """Against the record that they were made of; what was logged more coarsely is off by what a line is from it, mm."""
    assert imported(tmp_path, CASES / name)["ready"]
    true = pq.read_table(CASES / "tz_column.parquet").to_pandas()
    records = load_campaign(tmp_path / "lab").records
    assert min(record.t[0] for record in records) == pytest.approx(first, abs=1e-6)
    assert max(record.t[-1] for record in records) == pytest.approx(last, abs=1e-6)
    for record in records:
        rows = np.rint(record.t / 1e-3).astype(int)
        assert record.t == pytest.approx(rows * 1e-3, abs=1e-5)
        for signal, cell, unit in (("command", "Command", 1.0), ("pa", "pA (bar)", 1e5), ("pb", "pB (bar)", 1e5)):
            assert record.signals[signal] == pytest.approx(unit * true[cell].to_numpy()[rows], abs=1e-6 * unit)
        assert record.signals["position"] == pytest.approx(
            1e-3 * true["Position (mm)"].to_numpy()[rows], abs=1e-3 * tolerance + 1e-8
        )


# --- held or drawn


@needs_cases
def test_a_command_logged_on_change_is_held_and_its_line_says_how_to_draw_it(tmp_path):
    metrics = imported(tmp_path, CASES / "events.mf4")
    true = pq.read_table(CASES / "tz_column.parquet").to_pandas()["Command"].to_numpy()
    assert {row["column"]: row["between"] for row in metrics["columns"]}["Command"] == "held"
    edges, values = np.array([0, 100, 900, 2900]), true[[0, 100, 900, 2900]]
    held = values[np.searchsorted(edges, np.arange(3000), side="right") - 1]
    (file,) = metrics["files"]
    written = (tmp_path / "lab" / "campaign.toml").read_text()
    line = 'command = {column = "Command", unit = "1", between = "held"}'
    assert line in written
    for way, expected in (("held", held), ("linear", np.interp(np.arange(2901), edges, values))):
        (tmp_path / "lab" / "campaign.toml").write_text(written.replace('between = "held"', f'between = "{way}"'))
        records = load_campaign(tmp_path / "lab").records
        for record in records:
            rows = np.rint(record.t / 1e-3).astype(int)
            assert record.signals["command"] == pytest.approx(expected[rows], abs=1e-9)
        assert max(record.t[-1] for record in records) == pytest.approx(1e-3 * (expected.size - 1))
    assert file["file"] == "events.parquet"


def test_what_goes_between_samples_is_told_by_name_by_numbers_and_by_clock(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    t, slow = np.arange(400) * 1e-3, np.arange(40) * 1e-2
    events = np.array([0.0, 0.013, 0.15, 0.16, 0.39])
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(np.sin(30 * t), t, unit="bar", name="pA")])
        drive = [("Ventil Soll", np.sin(30 * slow)), ("Zustand", np.arange(40) % 3), ("Kraft", np.cos(30 * slow))]
        file.append([asammdf.Signal(values.astype(float), slow, unit="", name=name) for name, values in drive])
        file.append([asammdf.Signal(np.linspace(0.0, 0.7, 5), events, unit="", name="Marke")])
        file.save(tmp_path / "a.mf4")
    source = open_foreign(tmp_path / "a.mf4")
    ways = {heading.cell: heading.between for heading in source.headings if "," not in heading.cell}
    assert ways == {"t": None, "pA": None, "Ventil Soll": "held", "Zustand": "held", "Kraft": "linear", "Marke": "held"}


def test_empty_cells_between_samples_are_filled_as_the_campaign_says(tmp_path):
    rows = [f"{k / 1000},{0.1 * k if k % 5 == 0 else ''},{k if k % 5 == 0 else ''}" for k in range(101)]
    (tmp_path / "a.csv").write_text("\n".join(["t [s],command [1],pa [bar]", *rows]) + "\n")
    with pytest.raises(InputError, match="cells are empty"):
        read_record(tmp_path / "a.csv")
    text = 'rig = "jack-10t"\n[records]\nheldout = ["a.csv"]\n[signals]\n'
    text += 'command = {scale = 1.0, between = "held"}\npa = {between = "linear"}\n'
    (tmp_path / "campaign.toml").write_text(text)
    (record,) = load_campaign(tmp_path).heldout
    k = np.arange(101)
    assert record.signals["command"] == pytest.approx(0.5 * (k // 5))
    assert record.signals["pa"] == pytest.approx(1e5 * k)
    assert record.valid["pa"].all()


def test_groups_without_a_date_beside_one_with_it_are_said(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    dated = {"wf_start_time": np.datetime64("2025-03-11T10:00:00.25"), "wf_increment": 1e-3}
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        channels = [("A", "Weg", np.arange(50.0), dated), ("B", "Kraft", np.arange(40.0) + 0.5, {"wf_increment": 1e-3})]
        writer.write_segment([nptdms.ChannelObject(*channel) for channel in channels])
    notes = open_foreign(tmp_path / "a.tdms").notes
    assert "B: no date beside A; taken to begin with it" in notes


TRACER = CASES.parents[1] / "data" / "mts_press" / "tracerdaq_head.txt"


@pytest.mark.skipif(not TRACER.is_file(), reason="measured data is not beside the repository")
def test_the_first_lines_of_a_tracerdaq_file_keep_their_header(tmp_path):
    source = open_foreign(TRACER)
    assert [heading.cell for heading in source.headings] == [
        "Sample Number", "Date/Time", "CHANNEL0", "CHANNEL1", "CHANNEL2",
    ]  # fmt: skip
    (part,) = write_parts(source, TRACER, tmp_path, "a")
    assert part.rows == 1993
    assert column(tmp_path / part.file, "Date/Time") == pytest.approx(1e-3 * np.arange(1993))
    assert column(tmp_path / part.file, "CHANNEL0")[0] == -0.0209
