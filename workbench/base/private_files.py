"""Files that nobody but the user can have written, and where a system keeps such files."""

import os
import sys
from pathlib import Path


def is_private(status: os.stat_result) -> bool:
    """Whether a file or folder belongs to this user and no other may write to it; where there is no POSIX, always."""
    return not hasattr(os, "getuid") or (status.st_uid == os.getuid() and not status.st_mode & 0o022)


def cache_folder() -> Path:
    """Where computed files are kept: $XDG_CACHE_HOME/jackbench, or what the system has for this purpose."""
    return _folder("XDG_CACHE_HOME", "LOCALAPPDATA", "Library/Caches", ".cache")


def config_folder() -> Path:
    """Where a user's choices are kept: $XDG_CONFIG_HOME/jackbench, or what the system has for this purpose."""
    return _folder("XDG_CONFIG_HOME", "APPDATA", "Library/Application Support", ".config")


def _folder(variable: str, windows: str, mac: str, other: str) -> Path:
    if given := os.environ.get(variable):
        return Path(given) / "jackbench"
    if sys.platform == "win32":
        return Path(os.environ.get(windows, Path.home() / "AppData")) / "jackbench"
    return Path.home() / (mac if sys.platform == "darwin" else other) / "jackbench"
