"""The limit of a step: the soonest motion of a known rig that an optimiser finds; it proves none sooner impossible.

By direct collocation on the plant of every other simulation, on meshes that are halved until the figure stands; what is
found is played on the engine, open loop. Every limit begins from rest where a scenario starts, and is kept in a cache.
"""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..base.private_cache import store, stored
from ..engine import Engine, collocation, fastest
from ..engine.collocation import MotionConstraints
from ..engine.fastest import Aim, Course, fastest_course
from ..linear import equilibrium
from ..linear.operating_point import far_end
from ..plant import build
from ..rigs.oil import saturation
from ..rigs.rig import Rig
from . import step_metrics as metrics
from .capability import oil_stiffness
from .scenarios import Scenario
from .sensors import settling_band

NO_CHAMBERS = "a linear plant has no chambers, which set the limit"
BELOW = "at rest a chamber is below the margin"
_SIGNALS = ("position", "force", "pa", "pb", "lowest_pressure")

T = TypeVar("T")
_MESHES = (24, 48, 96)  # intervals on the way, and as many after it
_GUESSES = (0.5, 1.0, 0.7)  # of the time that is watched, in which the jack moves: the next where one leads nowhere
_STANDS = 0.005  # change of the figure on a mesh of half the length, up to which it stands
_PLAYS = 0.2  # of the band: how far the engine may be off what was found
_WATCHED = 1.6  # periods of the mass on the oil that it stays settled before it is at rest
_EXACT = 1e-7  # tolerance of the engine that plays what was found
_SOURCES = (fastest.__file__,)


def motion_from(rig: Rig, scenario: Scenario, margin: float) -> tuple[MotionConstraints, float]:
    """The motion, no chamber less than `margin` [Pa] above 1 atm, where gas comes out, and the controlled signal's
    level (SI) at rest. Raises InputError where the rig has no operating point there."""
    plant, position = build(rig), scenario.position(rig.limit("stroke"))
    start = equilibrium(plant, None, None, position, None, **far_end(plant, position))
    level = float(plant.observe(start.x, start.u)[0, plant.output(scenario.signal)])
    high = np.full(plant.n, np.inf)
    high[plant.state("x")], high[plant.state("v")] = rig.limit("stroke"), rig.limit("speed")
    low = np.where([state.unit == "Pa" for state in plant.states], saturation(rig["Pr"]) + margin, -high)
    return MotionConstraints(plant, start.x, start.u, low, high, rig.limit("command_rate")), level


def signals_of(motion: MotionConstraints, t: np.ndarray, x: np.ndarray, u: np.ndarray) -> dict[str, np.ndarray]:
    """The time "t [s]", command and outputs [k + 1], SI, of states x [k + 1, n] at t [k + 1] s and inputs u [k, m]."""
    every = np.append(u, u[-1:], axis=0)
    outputs, plant = motion.plant.observe(x, every), motion.plant
    named = {name: outputs[:, plant.output(name)] for name in _SIGNALS if name in plant.outputs}
    return {"t [s]": t, "command": every[:, 0], **named}


def kept(
    kind: Callable[..., T],
    find: Callable[[], T],
    motion: MotionConstraints,
    output: str,
    numbers: Sequence[np.ndarray],
    sources: Iterable[str],
) -> T:
    """What `find` finds, a dataclass of `kind` with `signals`: from the user's cache folder where it was found before.

    It follows from the motion, the output, the numbers of its task and the sources (files) that find it.
    """
    name = f"{_digest(motion, output, numbers, sources)}.limit"
    if content := stored(name):
        return _read(kind, json.loads(content))
    found: Any = find()
    store(name, json.dumps(asdict(found), default=np.ndarray.tolist).encode())
    return found


def _digest(motion: MotionConstraints, output: str, numbers: Sequence[np.ndarray], sources: Iterable[str]) -> str:
    plant = motion.plant
    given = [motion.x, motion.u, motion.low, motion.high, np.array(motion.rate), plant.p, plant.scale, *numbers]
    parts = [plant.f.serialize(), plant.h.serialize(), output, *(part.tobytes().hex() for part in given)]
    parts += [Path(source).read_text(encoding="utf-8") for source in (__file__, collocation.__file__, *sources)]
    return sha256(chr(0).join(parts).encode()).hexdigest()


def _read(kind: Callable[..., T], table: Mapping[str, Any]) -> T:
    return kind(**{**table, "signals": {name: np.array(values) for name, values in table["signals"].items()}})


@dataclass(frozen=True, eq=False)
class Limit:
    """The least time [s] in which a step settles into `band` (SI); None where none was found, and the `reason`.

    `mesh_difference` [s] is its change from the mesh before, None where there is but one: the figure's own error, as
    far as meshes of held commands tell it, whose order is the first. Of the motion as the engine
    plays it: its `lowest_pressure` [Pa], `peak_command` and `overshoot` [percent]; `off`, how far it is off what was
    found (SI); and `signals` [k] by name, SI, with the time "t [s]".
    """

    band: float
    reason: str = ""
    settling: float | None = None
    mesh_difference: float | None = None
    lowest_pressure: float | None = None
    peak_command: float | None = None
    overshoot: float | None = None
    off: float | None = None
    signals: Mapping[str, np.ndarray] = field(default_factory=dict)

    @property
    def stands(self) -> bool:
        """Whether the mesh matters no more, and the engine agrees."""
        if self.settling is None or self.mesh_difference is None or self.off is None:
            return False
        return self.mesh_difference <= _STANDS * self.settling and self.off <= _PLAYS * self.band


def settling_limit(rig: Rig, scenario: Scenario, margin: float = 0.0) -> Limit:
    """The least settling time of a scenario with chambers at least `margin` [Pa] above 1 atm, where gas comes out.

    The jack goes from rest where the scenario starts into the band in which a loop counts as settled, stays there for
    1.6 periods of the mass on the oil, and is at rest at their end; the command stays within +-1 and the rig's rate,
    the jack within stroke and speed. A drive that is late adds its delay. It is computed once, in some seconds, and
    kept in the user's cache folder. Raises InputError where the rig has no operating point there.
    """
    band = settling_band(rig, scenario.signal, scenario.size)
    if reason := _no_limit(rig, scenario):
        return Limit(band, reason)
    aim = _aim(rig, scenario, band, margin)
    if np.any(aim.motion.x < aim.motion.low):
        return Limit(band, BELOW)
    numbers = [np.array(aim.band), np.array([aim.hold, aim.size])]
    return kept(Limit, lambda: _found(aim, _guesses(aim, rig, scenario)), aim.motion, aim.output, numbers, _SOURCES)


def limits_by_name(rig: Rig, scenarios: Iterable[Scenario]) -> dict[str, float | None]:
    """Limits [s] of scenarios by name; None where there is none, or it was not found."""
    return {scenario.name: settling_limit(rig, scenario).settling for scenario in scenarios}


def times_limit(reached: float | None, limit: float | None) -> float | None:
    """How many times a limit something is, a time [s] or an error (SI); None where one is not known."""
    return None if reached is None or limit is None else reached / limit


def _no_limit(rig: Rig, scenario: Scenario) -> str:
    """Why a scenario has no limit of settling; empty where it has one."""
    if not rig.is_jack:
        return NO_CHAMBERS
    if not scenario.is_step:
        return "not a step"
    end = scenario.position(rig.limit("stroke")) + scenario.size
    if scenario.signal == "position" and abs(end) > rig.limit("stroke"):
        return "it leads beyond the stroke limit"
    return ""


def _aim(rig: Rig, scenario: Scenario, band: float, margin: float) -> Aim:
    motion, level = motion_from(rig, scenario, margin)
    return Aim(
        motion,
        output=scenario.signal,
        size=scenario.size,
        band=(level + scenario.size - band, level + scenario.size + band),
        hold=_WATCHED * 2 * np.pi * float(np.sqrt(rig["M"] / oil_stiffness(rig))),
    )


def _guesses(aim: Aim, rig: Rig, scenario: Scenario) -> list[Course]:
    """At constant speeds, without a command."""
    there = aim.motion.x.copy()
    there[aim.motion.plant.state("x")] += scenario.size / (
        rig.specimen_stiffness if scenario.signal == "force" else 1.0
    )
    x, u = np.array([aim.motion.x, there, there]), np.tile(aim.motion.u, (2, 1))
    return [Course(aim.hold * np.array([0.0, share, share + 1]), x, u, aim.hold * share) for share in _GUESSES]


def _found(aim: Aim, guesses: Sequence[Course]) -> Limit:
    """On every mesh from what the one before found, until the figure stands and the engine agrees."""
    first, *finer = _MESHES
    found = (fastest_course(aim, first, guess, near=False) for guess in guesses)
    course = next((course for course in found if course is not None), None)
    if course is None:
        return Limit((aim.band[1] - aim.band[0]) / 2, "the solver finds no motion")
    limit = _played(aim, course, None)
    for intervals in finer:
        refined = fastest_course(aim, intervals, course, near=True)
        if refined is None:
            break
        limit, course = _played(aim, refined, limit.settling), refined
        if limit.stands:
            break
    return limit


def _played(aim: Aim, course: Course, before: float | None) -> Limit:
    """A course on the engine; `before` [s] is the limit that the mesh before gave."""
    plant, settling = aim.motion.plant, course.arrives + aim.motion.plant.lateness()
    x = Engine(plant, _EXACT, brief=True).run(course.x[0], course.t, course.u).x
    signals, found = (signals_of(aim.motion, course.t, states, course.u) for states in (x, course.x))
    y = signals[aim.output]
    return Limit(
        band=(aim.band[1] - aim.band[0]) / 2,
        settling=settling,
        mesh_difference=None if before is None else abs(settling - before),
        lowest_pressure=float(signals["lowest_pressure"].min()),
        peak_command=float(np.abs(course.u[:, 0]).max()),
        overshoot=metrics.overshoot(y, float(y[0]), float(y[0]) + aim.size),
        off=float(np.abs(y - found[aim.output]).max()),
        signals=signals,
    )
