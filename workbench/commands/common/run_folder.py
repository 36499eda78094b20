"""The folder that a command leaves behind: worked on as DIR.partial, resumable stage by stage, renamed DIR when whole.

    with open_run(Path("out/bench"), {"command": "bench", "config": config, "seed": 7}) as run:
        rows = run.stage("nominal", lambda: simulate(...))      # computed once, read back when the command is resumed
        run.finish({"rows": rows}, resolved_config(command), tables, html)

What only resuming needs is in DIR.partial/stages: @command.json (what the run is), @lock, and a file for each stage.
"""

import json
import math
import os
import platform
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from filelock import FileLock, Timeout

from ...base.errors import InputError, short_path
from ...base.files import WINDOWS, sync, write_whole
from ...base.kept_columns import KeptColumns
from ...base.toml_text import toml_text
from .stage_file import Unreadable, load_stage, plain, stage_path, store_stage

T = TypeVar("T")

_COMMAND, _LOCK = "@command.json", "@lock"  # quote() escapes "@": no stage can have these names
_ROWS = 2**16  # of a table on disk that are in memory at once
_DIGITS = 10  # of the floats in metrics.json: last-bit differences between machines do not show


class RunFolder:
    """An open run, made by open_run.

    dir: DIR.partial, where a command may write files of its own (trace.json). resumed: an earlier call worked there.
    """

    def __init__(self, out: Path, partial: Path, resumed: bool, lock: FileLock) -> None:
        self.out, self.dir, self.resumed = out, partial, resumed
        self._lock = lock
        self.finished = False
        self._asked: set[str] = set()

    def stage(self, name: str, compute: Callable[[], T]) -> T:
        """The result of `compute`, which runs only when no earlier call of this command finished the stage `name`; one
        that cannot be read as it was written is not finished.

        A result is made of dict (str keys), list, str, int, float, bool, None and numpy arrays, and comes back as it
        was, NaN too; a numpy scalar comes back as Python's. Raises TypeError for anything else, ValueError for a name
        that was used before.
        """
        if name in self._asked:
            raise ValueError(f'stage "{name}" is there twice: the second would get the result of the first')
        self._asked.add(name)
        path = stage_path(self.dir / "stages", name)
        with suppress(Unreadable):
            return load_stage(path)
        store_stage(path, compute())
        return load_stage(path)

    def keep(
        self, metrics: Mapping[str, Any], config_toml: str, tables: Mapping[str, Mapping[str, np.ndarray]]
    ) -> None:
        """Write metrics.json, config.toml and NAME.parquet for each table: name -> column -> (n,), one n a table."""
        write_whole(self.dir / "metrics.json", metrics_json(metrics))
        write_whole(self.dir / "config.toml", config_toml)
        for name, columns in tables.items():
            _write_table(columns, self.dir / f"{name}.parquet")

    def finish(
        self,
        metrics: Mapping[str, Any],
        config_toml: str,
        tables: Mapping[str, Mapping[str, np.ndarray]],
        report: str,
    ) -> None:
        """Write all that `keep` does and report.html, then rename DIR.partial to DIR.

        An older DIR (force) is moved aside first and deleted last.
        """
        self.keep(metrics, config_toml, tables)
        write_whole(self.dir / "report.html", report)
        if WINDOWS:  # which renames no folder with an open file in it
            self._lock.release()
        _publish(self.dir, self.out)
        self.finished = True


@contextmanager
def open_run(out: Path, command: Mapping[str, Any], force: bool = False) -> Iterator[RunFolder]:
    """Open DIR.partial for `command`, or resume what the same command left there.

    command: JSON-able name, config and seeds, which with the package versions say what the run is; not its --out.
    Raises InputError, before anything is computed, when DIR exists (unless force), when DIR.partial belongs to another
    command (unless force) or to a process still at work, and when the place cannot be written. With force nothing of
    DIR.partial is used. An InputError from the block removes what this call made; after any other end, an interrupt or
    a kill, the same command resumes.
    """
    out = _resolved(out)
    partial = out.with_name(out.name + ".partial")
    _tidy(out)
    identity = _canonical({"command": command, "versions": versions()})
    _check_free(out, force)
    _check_ours(partial)
    made = [folder for folder in (partial, *out.parents) if not folder.exists()]
    with _locked(partial) as lock:
        keep, finished = (partial / "stages" / _COMMAND).exists(), False
        try:
            _check_free(out, force)  # another process may have finished between the first look and the lock
            keep = _claim(partial, identity, force)
            run = RunFolder(out, partial, keep, lock)
            yield run
            finished = run.finished
        except InputError:
            if not keep and partial.exists():
                shutil.rmtree(partial)
                _remove_empty(made)
            raise
        if not finished:
            raise RuntimeError(f"{out}: the run ended without finish()")


def metrics_json(metrics: Mapping[str, Any]) -> str:
    """Strict JSON in the order given: floats to ten significant digits, NaN and infinities null, arrays as lists.

    Raises TypeError for a key that is no string and for a value that JSON does not know.
    """
    return json.dumps(plain(metrics, _rounded), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _write_table(columns: Mapping[str, np.ndarray], path: Path) -> None:
    """Columns that are on disk are read part by part."""
    with ExitStack() as stack:
        writer: pq.ParquetWriter | None = None
        for part in columns.parts(_ROWS) if isinstance(columns, KeptColumns) else (columns,):
            table = pa.table({key: pa.array(np.asarray(column)) for key, column in part.items()})
            writer = writer or stack.enter_context(pq.ParquetWriter(path, table.schema))
            writer.write_table(table)


def versions() -> dict[str, str]:
    """Versions of what a result depends on."""
    versions = {"python": platform.python_version()}
    for name in ("jackbench", "numpy", "scipy", "casadi", "control", "cmaes"):
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "not installed"
    return versions


def resolved_config(command: Mapping[str, Any]) -> str:
    """TOML of `command` with a table of versions; what is None is left out, since TOML has no null."""
    return toml_text({**_without_none(command), "versions": versions()})


def _resolved(out: Path) -> Path:
    try:
        out = out.resolve()
        if not out.name:
            raise InputError(f"{out}: cannot be an output folder; choose another --out")
        with suppress(FileNotFoundError, NotADirectoryError):
            os.stat(out.with_name(f"{out.name}.partial") / "stages" / _COMMAND)
        str(out).encode()
    except InputError:
        raise
    except UnicodeEncodeError:
        raise InputError(f"{short_path(out)}: is no UTF-8; choose another --out") from None
    except (OSError, RuntimeError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{short_path(out)}: {reason}; choose another --out") from None
    return out


def _tidy(out: Path) -> None:
    """Remove what a kill right after the renaming left beside a whole run."""
    if (out / "stages" / _COMMAND).exists():
        _remove_leftovers(out)


def _check_free(out: Path, force: bool) -> None:
    if not os.path.lexists(out):
        return
    if not force:
        raise InputError(f"{out}: exists already; choose another --out or add --force to replace it")
    if not out.is_dir():
        raise InputError(f"{out}: is a file, not a folder; choose another --out")
    if not (out / "metrics.json").exists() and any(out.iterdir()):
        raise InputError(f"{out}: is no run (no metrics.json), so --force does not replace it; remove it yourself")


def _check_ours(partial: Path) -> None:
    if not os.path.lexists(partial):
        return
    if not partial.is_dir():
        raise InputError(f"{partial}: is a file in the way; remove it or choose another --out")
    if not (partial / "stages" / _COMMAND).exists() and any(entry.name != "stages" for entry in partial.iterdir()):
        raise InputError(f"{partial}: is there but no unfinished run; move it away or choose another --out")


@contextmanager
def _locked(partial: Path) -> Iterator[FileLock]:
    """DIR.partial exists and is ours alone, until this process ends."""
    busy = InputError(f"{partial}: another process is working there; wait for it or choose another --out")
    path = partial / "stages" / _LOCK
    lock = FileLock(path, timeout=0)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock.acquire()
    except Timeout:
        raise busy from None
    except OSError as error:
        raise InputError(f"{partial}: {error.strerror}; choose another --out") from None
    try:
        if not path.exists():  # the folder was published, with the file that we opened, before we got the lock
            raise busy
        yield lock
    finally:
        lock.release()


def _claim(partial: Path, identity: str, force: bool) -> bool:
    """Make `partial` the place of this command; whether an earlier call of it worked there."""
    path = partial / "stages" / _COMMAND
    if path.exists() and not force:
        earlier = path.read_bytes()
        if earlier == identity.encode():
            return True
        advice = "choose another --out or add --force to discard it"
        raise InputError(f"{partial}: is an unfinished run of {_other(earlier, identity)}; {advice}")
    _clear(partial)
    write_whole(path, identity)
    return False


def _other(earlier: bytes, identity: str) -> str:
    """Whose run an earlier one is, that is not this one."""
    try:
        same = json.loads(earlier)["command"] == json.loads(identity)["command"]
    except (ValueError, LookupError, TypeError):
        return f"a command that cannot be read any more (stages/{_COMMAND})"
    return "this command with other package versions" if same else "another command"


def _clear(partial: Path) -> None:
    """Empty the folder, but for the lock that we hold."""
    for entry in (*partial.iterdir(), *(partial / "stages").iterdir()):
        if entry.name not in ("stages", _LOCK):
            shutil.rmtree(entry) if entry.is_dir() else entry.unlink()


def _publish(partial: Path, out: Path) -> None:
    """Rename `partial` to `out`. At every moment a whole run, old or new, is on disk."""
    for path in sorted(partial.iterdir()):
        if path.is_file():
            sync(path)
    sync(partial)
    aside = _aside(out)
    if out.exists():
        shutil.rmtree(aside, ignore_errors=True)  # left by a crash; `out` is newer
        out.rename(aside)
    partial.rename(out)
    sync(out.parent)
    _remove_leftovers(out)


def _remove_leftovers(out: Path) -> None:
    """What was needed to resume a run that is whole, and the run that it replaced."""
    shutil.rmtree(out / "stages", ignore_errors=True)  # another process may be at it too
    shutil.rmtree(_aside(out), ignore_errors=True)


def _aside(out: Path) -> Path:
    return out.with_name(f".{out.name}.replaced")


def _remove_empty(made: list[Path]) -> None:
    for folder in made:
        with suppress(OSError):  # not empty any more: somebody else uses it now
            folder.rmdir()


def _rounded(value: object) -> object:
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist(), _rounded)
    if isinstance(value, tuple):
        return plain(list(value), _rounded)
    if isinstance(value, float):
        return float(f"{value:.{_DIGITS}g}") + 0.0 if math.isfinite(value) else None  # + 0.0: no "-0.0"
    return value


def _canonical(value: object) -> str:
    return json.dumps(value, sort_keys=True, separators=(",", ":"))


def _without_none(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    return [_without_none(item) for item in value] if isinstance(value, (list, tuple)) else value
