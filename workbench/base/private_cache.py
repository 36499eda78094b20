"""Computed files that a later start takes instead of computing them: whole, and the user's own."""

import hashlib
import json
import os
import tempfile
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from .private_files import cache_folder, is_private

_DIGEST = 32  # bytes of SHA-256 before the content: what reads it may not survive a damaged one


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
