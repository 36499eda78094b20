"""What to record next to see an effect, or to tell it from others: the record and the channel that show it most.

Records of the plan's family are simulated on the rig as fitted, without what is in question. What an effect changes in
their windows, less what initial states, the rig's numbers in their ranges, and the effects that it is to be told from
could do as well, is the difference that a record shows. It is counted in the noise of a channel; channels that the
rig's kind has and the campaign has not are simulated too, one at a time.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...base.errors import InputError
from ...loop.drive_simulation import drive
from ...plant import build
from ...plant.effects import Effect
from ...records import Record
from ...rigs.rig import Rig
from ...rigs.sensor import Sensor
from ..fit.free_parameters import Candidate, model_with
from ..fit.model import Model
from ..fit.normal_equations import STATE_PULL, held, slopes_of, stable
from ..fit.solver import Fit
from ..fit.windows import Windows, cut_windows, further_inputs, predicted
from ..found.fitted import rig_as_fitted
from ..trace import rule as decide
from ..trace.problem import EstimationProblem
from ..trace.refit import FittedModel
from ..trace.score import effect_change
from .family import family, planned
from .played import simulated

RECORDS = (
    *("triangle-slow", "triangle-creep", "steps-small", "steps-large", "steps-position", "sine-1hz"),
    *("multisine-slow", "multisine-fast", "multisine-small"),
)
"""Of the family: what another one shows, one of these shows about as well."""
_ASSUMED = 2e-4  # of the largest value: the noise of a channel that neither campaign nor rig file tells
_UNASKED = ("velocity", "load_pressure")  # which other channels give
_MORE = 2.0  # times the difference: from there on a further channel is asked for, unless what is known shows at
_PLAIN = 10.0  # times the noise without it
_FREE = 1e-9  # of its own square: what holds the size of an effect


@dataclass(frozen=True, eq=False)
class Question:
    """What a record is to show: effects on one side, or those of two sides or more that it is to tell apart.

    `names` are those of the sides. `known`: one of these is what is missing, which else is only like them. `through`:
    the one channel that counts, where what a side may be else could do as well as the other in all others.
    """

    names: tuple[str, ...]
    sides: tuple[tuple[Candidate, ...], ...]
    known: bool = True
    through: str = ""

    @property
    def members(self) -> list[tuple[int, Candidate]]:
        """Every effect with the place of its side."""
        return [(place, each) for place, side in enumerate(self.sides) for each in side]


@dataclass(frozen=True)
class Advice:
    """What answers a question about effects of these `names`: a `record` of the family with its peak [1 or mm], a
    channel to be `added`, the `channel` that shows the difference most, and how many times its noise it is there (RMS).

    No record where none shows it. `assumed`: neither campaign nor rig file tells the noise of that channel. `unplayed`:
    no record can be simulated.
    """

    names: tuple[str, ...]
    record: str = ""
    peak: float = 0.0
    added: str = ""
    channel: str = ""
    times: float = 0.0
    assumed: bool = False
    unplayed: bool = False


def advised(problem: EstimationProblem, model_fit: FittedModel, question: Question) -> Advice:
    """The record that answers a question about a fit, less those of its effects that are in question."""
    if any(further_inputs(record) for record in problem.campaign.train):
        return Advice(question.names, unplayed=True)  # nobody knows what else a new record would be driven by
    bare = _without(model_fit, {each.effect.name for _, each in question.members})
    rig = rig_as_fitted(problem.rig, "advice", bare.fit, bare.effects)
    try:
        ready, channels = drive(_with_position(rig)), _channels(problem, rig)
    except InputError:  # it rests nowhere
        return Advice(question.names, unplayed=True)
    waves = {name: wave for name in RECORDS if (wave := planned(ready, name, family(ready.rig)[name])) is not None}
    records = {name: simulated(ready, wave.played, channels) for name, wave in waves.items()}
    sigma = _noise(problem, rig, [record for record in records.values() if record is not None], channels)
    differ = _Differences(problem, bare, question, channels, sigma)
    found = [
        replace(each, record=name, peak=waves[name].peak)
        for name, record in records.items()
        if record is not None
        for each in differ.options(record)
    ]
    return _best(question, found)


def _best(question: Question, found: Sequence[Advice]) -> Advice:
    """The plainest of what shows a difference: a further channel only where it shows far more."""
    plain, further = (
        max((each for each in found if bool(each.added) == added), key=lambda each: each.times, default=None)
        for added in (False, True)
    )
    nothing = Advice(question.names)
    if further is None or plain is None:
        return plain or further or nothing
    enough = question.known and plain.times >= _PLAIN
    return further if further.times >= _MORE * plain.times and not enough else plain


class _Differences:
    """How far effects differ in a record, as its windows are compared."""

    def __init__(
        self,
        problem: EstimationProblem,
        bare: "_Bare",
        question: Question,
        channels: Sequence[str],
        sigma: Mapping[str, float],
    ) -> None:
        self._problem, self._question, self._fit = problem, question, bare.fit
        self._floor = replace(problem.floor, sigma=dict(sigma))

        def model(*more: Candidate) -> Model:
            effects = (*bare.effects, *(each.effect for each in more))
            return model_with(problem.rig, effects, channels, True, problem.sessions)

        self._base, self._models = model(), [model(each) for _, each in question.members]

    def options(self, record: Record) -> list[Advice]:
        """What shows the difference in a record: its recorded channels, and with one more, where they do."""
        windows = cut_windows(self._base.plant, [record], self._floor)
        products = self._products(windows)
        names, own = windows.names, set(self._problem.train.names)
        rows = np.array([windows.samples_by_signal[name] for name in names])
        shown = []
        for added in ("", *(name for name in names if name not in own)):
            kept = np.array([name in own or name == added for name in names])
            times = self._times(products, kept, rows) * np.array(
                [self._question.through in ("", name) for name in names]
            )
            gate = decide.gate(self._problem.deviation(int(rows[kept].sum()))) - 1
            if float(times**2 @ rows) > gate * rows[kept].sum():
                most = int(np.argmax(times))
                assumed = names[most] not in self._problem.floor.sigma
                shown.append(Advice(self._question.names, "", 0.0, added, names[most], float(times[most]), assumed))
        return shown

    def _products(self, windows: Windows) -> np.ndarray:
        """Inner products [signals, w, c, c] of what n initial states, k numbers and e effects do to the errors."""
        base, p = self._base, self._fit.p
        x0 = base.starts(windows, p)  # from rest on, without noise: they need no fit
        fit = replace(self._fit, x0=x0)
        plain, slopes = base.errors(windows, x0, p), slopes_of(base, windows, x0, p, fit.free, fit.x)
        changes = [
            effect_change(model, base, windows, fit, each.effect, each.start, plain)
            for model, (_, each) in zip(self._models, self._question.members, strict=True)
        ]
        size = slopes[0].shape[-1] + len(changes)
        products = np.zeros((len(windows.names), windows.count, size, size))
        for g, (group, slope) in enumerate(zip(windows.groups, slopes, strict=True)):
            own = [np.zeros_like(plain[g]) if change is None else change[g] for change in changes]
            whole = stable(np.concatenate([slope, *(each.reshape(*slope.shape[:2], 1) for each in own)], axis=2))
            by_signal = whole.reshape(len(whole), -1, len(windows.names), size)
            products[:, group.which] = np.einsum("wrsi,wrsj->swij", by_signal, by_signal, optimize=True)
        return products

    def _times(self, products: np.ndarray, kept: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """How many times its noise the difference is in each channel [signals], where those `kept` are recorded: that
        of the side which differs least, of a typical effect of it."""
        n, k = self._base.plant.n, len(self._fit.free)
        sides = np.array([place for place, _ in self._question.members])
        free = np.array([number.name for number in self._fit.free])
        recorded = products[kept].sum(axis=0)
        states = recorded[:, :n, :n] + np.eye(n) / STATE_PULL**2
        carried = np.linalg.solve(states, recorded[:, :n, n:])
        matrix = (recorded[:, n:, n:] - np.swapaxes(recorded[:, :n, n:], 1, 2) @ carried).sum(axis=0)
        hold = np.diag(np.append(np.diag(held(self._fit.free)), _FREE * np.diag(matrix)[k:] + 1e-12))
        squares = np.zeros((len(sides), len(rows)))
        for member, (side, each) in enumerate(self._question.members):
            along = np.zeros(k + len(sides))
            along[k + member] = 1.0
            others = np.append(free != each.effect.shifts, sides != side)
            along[others] = -np.linalg.solve((matrix + hold)[np.ix_(others, others)], matrix[others, k + member])
            whole = np.hstack((-carried @ along, np.tile(along, (len(carried), 1))))
            squares[member, kept] = np.einsum("wi,swij,wj->s", whole, products[kept], whole, optimize=True)
        typical = [np.median(squares[sides == side], axis=0) for side in np.unique(sides)]
        least = min(typical, key=lambda each: float(each.sum()))
        return np.sqrt(np.maximum(least, 0.0) / np.maximum(rows, 1))


@dataclass(frozen=True, eq=False)
class _Bare:
    """A fit less some of its effects: what is left of both."""

    fit: Fit
    effects: tuple[Effect, ...]


def _without(model_fit: FittedModel, gone: Collection[str]) -> _Bare:
    fit, model = model_fit.fit, model_fit.model
    names = {
        effect.key(number.name) for effect in model_fit.effects if effect.name in gone for number in effect.numbers
    }
    keep = [place for place, free in enumerate(fit.free) if free.name not in names]
    left = [place for place, name in enumerate(model.parameters) if name not in names]
    free = tuple(fit.free[place] for place in keep)
    covariance = fit.covariance[np.ix_(keep, keep)]
    effects = tuple(effect for effect in model_fit.effects if effect.name not in gone)
    return _Bare(replace(fit, free=free, x=fit.x[keep], p=fit.p[left], covariance=covariance), effects)


def _channels(problem: EstimationProblem, rig: Rig) -> tuple[str, ...]:
    """What the campaign compares, and what else such a rig can record."""
    unasked = {*_UNASKED, *(("force",) if rig.cell_is_idle else ())} - set(problem.train.names)
    return tuple(name for name in predicted(build(rig)) if name not in unasked)


def _with_position(rig: Rig) -> Rig:
    """The rig whose drive can follow its position, though no campaign records it."""
    return rig if "position" in rig.sensors else replace(rig, sensors={**rig.sensors, "position": Sensor(0.0, 0.0)})


def _noise(
    problem: EstimationProblem, rig: Rig, records: Sequence[Record], channels: Sequence[str]
) -> dict[str, float]:
    """The noise of each channel: that of the campaign, of the rig file's sensor, or assumed."""
    noise = {}
    for name in channels:
        sensor = rig.sensors.get(name)
        own = float(np.hypot(sensor.noise, sensor.resolution / np.sqrt(12))) if sensor else 0.0
        most = max(float(np.abs(record.signals[name]).max()) for record in records)
        noise[name] = problem.floor.sigma.get(name) or own or _ASSUMED * most
    return noise
