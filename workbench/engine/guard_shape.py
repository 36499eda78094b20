"""What the guard's graph reads, keeps and is given: places in its vectors, and the names of trips."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from ..base.signals import MEASURED

WATCHED = ("position", "force", "pa", "pb", "supply", "spool")  # what the rules read beside what the law does
TRIPS = (
    "",
    "stroke",
    "speed",
    "force",
    "command",
    "braking",
    "lost",
    "observer",
    "impulse",
    "following",
    "pressure",
    *(f"{what} {name}" for what in ("still", "finite") for name in MEASURED),
    "beside",
)  # by the number that a tripped guard keeps; "command", "finite pa": not a finite one; "beside": another leg tripped
BESIDE = TRIPS.index("beside")


def places(**sizes: int) -> dict[str, slice]:
    ends = accumulate(sizes.values())
    return {name: slice(end - size, end) for (name, size), end in zip(sizes.items(), ends, strict=True)}


def packed(places: Mapping[str, slice], **values: np.ndarray | float) -> np.ndarray:
    """Values [.., size of their place], a number standing for a single one, side by side: [.., k]."""
    parts = [np.atleast_1d(np.asarray(values[name], float)) for name in places]
    lead = np.broadcast_shapes(*(part.shape[:-1] for part in parts))
    return np.concatenate([np.broadcast_to(part, (*lead, part.shape[-1])) for part in parts], axis=-1)


def length(of: Mapping[str, slice]) -> int:
    """The length of a vector with such places."""
    return max(place.stop for place in of.values())


@dataclass(frozen=True)
class GuardShape:
    """What decides the graph: the signals `read`, whether the rig is a `jack` that is known, whether it is a `leg` of a
    platform, which others push, too, and whether a `cell` measures what pushes at the moving mass from behind."""

    read: tuple[str, ...]
    jack: bool
    leg: bool = False
    cell: bool = True

    @property
    def observes(self) -> bool:
        """Whether flow and pressures say how the jack moves."""
        return self.jack and "pa" in self.read and "pb" in self.read

    @property
    def balances(self) -> bool:
        """Whether pressures and load cell say how the mass is accelerated."""
        return self.observes and self.cell and "force" in self.read

    @property
    def state(self) -> dict[str, slice]:
        """Places in the guard's state: reason for a trip, command to which the brake has come, samples since the start,
        filtered position and speed, force and its rate, integrals of the observer, load at rest, spool, whether
        and where the jack is held, samples that it is astray, last readings, repeats."""
        names = ("trip", "brake", "count", "x", "v", "f", "df", "flow", "gap", "travel", "strain", "impulse", "change")
        read = len(self.read)
        return places(**dict.fromkeys((*names, "rest", "spool", "held", "stand", "astray"), 1), last=read, still=read)

    @property
    def numbers(self) -> dict[str, slice]:
        """Places of the numbers of a rig."""
        names = ("middle", "stroke", "speed", "move", "force", "step", "period", "fast", "slow", "calm", "hold")
        names += ("mass", "braking", "stall", "over", "late", "latency", "opening", "fade", "following", "patience")
        names += ("forget", "allowed", "flow_share", "mass_share", "allowed_impulse", "friction", "lag", "null")
        names += ("flow_a", "flow_b", "lap", "travel", "oil", "specimen", "area_a", "area_b", "supply", "drain")
        names += ("weight", "drag", "pushed", "largest", "pressure", "least_pressure", "line_mass", "line_drag")
        return places(**dict.fromkeys(names, 1), repeats=len(self.read))

    def at(self, name: str) -> int:
        """Place of a signal in the readings."""
        return self.read.index(name)
