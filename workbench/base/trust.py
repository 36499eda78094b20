"""Code that comes with data: it runs only where the user has said so, by the digest of what it says.

A rig file or a campaign is data, whoever sent it, but may name Python files with effects of its own. Such a file runs
after `jackbench trust FILE`, which keeps the digest of its content in the user's config folder: a file that has changed
since then is another file. What is allowed is trusted by this process and its workers only.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path

from .errors import InputError
from .files import read_bytes
from .private_cache import config_folder, is_private

_ALLOWED = "JACKBENCH_TRUSTED"  # in the environment, which worker processes inherit: digests, or EVERYTHING
_EVERYTHING = "*"


def trust(*files: str | Path) -> Path:
    """Remember what files of code say now, so that they may run.

    Parameters
    ----------
    *files
        Files with effects that a rig or a campaign names.

    Returns
    -------
    The list that remembers.

    Raises
    ------
    InputError
        For a file that cannot be read, or where the list cannot be written.
    """
    digests = {_digest(_content(file)): Path(file).resolve() for file in files}
    list_file = config_folder() / "trusted"
    known = _remembered()
    lines = [f"{digest}  {path}\n" for digest, path in digests.items() if digest not in known]
    try:
        list_file.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        with open(os.open(list_file, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600), "a", encoding="utf-8") as file:
            file.write("".join(lines))
    except OSError as error:
        raise InputError(f"{list_file}: {error.strerror}; digests of trusted files are kept there") from None
    return list_file


def allow(*files: str | Path) -> None:
    """Trust these files as they are now, until this process ends. Raises InputError for one that cannot be read."""
    os.environ[_ALLOWED] = " ".join([*_allowed(), *(_digest(_content(file)) for file in files)])


def allow_everything() -> None:
    """Trust every file, until this process ends."""
    os.environ[_ALLOWED] = _EVERYTHING


def granted() -> str:
    """What the user trusts, for a worker of another machine: `lent` takes it there."""
    return " ".join(sorted({*_allowed(), *_remembered()}))


@contextmanager
def lent(grants: str) -> Iterator[None]:
    """Trust what another machine's process was granted, inside this context. For one thread at a time."""
    before = os.environ.get(_ALLOWED, "")
    os.environ[_ALLOWED] = f"{before} {grants}"
    try:
        yield
    finally:
        os.environ[_ALLOWED] = before


def check(path: Path, content: bytes) -> None:
    """Raises InputError unless the user trusts a file of this content."""
    allowed, digest = _allowed(), _digest(content)
    if _EVERYTHING not in allowed and digest not in allowed and digest not in _remembered():
        raise InputError(
            f"{path}: Python code that a rig file names is not trusted; read it, then `jackbench trust {path}`, "
            "or add --trust for once"
        )


def _allowed() -> list[str]:
    return os.environ.get(_ALLOWED, "").split()


def _remembered() -> set[str]:
    """Trusted digests; none of a list that others could have written."""
    list_file = config_folder() / "trusted"
    try:
        with list_file.open(encoding="utf-8") as file:
            if not (is_private(os.fstat(file.fileno())) and is_private(list_file.parent.stat())):
                return set()
            return {line.split(maxsplit=1)[0] for line in file if line.strip()}
    except (OSError, UnicodeDecodeError):
        return set()


def _content(file: str | Path) -> bytes:
    return read_bytes(Path(file), kind="Python file")


def _digest(content: bytes) -> str:
    return sha256(content).hexdigest()
