"""A folder that a command makes at once is whole, or is told in a line."""

import pytest

from workbench.base.errors import InputError
from workbench.commands.common.new_folder import write_folder


def test_all_files_are_there_or_none(tmp_path):
    write_folder(tmp_path / "law", {"law.c": "int x;\n", "rigs/own.bin": b"\0"})
    assert (tmp_path / "law" / "law.c").read_text() == "int x;\n"
    assert (tmp_path / "law" / "rigs" / "own.bin").read_bytes() == b"\0"
    with pytest.raises(InputError, match="choose another folder"):
        write_folder(tmp_path / "law", {"other.c": ""})
    assert sorted(path.name for path in tmp_path.iterdir()) == ["law"]
    assert not (tmp_path / "law" / "other.c").exists()


def test_a_folder_that_cannot_be_made_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"law: .*; choose another folder"):
        write_folder(tmp_path / "file" / "law", {"law.c": ""})
