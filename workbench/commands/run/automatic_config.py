"""An automatic tuning experiment: a set of rigs, and plants drawn as `jackbench robustness` draws them."""

from collections.abc import Mapping

import numpy as np

from ...control.automatic_tuning import READ, pulses
from ...control.controller_spec import ControllerSpec
from ...loop.scenarios import Scenario
from ...rigs.rig import Rig
from ..common.declared import Experiment, ExperimentFile, declared, meanings, part
from ..common.experiment import RIG, asked_rig
from ..common.rig_sets import RIGS, checked_rig_set
from ..common.scenario_tables import SCENARIOS_KEYS, check_scenarios, read_scenarios
from ..robustness.options import RobustnessConfig

_NOT_DRAWN = ("experiment", "specimen", "known", "moves", "controllers", "from")  # keys of a robustness experiment


def _rig(at: ExperimentFile) -> Rig:
    rig = asked_rig(at)
    missing = [name for name in READ if name not in rig.sensors]
    if missing or not rig.is_jack:
        raise at.top.complaint("rig", f"the moves need a jack with position, pa and pb; {rig.name} has no {missing[0]}")
    return rig


def _scenarios(at: ExperimentFile) -> tuple[Scenario, ...]:
    scenarios = read_scenarios(at.top, at.rig)
    if elsewhere := [scenario.name for scenario in scenarios if scenario.signal != "position"]:
        raise at.top.complaint("scenarios", f"{elsewhere[0]} asks for no position, which is what is tuned; remove it")
    check_scenarios(at.top, scenarios, at.rigs.values())
    return scenarios


def _drawn(at: ExperimentFile) -> RobustnessConfig:
    from ...loop.automatic import self_tuning  # builds plants, which a refusal does not need

    known = {"rig": at.rig, "signal": at.rig.signal("position"), "controllers": (self_tuning(at.rig),)}
    return RobustnessConfig.read(ExperimentFile(RobustnessConfig, at.top, at.path, {}, known | {"source": at.source}))


@declared
class AutomaticConfig(Experiment):
    """`rigs` by name, each tuned and then played in `scenarios`; `drawn`: plants, each tuned and then stepped.

    The one controller of `drawn` makes its moves as the datasheet's rig, that of `drawn`, allows.
    """

    KIND = "automatic"
    rig: Rig = part(_rig, RIG)
    rigs: Mapping[str, Rig] = part(checked_rig_set, RIGS)
    scenarios: tuple[Scenario, ...] = part(_scenarios, SCENARIOS_KEYS)
    drawn: RobustnessConfig = part(
        _drawn, {key: text for key, text in meanings(RobustnessConfig).items() if key not in _NOT_DRAWN}
    )

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
