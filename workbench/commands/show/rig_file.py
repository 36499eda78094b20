"""A rig as the text of a rig file."""

from importlib.resources import files

from ...rigs.rig import Rig
from ...rigs.rig_file import bundled, rig_text


def rig_file(name: str, rig: Rig) -> str:
    """The file of a bundled rig with its comments; of any other rig, its tables."""
    return (files("workbench") / "rigs" / f"{name}.toml").read_text("utf-8") if name in bundled() else rig_text(rig)
