"""A linear plant of the user's own in the place of a rig: its model, limits, sensors and control period."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..base.errors import InputError
from ..base.signals import SIGNALS, Signal
from ..base.units import Spec, to_si
from ..records.rational_fit import RationalFit
from .jack import JackKind
from .linear_form import ANY, LinearForm
from .linear_signals import measured_as, output_signals
from .number import Number, number_entry
from .rig import MOVING, Rig
from .sensor import sensor_entry
from .valve import ValveKind

GAIN = Spec("1", -ANY, ANY, "factor on the whole model")
LOAD = Spec("1/N", -ANY, ANY, "command to which a force on the plant amounts")
DELAY = Spec("s", 0.0, 0.1, "delay of the command")
_SWEPT = np.geomspace(1e-3, 1e5, 400)  # rad/s: where the sizes of states are looked for


@dataclass(frozen=True, repr=False, kw_only=True)
class LinearRig(Rig):
    """A linear plant: `numbers` are those of its `form`, a `gain` on all of it, the `delay` [s] of its command, and a
    `load` [1/N] where a force acts on its command.

    `full_command` is the model's input at command 1, `units` those of its outputs, `computing` [s] adds to the delay.
    `fit`: the model beside the frequency response that it was fitted to, where it was.
    """

    form: LinearForm
    full_command: float
    units: tuple[str, ...]
    computing: float = 0.0
    fit: RationalFit | None = field(default=None, compare=False)

    def signal(self, name: str) -> Signal:
        """Position, velocity and acceleration are in the units of the plant's output."""
        return self._signals.get(name, SIGNALS[name])

    @cached_property
    def _signals(self) -> Mapping[str, Signal]:
        units = dict(zip(self.form.outputs, self.units, strict=True))
        return output_signals(units, measured_as(units.get("position", "m")))

    @property
    def kind(self) -> str:
        """What a set of plants must share: the form, its order, signals and what they are."""
        si = self.signal("position").si
        return f"{type(self.form).__name__} {sorted(self.numbers)} {self.form.outputs} {si}"

    @property
    def specs(self) -> Mapping[str, Spec]:
        """Unit, possible range and meaning of every number."""
        return {**self.form.specs(), "gain": GAIN, "load": LOAD, "delay": DELAY}

    @property
    def delay(self) -> Number:
        """By how much its command is late, without what a controller computes."""
        return self.numbers["delay"]

    @property
    def valve_kind(self) -> ValveKind:
        """Raises InputError."""
        raise self._no("valve")

    @property
    def jack_kind(self) -> JackKind:
        """Raises InputError."""
        raise self._no("jack")

    @property
    def middle(self) -> float:
        """Position [m] in the middle of the stroke."""
        return 0.0

    @property
    def specimen_stiffness(self) -> float:
        """No specimen."""
        return 0.0

    @property
    def is_jack(self) -> bool:
        """It has neither chambers nor a stroke over which loops differ."""
        return False

    @property
    def passing_speed(self) -> float:
        """0.1 of its unit a second, whatever that is."""
        return MOVING

    @property
    def is_throttled(self) -> bool:
        """Whether lands meter the flow to a jack: nothing is known of it."""
        return False

    @property
    def takes_load(self) -> bool:
        """Whether a force acts on it."""
        return "load" in self.numbers or "E_1" in self.numbers

    @property
    def constants(self) -> dict[str, float]:
        """What besides `numbers` makes the plant, SI: it may differ between the plants of a set."""
        units = zip(self.form.outputs, self.units, strict=True)
        values = {f"unit_{name}": float(to_si(1.0, unit, self.signal(name).si)) for name, unit in units}
        return {"full_command": self.full_command, **values}

    def matrices(self, number: Mapping[str, Any]) -> tuple[Any, Any, Any, Any]:
        """A [n, n], B [n, 1], C [outputs, n] and E [n, 1] from command [1] and force [N] to SI outputs, as lists.

        `number` has the `numbers` and `constants`: floats, or the symbols of a graph.
        """
        a, b, c, e = self.form.matrices(number)
        into, load = number["gain"] * number["full_command"], number.get("load", 0.0)
        b = [[into * entry for entry in row] for row in b]
        e = [[entry + load * command[0] for entry in row] for row, command in zip(e, b, strict=True)]
        c = [[number[f"unit_{name}"] * entry for entry in row] for name, row in zip(self.form.outputs, c, strict=True)]
        return a, b, c, e

    def state_matrices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The matrices (A, B, C, E) as arrays, of this plant's own numbers, without the delay."""
        values = {name: number.value for name, number in self.numbers.items()} | self.constants
        a, b, c, e = (np.array(part, float) for part in self.matrices(values))
        return a, b, c, e

    @property
    def sizes(self) -> list[float]:
        """Sizes of the states: the largest over sines of a command of up to 1 that keep the position in the stroke."""
        a, b, c, _ = self.state_matrices()
        resolvent = 1j * _SWEPT[:, None, None] * np.eye(len(a)) - a
        states = np.linalg.solve(resolvent, np.broadcast_to(b, (len(_SWEPT), *b.shape)))[..., 0]
        travel = np.maximum(np.abs(states @ c[0]), np.finfo(float).tiny)
        sizes = (np.abs(states) * np.minimum(1.0, self.limit("stroke") / travel)[:, None]).max(axis=0)
        return np.where(sizes > 0, sizes, 1.0).tolist()

    def later(self, delay: float) -> "LinearRig":
        """This rig with its command `delay` [s] later."""
        return replace(self, computing=self.computing + delay)

    def table(self) -> dict[str, Any]:
        """The tables of a file, every number but the coefficients with its unit."""
        values = {name: number.value for name, number in self.numbers.items()}
        tables = {name: {"gain": values["gain"], **model} for name, model in self.form.tables(values).items()}
        signals: dict[str, Any] = {"command": self.full_command}
        signals |= {name: _entry(self.numbers[name]) for name in ("delay", "load") if name in values}
        signals |= zip(self.form.outputs, self.units, strict=True)
        bounds = {name: [n.low, n.high] for name, n in self.numbers.items() if n.low is not None}
        titles = {"name": self.name, "title": self.title, "source": self.source}
        return {
            **{key: text for key, text in titles.items() if text},
            **tables,
            "signals": signals,
            "limits": {name: number_entry(n) for name, n in self.limits.items()},
            "control": {n.name: number_entry(n) for n in self.control},
            "sensors": {name: sensor_entry(self.signal(name), sensor) for name, sensor in self.sensors.items()},
            **({"bounds": bounds} if bounds else {}),
        }

    def __repr__(self) -> str:
        """Two lines: the title; order, outputs, delay and control period."""
        outputs, delay = ", ".join(self.form.outputs), self.delay.value * 1e3
        size = f"{self.form.order} states, delay {delay:g} ms, measured {outputs}"
        return f"<Linear plant {self.name}: {self.title}\n {size}, period {self.period.value * 1e3:g} ms>"

    def _no(self, part: str) -> InputError:
        return InputError(f"{self.name} is a linear plant and has no {part}; this needs a rig")


def _entry(number: Number) -> dict[str, Any]:
    """Without its bounds: they stand in a table of their own."""
    return number_entry(replace(number, low=None, high=None))
