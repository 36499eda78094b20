"""What an observation holds: channels over their full scales, in float32, never outside +-2."""

from dataclasses import dataclass

import numpy as np

from workbench.base.errors import InputError
from workbench.base.signals import SIGNALS
from workbench.base.units import from_si
from workbench.plant import Plant
from workbench.rigs.rig import Rig

from .task import Task

BOUND = 2.0  # of full scale: what is beyond is cut


@dataclass(frozen=True)
class ObservedChannel:
    """One number of an observation: (value - zero) / full_scale, both in the SI unit."""

    name: str
    unit: str
    full_scale: float
    zero: float = 0.0

    @property
    def shown(self) -> str:
        """The full scale in the unit that people are shown, e.g. "210 bar"."""
        signal = SIGNALS.get(self.name)
        unit = signal.unit if signal and signal.si == self.unit else _SHOWN.get(self.unit, self.unit)
        return f"{float(from_si(self.full_scale, unit, self.unit)):.6g} {unit}".removesuffix(" 1")


_SHOWN = {"Pa": "bar", "N": "kN", "m": "mm"}


class ObservationEncoder:
    """Makes observations [N, channels] of N lanes; `reference`, `error` and `command` [N] (SI) are filled in place.

    `names` are the sensors, in the order of what they measure.
    """

    def __init__(self, task: Task, plant: Plant, names: tuple[str, ...], lanes: int) -> None:
        self._made_of = task, plant, names, lanes
        own = signal_channel(task.loop, task.rig)
        demanded = ObservedChannel("reference", own.unit, own.full_scale, own.zero)
        loop = (demanded, ObservedChannel("error", own.unit, task.error_scale), ObservedChannel("command", "1", 1.0))
        ideal = task.observes == "ideal"
        inside = tuple(ObservedChannel(state.name, state.unit, state.scale) for state in plant.states if ideal)
        shown = [name for name in names if not ideal or name == task.loop == "force"]
        self.channels = loop + inside + tuple(signal_channel(name, task.rig) for name in shown)
        self._columns = np.array([names.index(name) for name in shown], int)
        # one for each lane, as what is contiguous is scaled in one go
        self._gain = np.tile(1 / np.array([c.full_scale for c in self.channels]), (lanes, 1))
        self._shift = np.array([c.zero for c in self.channels]) * self._gain
        self._shifted = bool(self._shift.any())
        values = np.zeros((lanes, len(self.channels)))
        self._values, self._scaled = values, np.empty_like(values)
        self._high, self._low = np.full_like(values, BOUND), np.full_like(values, -BOUND)
        self.reference, self.error, self.command = values.T[:3]
        self._states, self._signals = values[:, 3 : 3 + len(inside)], values[:, 3 + len(inside) :]

    def __reduce__(self) -> tuple[object, ...]:
        return ObservationEncoder, self._made_of  # its arrays are views of each other, filled anew in every step

    def encode(self, x: np.ndarray, measured: np.ndarray) -> np.ndarray:
        """A new observation; it takes what it shows of the states [N, n] and the measured signals [N, names] (SI)."""
        scaled = self._scaled
        if self._states.size:
            np.copyto(self._states, x)
        if self._signals.size:
            np.copyto(self._signals, measured.take(self._columns, 1))
        np.multiply(self._values, self._gain, scaled)
        if self._shifted:
            np.subtract(scaled, self._shift, scaled)
        np.fmin(scaled, self._high, scaled)  # fmin and fmax turn what is not a number into a bound
        np.fmax(scaled, self._low, scaled)
        return scaled.astype(np.float32)


def signal_channel(name: str, rig: Rig) -> ObservedChannel:
    """The channel of a signal on a rig. Raises InputError for one that has no full scale."""
    numbers = rig.numbers
    scales = {
        "current": lambda: rig["imax"],
        "spool": lambda: rig["z3max"],
        "pa": lambda: rig["Ps"],
        "pb": lambda: rig["Ps"],
        "supply": lambda: rig["Ps"],
        "position": lambda: rig["S"] / 2,
        "velocity": lambda: rig.limit("speed"),
        "acceleration": lambda: rig.limit("force") / rig["M"],
        "force": lambda: rig.limit("force"),
    }
    if name not in scales:
        raise InputError(
            f"rig {rig.name}: sensor {name} has no full scale for an observation; known: {', '.join(scales)}"
        )
    return ObservedChannel(name, SIGNALS[name].si, scales[name](), numbers["xmid"].value if name == "position" else 0.0)
