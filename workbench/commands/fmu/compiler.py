"""The C compiler of this machine."""

import shutil

from ...base.errors import InputError


def compiler() -> str:
    """Its path. Raises InputError where there is none."""
    path = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if path is None:
        raise InputError("an FMU is compiled C, and there is no cc, gcc or clang here; install a C compiler")
    return path
