"""The rules of the guard as one graph: what it concludes from readings, and what it lets through to the drive.

A loop in Python evaluates the graph sample by sample, a compiled one has it inside its instant: the rules are written
once. The state of a guard is a vector with the places of `state`, its numbers one with those of `numbers`, so that
other rigs and limits need no other machine code.

Four looks are taken. Limits: of stroke, speed and force, and whether the jack can still stop before the end of its
stroke, or the force before its limit. Repeated readings: noise makes exact repeats rare. The rig's own observer, in
a window that forgets: displacement by the flow through the valve and the compression of the oil against the measured
one; impulse of the pressures less the load cell against the measured change of speed.
"""

from collections.abc import Mapping
from functools import cache

import casadi as ca

from .guard_shape import TRIPS, GuardShape, length

_DISBELIEVED = ("lost", "observer", "still position")  # trips that say that the position is wrong
_LARGEST = 1.7e308
_WEAK = 0.05  # the largest command that holds a jack after a trip
_HELD = 3  # equal readings before a jump that say that samples were lost

_Parts = Mapping[str, ca.SX]


def watched(shape: GuardShape, s: _Parts, y: ca.SX, u: ca.SX, q: _Parts) -> dict[str, ca.SX]:
    """The guard's state after readings y, where the drive last got the command u; a trip stays."""
    first, finite = s["count"] < 1, ca.fabs(ca.sum1(y)) <= _LARGEST
    y = ca.if_else(finite, y, s["last"])
    after = dict(s) | {"count": s["count"] + 1, "last": y}
    after["still"] = ca.if_else(first, 0, (y == s["last"]) * (s["still"] + 1))
    push = _push(shape, y, q)
    after |= _motion(shape, s, y, q, first, push)
    after |= _load(shape, s, y, q, first, push)
    if shape.observes:
        after |= _observer(shape, s, after, y, u, q, first, push)
    reason = ca.if_else(finite, _reason(shape, s, after, y, u, q, push, first), TRIPS.index("finite"))
    now = ca.if_else(s["trip"] > 0, s["trip"], reason)
    believed = 1 - ca.fmin(1, sum((now == TRIPS.index(name) for name in _DISBELIEVED), ca.SX(0)))
    speed = ca.if_else(now == TRIPS.index("speed"), s["v"], after["v"])  # after a jump: the one before
    speed = ca.if_else(believed, speed, after["flow"]) if shape.observes else speed
    gain = push / q["mass"] * q["latency"]
    speed = ca.if_else(now == TRIPS.index("force"), 0, speed + ca.if_else(speed * gain > 0, gain, 0))
    after |= _held(s, after, believed * (now != TRIPS.index("finite")), q)
    braked = ca.if_else(after["held"], _holding_command(after, q), _faded(s["brake"], q))
    after["brake"] = ca.if_else(s["trip"] > 0, braked, _braking_command(u, speed, believed, shape, q))
    return after | {"trip": now}


def let_through(s: _Parts, demanded: ca.SX, u: ca.SX, q: _Parts) -> tuple[ca.SX, ca.SX]:
    """The command that the drive gets after u, and the reason for a trip, for the demanded one: limited in size and
    rate; after a trip the one of the brake."""
    finite = ca.fabs(demanded) <= _LARGEST
    trip = ca.if_else(s["trip"] > 0, s["trip"], ca.if_else(finite, 0, TRIPS.index("command")))
    target = ca.if_else(trip > 0, s["brake"], ca.fmin(1, ca.fmax(-1, demanded)))
    return u + ca.fmin(q["step"], ca.fmax(-q["step"], target - u)), trip


def _pressed(shape: GuardShape, y: ca.SX, q: _Parts) -> ca.SX:
    """Force [N] of the pressures on the piston."""
    return q["area_a"] * y[shape.at("pa")] - q["area_b"] * y[shape.at("pb")]


def _push(shape: GuardShape, y: ca.SX, q: _Parts) -> ca.SX:
    """Force [N] that accelerates the mass, of the pressures less the load cell; 0 where they are not measured."""
    return _pressed(shape, y, q) - y[shape.at("force")] if shape.balances else ca.SX(0)


def _motion(shape: GuardShape, s: _Parts, y: ca.SX, q: _Parts, first: ca.SX, push: ca.SX) -> dict[str, ca.SX]:
    """Position and speed: a prediction by the force on the mass, corrected by what the position says of it."""
    x, period = y[shape.at("position")], q["period"]
    gain = push / q["mass"] * period
    ahead = s["x"] + (s["v"] + gain / 2) * period
    off = x - ahead
    return {
        "x": ca.if_else(first, x, ahead + q["fast"] * off),
        "v": ca.if_else(first, 0, s["v"] + gain + q["slow"] / period * off),
    }


def _load(shape: GuardShape, s: _Parts, y: ca.SX, q: _Parts, first: ca.SX, push: ca.SX) -> dict[str, ca.SX]:
    """Force of the load cell and its rate, in the same way: the push moves the specimen."""
    if "force" not in shape.read:
        return {}
    force, period = y[shape.at("force")], q["period"]
    gain = q["specimen"] * push / q["mass"] * period
    ahead = s["f"] + (s["df"] + gain / 2) * period
    off = force - ahead
    return {
        "f": ca.if_else(first, force, ahead + q["fast"] * off),
        "df": ca.if_else(first, 0, s["df"] + gain + q["slow"] / period * off),
    }


def _flow_speed(shape: GuardShape, s: _Parts, y: ca.SX, u: ca.SX, q: _Parts) -> tuple[ca.SX, ca.SX]:
    """Speed [m/s] of a piston on stiff oil by the flows through the lands, and the spool's travel [m]."""
    lagged = s["spool"] + q["lag"] * ((u + q["null"]) * q["travel"] - s["spool"])
    z = y[shape.at("spool")] if "spool" in shape.read else lagged
    pa, pb = y[shape.at("pa")], y[shape.at("pb")]
    supply = y[shape.at("supply")] if "supply" in shape.read else q["supply"]
    shut = ca.fmax(0, 1 - ca.fabs(z) / (2 * q["lap"]))
    leak, wide = q["lap"] * shut * shut, ca.fabs(z) + q["lap"]
    forward, backward = ca.if_else(z >= 0, wide, leak), ca.if_else(z >= 0, leak, wide)
    into_a = q["flow_a"] * (forward * _root(supply - pa) - backward * _root(pa - q["drain"]))
    out_of_b = q["flow_b"] * (forward * _root(pb - q["drain"]) - backward * _root(supply - pb))
    return (into_a + out_of_b) / 2, lagged


def _root(drop: ca.SX) -> ca.SX:
    """Signed root [Pa^0.5] of a pressure drop [Pa]: what is above the supply flows back."""
    return drop / ca.sqrt(ca.fabs(drop) + 1.0)


def _observer(
    shape: GuardShape, s: _Parts, after: _Parts, y: ca.SX, u: ca.SX, q: _Parts, first: ca.SX, push: ca.SX
) -> dict[str, ca.SX]:
    """What flow and pressures say that the readings should have done, in a window that forgets."""
    speed, spool = _flow_speed(shape, s, y, u, q)
    moved = y[shape.at("position")] - s["last"][shape.at("position")]
    keep, period = 1 - q["forget"], q["period"]
    rest = ca.if_else(first, push, s["rest"])
    steps = {
        "gap": moved - speed * period,
        "travel": ca.fabs(speed) * period,
        "strain": _pressed(shape, y, q) - _pressed(shape, s["last"], q),
        "impulse": (push - rest - q["friction"] * after["v"]) * period,
        "change": after["v"] - s["v"],
    }
    sums = {name: ca.if_else(first, 0, keep * s[name] + step) for name, step in steps.items()}
    return sums | {"flow": speed, "rest": rest, "spool": ca.if_else(first, (u + q["null"]) * q["travel"], spool)}


def _reason(
    shape: GuardShape, s: _Parts, after: _Parts, y: ca.SX, u: ca.SX, q: _Parts, push: ca.SX, first: ca.SX
) -> ca.SX:
    """The number of the reason for a trip, or 0: of several, the last one of this list."""
    position = y[shape.at("position")]
    place = shape.at("position")
    moved = ca.fabs(position - s["last"][place])
    reasons: list[tuple[str, ca.SX]] = []
    if shape.observes:
        reasons += _implausible(shape, after, q)
    reasons += [(f"still {name}", after["still"][i] >= q["repeats"][i]) for i, name in enumerate(shape.read)]
    reasons.append(("braking", _too_late(after, u, push, q)))
    if "force" in shape.read:
        swing = ca.if_else(q["specimen"] > 0, _highest_load(after, push, u, q), 0)  # nothing to press on: no swing
        most = ca.fmax(swing, ca.fabs(y[shape.at("force")]))
        reasons.append(("force", most > q["force"]))
    jumped = ca.if_else(first, 0, moved > q["move"])
    reasons.append(("speed", ca.logic_or(jumped, _too_fast(after, push, q))))
    reasons.append(("lost", ca.logic_and(jumped, s["still"][place] >= _HELD)))
    reasons.append(("stroke", ca.fabs(position - q["middle"]) > q["stroke"]))
    trip = ca.SX(0)
    for name, holds in reasons:
        trip = ca.if_else(holds, TRIPS.index(name), trip)
    return trip


def _implausible(shape: GuardShape, after: _Parts, q: _Parts) -> list[tuple[str, ca.SX]]:
    """Where measured and observed motion differ by more than other oil, flow and mass explain."""
    strain = after["strain"] / q["oil"]
    gap = ca.fabs(after["gap"] + strain)
    moved = [("observer", gap > q["allowed"] + q["flow_share"] * after["travel"] + ca.fabs(strain))]
    if not shape.balances:  # a load that nothing measures is no fault
        return moved
    impulse = ca.fabs(after["impulse"] - q["mass"] * after["change"])
    allowed = q["allowed_impulse"] + q["mass_share"] * q["mass"] * ca.fabs(after["change"])
    return [("impulse", impulse > allowed), *moved]


def _too_fast(after: _Parts, push: ca.SX, q: _Parts) -> ca.SX:
    """Whether the speed will be above its limit before a command can change that."""
    ahead = ca.if_else(after["v"] >= 0, 1, -1)
    return ca.fabs(after["v"]) + ca.fmax(0, ahead * push / q["mass"]) * q["latency"] > q["speed"]


def _too_late(after: _Parts, u: ca.SX, push: ca.SX, q: _Parts) -> ca.SX:
    """Whether braking that began any later would end beyond the stroke, where the command does not brake already; or
    where even the whole force of the supply would not stop the jack, unless it slows down enough by itself."""
    v, latency = after["v"], q["latency"]
    ahead = ca.if_else(v >= 0, 1, -1)
    speed, gain = ca.fabs(v), ahead * push / q["mass"]
    left = 2 * (q["stroke"] + q["over"] - ahead * (after["x"] - q["middle"]))
    faster = speed + ca.fmax(gain, 0) * latency
    now = faster * faster > q["braking"] * (left - (speed + faster) * latency)
    over = ca.logic_and(speed * speed > q["stall"] * left, speed * speed > -gain * left)
    return ca.logic_or(ca.logic_and(now, ahead * u >= q["opening"] * speed), over)


def _highest_load(after: _Parts, push: ca.SX, u: ca.SX, q: _Parts) -> ca.SX:
    """Force [N] to which the load cell still swings where the valve closes now: the push lasts as long as that takes,
    then the mass swings between specimen and shut-in oil."""
    late, stiffness = q["late"] + ca.fabs(u) / q["step"] * q["period"], q["specimen"] + q["oil"]
    jerk = q["specimen"] * push / q["mass"]
    load, rate = after["f"] + (after["df"] + jerk * late / 2) * late, after["df"] + jerk * late
    rest = (after["f"] + push - load) * q["specimen"] / stiffness
    return ca.fabs(load + rest) + ca.sqrt(rest * rest + rate * rate * q["mass"] / stiffness)


def _braking_command(u: ca.SX, speed: ca.SX, believed: ca.SX, shape: GuardShape, q: _Parts) -> ca.SX:
    """Where the brake begins: the opening that throttles this speed with the braking force, no wider than it is."""
    wide = q["opening"] * speed
    braked = ca.fmin(ca.fmax(u, ca.fmin(wide, 0)), ca.fmax(wide, 0))
    return braked if shape.observes else ca.if_else(believed, braked, u)


def _held(s: _Parts, after: _Parts, believed: ca.SX, q: _Parts) -> dict[str, ca.SX]:
    """Where a jack stands that is to be held after a trip: from when the brake is through, if its position is known."""
    stands = ca.logic_and(ca.logic_and(s["trip"] > 0, s["brake"] == 0), ca.fabs(after["v"]) < q["calm"])
    held = ca.logic_and(q["hold"] > 0, ca.logic_or(s["held"], ca.logic_and(stands, believed)))
    return {"held": held, "stand": ca.if_else(s["held"], s["stand"], after["x"])}


def _holding_command(after: _Parts, q: _Parts) -> ca.SX:
    """A weak proportional loop about where the jack stands."""
    return ca.fmin(_WEAK, ca.fmax(-_WEAK, q["hold"] * (after["stand"] - after["x"])))


def _faded(brake: ca.SX, q: _Parts) -> ca.SX:
    """The brake's command one period on, towards 0."""
    return brake - ca.fmin(q["fade"], ca.fmax(-q["fade"], brake))


@cache
def graphs(shape: GuardShape) -> tuple[ca.Function, ca.Function]:
    """(state, readings, u, numbers) -> state, and (state, demanded, u, numbers) -> (command, trip)."""
    state, y = ca.SX.sym("s", length(shape.state)), ca.SX.sym("y", len(shape.read))
    numbers, u, demanded = ca.SX.sym("q", length(shape.numbers)), ca.SX.sym("u"), ca.SX.sym("r")
    s, q = parts(state, shape.state), parts(numbers, shape.numbers)
    after = watched(shape, s, y, u, q)
    command, trip = let_through(s, demanded, u, q)
    return (
        ca.Function("watch", [state, y, u, numbers], [ca.cse(packed_state(shape, after))]),
        ca.Function("limit", [state, demanded, u, numbers], [ca.vertcat(command, trip)]),
    )


def parts(vector: ca.SX, of: Mapping[str, slice]) -> dict[str, ca.SX]:
    """A vector by the names of its places."""
    return {name: vector[place] for name, place in of.items()}


def packed_state(shape: GuardShape, s: _Parts) -> ca.SX:
    """A guard's state as a vector."""
    return ca.vertcat(*(s[name] for name in shape.state))
