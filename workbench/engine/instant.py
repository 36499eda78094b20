"""What happens at each sampling instant, as one graph: of one jack, or of all legs of a platform.

At an instant the sensors are read, the law demands a command, the guard limits it or trips, the drive holds what has
arrived. The law does not learn of a command that is added to its own. loop/sampled_loop.py runs the same instants in
Python and is the oracle in tests.
"""

from collections.abc import Mapping, Sequence

import casadi as ca

from ..plant import Plant
from ..rigs.sampling import arriving, in_steps
from .guard_rules import COUPLED, coupled, let_through, packed_state, parts, told, watched
from .guard_shape import BESIDE, length, places
from .sampled_law import LawShape

Parts = Mapping[str, ca.SX]


def instant(plant: Plant, shape: LawShape) -> ca.Function:
    """(x, u, p, state, row, numbers) -> (inputs of the plant, state after, what is put out), one after the other."""
    x, u, p = (ca.SX.sym(*args) for args in (("x", plant.n), ("u", len(plant.inputs)), ("p", len(plant.parameters))))
    vectors = (shape.state, shape.inputs(plant), shape.numbers)
    state, row, numbers = (ca.SX.sym(name, length(of)) for name, of in zip(("s", "r", "q"), vectors, strict=True))
    s, r, q = (parts(vector, of) for vector, of in zip((state, row, numbers), vectors, strict=True))
    outputs = plant.h(x, ca.vertcat(s["held"], r["others"]), p)
    signals = [
        {name: outputs[plant.output(shape.output(jack, name))] for name in shape.read} for jack in range(shape.jacks)
    ]
    law = _law(shape, s, r, q, [_readings(shape, jack, own, r, q) for jack, own in enumerate(signals)])
    now, last, line = _arriving(shape, s["line"], law["sent"], q)
    after = ca.vertcat(last, line, law["sent"], law["guard"], law["state"])
    put_out = [law["sent"], law["demanded"], now, law["trip"]]
    put_out += [outputs[plant.output(name)] for name in shape.recorded]
    arguments = [x, u, p, state, row, numbers]
    return ca.Function("instant", arguments, [ca.cse(ca.vertcat(now, r["others"], after, *put_out))])


def controller_instant(shape: LawShape) -> ca.Function:
    """(state, row, numbers) -> (state after, sent, demanded, trip): an instant of law and guards alone, whose readings
    come from outside. A row is the references and those to come, the added commands, and the readings of `shape.read`,
    one jack after the other."""
    jacks, read = shape.jacks, len(shape.read)
    inputs = places(reference=jacks * (1 + shape.ahead), added=jacks, readings=jacks * read)
    vectors = (shape.state, inputs, shape.numbers)
    state, row, numbers = (ca.SX.sym(name, length(of)) for name, of in zip("srq", vectors, strict=True))
    s, r, q = (parts(vector, of) for vector, of in zip((state, row, numbers), vectors, strict=True))
    own = (r["readings"][jack * read : (jack + 1) * read] for jack in range(jacks))
    law = _law(shape, s, r, q, [{name: values[i] for i, name in enumerate(shape.read)} for values in own])
    kept = {name: s[name] for name in shape.state} | {
        "held": law["sent"], "command": law["sent"], "guard": law["guard"], "law": law["state"]
    }  # fmt: skip
    after = ca.vertcat(*(kept[name] for name in shape.state), law["sent"], law["demanded"], law["trip"])
    return ca.Function("controller", [state, row, numbers], [ca.cse(after)])


def _readings(shape: LawShape, jack: int, signals: Parts, r: Parts, q: Parts) -> Parts:
    """What the sensors of a jack say that law or guard reads."""
    if not shape.noisy:
        return signals
    sensors, first = jack * len(shape.sensors), jack * len(shape.read)
    noise = {name: r["noise"][sensors + shape.sensors.index(name)] for name in shape.read}
    return {
        name: _reading(signals[name], q["noise"][i] * noise[name], q["resolution"][i])
        for i, name in enumerate(shape.read, first)
    }


def _reading(value: ca.SX, noise: ca.SX, quantum: ca.SX) -> ca.SX:
    """What a sensor says of an output: with its noise, in steps of its resolution where it has one."""
    return in_steps(value + noise, quantum > 0, ca.if_else(quantum > 0, quantum, 1), ca.floor, ca.if_else)


def watched_readings(
    outputs: int, columns: Sequence[int], quanta: Sequence[float], watched: Sequence[int]
) -> ca.Function:
    """(outputs, noise [channels], middles [limits], sizes [limits]) -> what sensors of some `columns` say, in steps of
    their `quanta`; then the number from 1 of the first limit that its output, one of `watched`, is beyond, or 0."""
    y, noise, middles, sizes = (
        ca.SX.sym(name, size)
        for name, size in (("y", outputs), ("e", len(columns)), ("m", len(watched)), ("r", len(watched)))
    )
    readings = [_reading(y[column], noise[i], ca.SX(quanta[i])) for i, column in enumerate(columns)]
    beyond = ca.SX(0)
    for i, column in reversed(list(enumerate(watched))):
        beyond = ca.if_else(ca.fabs(y[column] - middles[i]) <= sizes[i], beyond, i + 1)
    return ca.Function("watched_readings", [y, noise, middles, sizes], [ca.vertcat(*readings, beyond)])


def _law(shape: LawShape, s: Parts, r: Parts, q: Parts, readings: Sequence[Parts]) -> dict[str, ca.SX]:
    """The commands that the guards let through, what was demanded, the trips, and the law's state after. Where the
    guard of one jack trips, the others brake, too."""
    measured = [values[name] for values in readings for name in shape.measured]
    numbers, states = _guard_numbers(shape, s, q, readings), _of_jacks(shape, s["guard"], shape.guard.state)
    guards = [
        watched(shape.guard, state, ca.vertcat(*values.values()), s["command"][jack], r["reference"][jack], own)
        for jack, (state, values, own) in enumerate(zip(states, readings, numbers, strict=True))
    ]
    tripped = ca.mmax(ca.vertcat(*(guard["trip"] for guard in guards))) > 0
    outside, inside = (r["added"], []) if shape.jacks == 1 else (0, [r["added"]])
    if shape.jacks > 1:
        beside = ca.if_else(tripped, BESIDE, 0)
        guards = [guard | {"trip": ca.if_else(guard["trip"] > 0, guard["trip"], beside)} for guard in guards]
    signals = ca.vertcat(r["reference"], *inside, *measured)
    demanded = ca.SX(shape.graphs.output(s["law"], signals, q["offset"], q["q"]))
    asked = ca.if_else(tripped, 0, demanded + outside)
    passed = [let_through(guard, asked[jack], s["command"][jack], numbers[jack]) for jack, guard in enumerate(guards)]
    sent, trip = (ca.vertcat(*column) for column in zip(*passed, strict=True))
    kept = [packed_state(shape.guard, guard | {"trip": trip[jack]}) for jack, guard in enumerate(guards)]
    advanced = ca.SX(shape.graphs.advance(s["law"], signals, sent - outside, q["offset"], q["q"]))
    state = ca.if_else(ca.mmax(trip) > 0, s["law"], advanced)
    return {"sent": sent, "demanded": asked, "trip": trip, "guard": ca.vertcat(*kept), "state": state}


def _guard_numbers(shape: LawShape, s: Parts, q: Parts, readings: Sequence[Parts]) -> list[Parts]:
    """The numbers of each guard; of a leg with what the others do to it, where their pressures are read."""
    own = _of_jacks(shape, q["guard"], shape.guard.numbers)
    if not (shape.guard.leg and shape.guard.observes):
        return own
    pairs = list(zip(own, readings, strict=True))
    pressed = [numbers["area_a"] * values["pa"] - numbers["area_b"] * values["pb"] for numbers, values in pairs]
    speeds = ca.vertcat(*(state["v"] for state in _of_jacks(shape, s["guard"], shape.guard.state)))
    accelerations, braking = coupled(parts(q["coupling"], COUPLED), speeds, ca.vertcat(*pressed))
    return [dict(numbers) | told(numbers, accelerations[leg], braking[leg]) for leg, numbers in enumerate(own)]


def _of_jacks(shape: LawShape, vector: ca.SX, of: Mapping[str, slice]) -> list[Parts]:
    """The parts of each jack, of a vector that has them one after the other."""
    size = length(of)
    return [parts(vector[jack * size : (jack + 1) * size], of) for jack in range(shape.jacks)]


def _arriving(shape: LawShape, line: ca.SX, sent: ca.SX, q: Parts) -> tuple[ca.SX, ca.SX, ca.SX]:
    """What the drives hold from now on, what at the period's end, and the commands on their way (as DelayLine)."""
    line, jacks = ca.vertcat(line, sent), shape.jacks
    before, now = line[:jacks], line[jacks : 2 * jacks]
    if shape.own_delays:  # of single jacks in lanes; the oldest command comes first
        taps = q["taps"][::-1]
        before, now = ca.dot(taps, line[:-1]), ca.dot(taps, line[1:])
    arrives_inside = shape.split or shape.interpolated
    return *arriving(before if arrives_inside else now, now, q["part"], shape.interpolated), line[jacks:]
