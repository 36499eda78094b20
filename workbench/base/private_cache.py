"""The user's own folders, and computed files there that a later start takes instead of computing them, whole."""

import hashlib
import json
import os
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

_DIGEST = 32  # bytes of SHA-256 before the content: what reads it may not survive a damaged one


def is_private(status: os.stat_result) -> bool:
    """Whether a file or folder belongs to this user and no other may write to it; where there is no POSIX, always."""
    return not hasattr(os, "getuid") or (status.st_uid == os.getuid() and not status.st_mode & 0o022)


def cache_folder() -> Path:
    """The folder of computed files: $XDG_CACHE_HOME/jackbench, or what the system has for this purpose."""
    return _folder("XDG_CACHE_HOME", "LOCALAPPDATA", "Library/Caches", ".cache")


def config_folder() -> Path:
    """The folder of a user's choices: $XDG_CONFIG_HOME/jackbench, or what the system has for this purpose."""
    return _folder("XDG_CONFIG_HOME", "APPDATA", "Library/Application Support", ".config")


def _folder(variable: str, windows: str, mac: str, other: str) -> Path:
    if given := os.environ.get(variable):
        return Path(given) / "jackbench"
    if sys.platform == "win32":
        return Path(os.environ.get(windows, Path.home() / "AppData")) / "jackbench"
    return Path.home() / (mac if sys.platform == "darwin" else other) / "jackbench"


def stored(name: str) -> bytes | None:
    """A file of the cache folder; None where there is none, it is damaged, or others could have written it."""
    with suppress(OSError), (cache_folder() / name).open("rb") as file:
        if not (is_private(cache_folder().stat()) and is_private(os.fstat(file.fileno()))):
            return None
        content = file.read()
        if hashlib.sha256(content[_DIGEST:]).digest() == content[:_DIGEST]:
            return content[_DIGEST:]
    return None


def store(name: str, content: bytes) -> bytes:
    """Keep the content, unless the folder cannot be written to; returns it."""
    with suppress(OSError):
        cache_folder().mkdir(parents=True, exist_ok=True)
        cache_folder().chmod(0o700)
        descriptor, part = tempfile.mkstemp(dir=cache_folder())
        try:
            with open(descriptor, "wb") as file:
                file.write(hashlib.sha256(content).digest() + content)
            os.replace(part, cache_folder() / name)
        except BaseException:
            os.unlink(part)  # a full disk keeps no part of it
            raise
    return content


def kept(kind: str, key: Any, compute: Callable[[], Any]) -> Any:
    """What is computed once for a key; both are of plain data, which JSON has. `kind` ends the file's name."""
    name = f"{hashlib.sha256(json.dumps(key, sort_keys=True, default=str).encode()).hexdigest()}.{kind}"
    if content := stored(name):
        return json.loads(content)
    result = compute()
    store(name, json.dumps(result).encode())
    return result
