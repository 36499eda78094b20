"""Universal files, data set 58, in text and binary: functions of time come back by name; what is none is said."""

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.records.foreign import open_foreign

pyuff = pytest.importorskip("pyuff")
T = np.arange(400) * 1e-3
X = 50 + 20 * np.cos(30 * T)
F = np.sin(30 * T)


def function(name, data, t=T, unit="mm", **changes):
    """A data set 58 as pyuff writes it."""
    plain = {
        "type": 58, "func_type": 1, "id1": name, "rsp_node": 1, "rsp_dir": 3, "ref_node": 0, "ref_dir": 0,
        "abscissa_spacing": 1, "abscissa_spec_data_type": 17, "abscissa_axis_units_lab": "s",
        "ordinate_axis_units_lab": unit, "orddenom_spec_data_type": 0, "x": t, "data": data,
    }  # fmt: skip
    return plain | changes


def write(path, *functions, is_double=True):
    """In text."""
    pyuff.UFF(str(path)).write_sets(list(functions), "overwrite", force_double=is_double)
    return path


def write_binary(path, *functions, order="<", kind="f8"):
    """As data sets 58b: the header of text, its second line with byte order, format, lines and bytes; then numbers."""
    sets = []
    for each in functions:
        lines = write(path, each, is_double=kind == "f8").read_bytes().splitlines(keepends=True)[:13]
        values = each["data"] if each["abscissa_spacing"] else np.column_stack((each["x"], each["data"])).ravel()
        numbers = values.astype(order + kind).tobytes()
        lines[1] = b"    58b%6d%6d%12d%12d%6d%6d%12d%12d\n" % (
            1 if order == "<" else 2,
            2,
            11,
            len(numbers),
            0,
            0,
            0,
            0,
        )
        sets += [*lines, numbers, b"\n    -1\n"]
    path.write_bytes(b"".join(sets))
    return path


def read(path):
    source = open_foreign(path)
    (block,) = source.blocks
    return {heading.cell: heading.unit for heading in source.headings}, np.array(block), source.notes


@pytest.mark.parametrize("even", [0, 1])
@pytest.mark.parametrize(
    ("writer", "how", "kind"),
    [
        (write, {}, "f8"), (write, {"is_double": False}, "f4"), (write_binary, {}, "f8"),
        (write_binary, {"kind": "f4"}, "f4"), (write_binary, {"order": ">"}, "f8"),
        (write_binary, {"order": ">", "kind": "f4"}, "f4"),
    ],
)  # fmt: skip
def test_text_and_binary_of_each_order_precision_and_spacing(tmp_path, even, writer, how, kind):
    of = {"abscissa_spacing": even, "ord_data_type": 2 if kind == "f4" else 4}
    path = writer(tmp_path / "a.uff", function("Disp", X, **of), function("Force [kN]", F, unit="NONE", **of), **how)
    units, table, notes = read(path)
    assert units == {"t": "s", "Disp": "mm", "Force [kN]": "kN"}
    for back, written in zip(table, (T, X, F), strict=True):
        np.testing.assert_allclose(back, written, rtol=1e-5 if kind == "f4" else 1e-10, atol=1e-8)
    assert not notes


def test_clocks_of_their_own_and_another_unit_of_time(tmp_path):
    slow = function("Force", F[::10], 1e3 * T[::10], "kN", abscissa_axis_units_lab="ms")
    units, table, notes = read(write(tmp_path / "a.uff", function("Disp", X), slow))
    assert units == {"t": "s", "Disp": "mm", "Force": "kN", "Force, held": "kN"}
    np.testing.assert_allclose(table[2][:391], np.interp(T[:391], T[::10], F[::10]), atol=1e-9)
    assert notes == ["Force: resampled from 100 Hz to 1000 Hz, on straight lines between its samples"]


@pytest.mark.parametrize(
    ("first", "second", "cells"),
    [
        (
            {"id1": "Run 7", "rsp_ent_name": "LF Disp"},
            {"id1": "Run 7", "rsp_ent_name": "LF Force"},
            ["LF Disp", "LF Force"],
        ),
        ({"id1": "Run 7"}, {"id1": "Run 7", "rsp_dir": -4}, ["Run 7 1Z", "Run 7 1-RX"]),
        ({"id1": "NONE", "rsp_dir": 0}, {"id1": "NONE", "rsp_node": 2}, ["point 1", "point 2Z"]),
    ],
)
def test_names_are_taken_from_where_they_tell_the_functions_apart(tmp_path, first, second, cells):
    path = write(tmp_path / "a.uff", function("", X) | first, function("", F) | second)
    assert list(read(path)[0]) == ["t", *cells]


RESPONSE = function("H", X + 1j * F, func_type=4, abscissa_spec_data_type=18)


def test_what_is_no_function_of_time_is_left_out_and_said(tmp_path):
    path = write(tmp_path / "a.uff", RESPONSE, function("Disp", X), RESPONSE, function("C", F, func_type=6))
    units, _, notes = read(path)
    assert list(units) == ["t", "Disp"]
    assert notes == ["left out, no real functions of time: 2 of frequency response, 1 of coherence"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (RESPONSE, "no function of time in it, only 1 of frequency response"),
        ({"data": X + 1j * F}, "only 1 of complex numbers"),
        ({"abscissa_spec_data_type": 18}, "only 1 of abscissa other than time"),
        ({"abscissa_axis_units_lab": "Hz"}, 'a.uff: broken uff file (unit "Hz" cannot be'),
        ({"x": -T}, "a time axis that does not rise"),
    ],
)
def test_a_file_without_a_function_of_time_is_refused(tmp_path, change, said):
    path = write(tmp_path / "a.uff", function("Disp", X) | change)
    with pytest.raises(InputError) as refused:
        read(path)
    assert said in str(refused.value)
    assert str(refused.value).isprintable()


@pytest.mark.parametrize("writer", [write, write_binary])
@pytest.mark.parametrize("part", [0.3, 0.6, 0.99])
def test_a_file_cut_short_is_refused(tmp_path, writer, part):
    whole = writer(tmp_path / "whole.uff", function("Disp", X), function("F", F)).read_bytes()
    (tmp_path / "a.uff").write_bytes(whole[: round(part * len(whole))])
    with pytest.raises(InputError, match="does not end with the mark -1"):
        read(tmp_path / "a.uff")


def test_fewer_points_than_told_a_broken_set_and_no_data_set_58_are_refused(tmp_path):
    text = write(tmp_path / "a.uff", function("Disp", X)).read_text()
    (tmp_path / "b.uff").write_text(text.replace("       400         1", "       900         1"))
    with pytest.raises(InputError, match="data set 1 tells 900 points and has 400"):
        read(tmp_path / "b.uff")
    (tmp_path / "b.uff").write_text(text.replace("e", "x", 9))
    with pytest.raises(InputError, match="data set 1 cannot be read"):
        read(tmp_path / "b.uff")
    (tmp_path / "c.uff").write_text("    -1\n   164\n         1  SI units\n    -1\n")
    with pytest.raises(InputError, match="no data set 58"):
        read(tmp_path / "c.uff")
