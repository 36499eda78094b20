"""Puts the shipped experiments into the wheel, as package data of the workbench; studies stay in the repository."""

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Shipped(BuildHookInterface):
    """Everything in experiments/ but the studies."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Say what a wheel has beside its packages."""
        for path in sorted(Path(self.root, "experiments").iterdir()):
            if path.name not in ("studies", "__pycache__"):
                build_data["force_include"][str(path)] = f"workbench/experiments/{path.name}"
