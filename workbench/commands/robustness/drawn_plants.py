"""What every controller's loops need: the engine, the drawn plants and their operating points at null and moving."""

from dataclasses import dataclass

from ...engine import Engine
from ...linear.equilibria import Equilibria, equilibria
from ...linear.operating_point import far_end
from ...loop.rig_variations import with_delay
from ...plant import build
from ...rigs.rig import Rig
from ..common.plant_draw import PlantDraw
from .config import RobustnessConfig
from .draw import drawn

POINTS = ("null", "moving")


@dataclass(frozen=True)
class DrawnPlants:
    """The drawn plants of a rig with its computing delay; `points`: theirs at "null" and "moving", where drawn."""

    rig: Rig
    engine: Engine
    draw: PlantDraw
    points: dict[str, Equilibria]


def drawn_plants(config: RobustnessConfig, delay: float) -> DrawnPlants:
    """Draw and balance them, for a computing delay [s]. Raises InputError where the nominal one has no such point."""
    rig = with_delay(config.rig, delay)
    engine = Engine(build(rig))
    plant, draw = engine.plant, drawn(config, engine.plant)
    speed = rig.passing_speed
    smooth, at = plant.without_dry_friction(draw.p), draw.position  # a specimen is relaxed there
    points = {
        "null": equilibria(plant, draw.p, at, None, None, **far_end(plant, at)),
        "moving": equilibria(plant, smooth, at, speed, None, **far_end(plant, at, speed)),
    }
    return DrawnPlants(rig, engine, draw, points)
