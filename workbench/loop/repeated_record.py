"""A record that a loop plays again and again, each time from rest where it starts, with noise of its own."""

from dataclasses import dataclass

import numpy as np

from ..control.controller_spec import ControllerSpec
from . import step_metrics as metrics
from .learning import Iteration
from .rows import LoopSetup
from .sampled_loop import SampledLoop
from .scenarios import Scenario
from .sensors import logged


def faded(scenario: Scenario, rest: float, fade: float, period: float) -> np.ndarray:
    """A scenario's course [k], from the start, with `rest` [s] before and after, faded in and out over `fade` [s]."""
    t = np.arange(round((scenario.duration + 2 * rest) / period) + 1) * period - rest
    inside = np.clip(t, 0.0, scenario.duration)
    course = scenario.reference(inside)
    if not fade:
        return course
    share = np.clip(np.minimum(inside, scenario.duration - inside) / fade, 0.0, 1.0)
    return np.sin(np.pi / 2 * share) ** 2 * course


def noise_seed(seed: int | None, number: int) -> int | None:
    """The seed of the noise of the nth time, from -2, that a record is played."""
    return None if seed is None else int(np.random.SeedSequence([seed, number + 2]).generate_state(1)[0])


@dataclass(frozen=True)
class RepeatedRecord:
    """A controller that plays drive files of a signal where a scenario starts; `seed` is that of its sensors' noise."""

    spec: ControllerSpec
    scenario: Scenario
    setup: LoopSetup
    seed: int | None

    @property
    def level(self) -> float:
        """The controlled signal at the start (SI): drives are deviations from it."""
        plant, start = self.setup.engine.plant, self.setup.where(self.scenario).null
        return float(self.setup.engine.observe(start.x, start.u)[plant.output(self.scenario.signal)])

    def play(self, number: int, drive: np.ndarray, gain: float) -> Iteration:
        """The nth time, from -2: another drive [k], and other noise. `gain` is that by which it was corrected."""
        seed = noise_seed(self.seed, number)
        setup, start = self.setup, self.setup.where(self.scenario).null
        controller = self.spec.build(setup.rig.period.value)
        run = SampledLoop(setup.engine, setup.rig, controller, start, seed).run(self.level + drive)
        signals, name = run.record.signals, self.scenario.signal
        return Iteration(
            drive,
            signals[name] - self.level,
            logged(signals, setup.rig, setup.engine.plant.outputs, seed)[name] - self.level,
            signals["command"],
            metrics.saturated_time(run.record.t, run.demanded, signals["command"]),
            float(signals["lowest_pressure"].min()) if setup.rig.is_jack else None,
            run.tripped,
            gain,
        )
