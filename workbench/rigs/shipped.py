"""The rigs and platforms that come with jackbench, by name."""

from importlib.resources import files


def bundled() -> list[str]:
    """Names of the rigs that come with jackbench."""
    return _names("rigs")


def bundled_platforms() -> list[str]:
    """Names of the platforms that come with jackbench."""
    return _names("rigs", "platform")


def _names(*folders: str) -> list[str]:
    """The names of the TOML files in a folder of the package."""
    folder = files("workbench").joinpath(*folders)
    return sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".toml"))
