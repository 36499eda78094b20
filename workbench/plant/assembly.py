"""The bench on which a plant is put together: named states, rates, outputs, parameters and slots for effects."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from ..base.errors import InputError, nearest
from ..rigs.inner_loop import DELAY
from .effects.effect import Effect, Scope
from .effects.slots import ORIGINS, RANGED, SENSED, SLOTS


@dataclass(frozen=True)
class Variable:
    """A state or input: SI unit, a magnitude that is large for it, and a plausible start value.

    `held`: a store that fills while the jack moves, so that an operating point holds it at its start, as the position;
    `number` is the number that it starts at. `follows` names the state that it comes to, where nothing moves. `memory`:
    it stays where it was until something drags it along. `parted`: a line that a valve may part from the chamber
    that it follows. `across`: its speed's state and the parameter that is how wide a gap about 0 is in which nothing
    holds it.
    """

    name: str
    unit: str
    scale: float
    start: float = 0.0
    held: bool = False
    number: str = ""
    follows: str = ""
    memory: bool = False
    parted: bool = False
    across: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Plant:
    """A finished plant: x' = f(x, u, p), y = h(x, u, p), all SI.

    `f` and `h` are CasADi functions of columns x [n], u [m], p [k]; `p` holds this rig's values in the order of
    `parameters`. `dry_friction` are the Coulomb-friction numbers that a linearisation sets to zero. `delay` is the
    parameter by which the command is late, where an effect declares one: whoever feeds the plant holds it back, by
    engine.DelayLine; where it is `interpolated`, the plant holds the mean of the commands that arrive in a period (a
    linear view takes that as a shift, too). `computing` is a parameter that adds to the delay. `bends` are sums of
    parameters, each over its typical value, that are 0 where a static curve of several of them is straight.
    `asked` is the position [m] that an inner loop is asked for at command 1; 0 where there is no such loop.
    """

    name: str
    states: tuple[Variable, ...]
    inputs: tuple[Variable, ...]
    outputs: tuple[str, ...]
    parameters: tuple[str, ...]
    p: np.ndarray
    f: ca.Function
    h: ca.Function
    dry_friction: tuple[str, ...]
    delay: str | None = None
    interpolated: bool = False
    computing: str | None = None
    bends: tuple[Mapping[str, float], ...] = ()
    asked: float = 0.0

    @property
    def n(self) -> int:
        """Number of states."""
        return len(self.states)

    @cached_property
    def commands(self) -> int:
        """How many of the inputs, the first ones, are commands."""
        return max(1, sum(variable.name.startswith("command") for variable in self.inputs))

    @property
    def scale(self) -> np.ndarray:
        """Magnitudes of the states, shape [n]."""
        return np.array([s.scale for s in self.states])

    @cached_property
    def gaps(self) -> tuple[tuple[int, int, int], ...]:
        """Each state that moves freely across a gap about 0, between impacts, with the state that is its speed and the
        parameter that is the gap's width.

        Between two impacts nothing brings two courses together, and each impact drives them apart.
        """
        return tuple(
            (column, self.state(state.across[0]), self.parameters.index(state.across[1]))
            for column, state in enumerate(self.states)
            if state.across
        )

    @property
    def start(self) -> np.ndarray:
        """A plausible state to begin a search for equilibrium from, shape [n]."""
        return self.following(np.array([s.start for s in self.states]))

    def command_at(self, position: Any) -> Any:
        """The command by which an inner loop holds a position [m] from mid stroke; 0 without such a loop."""
        if not self.asked:
            return 0.0 * position
        return (position + self.p[self.parameters.index("xmid")]) / self.asked

    def following(self, x: np.ndarray) -> np.ndarray:
        """A state [..., n] with those that follow others where these are."""
        x = x.copy()
        for column, state in enumerate(self.states):
            if state.follows:
                x[..., column] = x[..., self.state(state.follows)]
        return x

    def state(self, name: str) -> int:
        """Index of a state. Raises InputError for an unknown name, as `input` and `output` do."""
        return self._index(name, "state", [state.name for state in self.states])

    def input(self, name: str) -> int:
        """Index of an input."""
        return self._index(name, "input", [variable.name for variable in self.inputs])

    def output(self, name: str) -> int:
        """Index of an output."""
        return self._index(name, "output", self.outputs)

    def _index(self, name: str, what: str, known: Sequence[str]) -> int:
        if name not in known:
            raise InputError(f'plant {self.name}: no {what} "{name}"; {nearest(name, known)}')
        return known.index(name)

    def __repr__(self) -> str:
        """Two lines: how many states and outputs, and the inputs by name."""
        inputs = ", ".join(variable.name for variable in self.inputs)
        late = f"; the command is late by {self.delay}" if self.delay else ""
        counts = f"{self.n} states, {len(self.outputs)} outputs, {len(self.parameters)} parameters"
        return f"<Plant {self.name}: {counts}{late}\n inputs {inputs}>"

    @cached_property
    def slopes(self) -> ca.Function:
        """(x, u, p) -> df/dx [n, n], df/du [n, m], dh/dx [outputs, n], dh/du [outputs, m].

        A store that an operating point holds is a constant: it acts on nothing, and by itself decays in 1 s. So does a
        memory that acts on nothing, as the bristles of a friction without force, beside what drags it: at rest it would
        count as an integrator in every loop.
        """
        x, u, p = (ca.SX.sym(name, self.f.numel_in(i)) for i, name in enumerate("xup"))
        rates, outputs = self.f(x, u, p), self.h(x, u, p)
        parts = [ca.jacobian(of, by) for of in (rates, outputs) for by in (x, u)]
        if any(state.held for state in self.states):
            parts = self._without_stores(parts)
        if any(state.memory for state in self.states):
            parts[0] -= self._idle_memories(*parts[::2])
        return ca.Function("slopes", [x, u, p], parts)

    def _without_stores(self, parts: list[ca.SX]) -> list[ca.SX]:
        """The slopes with the states that are `held` cut out."""
        kept = ca.DM([0.0 if state.held else 1.0 for state in self.states])
        a, b, c, d = parts
        return [a * (kept @ kept.T) - ca.diag(1 - kept), b * ca.repmat(kept, 1, b.shape[1]), c @ ca.diag(kept), d]

    def _idle_memories(self, a: ca.SX, c: ca.SX) -> ca.SX:
        """A diagonal [n, n] of ones at the memories on which no output and no rate but their own depends."""
        others = a - ca.diag(ca.diag(a))
        idle = ca.sum1(others * others) + ca.sum1(c * c) == 0
        return ca.diag(idle.T * ca.DM([float(state.memory) for state in self.states]))

    def parameter_values(self, p: np.ndarray | None = None, **values: float) -> np.ndarray:
        """The parameter vector, the plant's own or `p`, with some SI values replaced."""
        p = (self.p if p is None else p).copy()
        for name, value in values.items():
            p[..., self.parameters.index(name)] = value
        return p

    def lateness(self, p: np.ndarray | None = None) -> float:
        """Time [s] by which the command is late; 0 where no effect says that it is."""
        return float(self.lane_lateness((self.p if p is None else p)[None])[0])

    def lane_lateness(self, p: np.ndarray) -> np.ndarray:
        """Lateness [lanes] s of plants with parameters p [lanes, k]."""
        delays = [p[:, self.parameters.index(name)] for name in (self.delay, self.computing) if name]
        return np.sum([np.zeros(len(p)), *delays], axis=0)

    def without_dry_friction(self, p: np.ndarray | None = None) -> np.ndarray:
        """Parameters, of one plant or of lanes [lanes, k], for a linearisation: tanh friction would pass for damping
        at rest."""
        return self.parameter_values(p, **dict.fromkeys(self.dry_friction, 0.0))

    def observe(self, x: np.ndarray, u: np.ndarray, p: np.ndarray | None = None) -> np.ndarray:
        """Outputs for rows of states [k, n] and inputs [k, m]: an array [k, outputs]."""
        columns = self.h(np.atleast_2d(x).T, np.atleast_2d(u).T, self.p if p is None else p)
        return np.array(columns).T


class Assembly:
    """Collects the symbols and equations of one plant. Parts call it; only build.py creates it."""

    def __init__(
        self, name: str, numbers: Mapping[str, float], effects: tuple[tuple[Effect, Mapping[str, float]], ...] = ()
    ) -> None:
        self.name = name
        self._values = dict(numbers)
        self._p = {key: ca.SX.sym(key) for key in numbers}
        self._x: dict[str, ca.SX] = {}
        self._variables: dict[str, Variable] = {}
        self._rates: dict[str, ca.SX] = {}
        self._inputs: dict[str, tuple[Variable, ca.SX]] = {}
        self._outputs: dict[str, ca.SX] = {}
        self._effect_inputs: dict[str, tuple[Variable, ca.SX]] = {}
        self._dry: list[str] = []
        self._delay: str | None = None
        self._interpolated = False
        self.asked = 0.0
        self._effects = effects
        self._shifts: dict[str, list[str]] = {}
        self._acting: set[str] = set()
        self._passed: set[str] = set()
        for effect, values in effects:
            self._add_effect(effect, values)

    def __getitem__(self, name: str) -> ca.SX:
        """The symbol of a number of the rig, with what shifts it."""
        shifts = [self._p[key] for key in self._shifts.get(name, ())]
        return sum(shifts, start=self._p[name]) if shifts else self._p[name]

    def get(self, name: str, default: float) -> ca.SX:
        """The symbol of a number of the rig, or a default where it has none."""
        return self[name] if name in self else ca.SX(default)

    def __contains__(self, name: str) -> bool:
        """Whether the rig has this number."""
        return name in self._p

    def magnitude(self, name: str) -> float:
        """The value of a number, to scale a state by."""
        return self._values[name]

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects that act in this plant, in order."""
        return tuple(effect for effect, _ in self._effects)

    def state(
        self,
        name: str,
        unit: str,
        scale: float,
        start: float = 0.0,
        number: str = "",
        follows: str = "",
        memory: bool = False,
        parted: bool = False,
        across: tuple[str, ...] = (),
    ) -> ca.SX:
        """Declare a state, a store that starts at a number if it names one; returns its symbol."""
        start = self._values[number] if number else start
        kinds = bool(number), number, follows, memory, parted, across
        self._variables[name] = Variable(name, unit, scale, start, *kinds)
        self._x[name] = ca.SX.sym(name)
        return self._x[name]

    def rate(self, name: str, expression: ca.SX) -> None:
        """The time derivative of a state."""
        self._rates[name] = expression

    def input(self, name: str, unit: str, scale: float) -> ca.SX:
        """Declare an input; returns its symbol."""
        symbol = ca.SX.sym(name)
        self._inputs[name] = (Variable(name, unit, scale), symbol)
        return symbol

    def output(self, **expressions: ca.SX) -> None:
        """Name outputs, by the names of signals.py."""
        self._outputs.update(expressions)

    def measure(self) -> None:
        """Pass every output that has a sensor through the slot of it, but for those that passed already."""
        for name in SENSED:
            if name in self._outputs and f"sensor_{name}" not in self._passed:
                self._outputs[name] = self.sensor(name, self._outputs[name])

    def sensor(self, name: str, value: ca.SX) -> ca.SX:
        """A signal through the slot of its sensor, which offers the part that is a number of the rig, and its range."""
        rest = self[ORIGINS[name]] if name in ORIGINS else ca.SX(0)
        ends = dict(zip(("low", "high"), self._range(name), strict=True)) if name in RANGED else {}
        return self.slot(f"sensor_{name}", value, rest=rest, **ends)

    def _range(self, name: str) -> tuple[ca.SX, ca.SX]:
        """Both ends of what a signal of RANGED can be."""
        if name == "position":
            return self["xmid"] - self["S"] / 2, self["xmid"] + self["S"] / 2
        if name == "force":
            full = self["Ps"] * self["Aj" if "Aj" in self else "AA"]
            return -full, full
        return ca.SX(0), self["Ps"]

    @property
    def outputs(self) -> Mapping[str, ca.SX]:
        """The outputs named so far."""
        return self._outputs

    def dry_friction(self, *names: str) -> None:
        """Numbers that a linearisation sets to zero."""
        self._dry += names

    def slot(self, name: str, value: Any, **context: ca.SX) -> Any:
        """Pass a quantity through every effect in this slot; with none it comes back as it was."""
        self._passed.add(name)
        for effect, _ in sorted(self._effects, key=lambda pair: not pair[0].anew):
            if name in effect.laws:
                self._acting.add(effect.name)
                u = {key: symbol for key, (_, symbol) in self._effect_inputs.items()}
                value = _passed(effect, name, value, Scope(effect, self._p, self._x, u, self._rates, context))
        return value

    def _add_effect(self, effect: Effect, values: Mapping[str, float]) -> None:
        for number in effect.numbers:
            key = effect.key(number.name)
            self._values[key] = values[number.name]
            self._p[key] = ca.SX.sym(key)
            if number.dry:
                self._dry.append(key)
        for state in effect.states:
            key = effect.key(state.name)
            across = tuple(effect.key(name) for name in state.across)
            self.state(
                key, state.unit, state.scale, state.start, follows=state.follows, memory=state.memory, across=across
            )
        for given in effect.inputs:
            key = effect.key(given.name)
            self._effect_inputs[key] = (Variable(key, given.unit, given.scale), ca.SX.sym(key))
        if effect.shifts:
            self._shifts.setdefault(effect.shifts, []).append(effect.key(effect.numbers[0].name))
        if effect.delay:
            self._delay, self._interpolated = effect.key(effect.delay), effect.interpolated

    def _drop_idle(self) -> None:
        for effect, _ in self._effects:
            idle = effect.name not in self._acting
            for state in effect.states:
                if idle or (state.of and state.of not in self._passed):
                    del self._x[effect.key(state.name)], self._variables[effect.key(state.name)]
            if idle:
                for given in effect.inputs:
                    del self._effect_inputs[effect.key(given.name)]

    def finish(self) -> Plant:
        """The plant, with every state given a rate; a bench leaves out effects of what it does not have."""
        self._drop_idle()
        inputs = self._inputs | self._effect_inputs
        x = ca.vertcat(*self._x.values())
        u = ca.vertcat(*(symbol for _, symbol in inputs.values()))
        p = ca.vertcat(*self._p.values())
        missing = [name for name in self._x if name not in self._rates]
        if missing:
            raise InputError(f"plant {self.name}: no rate for state {missing[0]}; its law must call s.rate")
        names = ["x", "u", "p"]
        delays = [name for name in (self._delay, DELAY) if name in self._p]
        rates = ca.vertcat(*(self._rates[name] for name in self._x))
        outputs = ca.vertcat(*self._outputs.values())
        return Plant(
            name=self.name,
            states=tuple(self._variables.values()),
            inputs=tuple(variable for variable, _ in inputs.values()),
            outputs=tuple(self._outputs),
            parameters=tuple(self._p),
            p=np.array([self._values[name] for name in self._p]),
            f=ca.Function("f", [x, u, p], [ca.cse(rates)], names, ["rates"]),
            h=ca.Function("h", [x, u, p], [ca.cse(outputs)], names, ["y"]),
            dry_friction=tuple(self._dry),
            delay=delays[0] if delays and "command" in inputs else None,
            interpolated=self._interpolated,
            computing=delays[1] if len(delays) > 1 else None,
            bends=tuple(bend for effect, _ in self._effects for bend in _bends(effect)),
            asked=self.asked,
        )


def _bends(effect: Effect) -> Iterator[Mapping[str, float]]:
    typical = {number.name: number.typical for number in effect.numbers}
    for bend in effect.bends:
        yield {effect.key(name): weight / typical[name] for name, weight in bend.items()}


def _passed(effect: Effect, slot: str, value: Any, scope: Scope) -> Any:
    """What a law makes of a slot's value; a law is anybody's code, so its mistakes are told with its name."""
    where = f"{effect.title}: its law in slot {slot}"
    try:
        after = effect.laws[slot](value, scope)
        form = [ca.SX(part).shape for part in _parts(after)]
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"{where} fails: {type(error).__name__}: {' '.join(str(error).split())}") from error
    if form != [(1, 1)] * len(_parts(value)):
        raise InputError(f"{where} must return what it is given: {SLOTS[slot].passes}")
    return after


def _parts(value: Any) -> tuple[Any, ...]:
    if value is None:
        return ()
    return value if isinstance(value, tuple) else (value,)
