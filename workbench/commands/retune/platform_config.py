"""Modal laws for another platform: the numbers that follow from a mode go with it.

Along its mode a platform is a jack of one mass m on the oil of six, w^2 = c/m with the same c. A feed-forward of that
mode has its w; a pressure feedback that damps it as much has a gain in proportion to w (2 zeta = gain c/(w Kv)). Gain
of position and corners stay.
"""

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...base.table import ConfigTable
from ...control.platform_controller import LEGS
from ..run.platform_config import PlatformConfig

_FEEDS_PRESSURE = "PressureFeedback"


@dataclass(frozen=True)
class PlatformRetune:
    """An experiment on the declared platform and on the found one, which `rig` names; only controllers on modes can
    follow it."""

    declared: PlatformConfig
    found: PlatformConfig
    top: ConfigTable
    path: Path
    rig: str

    @property
    def modal(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(spec.name for spec in self.found.controllers if spec.modal)

    def retuned(self, ratio: np.ndarray) -> PlatformConfig:
        """The experiment on the found platform with laws whose modes are `ratio` [6] times as fast as before."""
        tables = {name: followed(self.found.source["controllers"][name], ratio) for name in self.modal}
        top = self.top.replaced({**self.top.values, "controllers": tables})
        return PlatformConfig.of(top, self.path, self.rig)


def load_platform_retune(top: ConfigTable, path: Path, rig: str | None, found: str) -> PlatformRetune:
    """The experiment on both, `rig` in place of the declared one where it is given.

    Raises InputError with file and key, and where no controller has laws on modes.
    """
    retune = PlatformRetune(PlatformConfig.of(top, path, rig), PlatformConfig.of(top, path, found), top, path, found)
    if not retune.modal:
        raise top.complaint("controllers", "none has laws on modes; only those follow another payload")
    return retune


def followed(table: Mapping[str, Any], ratio: np.ndarray) -> dict[str, Any]:
    """The table of a controller on modes for modes [6] so many times as fast."""
    table = deepcopy(dict(table))
    for law in table["laws"]:
        own = float(np.mean([ratio[int(mode) - 1] for mode in law["modes"] if 1 <= mode <= LEGS]))
        if "forward" in law and "frequency" in law["forward"]:
            law["forward"]["frequency"] = _times(law["forward"]["frequency"], own)
        for compensator in law.get("compensators", ()):
            if compensator["use"].endswith(_FEEDS_PRESSURE):
                compensator["gain"] = _times(compensator["gain"], own)
    return table


def _times(quantity: Any, ratio: float) -> Any:
    """A number with its unit, as a file has it, so many times larger, to five digits."""
    if isinstance(quantity, Mapping):
        return {**quantity, "value": _rounded(quantity["value"] * ratio)}
    number, _, unit = str(quantity).partition(" ")
    return f"{_rounded(float(number) * ratio):g} {unit}".strip()


def _rounded(value: float) -> float:
    return float(f"{value:.5g}")
