"""The sampling instants of a platform: one law for all jacks, and a guard for each, as one graph.

As sampled_law.py has it for a single jack: the sensors of all legs are read, the law demands six commands, each guard
limits its own or trips, the drives hold what has arrived. Where one guard trips, the other legs brake, too.
"""

from dataclasses import dataclass

import casadi as ca

from ..plant import Plant
from .guard_coupling import COUPLED, coupled, told
from .guard_rules import let_through, packed_state, parts, watched
from .guard_shape import BESIDE, GuardShape, length, places
from .instant import Parts, held, reading
from .sampled_law import LawGraphs

LEGS = 6
OUT = ("sent", "demanded", "held", "trip")  # what every instant puts out of each leg, before the recorded outputs


@dataclass(frozen=True)
class PlatformShape:
    """What decides the machine code; everything else is a parameter.

    graphs: of the law, output (x, (r, y), o, q) -> u [6] and advance (x, (r, y), v, o, q) -> x+, r the references of
    the legs and the feed-forward of the law [12], y what it `measured`, leg by leg. The rest as LawShape has it, of one
    leg.
    """

    graphs: LawGraphs
    measured: tuple[str, ...]
    sensors: tuple[str, ...]
    guard: GuardShape
    late: int = 0
    split: bool = False
    interpolated: bool = False
    noisy: bool = False
    recorded: tuple[str, ...] = ()

    @property
    def state(self) -> dict[str, slice]:
        """Places in the state: the commands that the drives hold last, those on their way, ..."""
        line, guard = LEGS * (self.late + 1), LEGS * length(self.guard.state)
        return places(held=LEGS, line=line, command=LEGS, guard=guard, law=self.graphs.states)

    @property
    def numbers(self) -> dict[str, slice]:
        """Places of the parameters; of the guards and sensors one leg after the other."""
        sensors, guard = LEGS * len(self.guard.read), LEGS * length(self.guard.numbers)
        sizes = {"q": self.graphs.numbers, "offset": LEGS, "guard": guard, "coupling": length(COUPLED), "part": 1}
        return places(**sizes, noise=sensors, resolution=sensors)

    @property
    def width_out(self) -> int:
        """How many numbers an instant puts out."""
        return LEGS * len(OUT) + len(self.recorded)

    def inputs(self, plant: Plant) -> dict[str, slice]:
        """Places in the row of an instant: references, feed-forward, the plant's other inputs, noise leg by leg."""
        noise = LEGS * len(self.sensors) if self.noisy else 0
        return places(reference=LEGS, forward=LEGS, others=len(plant.inputs) - LEGS, noise=noise)

    def instant(self, plant: Plant) -> ca.Function:
        """The graph of an instant."""
        sizes = (("x", plant.n), ("u", len(plant.inputs)), ("p", len(plant.parameters)))
        x, u, p = (ca.SX.sym(*args) for args in sizes)
        vectors = (self.state, self.inputs(plant), self.numbers)
        state, row, numbers = (ca.SX.sym(name, length(of)) for name, of in zip("srq", vectors, strict=True))
        s, r, q = (parts(vector, of) for vector, of in zip((state, row, numbers), vectors, strict=True))
        outputs = plant.h(x, ca.vertcat(s["held"], r["others"]), p)
        signals = dict(zip(plant.outputs, ca.vertsplit(outputs), strict=True))
        law = _law(self, s, r, q, _readings(self, signals, r, q))
        now, last, line = _arriving(self, s["line"], law["sent"], q)
        after = ca.vertcat(last, line, law["sent"], law["guard"], law["state"])
        put_out = [law["sent"], law["demanded"], now, law["trip"], *(signals[name] for name in self.recorded)]
        arguments = [x, u, p, state, row, numbers]
        return ca.Function("instant", arguments, [ca.cse(ca.vertcat(now, r["others"], after, *put_out))])


def _readings(shape: PlatformShape, signals: Parts, r: Parts, q: Parts) -> list[Parts]:
    """What the sensors of each leg say that law or guard reads: with their noise, in steps of their resolution."""
    read, sensors = shape.guard.read, shape.sensors
    legs = []
    for leg in range(LEGS):
        values = {name: signals[f"leg{leg + 1}.{name}"] for name in read}
        if shape.noisy:
            for i, name in enumerate(read):
                noise = r["noise"][leg * len(sensors) + sensors.index(name)]
                at = leg * len(read) + i
                values[name] = reading(values[name], q["noise"][at] * noise, q["resolution"][at])
        legs.append(values)
    return legs


def _law(shape: PlatformShape, s: Parts, r: Parts, q: Parts, readings: list[Parts]) -> dict[str, ca.SX]:
    """The commands that the guards let through, what was demanded, the trips, and the law's state after."""
    measured = [reading[name] for reading in readings for name in shape.measured]
    signals = ca.vertcat(r["reference"], r["forward"], *measured)
    numbers = _told(shape, s, q, readings)
    guards = [_watched(shape, leg, s, r, numbers[leg], reading) for leg, reading in enumerate(readings)]
    tripped = ca.mmax(ca.vertcat(*(guard["trip"] for guard in guards))) > 0
    beside = ca.if_else(tripped, BESIDE, 0)
    guards = [guard | {"trip": ca.if_else(guard["trip"] > 0, guard["trip"], beside)} for guard in guards]
    computed = ca.SX(shape.graphs.output(s["law"], signals, q["offset"], q["q"]))
    asked = ca.if_else(tripped, 0, computed)
    passed = [let_through(guard, asked[leg], s["command"][leg], numbers[leg]) for leg, guard in enumerate(guards)]
    sent, trips = (ca.vertcat(*column) for column in zip(*passed, strict=True))
    states = [packed_state(shape.guard, guard | {"trip": trips[leg]}) for leg, guard in enumerate(guards)]
    advanced = ca.SX(shape.graphs.advance(s["law"], signals, sent, q["offset"], q["q"]))
    state = ca.if_else(tripped, s["law"], advanced)
    return {"sent": sent, "demanded": asked, "trip": trips, "guard": ca.vertcat(*states), "state": state}


def _watched(shape: PlatformShape, leg: int, s: Parts, r: Parts, q: Parts, reading: Parts) -> dict[str, ca.SX]:
    values, state = ca.vertcat(*reading.values()), _state(shape, leg, s)
    return dict(watched(shape.guard, state, values, s["command"][leg], r["reference"][leg], q))


def _told(shape: PlatformShape, s: Parts, q: Parts, readings: list[Parts]) -> list[Parts]:
    """The numbers of each leg's guard, with what the others do to it where their pressures are read."""
    own = [_numbers(shape, leg, q) for leg in range(LEGS)]
    if not shape.guard.observes:
        return own
    pairs = list(zip(own, readings, strict=True))
    pressed = [numbers["area_a"] * reading["pa"] - numbers["area_b"] * reading["pb"] for numbers, reading in pairs]
    speeds = ca.vertcat(*(_state(shape, leg, s)["v"] for leg in range(LEGS)))
    accelerations, braking = coupled(parts(q["coupling"], COUPLED), speeds, ca.vertcat(*pressed))
    return [dict(numbers) | told(numbers, accelerations[leg], braking[leg]) for leg, numbers in enumerate(own)]


def _state(shape: PlatformShape, leg: int, s: Parts) -> Parts:
    """Of a leg's guard."""
    size = length(shape.guard.state)
    return parts(s["guard"][leg * size : (leg + 1) * size], shape.guard.state)


def _numbers(shape: PlatformShape, leg: int, q: Parts) -> Parts:
    """Those of a leg's guard."""
    size = length(shape.guard.numbers)
    return parts(q["guard"][leg * size : (leg + 1) * size], shape.guard.numbers)


def _arriving(shape: PlatformShape, line: ca.SX, sent: ca.SX, q: Parts) -> tuple[ca.SX, ca.SX, ca.SX]:
    """What the drives hold from now on, what at the period's end, and the commands on their way (as DelayLine)."""
    line = ca.vertcat(line, sent)
    return *held(shape, line[:LEGS], line[LEGS : 2 * LEGS], q["part"]), line[LEGS:]
