"""The maps are complete: every folder's docstring names what is in it; CONTRIBUTING names only what there is."""

import ast
import re
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = sorted(
    path.parent for package in ("workbench", "controllers", "envs") for path in (ROOT / package).rglob("__init__.py")
)
SHELVES = {"controllers", "library"}  # folders whose files `jackbench list` lists: a new one is in them by being there
OF_A_COMMAND = {"options", "config", "study", "page"}  # which workbench/commands/__init__.py explains once for all
TOP = ("workbench", "controllers", "envs", "experiments", "docs", "tests")


@cache
def trees() -> list[ast.Module]:
    return [ast.parse(path.read_text("utf-8")) for folder in FOLDERS for path in folder.glob("*.py")]


def plain(word: str) -> str:
    return word.lower().replace("_", "").replace("-", "")


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: str(folder.relative_to(ROOT)))
def test_a_folder_s_docstring_names_its_modules_and_folders(folder):
    text = ast.get_docstring(ast.parse((folder / "__init__.py").read_text())) or ""
    words = {plain(word) for word in re.findall(r"[\w-]+", text)}
    inside = {path.stem for path in folder.glob("*.py")} - {"__init__"}
    inside |= {path.parent.name for path in folder.glob("*/__init__.py")}
    if folder.parent.name == "commands" and folder.name != "common":
        inside -= OF_A_COMMAND
    if folder.name in SHELVES:
        inside = set()
    if folder.name == "commands":
        inside = {"common"}  # the others are the commands themselves, listed below the docstring
    missing = {name for name in inside if not any(word.startswith(plain(name)) for word in words)}
    assert not missing


def test_the_commands_are_their_folders():
    from workbench.commands import COMMANDS, folder

    folders = {path.parent.name for path in (ROOT / "workbench/commands").glob("*/options.py")} - {"common"}
    assert {folder(name) for name in COMMANDS} == folders


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md"])
def test_a_page_names_the_top_level_and_only_paths_that_exist(page):
    text = (ROOT / page).read_text()
    assert all(f"`{name}/`" in text for name in TOP)
    roots = "|".join((*TOP, "examples"))
    paths = re.findall(rf"`((?:{roots})/[\w./-]*)`", text)
    assert not [path for path in paths if not (ROOT / path).exists()]


def test_contributing_answers_ten_questions_by_a_path_each():
    rows = [row for row in (ROOT / "CONTRIBUTING.md").read_text().splitlines() if row.startswith("| ") and "`" in row]
    assert len(rows) == 10
    for row in rows:
        (path, *_) = re.findall(r"`([\w./-]+/[\w./-]*)`", row)
        assert (ROOT / path).exists()


def test_a_class_name_means_one_thing():
    classes = (node for tree in trees() for node in tree.body if isinstance(node, ast.ClassDef))
    names = Counter(node.name for node in classes if not node.name.startswith("_"))
    assert not {name for name, count in names.items() if count > 1}


def test_a_docstring_begins_with_what_it_speaks_of_and_names_its_errors():
    bodies = (node for tree in trees() for node in ast.walk(tree) if isinstance(node, (ast.ClassDef, ast.FunctionDef)))
    texts = [ast.get_docstring(node) or "" for node in bodies]
    assert not [text for text in texts if re.match(r"(Of|The same|Where|As)\b", text)]
    assert not [text for text in texts if re.search(r"raises as\b", text, re.IGNORECASE)]  # an error has its name


def test_what_scripts_tests_and_examples_import_of_the_house_is_there():
    """The type checker leaves out hidden folders: a module that moved is missed there by whoever runs the script."""
    missing = []
    for folder in (".ci", "docs", "examples", "experiments", "tests"):
        for path in (ROOT / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if (
                    isinstance(node, ast.ImportFrom)
                    and node.module
                    and node.module.split(".")[0] in {"workbench", "controllers", "envs"}
                ):
                    module = ROOT / node.module.replace(".", "/")
                    if not (module.is_dir() or module.with_suffix(".py").is_file()):
                        missing.append(f"{path.relative_to(ROOT)}:{node.lineno}: {node.module}")
    assert not missing
