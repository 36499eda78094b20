"""Readers that come with a group of optional dependencies."""

from importlib import import_module
from typing import Any

from ...base.errors import InputError


def needed(module: str, group: str) -> Any:
    """A module of an optional group. Raises InputError that names the group where it is not installed."""
    try:
        return import_module(module)
    except ImportError:
        raise InputError(f"reading .{group} files needs {module}; pip install 'jackbench[{group}]'") from None
