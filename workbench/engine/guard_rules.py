"""The rules of the guard as one graph: what it concludes from readings, and what it lets through to the drive.

A loop in Python evaluates the graph sample by sample, a compiled one has it inside its instant: the rules are written
once. The state of a guard is a vector with the places of `state`, its numbers one with those of `numbers`, so that
other rigs and limits need no other machine code.

Five looks are taken. Limits: of stroke, speed, force and the pressure of each chamber, and whether the jack can still
stop before the end of its stroke, or the force before its limit. Repeated readings: noise makes exact repeats rare. The
rig's own observer, see guard_motion. Following error. Readings that are not finite.
"""

from collections.abc import Iterable, Mapping
from functools import cache

import casadi as ca
import numpy as np

from ..rigs.sampling import command_change
from .buffered import BufferedFunction
from .guard_motion import Parts, Sample, estimated, is_finite
from .guard_shape import TRIPS, GuardShape, length, places

_DISBELIEVED = ("lost", "observer", "still position")  # trips that say that the position is wrong
_WEAK = 0.05  # the largest command that holds a jack after a trip
LEGS = 6
COUPLED = places(inertia=LEGS**2, mobility=LEGS**2, load=LEGS, drag=LEGS, left=LEGS, least=LEGS)
_KNOWN = 0.74  # of the deceleration along its way that a payload other than the declared one is taken to leave
_STILL = 1e-9  # kg m/s: nothing to brake


def watched(shape: GuardShape, s: Parts, y: ca.SX, u: ca.SX, reference: ca.SX, q: Parts) -> dict[str, ca.SX]:
    """The guard's state after readings y, where the drive last got the command u; a trip stays."""
    broken = _last_of((f"finite {name}", ca.logic_not(is_finite(y[i]))) for i, name in enumerate(shape.read))
    sample = Sample(shape, s, ca.if_else(broken > 0, s["last"], y), u, reference, q)
    after = estimated(sample)
    reason = ca.if_else(broken > 0, broken, _last_of(_reasons(sample, after)))
    trip = ca.if_else(s["trip"] > 0, s["trip"], reason)
    return after | _stopped(sample, after, trip) | {"trip": trip}


def let_through(s: Parts, demanded: ca.SX, u: ca.SX, q: Parts) -> tuple[ca.SX, ca.SX]:
    """The command that the drive gets after u, and the reason for a trip, for the demanded one: limited in size and
    rate; after a trip the one of the brake."""
    trip = ca.if_else(s["trip"] > 0, s["trip"], ca.if_else(is_finite(demanded), 0, TRIPS.index("command")))
    asked, largest = ca.if_else(trip > 0, s["brake"], demanded), q["largest"]
    return u + command_change(asked, u, -largest, largest, q["step"], ca.fmin, ca.fmax), trip


def _last_of(reasons: Iterable[tuple[str, ca.SX]]) -> ca.SX:
    """The number of a trip, or 0: of several reasons that hold, the last."""
    trip = ca.SX(0)
    for name, holds in reasons:
        trip = ca.if_else(holds, TRIPS.index(name), trip)
    return trip


def _is_any(trip: ca.SX, names: Iterable[str]) -> ca.SX:
    return ca.fmin(1, sum((trip == TRIPS.index(name) for name in names), ca.SX(0)))


def _reasons(sample: Sample, after: Parts) -> list[tuple[str, ca.SX]]:
    """What could be wrong, and whether it is; what tells more comes later."""
    shape, q = sample.shape, sample.q
    reasons = [("following", after["astray"] >= q["patience"])]
    if shape.observes:
        reasons += _implausible(sample, after)
    reasons += [(f"still {name}", after["still"][i] >= q["repeats"][i]) for i, name in enumerate(shape.read)]
    reasons += [("pressure", _too_high(sample, name)) for name in ("pa", "pb") if name in shape.read]
    reasons.append(("braking", _too_late(sample, after)))
    if "force" in shape.read:
        swing = ca.if_else(q["specimen"] > 0, _highest_load(sample, after), 0)  # nothing to press on: no swing
        most = ca.fmax(swing, ca.fabs(sample.read("force")))
        reasons.append(("force", most > q["force"]))
    reasons += _too_fast(sample, after)
    reasons.append(("stroke", ca.fabs(sample.read("position") - q["middle"]) > q["stroke"]))
    return reasons


def _implausible(sample: Sample, after: Parts) -> list[tuple[str, ca.SX]]:
    """Whether measured and observed motion differ by more than other oil, flow and mass explain; a position that
    repeats while flow moves the jack is lost."""
    q, strain = sample.q, after["strain"] / sample.q["oil"]
    gap = ca.fabs(after["gap"] + strain)
    wrong = [("observer", gap > q["allowed"] + q["flow_share"] * after["travel"] + ca.fabs(strain))]
    if sample.shape.balances:  # a load that nothing measures is no fault
        impulse = ca.fabs(after["impulse"] - q["mass"] * after["change"])
        allowed = q["allowed_impulse"] + (q["mass_share"] * q["mass"] + q["line_mass"]) * ca.fabs(after["change"])
        allowed += q["line_drag"] * after["travel"]
        wrong.insert(0, ("impulse", impulse > allowed))
    stands = after["still"][sample.shape.at("position")] * q["period"] * ca.fabs(after["flow"]) > q["allowed"]
    return wrong + [("lost", ca.logic_and(holds, stands)) for _, holds in wrong]


def _too_fast(sample: Sample, after: Parts) -> list[tuple[str, ca.SX]]:
    """Whether the speed will be above its limit before a command can change that, or the position jumps; after equal
    readings, no further than the jack can have moved meanwhile, some were lost."""
    q, stood = sample.q, sample.before["still"][sample.shape.at("position")]
    moved = ca.fabs(sample.read("position") - sample.last("position"))
    jumped = ca.if_else(sample.first, 0, moved > q["move"])
    ahead = ca.if_else(after["v"] >= 0, 1, -1)
    fast = ca.fabs(after["v"]) + ca.fmax(0, ahead * sample.acceleration) * q["latency"] > q["speed"]
    lost = ca.logic_and(stood >= 1, moved <= (stood + 1) * q["move"])
    return [("speed", ca.logic_or(jumped, fast)), ("lost", ca.logic_and(jumped, lost))]


def _too_high(sample: Sample, chamber: str) -> ca.SX:
    """Whether a chamber's pressure is beyond its limits, or will be at the next sample if it changes on as it did."""
    q, now = sample.q, sample.read(chamber)
    change = ca.if_else(sample.first, 0, now - sample.last(chamber))
    high, low = now + ca.fmax(0, change), now + ca.fmin(0, change)
    return ca.logic_or(high > q["pressure"], low < q["least_pressure"])


def _too_late(sample: Sample, after: Parts) -> ca.SX:
    """Whether braking that began any later would end beyond the stroke, where the command does not brake already; or
    where even the whole force of the supply would not stop the jack, unless it slows down enough by itself."""
    q, v, latency = sample.q, after["v"], sample.q["latency"]
    ahead = ca.if_else(v >= 0, 1, -1)
    speed, gain = ca.fabs(v), ahead * sample.acceleration
    left = 2 * (q["stroke"] + q["over"] - ahead * (after["x"] - q["middle"]))
    faster = speed + ca.fmax(gain, 0) * latency
    now = faster * faster > q["braking"] * (left - (speed + faster) * latency)
    over = ca.logic_and(speed * speed > q["stall"] * left, speed * speed > -gain * left)
    return ca.logic_or(ca.logic_and(now, ahead * sample.u >= q["opening"] * speed), over)


def _highest_load(sample: Sample, after: Parts) -> ca.SX:
    """Force [N] to which the load cell still swings where the valve closes now: the push lasts as long as that takes,
    growing on as it does if it does, up to the stall force; then the mass swings between specimen and shut-in oil."""
    q = sample.q
    late, stiffness = q["late"] + ca.fabs(sample.u) / q["step"] * q["period"], q["specimen"] + q["oil"]
    push = _grown_push(sample, late)
    jerk = q["specimen"] * push / q["mass"]
    load, rate = after["f"] + (after["df"] + jerk * late / 2) * late, after["df"] + jerk * late
    rest = (after["f"] + push - load) * q["specimen"] / stiffness
    return ca.fabs(load + rest) + ca.sqrt(rest * rest + rate * rate * q["mass"] / stiffness)


def _grown_push(sample: Sample, late: ca.SX) -> ca.SX:
    """The push [N], half way to what it will be after `late` seconds where it grows."""
    q, push = sample.q, sample.push
    if not sample.shape.balances:
        return push
    growth = ca.if_else(sample.first, 0, sample.strained / q["period"] * late)
    most = ca.fmax(q["stall"] * q["mass"] - ca.fabs(push), 0)
    return push + ca.if_else(growth * push > 0, ca.fmax(-most, ca.fmin(growth, most)) / 2, 0)


def _stopped(sample: Sample, after: Parts, trip: ca.SX) -> dict[str, ca.SX]:
    """The command of the brake after a trip, and whether and where the jack is held then."""
    s, q = sample.before, sample.q
    believed = 1 - _is_any(trip, _DISBELIEVED)
    finite = 1 - _is_any(trip, (f"finite {name}" for name in sample.shape.read))
    held = _held(s, after, believed * finite, q)
    braked = ca.if_else(held["held"], _holding_command(held["stand"] - after["x"], q), _faded(s["brake"], q))
    begun = _braking_command(sample, _speed_to_brake(sample, after, trip, believed), believed)
    return held | {"brake": ca.if_else(s["trip"] > 0, braked, begun)}


def _speed_to_brake(sample: Sample, after: Parts, trip: ca.SX, believed: ca.SX) -> ca.SX:
    """Speed [m/s] at which the brake will take hold, as far as it is known."""
    q = sample.q
    speed = ca.if_else(trip == TRIPS.index("speed"), sample.before["v"], after["v"])  # after a jump: the one before
    speed = ca.if_else(believed, speed, after["flow"]) if sample.shape.observes else speed
    gain = sample.acceleration * q["latency"]
    return ca.if_else(trip == TRIPS.index("force"), 0, speed + ca.if_else(speed * gain > 0, gain, 0))


def _braking_command(sample: Sample, speed: ca.SX, believed: ca.SX) -> ca.SX:
    """The opening that the brake begins at: it throttles this speed with the braking force, no wider than it is."""
    u, wide = sample.u, sample.q["opening"] * speed
    braked = ca.fmin(ca.fmax(u, ca.fmin(wide, 0)), ca.fmax(wide, 0))
    return braked if sample.shape.observes else ca.if_else(believed, braked, u)


def _held(s: Parts, after: Parts, believed: ca.SX, q: Parts) -> dict[str, ca.SX]:
    """The position to hold a jack at after a trip, from when the brake is through, if its position is known."""
    stands = ca.logic_and(ca.logic_and(s["trip"] > 0, s["brake"] == 0), ca.fabs(after["v"]) < q["calm"])
    held = ca.logic_and(q["hold"] > 0, ca.logic_or(s["held"], ca.logic_and(stands, believed)))
    return {"held": held, "stand": ca.if_else(s["held"], s["stand"], after["x"])}


def _holding_command(error: ca.SX, q: Parts) -> ca.SX:
    """A weak proportional loop about where the jack stands."""
    return ca.fmin(_WEAK, ca.fmax(-_WEAK, q["hold"] * error))


def _faded(brake: ca.SX, q: Parts) -> ca.SX:
    """The brake's command one period on, towards 0."""
    return brake - ca.fmin(q["fade"], ca.fmax(-q["fade"], brake))


@cache
def graphs(shape: GuardShape) -> tuple[ca.Function, ca.Function]:
    """(state, readings, u, numbers, reference) -> state, and (state, demanded, u, numbers) -> (command, trip)."""
    state, y = ca.SX.sym("s", length(shape.state)), ca.SX.sym("y", len(shape.read))
    numbers, u, demanded = ca.SX.sym("q", length(shape.numbers)), ca.SX.sym("u"), ca.SX.sym("r")
    reference = ca.SX.sym("reference")
    s, q = parts(state, shape.state), parts(numbers, shape.numbers)
    after = watched(shape, s, y, u, reference, q)
    command, trip = let_through(s, demanded, u, q)
    return (
        ca.Function("watch", [state, y, u, numbers, reference], [ca.cse(packed_state(shape, after))]),
        ca.Function("limit", [state, demanded, u, numbers], [ca.vertcat(command, trip)]),
    )


def parts(vector: ca.SX, of: Mapping[str, slice]) -> dict[str, ca.SX]:
    """A vector by the names of its places."""
    return {name: vector[place] for name, place in of.items()}


def packed_state(shape: GuardShape, s: Parts) -> ca.SX:
    """A guard's state as a vector."""
    return ca.vertcat(*(s[name] for name in shape.state))


def coupled(q: Parts, speeds: ca.SX, pressed: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Acceleration [6] of each leg by all pushes, and deceleration [6] of each where all brake, m/s^2, at speeds [6]
    and forces of the pressures [6]. One that is not finite counts as the load that the leg holds.

    Numbers by COUPLED: inertia and its inverse, column by column, load [N] and drag [N s/m] of each leg, what force it
    has `left` to brake, and its `least` deceleration.
    """
    inertia, mobility = (ca.reshape(q[name], LEGS, LEGS) for name in ("inertia", "mobility"))
    push = ca.if_else(is_finite(pressed), pressed - q["load"], 0) - q["drag"] * speeds
    asked = ca.fabs(inertia @ speeds)
    rate = ca.mmin(q["left"] / (asked + _STILL))
    return mobility @ push, ca.fmax(q["least"], _KNOWN * rate * ca.fabs(speeds))


def told(q: Parts, acceleration: ca.SX, braking: ca.SX) -> dict[str, ca.SX]:
    """The numbers of a leg's guard that go by what the others do, of its own ones."""
    return {"pushed": acceleration, "braking": braking, "fade": braking * q["opening"] * q["period"]}


class GuardSteps:
    """A guard's state, stepped by `watch` and `limit`. `numbers` are those of `shape.numbers`, in its order."""

    def __init__(self, shape: GuardShape, numbers: np.ndarray) -> None:
        self._read, self._numbers = shape.read, np.array(numbers, float)
        self._trip, self._speed = shape.state["trip"].start, shape.state["v"].start
        watch, limit = graphs(shape)
        self._state = np.zeros(watch.numel_in(0))
        self._readings, self._command, self._demanded, self._reference = np.zeros(len(shape.read)), *np.zeros((3, 1))
        places = self._command, self._numbers
        self._watch = BufferedFunction(watch, self._state, self._readings, *places, self._reference)
        self._limit = BufferedFunction(limit, self._state, self._demanded, *places)

    def reset(self) -> None:
        """Forget the past."""
        self._state[:] = 0

    @property
    def speed(self) -> float:
        """The speed [m/s] that the readings say."""
        return float(self._state[self._speed])

    def watch(self, measurement: Mapping[str, float], command: float, reference: float) -> int:
        """Read the signals (SI, NaN where one is missing) while the drive holds a command, and the position should be
        at a reference, NaN: anywhere; the trip's number, or 0."""
        self._readings[:] = [measurement.get(name, np.nan) for name in self._read]
        self._command[0], self._reference[0] = command, reference
        self._watch.evaluate()
        self._state[:] = self._watch.found
        return int(self._state[self._trip])

    def limit(self, demanded: float, command: float) -> tuple[float, int]:
        """The command that the drive gets after `command`, and the number of the trip, or 0."""
        self._demanded[0], self._command[0] = demanded, command
        self._limit.evaluate()
        sent, trip = self._limit.found.tolist()
        self._state[self._trip] = trip
        return sent, int(trip)
