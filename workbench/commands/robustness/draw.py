"""The plants of a robustness experiment, with room for the step within the share of the stroke."""

from ...plant import Plant
from ..common.plant_draw import PlantDraw, draw_plants
from .config import RobustnessConfig


def drawn(config: RobustnessConfig, plant: Plant, block: range | None = None) -> PlantDraw:
    """The same for the same seed, all or a `block` of them. The first is the nominal one at mid stroke."""
    reach = config.stroke * config.rig.limit("stroke")
    way = config.step if config.signal.name == "position" else 0.0
    span = -reach, reach - way
    return draw_plants(config.rig, plant, config.factors, config.plants, config.conditions.seed, span, block)
