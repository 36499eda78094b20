"""A record on plants drawn over what is uncertain of a rig, beside the rigs of its set."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...base.signals import Signal
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
    top, rig = at.top, at.rig
    if draws_nothing(at, "within", "stroke"):
        return None
    stroke, reference = top.positive("stroke"), faded(at.scenario, at.rest, at.fade, rig.period.value)
    span = span_of(rig, at.signal, reference, stroke, top.complaint)
    return DrawnConfig(rig, at.plants, at.conditions.seed, read_factors(top, rig), span)


def span_of(
    rig: Rig, signal: Signal, reference: np.ndarray, stroke: float, complaint: Callable[[str, str], InputError]
) -> tuple[float, float]:
    """From where to where a record [k] of a signal, SI, may begin [m], so that it stays within a share of the stroke.

    Raises the `complaint` of the key for a larger record.
    """
    reach = stroke * rig.limit("stroke")
    low, high = (reference.min(), reference.max()) if signal.name == "position" else (0.0, 0.0)
    if rig.is_jack and max(-low, high) > reach:
        size = float(from_si(max(-low, high), signal.unit, signal.si))
        raise complaint("stroke", f"the record of {size:.4g} {signal.unit} leaves it even from mid stroke")
    return -reach - min(low, 0.0), reach - max(high, 0.0)
