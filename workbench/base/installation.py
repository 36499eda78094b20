"""What is installed here and computes: versions, and a digest of the package's own code."""

import platform
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

Installation = tuple[tuple[str, str], ...]  # name and version

_ROOT = Path(__file__).parents[2]
_CODE = "workbench", "controllers"
_LIBRARIES = "numpy", "scipy", "casadi", "control", "llvmlite"


@cache
def installation() -> Installation:
    """jackbench with the digest of its code, Python, and the libraries that compute."""
    own = f"{_version('jackbench')} ({_digest()})"
    return ("jackbench", own), ("Python", platform.python_version()), *((name, _version(name)) for name in _LIBRARIES)


def differences(here: Installation, there: Installation) -> str:
    """What differs there, and from what it differs here; nothing where all is the same."""
    ours = dict(here)
    return ", ".join(f"{name} {version}, not {ours[name]}" for name, version in there if version != ours[name])


def _digest() -> str:
    code = sha256()
    for path in sorted(path for package in _CODE for path in (_ROOT / package).rglob("*.py")):
        code.update(path.relative_to(_ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    return code.hexdigest()[:12]


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"
