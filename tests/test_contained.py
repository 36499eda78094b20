"""Files that end a library, fill the memory or take for ever are refused in one line; the next file is read."""

import io
import os
import signal
import time
import tracemalloc
import warnings
from pathlib import Path
from random import Random

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import reading_work
from judged_reading import bad_message
from mutants import mutated_bytes
from scipy.io import loadmat, savemat
from test_rpc import Layout, write_rpc

from workbench.base import contained as module
from workbench.base.contained import contained
from workbench.base.errors import InputError
from workbench.records.foreign import open_foreign
from workbench.records.mat import vectors
from workbench.records.table import open_table

CASES = Path(__file__).parents[1] / ".." / "shared" / "cases"
T = np.arange(60) / 1000


@pytest.fixture
def path(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parent)
    monkeypatch.setattr(module, "_idle", [])
    (tmp_path / "a.bin").write_bytes(b"x")
    yield tmp_path / "a.bin"
    module._end_all()


def test_pieces_come_in_their_order_and_what_is_printed_is_no_piece(path):
    assert list(contained(reading_work.numbers, path)) == [0, 1, 2]
    assert list(contained(reading_work.printing, path)) == ["read"]


@pytest.mark.parametrize(
    ("work", "message"),
    [
        (reading_work.ends, r"a.bin: it ends the library that reads it \(SIGSEGV\)"),
        (reading_work.fails, "a.bin: broken bin file"),
        (reading_work.takes_memory, "a.bin: to read it takes more than 3 GiB"),
        (reading_work.takes_time, "a.bin: to read it takes more than 60 s"),
    ],
)
def test_what_goes_wrong_is_one_line_and_the_next_file_is_read(path, work, message):
    with pytest.raises(InputError, match=message) as refused:
        list(contained(work, path))
    assert not bad_message(str(refused.value))
    assert list(contained(reading_work.numbers, path)) == [0, 1, 2]


def test_one_process_reads_file_after_file_and_none_answers_for_another(path):
    (first,) = contained(reading_work.process_number, path)
    assert list(contained(reading_work.process_number, path)) == [first]
    os.kill(first, signal.SIGKILL)  # as a fault that an earlier file left would
    (second,) = contained(reading_work.process_number, path)
    assert second != first
    pieces = contained(reading_work.numbers, path)
    next(pieces)
    pieces.close()  # half read: its process is not asked again
    assert next(contained(reading_work.process_number, path)) != second


def test_a_process_that_reads_ends_with_this_one(path):
    (child,) = contained(reading_work.process_number, path)
    module._end_all()
    with pytest.raises(ProcessLookupError):
        os.kill(child, 0)


def test_an_answer_has_all_digits_and_every_shape(path):
    (table, nothing, others), ((name, whole), flags, singles) = contained(reading_work.arrays, path)
    np.testing.assert_array_equal(table, np.arange(6.0).reshape(2, 3).T)
    assert (nothing.shape, nothing.dtype) == ((0, 4), np.int16)
    assert others == [True, None, 1.5, "ä\ud800"]
    assert (name, whole.tolist(), flags.tolist()) == ("x", [2**62 + 1, -1], [True])
    assert singles.dtype == np.float32
    np.testing.assert_array_equal(singles, [np.nan, np.inf])


@pytest.mark.parametrize("work", [reading_work.subverted, reading_work.objects])
def test_no_answer_is_code_whatever_a_file_makes_of_its_process(path, work):
    with pytest.raises(InputError, match=r"a.bin: it ends the library that reads it"):
        list(contained(work, path))
    assert not Path(f"{path}.made").exists()
    assert list(contained(reading_work.numbers, path)) == [0, 1, 2]


@pytest.mark.parametrize(
    "text",
    [b"[", b'{"type": "|O8", "shape": [1]}', b'{"type": "<f8", "shape": [4000000000]}', b'{"type": 3, "shape": [1]}',
     b'{"type": "<f8", "shape": [-1]}', b'{"shape": [1]}', b"[" * 100_000, b'{"type": "<f8", "shape": [2]}', b""],
)  # fmt: skip
def test_what_is_no_answer_is_none(text):
    with pytest.raises(EOFError):
        module._received(io.BufferedReader(io.BytesIO(len(text).to_bytes(8) + text + b"12345678")))


# --- the formats


def mat_bytes(compressed=False):
    buffer = io.BytesIO()
    structure = {"a": np.arange(3.0), "names": np.array(["u", "x"], object)}
    savemat(buffer, {"t": T, "x": np.cos(T), "m": np.ones((60, 2)), "structure": structure}, do_compression=compressed)
    return buffer.getvalue()


def hdf5_bytes():
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file["run/t"], file["run/x"], file["run/m"] = T, np.cos(T), np.ones((60, 3))
        file["run"].attrs["fs"] = 1000.0
    return buffer.getvalue()


def parquet_bytes():
    buffer = io.BytesIO()
    pq.write_table(pa.table({"t": T, "x [mm]": np.cos(T), "n": np.arange(60), "s": ["a"] * 60}), buffer)
    return buffer.getvalue()


def xlsx_bytes():
    openpyxl = pytest.importorskip("openpyxl")
    book, buffer = openpyxl.Workbook(), io.BytesIO()
    for row in [("t [s]", "x [mm]"), *zip(T.tolist(), np.cos(T).tolist(), strict=True)]:
        book.active.append(row)
    book.save(buffer)
    return buffer.getvalue()


def tdms_bytes():
    tdms, buffer = pytest.importorskip("nptdms"), io.BytesIO()
    with tdms.TdmsWriter(buffer) as writer:
        writer.write_segment([tdms.ChannelObject("a", "x", np.cos(T), {"wf_increment": 1e-3, "wf_start_offset": 0.0})])
    return buffer.getvalue()


def mdf_bytes(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    with warnings.catch_warnings(action="ignore"), asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(np.cos(T), T, unit="mm", name="x"), asammdf.Signal(T, T, name="y")])
        file.save(tmp_path / "good.mf4")
    return (tmp_path / "good.mf4").read_bytes()


def uff_bytes(tmp_path):
    pyuff = pytest.importorskip("pyuff")
    function = {
        "type": 58, "func_type": 1, "id1": "x", "rsp_node": 1, "rsp_dir": 3, "ref_node": 0, "ref_dir": 0,
        "abscissa_spacing": 1, "abscissa_spec_data_type": 17, "orddenom_spec_data_type": 0, "x": T, "data": np.cos(T),
    }  # fmt: skip
    pyuff.UFF(str(tmp_path / "good.uff")).write_sets([function], "overwrite")
    return (tmp_path / "good.uff").read_bytes()


def rpc_bytes(tmp_path):
    write_rpc(tmp_path / "good.rsp", Layout(), {"x": np.cos(T), "y": T}, {"x": "mm", "y": "kN"})
    return (tmp_path / "good.rsp").read_bytes()


@pytest.mark.parametrize("suffix", ["mat", "h5", "parquet", "xlsx", "tdms", "mf4", "uff", "rsp"])
def test_a_damaged_file_is_read_or_refused_in_one_line(tmp_path, suffix):
    makers = {"mat": mat_bytes, "h5": hdf5_bytes, "parquet": parquet_bytes, "xlsx": xlsx_bytes, "tdms": tdms_bytes}
    raw = (
        makers[suffix]()
        if suffix in makers
        else {"mf4": mdf_bytes, "uff": uff_bytes, "rsp": rpc_bytes}[suffix](tmp_path)
    )
    path = tmp_path / f"a.{suffix}"
    refused = 0
    for seed in range(24):
        path.write_bytes(mutated_bytes(raw, Random(seed)))
        for read in (_foreign, _strict) if suffix in ("mat", "parquet") else (_foreign,):
            message = _refusal(read, path)
            refused += bool(message)
            assert not message or not bad_message(message)
    assert refused > 0
    path.write_bytes(raw)
    assert _foreign(path) > 0


def _refusal(read, path):
    try:
        read(path)
    except InputError as error:
        return str(error)
    return ""


def _foreign(path):
    return sum(len(block[0]) for block in open_foreign(path).blocks)


def _strict(path):
    table = open_table(path)
    return table.read(table.header[:1])


@pytest.mark.parametrize("compressed", [False, True])
def test_vectors_of_a_mat_file_are_those_that_scipy_reads(tmp_path, compressed):
    variables = {
        "t": np.arange(20) * 1e-3, "column": np.arange(5.0)[:, None], "short": np.array([1, 2], np.int8),
        "single": np.arange(7, dtype=np.float32), "wide": np.array([2**60, -3]), "flags": np.array([True, False]),
        "matrix": np.ones((3, 4)), "scalar": 2.5, "complex": np.arange(3) * 1j, "text": "a text",
        "structure": {"a": np.arange(3.0)}, "cells": np.array([1.0, "b"], dtype=object), "empty": np.zeros((0, 0)),
    }  # fmt: skip
    savemat(tmp_path / "a.mat", variables, do_compression=compressed)
    read, expected = dict(vectors(tmp_path / "a.mat")), loadmat(tmp_path / "a.mat")
    assert tuple(read) == ("t", "column", "short", "single", "wide", "flags")
    for name, values in read.items():
        np.testing.assert_array_equal(values, expected[name].ravel())
        assert values.dtype == expected[name].dtype


@pytest.mark.parametrize("read", [_foreign, _strict])
def test_a_type_that_does_not_exist_in_a_mat_file_ends_no_more_than_its_reader(tmp_path, read):
    raw = bytearray(mat_bytes())
    raw[raw.index(b"\x01\x00\x01\x00t") + 8] = 110
    (tmp_path / "a.mat").write_bytes(raw)
    with pytest.raises(InputError, match=r"a.mat: .*(ends the library|broken mat)"):
        read(tmp_path / "a.mat")


@pytest.mark.parametrize("suffix", ["h5", "mat"])
def test_numbers_that_no_memory_holds_are_counted_before_they_are_read(tmp_path, suffix):
    with h5py.File(tmp_path / f"a.{suffix}", "w") as file:
        for name in "tx":
            file.create_dataset(name, (100_000_000,), "f8", chunks=(2**20,), fillvalue=1.0)
    with pytest.raises(InputError, match=r"200000000 numbers are more than 512 MiB; split it"):
        open_foreign(tmp_path / f"a.{suffix}")


def test_a_cell_far_from_the_table_of_a_workbook_costs_no_time_and_is_said(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    sheet = book.active
    for row in [("t [s]", "x [mm]", "y [mm]"), *((t, t + 1, None if t else 2.0) for t in T.tolist())]:
        sheet.append(row)
    sheet["AB7"], sheet["XFD1048576"] = 3, "stray"
    for place in range(4):
        sheet.cell(10 + place, 3, 1.0)
    book.save(tmp_path / "a.xlsx")
    began = time.process_time()
    source = open_foreign(tmp_path / "a.xlsx")
    values = np.concatenate([np.column_stack(list(block)) for block in source.blocks])
    assert time.process_time() - began < 5
    assert [heading.cell for heading in source.headings] == ["t [s]", "x [mm]", "y [mm]"]
    np.testing.assert_array_equal(values[:, 0], T)
    assert np.isfinite(values[:, 2]).sum() == 5
    assert "left out, beyond the columns of the table: 2 cells" in source.notes


@pytest.mark.skipif(not CASES.is_dir(), reason="the cases are not beside the repository")
@pytest.mark.parametrize("name", ["v5-238.mat", "a-303.mf4", "f_a_parquet-0.parquet", "fill.h5", "fill100M.h5"])
def test_hostile_files_are_refused_in_one_line(name):
    if name.endswith(".mf4"):
        pytest.importorskip("asammdf")
    tracemalloc.start()
    try:
        with pytest.raises(InputError) as refused:
            _foreign(CASES / "hostile" / name)
        assert tracemalloc.get_traced_memory()[1] < 50e6
    finally:
        tracemalloc.stop()
    assert not bad_message(str(refused.value))
