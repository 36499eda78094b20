"""The bundled tasks of the environments, and files of tasks that tests change."""

import tomllib
from importlib.resources import files
from pathlib import Path

import tomli_w

from envs.single import JackForce, JackPosition

TASKS = {
    "position": "position",
    "position-sensors": "position",
    "pump": "position",
    "force": "force",
    "force-moving-end": "force",
}
"""The loop of each."""


def make(task):
    """The environment of a bundled task or of a task file with its loop in its name."""
    return (JackPosition if "force" not in str(task) else JackForce)(task)


def table_of(name):
    """A bundled task's TOML."""
    return tomllib.loads((files("envs") / "tasks" / f"{name}.toml").read_text())


def write_task(folder: Path, name, /, **changes):
    """A bundled task with some tables or values replaced (None: left out), as a file."""
    table = table_of(name)
    for key, value in changes.items():
        if value is None:
            table.pop(key)
        else:
            table[key] = {**table[key], **value} if isinstance(value, dict) and key != "references" else value
    path = folder / f"{name}-changed.toml"
    path.write_text(tomli_w.dumps(table))
    return path


def mm(low, high):
    """A range."""
    return {"low": low, "high": high, "unit": "mm"}


def hold_at(size):
    """A reference that steps to one place and stays, and a start at mid stroke."""
    steps = {"weight": 1, "size": mm(size, size), "hold": {"low": 1, "high": 1, "unit": "s"}}
    return {"randomise": False, "start": mm(0, 0), "references": {"steps": steps}}
