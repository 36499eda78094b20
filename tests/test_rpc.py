"""RPC III time histories of any layout come back as written, with names, units and one clock; others are refused."""

import json
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, strategies as st
from made_recordings import columns

from workbench.base.errors import InputError
from workbench.cli import main
from workbench.records.foreign import open_foreign

ORDERS = {"BINARY": "<", "BINARY_IEEE_LITTLE_END": "<", "BINARY_IEEE_BIG_END": ">"}
UNITS = {"command": "1", "spool": "mm", "pa": "bar", "pb": "MPa", "position": "mm", "acceleration": "m/s^2"}


@dataclass(frozen=True)
class Layout:
    """How a file has its numbers; `fill` is what follows the last row: a number, or None for the last row again."""

    order: str = "BINARY_IEEE_LITTLE_END"
    kind: str = "SHORT_INTEGER"
    frame: int = 256
    frames_a_group: int = 4
    is_padded: bool = True
    fill: float | None = None


def write_rpc(path, layout, channels, units, period=1e-3, changes=None):
    """Write channels [n] by name; their scales. `changes` replaces values of the header, None leaves one out."""
    names, values = list(channels), np.array(list(channels.values()))
    is_float = layout.kind == "FLOATING_POINT"
    scales = np.ones(len(names)) if is_float else np.maximum(np.abs(values).max(axis=1), 1e-6) / 32752
    stored = values if is_float else np.round(values / scales[:, None])
    frames = -(-values.shape[1] // layout.frame)
    group = layout.frame * layout.frames_a_group
    rows = frames * layout.frame
    length = -(-rows // group) * group if layout.is_padded else rows
    last = stored[:, -1:] if layout.fill is None else np.full((len(names), 1), layout.fill)
    stored = np.hstack((stored, np.repeat(last, length - stored.shape[1], axis=1)))
    header = {
        "FORMAT": layout.order, "NUM_HEADER_BLOCKS": 0, "NUM_PARAMS": 0, "FILE_TYPE": "TIME_HISTORY",
        "TIME_TYPE": "RESPONSE", "DATA_TYPE": layout.kind, "DELTA_T": f"{period:.6E}", "CHANNELS": len(names),
        "FRAMES": frames, "PTS_PER_FRAME": layout.frame, "PTS_PER_GROUP": group, "INT_FULL_SCALE": 32752,
        "HALF_FRAMES": 0, "REPEATS": 1, "BYPASS_FILTER": 0, "PARTITIONS": 1,
    }  # fmt: skip
    for n, name in enumerate(names, 1):
        header |= {
            f"DESC.CHAN_{n}": name,
            f"UNITS.CHAN_{n}": units[name],
            f"SCALE.CHAN_{n}": repr(float(scales[n - 1])),
        }
    header |= {"NUM_HEADER_BLOCKS": -(-len(header) // 4), "NUM_PARAMS": len(header)}
    header = {key: value for key, value in (header | (changes or {})).items() if value is not None}
    records = [key.encode("cp1252").ljust(32, b"\0") + str(value).encode("cp1252").ljust(96, b"\0")
               for key, value in header.items()]  # fmt: skip
    dtype = ORDERS.get(layout.order, "<") + ("f4" if is_float else "i2")
    groups = [stored[:, k : k + group].astype(dtype).tobytes() for k in range(0, length, group)]
    path.write_bytes(b"".join(records).ljust(-(-len(records) // 4) * 512, b"\0") + b"".join(groups))
    return scales


def read(path):
    source = open_foreign(path)
    (block,) = source.blocks
    return {heading.cell: heading.unit for heading in source.headings}, np.array(block), source.notes


@given(
    layout=st.builds(
        Layout,
        order=st.sampled_from(list(ORDERS)),
        kind=st.sampled_from(["SHORT_INTEGER", "FLOATING_POINT"]),
        frame=st.sampled_from([2, 8, 64, 256]),
        frames_a_group=st.sampled_from([1, 2, 8]),
        is_padded=st.booleans(),
        fill=st.sampled_from([None, 0.0]),
    ),
    rows=st.integers(2, 700),
    seed=st.integers(0, 99),
    size=st.sampled_from([1e-3, 1.0, 1e6]),
)
def test_what_was_written_comes_back(tmp_path_factory, layout, rows, seed, size):
    """Within half of the last of 16 bits, or single precision; a counter beside it tells each row from the next."""
    path = tmp_path_factory.mktemp("rpc") / "a.rsp"
    values = np.random.default_rng(seed).normal(size=(2, rows)) * size
    channels = {"counter": np.arange(1.0, rows + 1), "LF Vert Disp": values[0], "LF Vert Force": values[1]}
    units = {"counter": "-", "LF Vert Disp": "mm", "LF Vert Force": "kN"}
    scales = write_rpc(path, layout, channels, units, period=1 / 2048)
    found, table, _ = read(path)
    assert found == {"t": "s", "counter": "1", "LF Vert Disp": "mm", "LF Vert Force": "kN"}
    assert table.shape == (4, rows)
    np.testing.assert_allclose(table[0], np.arange(rows) / 2048, rtol=1e-6)
    for back, written, scale in zip(table[1:], channels.values(), scales, strict=True):
        if layout.kind == "SHORT_INTEGER":
            np.testing.assert_allclose(back, written, atol=0.5001 * scale)
        else:
            np.testing.assert_array_equal(back, written.astype("f4"))


def refusal(path):
    """What is said of a file that is refused; nothing of one that is read."""
    try:
        read(path)
    except InputError as error:
        return str(error)
    return ""


RAMP = {"a": np.arange(1.0, 601), "b": np.arange(600, 0, -1.0)}
TWO = {"a": "kN", "b": "deg"}


def test_what_only_fills_the_last_frame_is_left_out_and_said(tmp_path):
    write_rpc(tmp_path / "a.drv", Layout(fill=0.0), RAMP, TWO)
    _, table, notes = read(tmp_path / "a.drv")
    assert table.shape == (3, 600)
    assert notes == ["left out at the end, only filling the last group: 168 rows"]


def test_a_record_that_never_moves_stays_whole(tmp_path):
    write_rpc(tmp_path / "a.drv", Layout(), {"a": np.full(512, 3.0)}, TWO)
    _, table, notes = read(tmp_path / "a.drv")
    assert table.shape == (2, 512)
    assert not notes


def test_rows_that_a_program_counts_are_believed(tmp_path):
    still = {"a": np.r_[np.arange(500.0), np.full(100, 7.0)]}
    write_rpc(tmp_path / "a.rpc", Layout(), still, TWO, changes={"SAMPLES": 590})
    assert read(tmp_path / "a.rpc")[1].shape == (2, 590)


@pytest.mark.parametrize("told", [3, 2])
def test_half_frames_are_kept_and_said_whether_counted_or_not(tmp_path, told):
    channels = {"a": np.arange(1.0, 769)}
    write_rpc(tmp_path / "a.tim", Layout(frames_a_group=1), channels, TWO, changes={"HALF_FRAMES": 1, "FRAMES": told})
    _, table, notes = read(tmp_path / "a.tim")
    assert table.shape == (2, 768)
    assert any("HALF_FRAMES" in note for note in notes)


def test_names_in_quotation_marks_of_another_code_page_and_units_in_names(tmp_path):
    names = {'"Zylinder Weg, links"': RAMP["a"], "Öl [bar]": RAMP["b"], "": RAMP["b"]}
    units = dict(zip(names, ["µm", "NONE", ""], strict=True))
    write_rpc(tmp_path / "a.rsp", Layout(), names, units)
    assert read(tmp_path / "a.rsp")[0] == {"t": "s", "Zylinder Weg, links": "µm", "Öl [bar]": "bar", "channel 3": None}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"FORMAT": "ASCII"}, 'FORMAT is "ASCII", not BINARY or'),
        ({"FORMAT": None}, "does not begin with FORMAT"),
        ({"FILE_TYPE": "MATRIX"}, 'FILE_TYPE is "MATRIX", not TIME_HISTORY'),
        ({"DATA_TYPE": "COMPLEX"}, 'DATA_TYPE is "COMPLEX", not SHORT_INTEGER or FLOATING_POINT'),
        ({"TIME_TYPE": "PEAK_PICK"}, "peaks without their times"),
        ({"DELTA_T": None}, "DELTA_T is missing"),
        ({"DELTA_T": "fast"}, 'DELTA_T is "fast", no number'),
        ({"DELTA_T": "-1.0E-3"}, "DELTA_T is -0.001 s"),
        ({"CHANNELS": "2.5"}, "CHANNELS is 2.5, not a whole number above 0"),
        ({"CHANNELS": 3}, "3 frames of 256 points in 3 channels of SHORT_INTEGER are told, which"),
        ({"FRAMES": 0}, "FRAMES is 0, not a whole number above 0"),
        ({"FRAMES": "1E18"}, "1000000000000000000 frames of 256 points"),
        ({"FRAMES": "1E999"}, 'FRAMES is "1E999", no number'),
        ({"PTS_PER_GROUP": 300}, "a group of 300 points is no whole number of frames of 256"),
        ({"NUM_PARAMS": 999}, "with 999 keywords are told"),
        ({"NUM_HEADER_BLOCKS": 99999}, "99999 header blocks of 512 bytes"),
        ({"NUM_HEADER_BLOCKS": 1}, "are told"),
        ({"SCALE.CHAN_2": None}, "SCALE.CHAN_2 is missing"),
    ],
)
def test_a_header_that_is_wrong_is_refused_by_its_keyword(tmp_path, changes, said):
    write_rpc(tmp_path / "a.rsp", Layout(), RAMP, TWO, changes=changes)
    assert said in refusal(tmp_path / "a.rsp")
    assert refusal(tmp_path / "a.rsp").isprintable()


def test_zeros_up_to_a_whole_block_belong_to_no_frame(tmp_path):
    write_rpc(tmp_path / "a.rsp", Layout(frame=8, is_padded=False), RAMP, TWO)
    with (tmp_path / "a.rsp").open("ab") as file:
        file.write(bytes(-file.tell() % 512))
    assert read(tmp_path / "a.rsp")[1].shape == (3, 600)


def test_a_file_cut_short_is_refused(tmp_path):
    write_rpc(tmp_path / "whole.rsp", Layout(), RAMP, TWO)
    content = (tmp_path / "whole.rsp").read_bytes()
    for cut in (0.1, 0.5, 0.9):
        (tmp_path / "a.rsp").write_bytes(content[: round(cut * len(content))])
        assert "are told" in refusal(tmp_path / "a.rsp") or "missing" in refusal(tmp_path / "a.rsp")


@given(cut=st.integers(1, 8000), seed=st.integers(0, 99))
def test_a_damaged_file_is_read_or_refused_in_one_line(tmp_path_factory, cut, seed):
    path = tmp_path_factory.mktemp("rpc") / "a.rsp"
    write_rpc(path, Layout(), RAMP, TWO)
    content = bytearray(path.read_bytes())
    rng = np.random.default_rng(seed)
    for place in rng.integers(0, len(content) // 2, seed % 7):
        content[place] = rng.integers(256)
    path.write_bytes(content[:cut] if seed % 2 else content)
    assert refusal(path).isprintable()


def test_drive_files_become_a_campaign_that_residual_takes(tmp_path):
    """Each record in another layout; the responses of the sample, as a test rig would have left them."""
    layouts = [Layout(), Layout("BINARY", "FLOATING_POINT", is_padded=False), Layout("BINARY_IEEE_BIG_END", fill=0.0)]
    files = []
    for name, layout in zip(("static", "steps", "multisine"), layouts, strict=True):
        write_rpc(tmp_path / f"{name}.rsp", layout, columns(name, UNITS), UNITS)
        files.append(str(tmp_path / f"{name}.rsp"))
    assert main(["import", *files, "--rig", "jack-10t", "--out", str(tmp_path / "out")]) == 0
    metrics = json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert metrics["ready"]
    assert set(metrics["signals"]) == {"t", *UNITS}
    assert [entry["rows"] for entry in metrics["files"]] == [2000, 6000, 6000]
    assert main(["residual", str(tmp_path / "out"), "--out", str(tmp_path / "residual")]) == 0
    rows = json.loads((tmp_path / "residual" / "metrics.json").read_text())["rows"]
    assert {row["signal"] for row in rows} == {"spool", "pa", "pb", "position", "acceleration"}
