"""A record on plants drawn over what is uncertain of a rig, beside the rigs of its set."""

from collections.abc import Mapping
from dataclasses import dataclass

from ...base.units import from_si
from ...loop.repeated_record import faded
from ...loop.robustness.drawn_plants import PlantDraw, draw_plants
from ...plant import Plant
from ...rigs.rig import Rig
from .declared import ExperimentFile
from .envelope_keys import draws_nothing, read_factors


@dataclass(frozen=True)
class DrawnConfig:
    """How many plants of a rig, by which seed, with which factors [low, high] on its numbers, where in a `span` [m]."""

    rig: Rig
    plants: int
    seed: int
    factors: Mapping[str, tuple[float, float]]
    span: tuple[float, float]

    def draw(self, plant: Plant) -> PlantDraw:
        """The plants, of the rig's own or one with a computing delay."""
        return draw_plants(self.rig, plant, self.factors, self.plants, self.seed, self.span)


def read_drawn(at: ExperimentFile) -> DrawnConfig | None:
    """`plants`, [within] and `stroke`, the share of the stroke limit within which a record stays; None without them.
    Raises InputError with file and key; for a larger record too."""
    top, rig, signal = at.top, at.rig, at.signal
    if draws_nothing(at, "within", "stroke"):
        return None
    reach = top.positive("stroke") * rig.limit("stroke")
    reference = faded(at.scenario, at.rest, at.fade, rig.period.value)
    low, high = (reference.min(), reference.max()) if signal.name == "position" else (0.0, 0.0)
    if rig.is_jack and max(-low, high) > reach:
        size = float(from_si(max(-low, high), signal.unit, signal.si))
        raise top.complaint("stroke", f"the record of {size:.4g} {signal.unit} leaves it even from mid stroke")
    span = -reach - min(low, 0.0), reach - max(high, 0.0)
    return DrawnConfig(rig, at.plants, at.conditions.seed, read_factors(top, rig), span)
