"""CONTRIBUTING.md as a part that a page includes: what it says is written once."""

from pathlib import Path

ROOT = Path(__file__).parents[2]


def parts() -> dict[str, str]:
    """The text of CONTRIBUTING.md below its title."""
    return {"part_contributing.md": (ROOT / "CONTRIBUTING.md").read_text("utf-8").partition("\n")[2]}
