"""The plants of a robustness experiment, with room for the step within the share of the stroke."""

from ...plant import Plant
from .plant_draw import PlantDraw, draw_plants
from .problem import RobustnessProblem


def drawn(problem: RobustnessProblem, plant: Plant, block: range | None = None) -> PlantDraw:
    """The same for the same seed, all or a `block` of them. The first is the nominal one at mid stroke."""
    reach = problem.stroke * problem.rig.limit("stroke")
    way = problem.step if problem.signal.name == "position" else 0.0
    span = -reach, reach - way
    return draw_plants(problem.rig, plant, problem.factors, problem.plants, problem.conditions.seed, span, block)
