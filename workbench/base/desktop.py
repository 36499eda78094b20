"""A page in the browser of this machine."""

import os
import sys
import webbrowser
from pathlib import Path


def show_file(path: Path) -> bool:
    """Open the file in a browser where there is a desktop to open it on; whether it was."""
    return has_desktop() and webbrowser.open(path.resolve().as_uri())


def has_desktop() -> bool:
    """Without one, a browser of the terminal would wait for somebody to close it."""
    if os.environ.get("CI"):
        return False
    return sys.platform in ("win32", "darwin") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
