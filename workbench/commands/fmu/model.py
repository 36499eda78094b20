"""What an FMU is made of: the graphs of a plant, its variables with units and start values, and a loop inside it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np

from ...base.errors import InputError
from ...base.signals import PLATFORM, SIGNALS, output_signal
from ...control.controller_spec import ControllerSpec
from ...control.protocol import graph_law
from ...engine import Engine
from ...engine.instant import instant
from ...engine.rosenbrock import adaptive_attempt
from ...engine.sampled_law import OUT, LawShape
from ...linear import equilibrium
from ...loop.compiled_loop import CompiledLoop
from ...loop.metrics import METRICS
from ...loop.sensors import Sensors, check_sensors
from ...plant import Plant, Variable, build
from ...plant.effects import resolve
from ...rigs.oil import CAVITATES
from ...rigs.rig import Rig

_PUT_OUT = {
    "sent": "command that the guard lets through to the drive",
    "demanded": "command that the controller demands",
    "held": "command that the drive holds",
    "trip": "number of the guard's rule that tripped, 0: none",
}


_CAVITATION = "cavitation_s"


@dataclass(frozen=True)
class FmuVariable:
    """A variable with its SI unit; `start` where it is given and not computed, `nominal` of a state."""

    name: str
    unit: str
    meaning: str
    start: float | None = None
    nominal: float | None = None


@dataclass(frozen=True)
class FmuLoop:
    """A loop inside: the form of its law, its numbers, its state at the start, the intervals of a period [s], and its
    reference, an input."""

    shape: LawShape
    numbers: np.ndarray
    state: np.ndarray
    durations: np.ndarray
    reference: FmuVariable


@dataclass(frozen=True, eq=False)
class FmuModel:
    """The plant of a rig or a platform from an operating point, state x [n] and inputs u [m]; the loop inside, where
    there is one; the control `period` [s], and each of the plant's `numbers` with its unit and its meaning."""

    name: str
    title: str
    period: float
    numbers: Mapping[str, tuple[str, str]]
    plant: Plant
    x: np.ndarray
    u: np.ndarray
    loop: FmuLoop | None

    @property
    def states(self) -> list[FmuVariable]:
        """In the plant's order; one that is an output too has that name as such."""
        taken = self.plant.outputs
        return [
            FmuVariable(
                f"state.{state.name}" if state.name in taken else state.name, state.unit, "state", start, state.scale
            )
            for state, start in zip(self.plant.states, self.x.tolist(), strict=True)
        ]

    @property
    def inputs(self) -> list[FmuVariable]:
        """Those of the plant; the reference instead of the command where a loop is inside."""
        inputs = [
            FmuVariable(variable.name, variable.unit, _meaning(variable.name), start)
            for variable, start in zip(self.plant.inputs, self.u.tolist(), strict=True)
        ]
        if self.loop:
            inputs[0] = self.loop.reference
        return inputs

    @property
    def outputs(self) -> list[FmuVariable]:
        """Those of the plant, then what an instant of the loop puts out."""
        outputs = [FmuVariable(name, _unit(name), _meaning(name)) for name in self.plant.outputs]
        return outputs + ([FmuVariable(name, "1", _PUT_OUT[name]) for name in OUT] if self.loop else [])

    @property
    def parameters(self) -> list[FmuVariable]:
        """In the plant's order."""
        values = zip(self.plant.parameters, self.plant.p.tolist(), strict=True)
        return [FmuVariable(name, *self.numbers[name], value) for name, value in values]

    @property
    def delays(self) -> tuple[str | None, ...]:
        """Parameters of the command's delay, which is what it is."""
        return self.plant.delay, self.plant.computing

    @cached_property
    def graphs(self) -> list[ca.Function]:
        """What fmu.c calls: rates, outputs, their derivatives along a direction, an attempt of a step, an instant."""
        plant = self.plant
        x, u, p = (ca.SX.sym(name, plant.f.numel_in(i)) for i, name in enumerate("xup"))
        dx, du = ca.SX.sym("dx", plant.n), ca.SX.sym("du", u.numel())
        rates, outputs = plant.f(x, u, p), plant.h(x, u, p)
        along = ca.jtimes(ca.vertcat(rates, outputs), ca.vertcat(x, u), ca.vertcat(dx, du))
        graphs = [
            _graph("plant_rates", [x, u, p], [rates]),
            _graph("plant_outputs", [x, u, p], [outputs]),
            _graph("plant_along", [x, u, p, dx, du], ca.vertsplit(along, [0, plant.n, along.numel()])),
            _named("plant_attempt", adaptive_attempt(plant)),
        ]
        return graphs + ([_named("plant_instant", instant(plant, self.loop.shape))] if self.loop else [])


def _graph(name: str, arguments: Sequence[ca.SX], results: Sequence[ca.SX]) -> ca.Function:
    return ca.Function(name, arguments, [ca.densify(result) for result in ca.cse(list(results))])


def _named(name: str, graph: ca.Function) -> ca.Function:
    arguments = graph.sx_in()
    return _graph(name, arguments, [ca.SX(graph(*arguments))])


def _unit(output: str) -> str:
    if output == _CAVITATION:
        return "s"
    return output_signal(output).si if _is_known(output) else "1"


def _meaning(signal: str) -> str:
    if signal == _CAVITATION:
        return METRICS[_CAVITATION].meaning
    return output_signal(signal).meaning if _is_known(signal) else signal.replace("_", " ")


def _is_known(signal: str) -> bool:
    return signal in PLATFORM or signal.rpartition(".")[2] in SIGNALS


def numbers_of(rig: Rig) -> dict[str, tuple[str, str]]:
    """Unit and meaning of each number of a rig and of its effects."""
    known = {name: (number.si, rig.specs[name].meaning) for name, number in rig.numbers.items()}
    for effect, _ in resolve(rig):
        known |= {effect.key(number.name): (number.si, number.meaning) for number in effect.numbers}
    return known


def with_cavitation(plant: Plant, start: np.ndarray) -> tuple[Plant, np.ndarray]:
    """A plant that counts, in its last state and output, the seconds in which a chamber had gas, and its start [n + 1];
    as it is where it has no chambers."""
    if "lowest_pressure" not in plant.outputs:
        return plant, start
    x, u, p = (ca.SX.sym(name, plant.f.numel_in(i) + (name == "x")) for i, name in enumerate("xup"))
    outputs = plant.h(x[: plant.n], u, p)
    gas = ca.if_else(outputs[plant.output("lowest_pressure")] < CAVITATES, 1.0, 0.0)
    counting = replace(
        plant,
        states=(*plant.states, Variable(_CAVITATION, "s", 1.0)),
        outputs=(*plant.outputs, _CAVITATION),
        f=ca.Function("f", [x, u, p], [ca.vertcat(plant.f(x[: plant.n], u, p), gas)], ["x", "u", "p"], ["rates"]),
        h=ca.Function("h", [x, u, p], [ca.vertcat(outputs, x[plant.n])], ["x", "u", "p"], ["y"]),
    )
    return counting, np.append(start, 0.0)


def fmu_model(rig: Rig, spec: ControllerSpec | None = None) -> FmuModel:
    """A rig at rest at mid stroke, with a controller and its guard inside where there is one.

    Raises InputError for a rig or a controller that an FMU cannot hold.
    """
    plant = build(rig)
    if spec is None and plant.lateness():
        late = f"{1e3 * plant.lateness():g} ms"
        raise InputError(f"rig {rig.name}: its drive holds the command back by {late}; add --controller FILE:NAME")
    about = equilibrium(plant)
    plant, x = with_cavitation(plant, about.x)
    loop = None if spec is None else _loop(rig, plant, spec, x, about.u)
    return FmuModel(rig.name, rig.title, rig.period.value, numbers_of(rig), plant, x, about.u, loop)


def _loop(rig: Rig, plant: Plant, spec: ControllerSpec, x: np.ndarray, u: np.ndarray) -> FmuLoop:
    """A controller on sensors without noise, started at an operating point without a bump."""
    controller = spec.build(rig.period.value)
    check_sensors(rig, controller.measures)
    engine, sensors = Engine(plant, back_end="interpreted"), Sensors(rig, plant.outputs, None)
    measured = sensors.read(engine.observe(x, u))
    reference = measured[controller.measures[0]]
    controller.reset(reference, measured, float(u[0]))
    law = graph_law(controller)
    if law is None:
        raise InputError(f"{spec.name}: is Python code; an FMU holds only laws that give their graph")
    if law.graphs.calls:
        raise InputError(f"{spec.name}: solves a programme in every sample; an FMU holds only laws that do not")
    loop = CompiledLoop(engine, rig, law, sensors, u, law.picked(reference, measured))
    controlled = rig.signal(controller.measures[0])
    own = FmuVariable("reference", controlled.si, f"of the {controlled.name}", reference)
    return FmuLoop(loop.law.shape, loop.numbers[0], loop.state[0], loop.law.durations, own)
