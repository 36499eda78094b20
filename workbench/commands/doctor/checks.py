"""What an installation can do, one row a part: whether it works, what was found, and how to get it."""

import ctypes
import os
import platform
import re
import shutil
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version

from ...base.cores import cores
from ...base.desktop import has_desktop
from ...base.errors import InputError
from ...base.private_cache import cache_folder, config_folder
from ..fmu.compiler import compiler

GROUPS = {
    "rl": "training with Stable-Baselines3",
    "tdms": "import of TDMS files",
    "mdf": "import of MDF files",
    "xlsx": "import of Excel sheets",
    "uff": "import of universal files",
    "mujoco": "the jack in a MuJoCo model",
    "cluster": "the workers of a Dask cluster",
    "fmu": "checking and simulating FMUs",
    "opcua": "a SCADA panel that looks on at a served rig",
}  # the optional groups of pyproject.toml, and what each is for
_IR = "define double @sum(double %a, double %b) {\n %c = fadd double %a, %b\n ret double %c\n}"


@dataclass(frozen=True)
class SelfTest:
    """A part of the installation; `advice` says how to get it where it does not work."""

    what: str
    works: bool
    found: str
    advice: str = ""


def checks() -> list[SelfTest]:
    """Every part, what is needed before what is optional."""
    return [_python(), *_libraries(), _machine_code(), _cores(), *_folders(), _c_compiler(), *_groups(), _desktop()]


def _python() -> SelfTest:
    found = (
        f"{platform.python_version()}, {platform.system()} {platform.machine()}, jackbench {_installed('jackbench')}"
    )
    return SelfTest("Python", True, found)


def _libraries() -> Iterator[SelfTest]:
    """The distributions that jackbench does not do without."""
    names = [name for name, group in _requirements() if not group]
    missing = [name for name in names if not _installed(name)]
    if missing:
        advice = f"pip install {' '.join(missing)}"
        yield SelfTest("libraries", False, f"without {', '.join(missing)}", advice)
    elif names:
        yield SelfTest("libraries", True, ", ".join(f"{name} {_installed(name)}" for name in names))


def _groups() -> Iterator[SelfTest]:
    """The optional groups; one works when all of its distributions are there."""
    for group, purpose in GROUPS.items():
        names = [name for name, of in _requirements() if of == group]
        there = bool(names) and all(_installed(name) for name in names)
        found = ", ".join(f"{name} {_installed(name)}" for name in names) if there else purpose
        yield SelfTest(group, there, found, f"pip install 'jackbench[{group}]' ({purpose})")


def _requirements() -> list[tuple[str, str]]:
    """Each distribution that the installed jackbench names, with its optional group or ""."""
    try:
        lines = requires("jackbench") or []
    except PackageNotFoundError:  # a copy of the sources alone
        return []
    pairs = []
    for line in lines:
        name = re.match(r"[\w.-]+", line)
        group = re.search(r"extra == ['\"]([\w-]+)", line)
        pairs.append((name.group() if name else line, group.group(1) if group else ""))
    return pairs


def _machine_code() -> SelfTest:
    """Compiles, links and calls a sum; a system that forbids code made at run time fails here."""
    advice = "pip install llvmlite; without it plants run through an interpreter, many times slower"
    try:
        from ...engine.object_cache import load, vector_width

        library = load(["doctor"], lambda: _IR, ["sum"])
        works = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double, ctypes.c_double)(library["sum"])(1.0, 2.0) == 3.0
        return SelfTest("machine code", works, f"{platform.machine()}, blocks of {vector_width()} plants", advice)
    except (ImportError, OSError, RuntimeError) as error:
        return SelfTest("machine code", False, str(error).partition("\n")[0], advice)


def _cores() -> SelfTest:
    return SelfTest("cores", True, f"{cores()} of {os.cpu_count()}; --jobs N takes fewer")


def _folders() -> Iterator[SelfTest]:
    """Checks of the folders of compiled plants and of trusted code."""
    folder = cache_folder()
    place = next(path for path in (folder, *folder.parents) if path.exists())
    size = sum(path.stat().st_size for path in folder.glob("*") if path.is_file()) / 1e6
    advice = f"let {place} be written to, or set XDG_CACHE_HOME; without it every start compiles its plants anew"
    yield SelfTest("cache", os.access(place, os.W_OK), f"{folder}, {size:.0f} MB; may be deleted", advice)
    yield SelfTest("trusted code", True, f"listed in {config_folder() / 'trusted'}")


def _c_compiler() -> SelfTest:
    try:
        return SelfTest("C compiler", True, compiler())
    except InputError:
        return SelfTest("C compiler", False, "for FMUs and for the programs of `coefficients`", "install gcc or clang")


def _desktop() -> SelfTest:
    terminal = shutil.get_terminal_size().columns
    found = f"a terminal of {terminal} columns, {sys.stdout.encoding}"
    return SelfTest("desktop", has_desktop(), found, "reports are files; open them in a browser of another machine")


def _installed(name: str) -> str:
    """The version of a distribution; nothing where it is not installed."""
    try:
        return version(name)
    except PackageNotFoundError:
        return ""
