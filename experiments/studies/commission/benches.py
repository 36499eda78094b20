"""Rigs that are not jack-10t as its file has it: other benches, tighter limits, missing channels, other periods."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from workbench.rigs.number import Number
from workbench.rigs.rig import Rig
from workbench.rigs.schema import LIMITS

from ..trace.campaigns.scene import drawn_rig
from . import RIG


@dataclass(frozen=True)
class OtherBench:
    """The name of a datasheet, and what the live rig has otherwise: `limits` that its hello tells, SI, channels that it
    `lacks`, its `period` [s]; None: as declared."""

    datasheet: str = RIG
    limits: Mapping[str, float] = field(default_factory=dict)
    lacks: tuple[str, ...] = ()
    period: float | None = None

    def live(self, rig: Rig) -> Rig:
        """A rig of the datasheet as it is behind the link."""
        told = {
            name: Number(name, value, LIMITS[name].unit, LIMITS[name].unit, "") for name, value in self.limits.items()
        }
        sensors = {name: sensor for name, sensor in rig.sensors.items() if name not in self.lacks}
        period = replace(rig.period, value=self.period or rig.period.value)
        return replace(rig, limits={**rig.limits, **told}, sensors=sensors, period=period)


OTHERS = {
    "festo-tp511": OtherBench("festo-tp511"),
    "pump-rig": OtherBench("pump-rig"),
    "bench-26kN": OtherBench("second-order-33"),
    "bench-251kN": OtherBench("second-order-122"),
    "slow-and-short": OtherBench(limits={"speed": 1.0, "stroke": 0.12}),
    "120-bar": OtherBench(limits={"pressure": 120e5}),
    "no-spool-no-acceleration": OtherBench(lacks=("spool", "acceleration")),
    "one-pressure": OtherBench(lacks=("pb",)),
    "500-Hz": OtherBench(period=2e-3),
    "5-kHz": OtherBench(period=2e-4),
}


def bench_of(name: str) -> OtherBench:
    """The bench of a name; jack-10t as its file has it without one."""
    return OTHERS[name] if name else OtherBench()


def datasheet_of(name: str) -> Rig:
    """The datasheet of the bench of a name."""
    return drawn_rig(bench_of(name).datasheet, "")
