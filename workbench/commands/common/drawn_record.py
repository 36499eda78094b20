"""A record on plants drawn over what is uncertain of a rig, beside the rigs of its set."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...base.signals import Signal
from ...base.table import ConfigTable
from ...base.units import from_si
from ...loop.robustness.drawn_plants import PlantDraw, draw_plants
from ...plant import Plant
from ...rigs.rig import Rig
from .envelope_keys import MOST_PLANTS, draws_nothing, read_factors

KEYS = ("plants", "draw", "stroke")


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


def read_drawn(
    top: ConfigTable, rig: Rig, seed: int, signal: Signal, reference: np.ndarray, plants: int | None
) -> DrawnConfig | None:
    """`plants`, [draw] and `stroke`, the share of the stroke limit within which a record [k] stays; None without them.

    An argument `plants` replaces that of the file. Raises InputError with file and key; for a larger record too.
    """
    if draws_nothing(top, plants, *KEYS[1:]):
        return None
    reach = top.positive("stroke") * rig.limit("stroke")
    low, high = (reference.min(), reference.max()) if signal.name == "position" else (0.0, 0.0)
    if rig.is_jack and max(-low, high) > reach:
        size = float(from_si(max(-low, high), signal.unit, signal.si))
        raise top.complaint("stroke", f"the record of {size:.4g} {signal.unit} leaves it even from mid stroke")
    return DrawnConfig(
        rig,
        plants or top.count("plants", 1, MOST_PLANTS),
        seed,
        read_factors(top, rig),
        (-reach - min(low, 0.0), reach - max(high, 0.0)),
    )
