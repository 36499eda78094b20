"""The file of an automatic tuning experiment: a set of rigs, and plants drawn as `jackbench robustness` draws them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.table import ConfigTable
from ...control.automatic_tuning import READ, pulses
from ...control.controller_spec import ControllerSpec
from ...loop.scenarios import Scenario
from ...rigs.rig import Rig
from ..common.rig_sets import check_variations, read_rig_set
from ..common.scenario_tables import check_scenarios, read_scenarios
from ..robustness.config import RobustnessConfig, read_drawn_steps

_KEYS = (
    "experiment", "rig", "rigs", "variation", "scenarios", "scenario", "plants", "seed", "ideal", "step", "seconds",
    "stroke", "positions", "draw",
)  # fmt: skip


@dataclass(frozen=True)
class AutomaticConfig:
    """`rigs` by name, each tuned and then played in `scenarios`; `drawn`: plants, each tuned and then stepped.

    The one controller of `drawn` makes its moves as the datasheet's rig, that of `drawn`, allows.
    """

    rigs: Mapping[str, Rig]
    scenarios: tuple[Scenario, ...]
    drawn: RobustnessConfig

    @property
    def rig(self) -> Rig:
        """The datasheet's."""
        return self.drawn.rig

    @property
    def moving(self) -> ControllerSpec:
        """The controller that tunes itself."""
        return self.drawn.controllers[0]

    @property
    def delay(self) -> float:
        """Its computing delay [s]."""
        return self.drawn.conditions.delay(self.moving, self.rig)

    @property
    def pulses(self) -> np.ndarray:
        """The commands [k] of its moves."""
        return pulses(self.moving.design.pulse, self.rig.period.value)

    @property
    def source(self) -> Mapping[str, Any]:
        """The experiment file as it was read."""
        return self.drawn.source


def automatic_config(top: ConfigTable, rig: Rig) -> AutomaticConfig:
    """The tables of the experiment on a rig. Raises InputError."""
    from ...loop.automatic import self_tuning  # builds plants, which a refusal does not need

    top.allow(*_KEYS)
    missing = [name for name in READ if name not in rig.sensors]
    if missing or not rig.is_jack:
        raise top.complaint("rig", f"the moves need a jack with position, pa and pb; {rig.name} has no {missing[0]}")
    rigs = read_rig_set(top, "rigs", top, rig)
    check_variations(top, rigs)
    scenarios = read_scenarios(top, rig)
    if elsewhere := [scenario.name for scenario in scenarios if scenario.signal != "position"]:
        raise top.complaint("scenarios", f"{elsewhere[0]} asks for no position, which is what is tuned; remove it")
    check_scenarios(top, scenarios, list(rigs.values()))
    signal = rig.signal("position")
    return AutomaticConfig(rigs, scenarios, read_drawn_steps(top, rig, signal, (self_tuning(rig),), None, top.values))
