"""What retuning would give back now: the controller searched anew on the rig as the newest session finds it."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ...base.errors import InputError
from ...rigs.rig import Rig
from ..common.outcome import no_checkpoint
from ..retune.config import load_retune
from ..retune.study import run_retune

DESIGNS = 200
Retuning = Callable[[Rig], Mapping[str, Any] | None]


def retuned(experiment: Path, controller: str, rig: Rig) -> dict[str, Any] | None:
    """`gain` (figures of the last step before and after), the `numbers` that move, and what the search `missed`; None
    where the controller cannot be searched."""
    try:
        config = load_retune(experiment, rig, controller=controller, designs=DESIGNS)
        found = run_retune(config, no_checkpoint, lambda _: None).metrics
    except InputError:
        return None
    return {key: found[key] for key in ("scenario", "gain", "numbers", "missed", "trials")}
