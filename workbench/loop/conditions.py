"""What a loop is judged under: its computing delay, and the noise and resolution of its sensors."""

from dataclasses import dataclass

from ..control.controller_spec import ControllerSpec
from ..rigs.rig import Rig


@dataclass(frozen=True)
class Conditions:
    """The computing delay, and sensor noise and resolution drawn from `seed`; none of them where `ideal`."""

    ideal: bool = False
    seed: int = 0

    @property
    def noise(self) -> int | None:
        """The seed of the sensors' noise; None without noise."""
        return None if self.ideal else self.seed

    def delay(self, spec: ControllerSpec, rig: Rig) -> float:
        """Computing delay [s] of a controller on a rig: its own where it has one, else the rig's."""
        if self.ideal:
            return 0.0
        return rig.computing_delay.value if spec.computing_delay is None else spec.computing_delay
