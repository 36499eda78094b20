"""The numbers of a rig's guard: limits, how it brakes, what its observer takes the jack for, what noise allows."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..engine.guard_shape import TRIPS, WATCHED, GuardShape
from ..rigs.limited import is_told
from ..rigs.load import ROD_CELL
from ..rigs.number import Number
from ..rigs.rig import Rig
from ..rigs.schema import FOLLOWING_TIME
from .capability import dead_zone, oil_stiffness, stall_force

_NEVER = 1e15  # of a rule that a rig cannot have
_BRAKING = 0.95  # of the stall force and of the force limit, for which the guard opens the valve to brake
_REACHED = 1.05  # of the same: the force that the jack then stands against on the way
_LEFT = 0.05  # of the same: what a jack that holds a load is taken to have left to brake with, at least
_WINDOW = 0.15  # s: over which the observer adds up what it sees
_MASS_SHARE = 0.5  # by which the mass may be other than the rig says
_KNOWN_FLOW = 0.2  # by which the flow may, where spool and supply are measured,
_GUESSED_FLOW = 0.5  # and where command and declared supply stand for them
_OVER = 0.02  # of the stroke limit, by which a braked jack may pass it where the stroke is longer still
_OFFSET = 0.006  # of the stroke limit: what the observer lets pass
_FRICTION = 0.1  # of the stall force: what the balance of forces lets pass
_CALM = 0.005  # of the speed limit: six standard deviations of the filtered speed, where that is possible
_HOUR = 3600.0  # s: in which repeated readings at rest trip with a chance of at most
_CHANCE = 1e-6
_HOLDING = 6.0  # 1/s: of the loop that holds a jack after a trip
_VALVE_LAG = 4e-3  # s: of a valve whose spool's frequency is not known


@dataclass(frozen=True)
class LegLoad:
    """The mass [kg] that a leg moves goes by the direction: `most` is to be braked, `least` slows down fastest. `load`
    [N]: what the leg holds at rest, positive where it pushes; `cell` [kg] and `weight` [N]: the mass between its piston
    and its load cell, and what that weighs along the leg."""

    most: float
    least: float
    load: float
    cell: float
    weight: float


def max_move_per_period(rig: Rig) -> float:
    """How far [m] the measured position may move in one period: at the speed limit, with room for the sensor's noise.

    The room is what two readings scatter by, and one step of the resolution.
    """
    sensor = rig.sensors.get("position")
    return rig.limit("speed") * rig.period.value + (sensor.scatter + sensor.resolution if sensor else 0.0)


def guard_shape(
    rig: Rig, signals: Sequence[str], measures: Sequence[str], carried: LegLoad | None = None
) -> GuardShape:
    """What the guard of a rig reads of the measured `signals`, where a controller needs those of `measures`."""
    read = tuple(name for name in dict.fromkeys((*signals, "position")) if name in (*measures, *WATCHED))
    return GuardShape(read, rig.is_metered, carried is not None, carried is not None or rig.load != ROD_CELL)


def guard_numbers(
    rig: Rig, shape: GuardShape, measures: Sequence[str], noisy: bool, carried: LegLoad | None = None
) -> dict[str, float | np.ndarray]:
    """All numbers of the rules by name, SI, of a controller that needs `measures`, the controlled one first; rules that
    the rig cannot have are put out of reach. `carried`: by a leg of a platform."""
    period = rig.period.value
    fast, slow = _filter_gains(rig)
    numbers: dict[str, float | np.ndarray] = {
        "pushed": 0.0,
        "largest": _declared(rig, "command", 1.0),
        "pressure": _declared(rig, "pressure", _NEVER),
        "least_pressure": _declared(rig, "least_pressure", -_declared(rig, "pressure", _NEVER)),
        "middle": rig.middle,
        "stroke": rig.limit("stroke"),
        "move": max_move_per_period(rig),
        "force": rig.limit("force"),
        "step": rig.limit("command_rate") * period,
        "period": period,
        "fast": fast,
        "slow": slow,
        "repeats": np.array([_repeats(rig, name) if noisy else _NEVER for name in shape.read]),
        "forget": period / _WINDOW,
        "speed": rig.limit("speed"),
        "calm": _CALM * rig.limit("speed"),
        "following": _declared(rig, "following_error", _NEVER) if tuple(measures[:1]) == ("position",) else _NEVER,
        "patience": math.ceil(FOLLOWING_TIME / period - 1e-9),
        "mass_share": _MASS_SHARE,
        "flow_share": _flow_error(rig, shape),
    }
    if not rig.is_throttled:
        return numbers | _UNKNOWN
    return numbers | _jack_numbers(rig) | _brake_numbers(rig, carried) | _moved_numbers(rig, carried)


_UNKNOWN = {
    **dict.fromkeys(("braking", "stall", "opening", "fade", "allowed", "allowed_impulse", "oil"), _NEVER),
    **dict.fromkeys(
        ("over", "late", "latency", "hold", "null", "flow_a", "flow_b", "specimen", "friction", "weight", "drag"), 0.0
    ),
    **dict.fromkeys(("area_a", "area_b", "supply", "drain", "line_mass", "line_drag"), 0.0),
    **dict.fromkeys(("mass", "lag", "lap", "travel"), 1.0),
}


def _brake_numbers(rig: Rig, carried: LegLoad | None) -> dict[str, float]:
    """How a jack behind a spool is braked in the direction in which it carries most, against what it holds."""
    stall, most, full = _forces(rig)
    mass, least, load = (carried.most, carried.least, abs(carried.load)) if carried else (rig["M"], rig["M"], 0.0)
    left = left_to_brake(rig, carried) if carried else _BRAKING * most
    return {
        "braking": (left if carried else _REACHED * most) / mass,  # a leg that moves less does not reach more
        "stall": (stall + load) / least,
        "opening": 1 / full,
        "fade": left / mass / full * rig.period.value,
        "hold": _HOLDING / full if rig.stop == "hold" else 0.0,
    }


def left_to_brake(rig: Rig, carried: LegLoad) -> float:
    """Force [N] that a leg has left to brake with, beside what it holds."""
    most = _forces(rig)[1]
    return max(_LEFT * most, _BRAKING * most - abs(carried.load))


def _moved_numbers(rig: Rig, carried: LegLoad | None) -> dict[str, float]:
    """The mass between pressures and load cell, a jack's own or a leg's rod, and the forces on it."""
    if carried is None:
        stiffness = 0.0 if rig.load == ROD_CELL else rig["ks"]  # that all of a cell's reading is the force of
        return {"mass": rig["M"], "weight": 0.0, "drag": 0.0, "friction": rig["b"], "specimen": stiffness}
    return {"mass": carried.cell, "weight": carried.weight, "drag": rig["b"], "friction": 0.0, "specimen": 0.0}


def _forces(rig: Rig) -> tuple[float, float, float]:
    """The stall force [N], what of it is allowed, and the speed [m/s] at full command that throttles as it brakes."""
    area_a, area_b = rig.areas
    stall = min(stall_force(rig, sign) for sign in (1.0, -1.0))
    most = min(stall, rig.limit("force"))
    flow = rig["n"] * rig["K3"]
    return stall, most, flow * rig["z3max"] * math.sqrt((stall + _BRAKING * most) / (area_a**3 + area_b**3))


def _jack_numbers(rig: Rig) -> dict[str, float]:
    """How late a jack behind a spool is, and the numbers of its observer."""
    area_a, area_b = rig.areas
    flow, (stall, _, full) = rig["n"] * rig["K3"], _forces(rig)
    valve = _valve_lag(rig)
    late = rig.period.value + _delay(rig) + valve
    sensor, (line_mass, line_drag) = rig.sensors.get("position"), _line(rig)
    return {
        "over": min(_OVER * rig.limit("stroke"), max(0.0, rig["S"] / 2 - rig.limit("stroke")) / 2),
        "late": late,
        "latency": late + 0.5 / rig.limit("command_rate"),
        "allowed": _OFFSET * rig.limit("stroke") + (sensor.scatter if sensor else 0.0) + _withheld(rig, full),
        "allowed_impulse": (_FRICTION * stall + 2 * _dry_friction(rig)) * _WINDOW,
        "lag": min(1.0, rig.period.value / valve),
        "null": rig["z0"] if "z0" in rig.numbers else 0.0,
        "flow_a": flow / area_a,
        "flow_b": flow / area_b,
        "lap": rig["eps"],
        "travel": rig["z3max"],
        "oil": oil_stiffness(rig),
        "area_a": area_a,
        "area_b": area_b,
        "supply": rig["Ps"],
        "drain": rig["Pr"],
        "line_mass": line_mass,
        "line_drag": line_drag,
    }


def _withheld(rig: Rig, full: float) -> float:
    """Travel [m] of a jack that goes at `full` [m/s] at full command, that an overlap keeps back in the window in which
    the observer, which has no overlap, looks."""
    overlap = dead_zone(rig)
    return 0.0 if overlap is None else overlap.value * full * _WINDOW


def _declared(rig: Rig, name: str, without: float) -> float:
    """An optional limit, SI; and what it is for a rig that declares none."""
    limit = rig.limits.get(name)
    return limit.value if limit else without


def _flow_error(rig: Rig, shape: GuardShape) -> float:
    """Share of the travel by which it may be other than the flow says: declared, or by what is measured."""
    return _declared(rig, "flow_error", _KNOWN_FLOW if {"spool", "supply"} <= set(shape.read) else _GUESSED_FLOW)


def _filter_gains(rig: Rig) -> tuple[float, float]:
    """Gains of the filter of position and speed, critically damped: the fastest whose speed is calm enough."""
    sensor = rig.sensors.get("position")
    allowed = _CALM * rig.limit("speed") * rig.period.value / (6 * sensor.noise) if sensor and sensor.noise else 1.0
    poles = np.linspace(0.6, 0.98, 39)
    fast, slow = 1 - poles**2, (1 - poles) ** 2
    calm = slow * np.sqrt(2 / (fast * (4 - slow - 2 * fast))) <= allowed
    pole = int(np.argmax(calm)) if calm.any() else -1
    return float(fast[pole]), float(slow[pole])


def _repeats(rig: Rig, name: str) -> float:
    """How many readings in a row that repeat the one before are no chance: of noise that is coarse against its
    resolution, q/(2 sigma root(pi)) of them do."""
    sensor = rig.sensors[name]
    if not sensor.noise:
        return _NEVER
    chance = sensor.resolution / (2 * sensor.noise * math.sqrt(math.pi)) if sensor.resolution else 1e-15
    if chance > 0.5:
        return _NEVER
    return float(max(3, math.ceil(math.log(_CHANCE * rig.period.value / _HOUR) / math.log(chance))))


def _valve_lag(rig: Rig) -> float:
    """Time [s] by which the spool is behind its command."""
    return rig["zeta"] / (math.pi * rig["f0"]) if "f0" in rig.numbers else _VALVE_LAG


def _dry_friction(rig: Rig) -> float:
    """Coulomb friction [N] that the rig declares; the sign of it is that of the speed."""
    own = (number for name, number in _numbers_of(rig).items() if name.startswith("jack.friction."))
    return max((number.value for number in own if number.si == "N"), default=0.0)


def _line(rig: Rig) -> tuple[float, float]:
    """What mass [kg] and drag [N s/m] the oil of the hoses is for the piston, which pressures at the valve have beyond
    those of the chambers: A^2 of both times inertance, 1/(C w0^2), and most loss over flow."""
    from ..plant.effects.library.hose import capacitance, mean_volume  # here: what only reads files needs no graph
    from ..plant.valve import VALVES

    parts = ((name.rpartition("."), number.value) for name, number in _numbers_of(rig).items())
    own = {name: value for (of, _, name), value in parts if of == "line.hose"}
    if not own.get("r"):
        return 0.0, 0.0
    areas, w0 = np.array(rig.areas), 2 * math.pi * own["f"]
    inertance = 1 / (float(capacitance(own["r"], mean_volume(rig), rig["beta"])) * w0 * w0)
    if "zeta" in own:
        resistance = np.full(2, 2 * own["zeta"] * w0 * inertance)
    else:
        resistance = own["loss"] * rig["Ps"] * areas * rig.limit("speed") / VALVES[rig.valve].rated_flow(rig) ** 2
    return inertance * float(areas @ areas), float(resistance @ areas**2)


def _delay(rig: Rig) -> float:
    """Time [s] by which the drive gets its command late."""
    return sum(number.value for name, number in _numbers_of(rig).items() if name == "drive.delay.delay")


def _numbers_of(rig: Rig) -> dict[str, Number]:
    """Those of its effects too, SI: a file has them in units of its own."""
    from ..plant.effects import numbers_of  # here: what only reads an experiment needs no graph

    return numbers_of(rig)


def trip_reason(rig: Rig, trip: int) -> str:
    """Why the guard tripped, in words, for the number of a trip."""
    name, stroke = TRIPS[trip], rig.signal("position").text(rig.limit("stroke"))
    centre = "mid stroke" if rig.is_jack else "rest"
    limit = rig.signal("position").text(_declared(rig, "following_error", _NEVER))
    if name.startswith("still "):
        return f"the {name[6:]} signal stands still: {_repeats(rig, name[6:]):g} equal readings"
    if name.startswith("finite "):
        return f"the {name[7:]} signal is not finite"
    reason = {
        "stroke": f"position beyond +-{stroke} of {centre}",
        "speed": f"speed above {rig.signal('velocity').text(rig.limit('speed'))}",
        "pressure": f"pressure of a chamber beyond {_pressures(rig)}",
        "force": f"force above {rig.limit('force') / 1e3:g} kN",
        "command": "the controller's command is not finite",
        "braking": f"too fast to stop within +-{stroke} of {centre}",
        "lost": "the position signal is lost: it stood still while the jack moved",
        "observer": "the position signal does not move as flow and pressures say",
        "impulse": "force, pressures and acceleration do not agree",
        "beside": "another leg tripped",
        "following": f"the position was off its reference by more than {limit} for {FOLLOWING_TIME * 1e3:g} ms",
    }[name]
    declared = rig.limits.get("stroke" if name == "braking" else name)
    return f"{reason} ({declared.source})" if declared and is_told(declared) else reason


def _pressures(rig: Rig) -> str:
    """The limits of a chamber's pressure."""
    ends = [rig.signal("pa").text(rig.limit(name)) for name in ("least_pressure", "pressure") if name in rig.limits]
    return " to ".join(ends)
