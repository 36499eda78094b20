"""A rig: every number of plant, limits and sensors once, with its value, unit, source and bounds; SI throughout."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from ..base.columns import lookup
from ..base.errors import InputError, nearest
from ..base.signals import SIGNALS, Signal
from ..base.units import Spec
from . import schema
from .inner_loop import InnerLoop
from .jack import JACKS, JackKind
from .limited import SignalLimit
from .line_valve import LineValve
from .load import LOADS, ROD_CELL, SPECIMEN
from .number import Number
from .rig_table import rig_table
from .sensor import Sensor
from .shut_off import ShutOff
from .summary import html_table, summary
from .together import problem_together
from .valve import VALVES, ValveKind

MOVING, MOVING_SHARE = 0.1, 0.2  # m/s; of the limit
COMPUTING_DELAY = Number("computing_delay", 3e-4, "ms", "s", "taken where a rig declares none")


@dataclass(frozen=True)
class EffectUse:
    """An effect that this rig declares: its name, which formula, and its numbers."""

    name: str
    formula: str
    numbers: Mapping[str, Number]


@dataclass(frozen=True)
class Rig(Mapping[str, float]):
    """All that is known of a rig; as a mapping, the SI values of the plant's numbers by name.

    `numbers` are those of the plant; `limits`, `period` and `computing_delay`, from a sample to its command, those of
    its controller, with the `deadline` of what computes; where somebody else's controller closes an `inner` loop, the
    rig's command is that one's reference; `line_valve` is in the lines to the jack, where there is one; `stop` what its
    guard does after a trip, `shut_off` the valve that it closes then, where there is one.

    `further_limits`: those of a live rig that was joined, on signals that `limits` say nothing of.

    `sessions` are numbers of the plant that were others in the records of a campaign's session, by its name.
    `effect_files` are Python files with effects that the library lacks, by absolute path; see plant/effects.
    """

    name: str
    title: str
    source: str
    valve: str
    corrector: str
    jack: str
    numbers: Mapping[str, Number]
    limits: Mapping[str, Number]
    period: Number
    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    effects: tuple[EffectUse, ...] = ()
    sessions: Mapping[str, Mapping[str, Number]] = field(default_factory=dict)
    recordings: str = ""
    effect_files: tuple[str, ...] = ()
    computing_delay: Number = COMPUTING_DELAY
    stop: str = schema.STOPS[0]
    deadline: Number | None = None
    load: str = SPECIMEN
    inner: InnerLoop | None = None
    line_valve: LineValve | None = None
    shut_off: ShutOff | None = None
    further_limits: tuple[SignalLimit, ...] = ()

    def __getitem__(self, name: str) -> float:
        """SI value of a plant number. Raises KeyError that names the nearest there is."""
        return lookup(self.numbers, name, f"number of rig {self.name}").value

    def __iter__(self) -> Iterator[str]:
        """Names of the plant's numbers."""
        return iter(self.numbers)

    def __len__(self) -> int:
        """How many numbers the plant has."""
        return len(self.numbers)

    def __repr__(self) -> str:
        """Three lines: title, kinds of valve and jack, and the numbers that tell its size."""
        return summary(self)

    def _repr_html_(self) -> str:
        """In a notebook: every number with unit, bounds, meaning and source."""
        return html_table(self)

    def signal(self, name: str) -> Signal:
        """A signal of its own by name, with its units."""
        return SIGNALS[name]

    @property
    def specs(self) -> Mapping[str, Spec]:
        """Unit, possible range and meaning of every number that the plant may have."""
        own = number_specs(self.valve, self.corrector, self.jack, self.load)
        return {**own, **schema.FURTHER_SPECS, **self._optional_specs}

    @property
    def _optional_specs(self) -> Mapping[str, Spec]:
        """Those of the tables that a rig may have: an inner loop and a line valve."""
        return {name: spec for part in (self.inner, self.line_valve) if part for name, spec in part.specs.items()}

    @property
    def valve_kind(self) -> ValveKind:
        """What is known of this kind of valve; its equations are in plant/valve."""
        return VALVES[self.valve]

    @property
    def jack_kind(self) -> JackKind:
        """What is known of this kind of jack."""
        return JACKS[self.jack]

    @property
    def areas(self) -> tuple[float, float]:
        """Piston areas [m^2] of side A and side B."""
        a, b = self.jack_kind.areas
        return self[a], self[b]

    @property
    def dead_volumes(self) -> tuple[float, float]:
        """Dead volumes [m^3] of side A and side B."""
        a, b = self.jack_kind.dead_volumes
        return self[a], self[b]

    @property
    def kind(self) -> str:
        """What rigs of a set share: the names of their numbers, effects with their formulas, where a line valve is."""
        side = f" {self.line_valve.side}" if self.line_valve else ""
        return f"{sorted(self.numbers)} {[(use.name, use.formula) for use in self.effects]}{side}"

    @property
    def control(self) -> tuple[Number, ...]:
        """What is declared of its controller: period, computing delay, and the deadline where there is one."""
        return (self.period, self.computing_delay, *((self.deadline,) if self.deadline else ()))

    @property
    def middle(self) -> float:
        """Position [m] of the middle of the stroke."""
        return self["xmid"]

    @property
    def specimen_stiffness(self) -> float:
        """Stiffness [N/m] of the specimen, 0 without one."""
        return self["ks"]

    @property
    def cell_is_idle(self) -> bool:
        """Whether a load cell feels nothing that the rig file declares, whatever the numbers are in their bounds."""
        loading = [self.numbers[name] for name in ("ks", "cs", *LOADS[self.load])]
        return self.load != ROD_CELL and not any(number.value or number.high for number in loading)

    @property
    def nyquist(self) -> float:
        """Half of the control rate [Hz]: no loop plays or answers a faster sine."""
        return 0.5 / self.period.value

    @property
    def is_jack(self) -> bool:
        """Whether it has chambers and a stroke over which loops differ."""
        return True

    @property
    def passing_speed(self) -> float:
        """Speed [m/s] of the operating point that is not at rest: 0.1 m/s, or less where that is above its limit."""
        limit = self.limit("speed")
        return MOVING if limit >= MOVING else MOVING_SHARE * limit

    @property
    def is_throttled(self) -> bool:
        """Whether lands meter the flow to a jack, so that closing them brakes it."""
        return self.valve_kind.has_lands

    @property
    def is_metered(self) -> bool:
        """Whether these lands see the chambers' pressures, so that they say how fast the jack is: no line valve parts
        them."""
        return self.is_throttled and self.line_valve is None

    @property
    def takes_load(self) -> bool:
        """Whether a force can push at it."""
        return True

    def table(self) -> dict[str, Any]:
        """The tables of a rig file."""
        return rig_table(self)

    def limit(self, name: str) -> float:
        """SI value of a limit: stroke [m], speed [m/s], force [N] or command_rate [1/s]; not of an optional one."""
        return self.limits[name].value

    def in_session(self, name: str | None) -> "Rig":
        """The rig as it was in a session; as it is where it has no numbers for that."""
        return replace(self._changed({**self.numbers, **self.sessions.get(name or "", {})}), sessions={})

    def with_corrector(self, corrector: str) -> "Rig":
        """A copy whose valve is driven by another of its kind's correctors. Raises InputError for one that the rig has
        not all numbers of, or that its kind lacks."""
        kind = self.valve_kind
        if corrector not in kind.correctors:
            raise InputError(f'rig {self.name}: no corrector "{corrector}"; {nearest(corrector, kind.correctors)}')
        specs = number_specs(self.valve, corrector, self.jack, self.load)
        if missing := [name for name in specs if name not in self.numbers]:
            raise InputError(f"rig {self.name}: corrector {corrector} needs {missing[0]}, which the rig file lacks")
        names = (*specs, *schema.FURTHER_SPECS, *self._optional_specs)
        numbers = {name: self.numbers[name] for name in names if name in self.numbers}
        return replace(self, corrector=corrector, numbers=numbers)

    def with_values(self, **values: float) -> "Rig":
        """A copy with other SI values; a value beyond its fit bounds or interval takes them along in proportion.

        Raises InputError for an unknown name or an impossible value.
        """
        numbers = dict(self.numbers)
        specs = self.specs
        for name, value in values.items():
            if name not in numbers:
                raise InputError(f'rig {self.name}: no number "{name}"; {nearest(name, numbers)}')
            if problem := specs[name].problem(value):
                raise InputError(f"rig {self.name}: {name}: {problem}")
            numbers[name] = _moved(numbers[name], float(value))
        return self._changed(numbers)

    def with_each_number(self, change: Callable[[Number], Number]) -> "Rig":
        """A copy with every number of the plant changed, those of its effects too."""

        def changed(numbers: Mapping[str, Number]) -> dict[str, Number]:
            return {name: change(number) for name, number in numbers.items()}

        uses = tuple(replace(use, numbers=changed(use.numbers)) for use in self.effects)
        return replace(self._changed(changed(self.numbers)), effects=uses)

    def _changed(self, numbers: Mapping[str, Number]) -> "Rig":
        """With other numbers of the plant. Raises InputError for those that a rig file may not have together."""
        if self.is_jack and (wrong := problem_together(numbers, self.limits)):
            _, name, problem = wrong
            raise InputError(f"rig {self.name}: {name}: {problem}")
        return replace(self, numbers=numbers)


def _moved(number: Number, value: float) -> Number:
    """The number with another value; a range that it leaves goes with it, in proportion."""
    shift = value / number.value if number.value else 1.0

    def moved(low: float, high: float) -> tuple[float, float]:
        if low <= value <= high:
            return low, high
        low, high = sorted((low * shift, high * shift))
        return min(low, value), max(high, value)

    ends = None if number.low is None or number.high is None else moved(number.low, number.high)
    interval = None if number.interval is None else moved(*number.interval)
    low, high = ends or (number.low, number.high)
    return replace(number, value=value, low=low, high=high, interval=interval)


def number_specs(valve: str, corrector: str, jack: str, load: str = SPECIMEN) -> dict[str, Spec]:
    """Every plant number that a rig of these kinds must have, by name."""
    tables = (schema.SUPPLY, schema.OIL, VALVES[valve].schema(corrector), JACKS[jack].numbers, schema.LOAD, LOADS[load])
    return {name: spec for table in tables for name, spec in table.items()}
