"""The limit of a step: the soonest that a known rig settles, whatever controls it.

By direct collocation on the plant of every other simulation, on meshes that are halved until the figure stands; what is
found is then played on the engine, open loop.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..engine import Engine
from ..engine.fastest import Aim, Course, fastest
from ..linear import equilibrium
from ..linear.operating_point import far_end
from ..plant import Plant, build
from ..rigs.rig import Rig
from . import step_metrics as metrics
from .capability import oil_stiffness
from .scenarios import Scenario
from .sensors import settling_band

_MESHES = (24, 48, 96)  # intervals on the way, and as many after it
_STANDS = 0.005  # change of the figure on a mesh of half the length, up to which it stands
_WATCHED = 1.6  # periods of the mass on the oil that it stays settled before it is at rest
_EXACT = 1e-7  # tolerance of the engine that plays what was found


@dataclass(frozen=True, eq=False)
class Limit:
    """The least `settling` time [s] of a step, into `band` (SI); None where none was found, and the `reason`.

    `mesh_difference` [s] is its change from a mesh of twice the length. Of the motion as the engine plays it: its
    `lowest_pressure` [Pa], its `peak_command`, how far it is off what was found (`played`, percent of the step), its
    overshoot [percent], and `signals` [k] by name, with the time "t [s]".
    """

    band: float
    reason: str = ""
    settling: float | None = None
    mesh_difference: float | None = None
    lowest_pressure: float | None = None
    peak_command: float | None = None
    overshoot: float | None = None
    played: float | None = None
    signals: Mapping[str, np.ndarray] = field(default_factory=dict)


def settling_limit(rig: Rig, scenario: Scenario, margin: float = 0.0) -> Limit:
    """Of a scenario from where it starts, no chamber below `margin` [Pa] above the vapour's pressure, 0 bar here.

    From rest into the band in which a loop counts as settled, there for 1.6 periods of the mass on the oil, and at rest
    at the end of them; the command within +-1 and the rig's rate, the jack within stroke and speed. A drive that is
    late adds its delay. Raises InputError where the rig has no operating point there.
    """
    band = settling_band(rig, scenario.signal, scenario.size)
    if reason := _no_limit(rig, scenario):
        return Limit(band, reason)
    aim = _aim(rig, scenario, band, margin)
    courses = _refined(aim, _first_guess(aim, rig, scenario))
    if not courses:
        return Limit(band, "the solver finds no motion from its guess")
    return _judged(aim, scenario, band, courses)


def _no_limit(rig: Rig, scenario: Scenario) -> str:
    """Why a scenario has no limit of settling; empty where it has one."""
    if not rig.is_jack:
        return "a linear plant has no chambers, whose pressure is the limit"
    if not scenario.is_step:
        return "not a step"
    start = scenario.position(rig.limit("stroke"))
    if scenario.signal == "position" and abs(start + scenario.size) > rig.limit("stroke"):
        return "it leads beyond the stroke limit"
    return ""


def _aim(rig: Rig, scenario: Scenario, band: float, margin: float) -> Aim:
    plant, position = build(rig), scenario.position(rig.limit("stroke"))
    start = equilibrium(plant, position=position, **far_end(plant, position))
    level = float(plant.observe(start.x, start.u)[0, plant.output(scenario.signal)])
    high = np.full(plant.n, np.inf)
    high[plant.state("x")], high[plant.state("v")] = rig.limit("stroke"), rig.limit("speed")
    low = np.where([state.unit == "Pa" for state in plant.states], margin, -high)
    target = level + scenario.size
    hold = _WATCHED * 2 * np.pi * float(np.sqrt(rig["M"] / oil_stiffness(rig)))
    return Aim(
        plant, start.x, start.u, scenario.signal, (target - band, target + band), hold, low, high, rig.limit("command_rate")
    )


def _first_guess(aim: Aim, rig: Rig, scenario: Scenario) -> Course:
    """At a constant speed in half the time that is watched."""
    way = scenario.size if scenario.signal == "position" else scenario.size / rig.specimen_stiffness
    there, x = aim.x.copy(), aim.plant.state("x")
    there[x] += way
    t = aim.hold * np.array([0.0, 0.5, 1.5])
    return Course(t, np.array([aim.x, there, there]), np.tile(aim.u, (2, 1)), float(t[1]))


def _refined(aim: Aim, guess: Course) -> list[Course]:
    """The fastest course on every mesh, from the one before, until the figure stands; none where a mesh has none."""
    courses: list[Course] = []
    for intervals in _MESHES:
        found = fastest(aim, intervals, intervals, courses[-1] if courses else guess)
        if found is None:
            break
        courses.append(found)
        if len(courses) > 1 and abs(found.arrives - courses[-2].arrives) <= _STANDS * found.arrives:
            break
    return courses


def _judged(aim: Aim, scenario: Scenario, band: float, courses: list[Course]) -> Limit:
    """The finest course, played by the engine."""
    course, plant = courses[-1], aim.plant
    played = Engine(plant, _EXACT, brief=True).run(course.x[0], course.t, course.u)
    u = np.append(course.u, course.u[-1:], axis=0)
    outputs, found = (plant.observe(x, u) for x in (played.x, course.x))
    names = [name for name in ("position", "force", "pa", "pb", "lowest_pressure") if name in plant.outputs]
    signals = {"t [s]": course.t, "command": u[:, 0]} | {name: outputs[:, plant.output(name)] for name in names}
    y, column = signals[scenario.signal], plant.output(scenario.signal)
    return Limit(
        band,
        "",
        course.arrives + plant.lateness(),
        abs(course.arrives - courses[-2].arrives) if len(courses) > 1 else None,
        float(signals["lowest_pressure"].min()),
        float(np.abs(course.u[:, 0]).max()),
        metrics.overshoot(y, float(y[0]), float(y[0]) + scenario.size),
        100 * float(np.abs(y - found[:, column]).max() / abs(scenario.size)),
        signals,
    )
