"""A task: what the jack has to follow, what an agent observes and what its reward is; a TOML file, read strictly.

title = "..."
rig = "jack-10t"                                # a bundled rig, or a rig file beside this one
loop = "position"                               # or "force"
control_periods = 1                             # of the rig, in one step of the environment
episode = {value = 1, unit = "s"}
randomise = true                                # draw the rig's numbers within their bounds
start = {low = -50, high = 50, unit = "mm"}     # from mid stroke

[observation]
observes = "ideal"                                # every state; "sensors": the rig's sensors, with noise
error = {value = 10, unit = "mm"}               # its full scale

[references.steps]                              # or ramps, sines, multisine: see references.py
weight = 1                                      # how often, next to the others
size = {low = -20, high = 20, unit = "mm"}
hold = {low = 0.1, high = 0.5, unit = "s"}

[reward]                                        # what one step costs, see Reward
tracking = {weight = 0.01, per = 1, unit = "mm"}
effort = {weight = 0.001, per = 1, unit = "1"}
change = {weight = 0.001, per = 100, unit = "1/s"}
trip = {weight = 20}

[specimen]                                      # what the jack pushes; needed by a force loop
stiffness = {low = 1e7, high = 1e8, unit = "N/m"}   # spread over decades
damping = {low = 0, high = 1e4, unit = "N s/m"}

[specimen.end]                                  # a far end that moves; without it, it is fixed
travel = {low = -1, high = 1, unit = "mm"}      # x_end = travel/2 (1 - cos 2 pi f t)
frequency = {low = 0.5, high = 2, unit = "Hz"}
"""

import math
from dataclasses import Field, dataclass, fields
from importlib.resources import files
from pathlib import Path
from typing import Any, get_args

from workbench.base.errors import InputError, nearest
from workbench.base.signals import SIGNALS
from workbench.base.table import ConfigTable
from workbench.base.toml import read_toml
from workbench.base.units import Spec
from workbench.rigs.rig import Rig
from workbench.rigs.rig_file import load_rig

from .references import FAMILIES, Family, Multisine, Range, Sines

LOOPS = ("position", "force")
OBSERVATIONS = ("ideal", "sensors")
KEYS = (
    "title", "rig", "loop", "control_periods", "episode", "randomise", "start",
    "observation", "references", "reward", "specimen",
)  # fmt: skip


@dataclass(frozen=True)
class Reward:
    """A step is paid -(tracking |error| + effort command^2 + change (rate of command)^2), less `trip` if it trips.

    Each weight is per the square, or for tracking per the magnitude, of the SI unit: m or N, 1, 1/s.
    """

    tracking: float
    effort: float
    change: float
    trip: float


@dataclass(frozen=True)
class SpecimenMotion:
    """The course of the specimen's far end: travel/2 (1 - cos 2 pi f t), travel [m], frequency [Hz]."""

    travel: Range
    frequency: Range


@dataclass(frozen=True)
class SpecimenDraw:
    """Stiffness [N/m] and damping [N s/m] between the jack and a far end, which is fixed if `end` is None."""

    stiffness: Range
    damping: Range
    end: SpecimenMotion | None


@dataclass(frozen=True)
class Task:
    """A task, all SI. `references` are pairs of weight and family."""

    name: str
    title: str
    rig: Rig
    loop: str
    control_periods: int
    episode: float
    randomise: bool
    start: Range
    observes: str
    error_scale: float
    references: tuple[tuple[float, Family], ...]
    reward: Reward
    specimen: SpecimenDraw | None

    @property
    def steps(self) -> int:
        """Steps of the environment in a whole episode."""
        return round(self.episode / (self.rig.period.value * self.control_periods))


def bundled() -> list[str]:
    """Names of the tasks that come with jackbench."""
    return sorted(entry.name[:-5] for entry in (files("envs") / "tasks").iterdir() if entry.name.endswith(".toml"))


def load_task(name: str | Path, loop: str) -> Task:
    """A bundled task by name, or a task file by path. Raises InputError with file and key, also for another loop's."""
    path, shown = Path(name), str(name)
    if shown in bundled():
        path = Path(str(files("envs") / "tasks" / f"{name}.toml"))
    elif path.suffix != ".toml":
        raise InputError(f'no bundled task "{name}"; {nearest(shown, bundled())} A task file ends in .toml')
    top = read_toml(path, shown).allow(*KEYS)
    task = _read(top, path)
    if task.loop != loop:
        raise top.complaint("loop", f'"{task.loop}", but this environment closes the {loop} loop; make the other one')
    return task


def _read(top: ConfigTable, path: Path) -> Task:
    loop = top.word("loop", LOOPS)
    unit = SIGNALS[loop].si
    observation = top.table("observation", "observes", "error")
    task = Task(
        name=path.stem,
        title=top.text("title"),
        rig=load_rig(top.text("rig"), path.parent),
        loop=loop,
        control_periods=top.count("control_periods"),
        episode=_positive(top, "episode", "s"),
        randomise=top.flag("randomise"),
        start=Range(*top.range("start", "m")),
        observes=observation.word("observes", OBSERVATIONS),
        error_scale=_positive(observation, "error", unit),
        references=_references(top.table("references", *FAMILIES), unit),
        reward=_reward(top.table("reward", "tracking", "effort", "change", "trip"), unit),
        specimen=_specimen(top.table("specimen", "stiffness", "damping", "end")) if "specimen" in top else None,
    )
    _check(task, top)
    return task


def _references(table: ConfigTable, unit: str) -> tuple[tuple[float, Family], ...]:
    families = []
    for name in table:
        kind = FAMILIES[name]
        part = table.table(name, "weight", *(entry.name for entry in fields(kind)))
        values: dict[str, Any] = {entry.name: _drawn(part, entry, unit) for entry in fields(kind)}
        families.append((part.weight("weight"), kind(**values)))
    if not sum(weight for weight, _ in families) > 0:
        raise table.complaint("weight", "no family has one above 0, so no reference can be drawn; give one")
    return tuple(families)


def _drawn(part: ConfigTable, entry: "Field[Any]", signal: str) -> int | Range:
    if entry.type is int:
        return part.count(entry.name)
    (unit,) = get_args(entry.type)[1:]
    least_above = -math.inf if unit == "signal" else 0.0
    return Range(*part.range(entry.name, unit.replace("signal", signal), above=least_above))


def _positive(table: ConfigTable, key: str, si: str) -> float:
    """A quantity above 0, in SI."""
    value = table.quantity(key, Spec(si, 0.0, math.inf, ""))
    if value == 0:
        raise table.complaint(key, "must be positive")
    return value


def _reward(table: ConfigTable, unit: str) -> Reward:
    def weight(key: str, si: str, power: int) -> float:
        part = table.table(key, "weight", "per", "unit")
        part.positive("per")
        return part.weight("weight") / part.measure("per", si) ** power

    return Reward(
        tracking=weight("tracking", unit, 1),
        effort=weight("effort", "1", 2),
        change=weight("change", "1/s", 2),
        trip=table.table("trip", "weight").weight("weight"),
    )


def _specimen(table: ConfigTable) -> SpecimenDraw:
    end = table.table("end", "travel", "frequency") if "end" in table else None
    return SpecimenDraw(
        stiffness=Range(*table.range("stiffness", "N/m", above=0.0)),
        damping=Range(*table.range("damping", "N s/m", least=0.0)),
        end=None if end is None else _motion(end),
    )


def _motion(end: ConfigTable) -> SpecimenMotion:
    return SpecimenMotion(Range(*end.range("travel", "m")), Range(*end.range("frequency", "Hz", above=0.0)))


def _check(task: Task, top: ConfigTable) -> None:
    """What no single key can tell."""
    rig = task.rig
    if task.steps < 1:
        raise top.complaint("episode", f"shorter than one step of {task.control_periods * rig.period.value:g} s")
    for name in ("position", task.loop):
        if name not in rig.sensors:
            raise top.complaint("rig", f"{rig.name} has no {name} sensor, which the guard and the loop need")
    for _, family in task.references:
        if isinstance(family, Sines | Multisine) and family.frequency.high > rig.nyquist:
            fastest = f"{family.frequency.high:g} Hz is above half the control rate, {rig.nyquist:g} Hz"
            raise top.complaint("references", f"{fastest}; lower frequency")
    if task.loop == "force" and task.specimen is None:
        raise top.complaint("specimen", "a force loop needs something to push; add a table [specimen]")
    reach = max(family.size.largest for _, family in task.references)
    limit, unit = (rig.limit("stroke"), "m") if task.loop == "position" else (rig.limit("force"), "N")
    if reach + (task.start.largest if task.loop == "position" else 0.0) >= limit:
        raise top.complaint(
            "references", f"they reach past the rig's limit of {limit:g} {unit}; make size or start smaller"
        )
    if task.start.largest >= rig.limit("stroke"):
        raise top.complaint("start", f"beyond the rig's stroke of {rig.limit('stroke'):g} m")
