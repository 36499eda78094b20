"""Machine code is kept for the next start: whole, the user's own, and made again where it is neither."""

import ctypes
import os
import sys
from dataclasses import replace
from pathlib import Path
from weakref import WeakValueDictionary, ref

import casadi as ca
import numpy as np
import pytest
from test_compiled import compile_outputs
from test_live import resident

from workbench import load_rig
from workbench.engine import object_cache
from workbench.engine.engine import attempt_of
from workbench.engine.rosenbrock import adaptive_attempt
from workbench.plant import Plant, build, build_platform
from workbench.rigs.platform import load_platform


@pytest.fixture
def fresh_cache(tmp_path: Path, monkeypatch) -> Path:
    """An empty cache folder, and a process that has loaded nothing."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(object_cache, "_LOADED", WeakValueDictionary())
    return tmp_path / "jackbench"


def square() -> float:
    x = ca.SX.sym("x")
    return compile_outputs([x * x], [x])[0].observe(np.array([3.0]), np.zeros(1))[0]


def restart(monkeypatch, compiler: object) -> None:
    monkeypatch.setattr(object_cache, "_LOADED", WeakValueDictionary())
    monkeypatch.setattr(object_cache, "_compile", compiler)


def test_the_second_start_needs_no_compiler(fresh_cache: Path, monkeypatch) -> None:
    assert square() == 9
    assert len(list(fresh_cache.iterdir())) == 1
    restart(monkeypatch, None)
    assert square() == 9


_ADDS = """define double @add_{0}(double %x) {{
  %y = fadd double %x, {0}.0
  ret double %y
}}"""
_TWICE = """declare double @add_{0}(double)
define double @twice_{0}(double %x) {{
  %y = call double @add_{0}(double %x)
  %z = call double @add_{0}(double %y)
  ret double %z
}}"""


def library(text: str, name: str, number: int) -> object_cache.Library:
    text = text.format(number)
    return object_cache.load(("test", text), lambda: text, (f"{name}_{number}",))


def called(library: object_cache.Library, name: str, x: float) -> float:
    return ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(library[name])(x)


@pytest.mark.usefixtures("fresh_cache")
def test_code_stays_in_memory_as_long_as_it_is_held_or_of_the_latest(monkeypatch) -> None:
    held = library(_ADDS, "add", 1)
    monkeypatch.setattr(object_cache._RECENT, "room", 3.5 * held.size)
    others = {number: ref(library(_ADDS, "add", number)) for number in range(2, 22)}
    assert [number for number, other in others.items() if other()] == [19, 20, 21]
    library(_ADDS, "add", 19)  # asked for again
    library(_ADDS, "add", 22)
    assert [number for number, other in others.items() if other()] == [19, 21]
    assert called(held, "add_1", 1.0) == 2.0
    assert library(_ADDS, "add", 1) is held


@pytest.mark.usefixtures("fresh_cache")
def test_code_that_other_code_calls_stays_with_it(monkeypatch) -> None:
    monkeypatch.setattr(object_cache._RECENT, "room", 0)
    adds = library(_ADDS, "add", 5)
    object_cache.provide("add_5", adds)
    twice, within = library(_TWICE, "twice", 5), ref(adds)
    del adds
    assert called(twice, "twice_5", 1.0) == 11.0
    assert within() is not None
    del twice
    assert within() is None


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.usefixtures("fresh_cache")
def test_what_was_compiled_leaves_no_memory_behind(monkeypatch) -> None:
    monkeypatch.setattr(object_cache._RECENT, "room", 0)
    most = []
    for number in range(60):
        adds = (f"  %y{k} = fadd double %x, {number}.{k:04}" for k in range(2000))
        text = "\n".join((f"define double @add_{number}(double %x) {{", *adds, "  ret double %x", "}"))
        object_cache.load(("test", text), lambda text=text: text, (f"add_{number}",))
        most.append(resident())
    assert most[-1] - most[19] < 4  # MB


def test_a_damaged_entry_is_compiled_again(fresh_cache: Path, monkeypatch) -> None:
    calls, compiler = [], object_cache._compile
    assert square() == 9
    (entry,) = fresh_cache.iterdir()
    whole = entry.read_bytes()
    for damaged in (whole[:-1], whole[:40], b"", whole[:-9] + b"x" + whole[-8:]):
        entry.write_bytes(damaged)
        restart(monkeypatch, lambda ir, *how: calls.append(ir) or compiler(ir, *how))
        assert square() == 9
        assert entry.read_bytes() == whole
    assert len(calls) == 4


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="only POSIX says who may write to a file")
@pytest.mark.parametrize("open_to_others", ["entry", "folder", "another user's"])
def test_an_entry_that_others_could_have_written_is_compiled_again(fresh_cache, monkeypatch, open_to_others) -> None:
    calls, compiler = [], object_cache._compile
    assert square() == 9
    (entry,) = fresh_cache.iterdir()
    assert (fresh_cache.stat().st_mode | entry.stat().st_mode) & 0o077 == 0
    if open_to_others == "another user's":
        monkeypatch.setattr(os, "getuid", lambda: entry.stat().st_uid + 1)
    else:
        (entry if open_to_others == "entry" else fresh_cache).chmod(0o722)
    restart(monkeypatch, lambda ir, *how: calls.append(ir) or compiler(ir, *how))
    assert square() == 9
    assert len(calls) == 1
    restart(monkeypatch, lambda ir, *how: calls.append(ir) or compiler(ir, *how))
    assert square() == 9
    assert len(calls) == (2 if open_to_others == "another user's" else 1)


def test_without_a_folder_to_write_to_nothing_is_kept(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.setattr(object_cache, "_LOADED", WeakValueDictionary())
    assert square() == 9


def test_a_full_disk_leaves_no_part_of_an_entry(fresh_cache: Path, monkeypatch) -> None:
    """Nothing can be written beyond some bytes, as where a disk is full."""
    resource, signal = pytest.importorskip("resource"), pytest.importorskip("signal")
    before, handler = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
        assert square() == 9
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    assert list(fresh_cache.iterdir()) == []


def test_a_large_graph_is_read_where_it_has_been_made(fresh_cache: Path) -> None:
    plant = build_platform(load_platform("hexapod"))
    made = attempt_of(plant, adaptive_attempt)
    (entry,) = fresh_cache.glob("*.graph")

    def never(plant: Plant) -> ca.Function:
        raise AssertionError("made again")

    never.__name__ = adaptive_attempt.__name__
    assert attempt_of(plant, never).serialize() == made.serialize()
    entry.write_bytes(entry.read_bytes()[:-1])
    assert attempt_of(plant, adaptive_attempt).serialize() == made.serialize()
    larger = replace(plant, states=(replace(plant.states[0], scale=2.0), *plant.states[1:]))
    with pytest.raises(AssertionError, match="made again"):
        attempt_of(larger, never)


def test_a_small_graph_leaves_no_file(fresh_cache: Path) -> None:
    attempt_of(build(load_rig("jack-10t")), adaptive_attempt)
    assert not fresh_cache.exists()
