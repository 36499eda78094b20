"""Experiments and campaigns that come with jackbench: a folder of the repository, package data of a wheel."""

from importlib.resources import files
from pathlib import Path


def shipped() -> Path:
    """The folder of the shipped experiments; it may be missing in a copy of the sources alone."""
    package = Path(str(files("workbench")))
    installed = package / "experiments"
    return installed if installed.is_dir() else package.parent / "experiments"


def experiment(text: str | Path) -> Path:
    """The path of an experiment: one that exists, or else a shipped one by its bare name (`paper`)."""
    return _found(text, f"{text}.toml")


def campaign(text: str | Path) -> Path:
    """The path of a campaign folder: one that exists, or else a shipped one by its bare name (`sample`)."""
    return _found(text, str(text))


def _found(text: str | Path, name: str) -> Path:
    path = Path(text)
    bare = text not in ("", ".", "..") and path.name == str(text)
    ours = shipped() / name
    return ours if bare and not path.exists() and ours.exists() else path
