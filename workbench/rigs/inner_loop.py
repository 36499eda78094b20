"""An inner loop of a rig: a controller that somebody else made, of which only the reference can be written."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..base.units import Spec

if TYPE_CHECKING:
    from ..base.table import ConfigTable

POSITION, FORCE = "position", "force"
GAIN = "loop_gain"  # the one number that every inner loop has
DELAY = "loop_delay"
_OF_POSITION = "loop_derivative_time"  # a force has no rate in the graph
_SI = {POSITION: "m", FORCE: "N"}
_REFERENCES = {POSITION: "reference", FORCE: "force_reference"}


@dataclass(frozen=True)
class InnerLoop:
    """What it `controls`, "position" or "force", and the reference [m or N] at the rig's command 1, `full_command`.

    Its numbers are among those of the rig.
    """

    controls: str
    full_command: float

    @property
    def reference(self) -> str:
        """The signal that is written to it."""
        return _REFERENCES[self.controls]

    @property
    def specs(self) -> Mapping[str, Spec]:
        """Unit, possible range and meaning of the numbers that it may have."""
        return inner_specs(self.controls)

    def table(self) -> dict[str, Any]:
        """The table of a rig file, without its numbers."""
        return {"controls": self.controls, "full_command": f"{self.full_command!r} {_SI[self.controls]}"}


def inner_specs(controls: str) -> dict[str, Spec]:
    """Unit, possible range and meaning of the numbers of a loop that `controls` position or force."""
    si = _SI[controls]
    specs = {
        GAIN: Spec(f"1/{si}", 1e-9, 1e6, "valve command per error of the inner loop"),
        "loop_integral_time": Spec("s", 1e-4, 1e4, "integral time of the inner loop"),
        _OF_POSITION: Spec("s", 0.0, 1.0, "derivative time of the inner loop, on what it controls"),
        "loop_feed_forward": Spec("s", 0.0, 1.0, "time by which the inner loop leads its reference"),
        "loop_pressure_feedback": Spec("1/Pa", 0.0, 1e-4, "valve command taken off per load pressure"),
        "loop_lag": Spec("s", 1e-5, 1.0, "time constant of the output of the inner loop"),
        DELAY: Spec("s", 0.0, 0.5, "time by which the inner loop has its reference late"),
    }
    return {name: spec for name, spec in specs.items() if controls == POSITION or name != _OF_POSITION}


def read_inner_loop(table: "ConfigTable", stroke: float, force: float) -> InnerLoop:
    """The loop of the table `inner` of a rig file, without its numbers; `stroke` [m] and `force` [N] are the limits,
    which are the reference at command 1 where the table does not say. Raises InputError where it has no gain."""
    controls = table.word("controls", (POSITION, FORCE), POSITION)
    if GAIN not in table:
        rough = {POSITION: '40, unit = "1/m", bounds = [0.8, 2000]', FORCE: '2e-6, unit = "1/N", bounds = [4e-8, 1e-4]'}
        why = (
            "missing, and without it there is no loop; where nobody knows it give a rough value in wide bounds, such as"
        )
        raise table.complaint(GAIN, f"{why} {GAIN} = {{value = {rough[controls]}}}")
    full = {POSITION: stroke, FORCE: force}[controls]
    if "full_command" in table:
        full = table.quantity("full_command", Spec(_SI[controls], 1e-9, 1e9, "reference at command 1"))
    return InnerLoop(controls, full)
