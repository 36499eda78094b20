"""A class by where it is: `"module:Class"` as Python imports it, or `"file.py:Class"` of a file of one's own."""

import sys
from functools import lru_cache
from hashlib import sha1
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from traceback import extract_tb
from types import ModuleType
from typing import Any

from ..base.errors import InputError, clipped, echo, nearest, short_path


def absolute(use: str, beside: Path | None) -> str:
    """This `use`, a path in it from the folder `beside` (else the current one) made absolute."""
    module, _, name = use.rpartition(":")
    return f"{((beside or Path()) / module).resolve()}:{name}" if module.endswith(".py") else use


def load_class(use: str, where: str) -> Any:
    """What `use` names. Raises InputError, opened by `where`, with file and line where a file does not run."""
    module, _, name = use.rpartition(":")
    try:
        loaded = _file_module(Path(module)) if module.endswith(".py") else _installed_module(module)
    except InputError as error:
        raise InputError(f"{where}: use = {_shown(use)}: {error}") from None
    if not hasattr(loaded, name):
        classes = [key for key, value in vars(loaded).items() if isinstance(value, type)]
        what = f"module {short_path(module)} has no class {clipped(name)}; {nearest(name[:80], classes)}"
        raise InputError(f"{where}: use = {_shown(use)}: {what}")
    return getattr(loaded, name)


def _shown(use: str) -> str:
    """The `use` as it may stand in a message: no name in a path is longer than 80 characters."""
    return f'"{short_path(use)}"' if use.isprintable() else echo(use)


def _installed_module(name: str) -> ModuleType:
    if not all(part.isidentifier() for part in name.split(".")):
        raise InputError(f"{echo(name)} is no module; write it as Python imports it")
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        if error.name and (name == error.name or name.startswith(f"{error.name}.")):
            raise InputError(f"{clipped(str(error))}; write the module as Python imports it") from None
        raise InputError(_failure(error)) from None
    except (Exception, SystemExit) as error:
        raise InputError(_failure(error)) from None


def _file_module(path: Path) -> ModuleType:
    if not path.is_file():
        raise InputError("no such file; write its path from the folder of the experiment")
    return _run(path, path.stat().st_mtime_ns)


@lru_cache
def _run(path: Path, changed: int) -> ModuleType:
    """The module of a file; one that has changed on disk is run again."""
    name = f"controller_file_{sha1(str(path).encode()).hexdigest()[:12]}"
    spec = spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[name] = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        raise InputError(_failure(error, path)) from None
    return module


def _failure(error: BaseException, path: Path | None = None) -> str:
    """In one line: the file and line at which an import failed, and why."""
    if isinstance(error, SyntaxError):
        file, line, text = error.filename, error.lineno, error.msg
    else:
        frames = extract_tb(error.__traceback__)
        own = [frame for frame in frames if path is None or frame.filename == str(path)]
        file, line, text = (own or frames)[-1].filename, (own or frames)[-1].lineno, str(error)
    return f"{file}: line {line}: {type(error).__name__}: {' '.join(text.split())}; correct it there"
