"""What every controller's loops need: the engine, drawn plants and their operating points at null and moving."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache

from ...engine import Engine
from ...linear.equilibria import Equilibria, equilibria
from ...linear.operating_point import far_end
from ...plant import build
from ...rigs.rig import Rig
from ..rig_variations import with_delay
from .plant_draw import PlantDraw, drawn
from .problem import RobustnessProblem

POINTS = ("null", "moving")


@dataclass(frozen=True)
class DrawnPlants:
    """A `block` of the drawn plants of a rig with its computing delay; `points`: theirs at "null" and "moving", where
    drawn."""

    rig: Rig
    engine: Engine
    block: range
    draw: PlantDraw
    points: dict[str, Equilibria]


def plants_by_block(problem: RobustnessProblem) -> Callable[[float, range], DrawnPlants]:
    """The drawn plants by computing delay [s] and block; the last ones are kept, for several tasks need them."""
    stand = cache(lambda delay: Engine(build(with_delay(problem.rig, delay))))
    return lru_cache(1)(lambda delay, block: drawn_plants(problem, with_delay(problem.rig, delay), stand(delay), block))


def drawn_plants(problem: RobustnessProblem, rig: Rig, engine: Engine, block: range) -> DrawnPlants:
    """Draw and balance a block of them. Raises InputError where the nominal one has no such point."""
    plant, draw = engine.plant, drawn(problem, engine.plant, block)
    speed = rig.passing_speed
    smooth, at = plant.without_dry_friction(draw.p), draw.position  # a specimen is relaxed there
    points = {
        "null": equilibria(plant, draw.p, at, None, None, **far_end(plant, at)),
        "moving": equilibria(plant, smooth, at, speed, None, **far_end(plant, at, speed)),
    }
    return DrawnPlants(rig, engine, block, draw, points)
