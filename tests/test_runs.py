"""The run folder: what a whole run leaves, and its stages."""

import json
import os
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import given, strategies as st
from made_runs import COMMAND, complete, finish, stop

from workbench.commands.common.run_folder import RunFolder, metrics_json, open_run, resolved_config, versions

# --- a whole run


def test_a_run_leaves_its_files_and_nothing_else(tmp_path: Path):
    t = np.arange(5) * 1e-3
    with open_run(tmp_path / "deep" / "out", COMMAND) as run:
        assert run.dir == tmp_path / "deep" / "out.partial"
        assert not run.resumed
        run.stage("mass+50/x", lambda: {"a": 1})
        (run.dir / "trace.json").write_text("{}")
        finish(run, tables={"steps": {"t [s]": t, "n": np.arange(5), "name": np.array(list("abcde"))}})
    out = tmp_path / "deep" / "out"
    names = {"metrics.json", "config.toml", "report.html", "steps.parquet", "trace.json"}
    assert {path.name for path in out.iterdir()} == names
    assert os.listdir(out.parent) == ["out"]
    read = pq.read_table(out / "steps.parquet")
    assert read.column_names == ["t [s]", "n", "name"]
    assert (read["t [s]"].to_numpy() == t).all()


def test_every_file_is_the_same_to_the_byte_for_the_same_command(tmp_path: Path):
    for name in ("a", "b"):
        with open_run(tmp_path / name, COMMAND) as run:
            finish(run, 1 / 3, {"steps": {"t [s]": np.arange(1000) / 3}})
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()


def test_the_config_says_command_seed_and_versions(tmp_path: Path):
    read = tomllib.loads((complete(tmp_path / "out") / "config.toml").read_text())
    assert read.pop("versions") == versions()
    assert read == COMMAND
    assert {"jackbench", "python", "numpy", "scipy", "casadi", "control", "cmaes"} == set(versions())
    assert "x" not in resolved_config({"x": None, "rigs": [{"x": None}]}).replace("rigs", "")


# --- metrics.json


def test_metrics_are_strict_json_in_the_order_given():
    text = metrics_json({"z": np.float64("nan"), "a": (np.inf, -0.0), "n": np.int64(3), "b": np.bool_(True), "e": "é"})
    assert text == '{\n  "z": null,\n  "a": [\n    null,\n    0.0\n  ],\n  "n": 3,\n  "b": true,\n  "e": "é"\n}\n'
    assert json.loads(metrics_json({"m": np.array([[1.0, np.nan]])})) == {"m": [[1.0, None]]}


@given(st.floats(-1e300, 1e300, allow_subnormal=False))
def test_the_last_bits_of_a_float_do_not_show(value):
    read = json.loads(metrics_json({"x": value}))["x"]
    assert read == pytest.approx(value, rel=1e-9, abs=0)
    if f"{value:.10g}" == f"{np.nextafter(value, 0):.10g}":
        assert metrics_json({"x": value}) == metrics_json({"x": np.nextafter(value, 0)})


@pytest.mark.parametrize("bad", [{1: 2}, {"a": object()}, {"a": {2: 3}}, {"a": 1j}])
def test_what_json_does_not_know_is_refused(bad):
    with pytest.raises(TypeError):
        metrics_json(bad)


# --- stages

RESULT = {
    "none": None,
    "rows": [1, 2.5, "x", True, [], {}],
    "nan": float("nan"),
    "inf": -np.inf,
    "third": 1 / 3,
    "arrays": [np.arange(6).reshape(2, 3), np.array([1 + 2j]), np.array(["a", "bc"]), np.array(3.0)],
}


def test_a_stage_comes_back_as_it_was_and_is_computed_once(tmp_path: Path):
    calls = []

    def compute() -> dict[str, Any]:
        calls.append(1)
        return RESULT

    def check(run: RunFolder) -> None:
        got = run.stage("first", compute)
        np.testing.assert_equal(got, RESULT)
        assert [a.dtype for a in got["arrays"]] == [a.dtype for a in RESULT["arrays"]]

    stop(tmp_path / "out", check)
    stop(tmp_path / "out", check)
    assert len(calls) == 1


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-30])


def emptied(path: Path) -> None:
    path.write_bytes(b"")


def another_digit(path: Path) -> None:
    path.write_bytes(path.read_bytes().replace(b"2.5", b"2.7"))


def another_bit(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


@pytest.mark.parametrize("kind", ["json", "npz"])
@pytest.mark.parametrize("damage", [cut, emptied, another_bit, another_digit, Path.unlink])
def test_a_stage_that_cannot_be_read_as_it_was_written_is_computed_again(tmp_path: Path, kind: str, damage):
    calls = []

    def check(run: RunFolder) -> None:
        np.testing.assert_equal(run.stage("first", lambda: calls.append(1) or RESULT), RESULT)

    stop(tmp_path / "out", check)
    (path,) = (tmp_path / "out.partial" / "stages").glob(f"first.{kind}")
    before = path.read_bytes()
    damage(path)
    damaged = not path.exists() or path.read_bytes() != before
    for _ in range(2):
        stop(tmp_path / "out", check)
    assert len(calls) == 1 + damaged
    assert damaged or (kind, damage) == ("npz", another_digit)  # arrays have no digits


@pytest.mark.parametrize("bad", [(1, 2), {1: 2}, object(), {"a": np.array([object()])}, 1j])
def test_a_stage_that_would_come_back_different_is_refused(tmp_path: Path, bad):
    with pytest.raises(TypeError), open_run(tmp_path / "out", COMMAND) as run:
        run.stage("first", lambda: bad)


def test_a_name_stands_for_one_stage(tmp_path: Path):
    with open_run(tmp_path / "out", COMMAND) as run:
        run.stage("first", lambda: 1)
        with pytest.raises(ValueError, match="twice"):
            run.stage("first", lambda: 2)
        finish(run)


@pytest.mark.parametrize("name", ["@command", "../../x", "a/b", "..", "mass+50 é"])
def test_any_name_of_a_stage_stays_in_its_folder(tmp_path: Path, name: str):
    with open_run(tmp_path / "out", COMMAND) as run:
        before = set(run.dir.rglob("*"))
        assert run.stage(name, lambda: 5) == 5
        (new,) = set(run.dir.rglob("*")) - before
        assert new.parent == run.dir / "stages"
        finish(run)
    assert os.listdir(tmp_path) == ["out"]


def test_a_run_that_ends_without_finish_is_a_bug(tmp_path: Path):
    with pytest.raises(RuntimeError, match="without finish"), open_run(tmp_path / "out", COMMAND):
        pass
