"""The script that counts how far a run walks: calls beyond an import, and the shortest way to a function."""

from importlib import import_module

import pytest
import walks


def test_functions_count_that_are_called_beyond_the_import_of_a_module(tmp_path, monkeypatch):
    folder = tmp_path / "walked_house"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "inner.py").write_text(
        "import functools\n\ndef at_import():\n    return 1\n\nONE = at_import()\n\ndef deep(n):\n"
        "    return max(deep(n - 1) for _ in range(1)) if n else row()\n\ndef row():\n    return ONE\n"
    )
    (folder / "outer.py").write_text("def run():\n    from .inner import deep, row\n\n    return deep(3), row()\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    outer = import_module("walked_house.outer")
    with walks.Walk([folder]) as walk:
        assert outer.run() == (1, 1)
    assert {code.co_name for code in walk.functions} == {"run", "deep", "row"}
    assert walk.files == {str(folder / "inner.py"), str(folder / "outer.py")}
    assert walk.deepest == 6  # run, four times deep, row
    assert walk.depth(folder / "inner.py", "row") == 2
    with pytest.raises(LookupError, match="at_import is not called"):
        walk.depth(folder / "inner.py", "at_import")


def test_a_law_to_c_is_counted(tmp_path):
    assert walks.line("law", tmp_path).startswith("law -> C: ")
    assert (tmp_path / "out").is_dir()


def test_every_size_has_its_aim():
    lines = walks.sizes()
    assert len(lines) == 4
    assert all("(aim: " in line for line in lines)
