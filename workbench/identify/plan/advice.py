"""What to record next to see an effect, or to tell it from others: the record and the channel that show it most.

Records of the plan's family are simulated on the rig as fitted, without what is in question. What an effect leaves
there once the rig alone, or another effect, is fitted to it, is the difference that a record shows (see
differences.py). It is counted in the noise of a channel. Channels that the rig's kind has and the campaign has not are
simulated too, one at a time.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
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
from ..fit.solver import Fit
from ..fit.windows import Windows, cut_windows, further_inputs, predicted
from ..found.fitted import rig_as_fitted
from ..trace import rule as decide
from ..trace.problem import EstimationProblem
from ..trace.refit import FittedModel
from .differences import Differences, differences
from .family import PlannedRecord, family, planned
from .played import simulated

RECORDS = (
    *("triangle-slow", "triangle-creep", "steps-small", "steps-large", "steps-position"),
    *("multisine-fast", "multisine-small"),
)
"""Of the family: what another one shows, one of these shows about as well."""
ASSUMED = 1e-3  # of the largest value: the noise of a channel that neither campaign nor rig file tells
_UNASKED = ("velocity", "load_pressure")  # which other channels give
_MORE = 2.0  # times the difference: from there on a further channel is asked for, unless what is known shows at all,
_PLAIN = 10.0  # or is told from others by so many times the noise, without it
_APART = 1 - decide.ALIKE**2  # of what an effect does: less than that others are taken for


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

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """Places of members of two sides, either way round."""
        sides = [side for side, _ in self.members]
        return [(i, j) for i, one in enumerate(sides) for j, other in enumerate(sides) if one != other]


@dataclass(frozen=True)
class Advice:
    """What answers a question about effects of these `names`: a `record` of the family with its peak [1 or mm], a
    channel to be `added`, the `channel` that shows the difference most, how many times its noise it is there (RMS), and
    what `share` it is of what an effect does.

    No record where none shows it. `assumed`: neither campaign nor rig file tells the noise of that channel. `unplayed`:
    no record can be simulated.
    """

    names: tuple[str, ...]
    record: str = ""
    peak: float = 0.0
    added: str = ""
    channel: str = ""
    times: float = 0.0
    share: float = 1.0
    assumed: bool = False
    unplayed: bool = False


def advised(problem: EstimationProblem, model_fit: FittedModel, question: Question) -> Advice:
    """The record that answers a question about a fit, less those of its effects that are in question."""
    if any(further_inputs(record) for record in problem.campaign.train):
        return Advice(question.names, unplayed=True)  # nobody knows what else a new record would be driven by
    fit, effects = _without(model_fit, {each.effect.name for _, each in question.members})
    rig = rig_as_fitted(problem.rig, "advice", fit, effects)
    channels = _channels(problem, rig)
    taken = _taken(rig, channels)
    if not taken:
        return Advice(question.names, unplayed=True)
    floor = replace(problem.floor, sigma=_noise(problem, rig, [record for _, record in taken], channels))

    def model(*more: Candidate) -> Model:
        every = (*effects, *(each.effect for each in more))
        return model_with(problem.rig, every, channels, True, problem.sessions)

    base, models = model(), [(model(each), each) for _, each in question.members]
    found = []
    for wave, record in taken:
        windows = cut_windows(base.plant, [record], floor)
        shown = _options(problem, question, windows, differences(base, fit, models, windows, question.pairs))
        found += [replace(each, record=wave.name, peak=wave.peak) for each in shown]
    return _best(question, found)


def _taken(rig: Rig, channels: tuple[str, ...]) -> list[tuple[PlannedRecord, Record]]:
    """The records that the rig takes, in these channels; none of a rig that no drive holds in its place."""
    taken = []
    try:
        ready = drive(_with_position(rig))
    except InputError:
        return []
    for name in RECORDS:
        try:
            wave = planned(ready, name, family(rig)[name])
        except InputError:  # such as a band beyond what the rig's rate plays
            continue
        record = wave and simulated(ready, wave.played, channels)
        if wave and record:
            taken.append((wave, record))
    return taken


def _best(question: Question, found: Sequence[Advice]) -> Advice:
    """The plainest of what shows a difference: a further channel only where it shows far more."""
    plain, further = (_clearest([each for each in found if bool(each.added) == added]) for added in (False, True))
    if further is None or plain is None:
        return plain or further or Advice(question.names)
    enough = question.known and (len(question.sides) == 1 or plain.times >= _PLAIN)
    more = further.times >= _MORE * plain.times and further.channel == further.added
    return further if further.share >= _MORE * plain.share or (more and not enough) else plain


def _clearest(found: Sequence[Advice]) -> Advice | None:
    """The one that stands out of the noise most, of those that differ about as much in kind as any."""
    most = max((each.share for each in found), default=0.0)
    return max((each for each in found if each.share >= most / _MORE), key=lambda each: each.times, default=None)


def _options(problem: EstimationProblem, question: Question, windows: Windows, found: Differences) -> Iterator[Advice]:
    """What shows the difference in a record: its recorded channels, and these with one more, where they do."""
    names, own = windows.names, set(problem.train.names)
    rows = np.array([windows.samples_by_signal[name] for name in names])
    for added in ("", *(name for name in names if name not in own)):
        kept = np.array([name in own or name == added for name in names])
        squares, share = _least(question, found, kept)
        squares = squares * np.array([question.through in ("", name) for name in names])
        samples = int(rows[kept].sum())
        if share >= _APART and squares.sum() > samples * (decide.gate(problem.deviation(samples)) - 1):
            times = np.sqrt(squares / rows)
            most = int(np.argmax(times))
            assumed = names[most] not in problem.floor.sigma and names[most] not in problem.rig.sensors
            yield Advice(question.names, "", 0.0, added, names[most], float(times[most]), share, assumed)


def _least(question: Question, found: Differences, kept: np.ndarray) -> tuple[np.ndarray, float]:
    """Squares [signals], and share of what an effect does, of the two sides that differ least, as their effects do on
    the whole; of one side what its effects leave to the rig alone."""
    seen = found.seen(kept)
    if len(question.sides) == 1:
        return np.median(seen, axis=0), 1.0
    sides = [side for side, _ in question.members]
    pairs: dict[tuple[int, int], list[tuple[np.ndarray, float]]] = {}
    for (first, second), squares in found.apart(kept).items():
        share = min(1.0, float(squares.sum()) / max(float(seen[first].sum()), 1e-300))
        pairs.setdefault((sides[first], sides[second]), []).append((squares, share))
    medians = [
        (np.median([squares for squares, _ in each], axis=0), float(np.median([share for _, share in each])))
        for each in pairs.values()
    ]
    return min(medians, key=lambda each: each[1])


def _without(model_fit: FittedModel, gone: Collection[str]) -> tuple[Fit, tuple[Effect, ...]]:
    """A fit less some of its effects, and those that it keeps."""
    fit, every = model_fit.fit, model_fit.effects
    names = {effect.key(number.name) for effect in every if effect.name in gone for number in effect.numbers}
    keep = [place for place, free in enumerate(fit.free) if free.name not in names]
    left = [place for place, name in enumerate(model_fit.model.parameters) if name not in names]
    free, covariance = tuple(fit.free[place] for place in keep), fit.covariance[np.ix_(keep, keep)]
    kept = tuple(effect for effect in every if effect.name not in gone)
    return replace(fit, free=free, x=fit.x[keep], p=fit.p[left], covariance=covariance), kept


def _channels(problem: EstimationProblem, rig: Rig) -> tuple[str, ...]:
    """What the campaign compares, and what else such a rig can record."""
    unasked = {*_UNASKED, *(("force",) if rig.cell_is_idle else ())} - set(problem.train.names)
    return tuple(name for name in predicted(build(rig)) if name not in unasked)


def _with_position(rig: Rig) -> Rig:
    """The rig whose drive can follow its position, though no campaign records it."""
    return rig if "position" in rig.sensors else replace(rig, sensors={**rig.sensors, "position": Sensor(0.0, 0.0)})


def _noise(
    problem: EstimationProblem, rig: Rig, records: Sequence[Record], channels: Sequence[str]
) -> Mapping[str, float]:
    """The noise of each channel: that of the campaign, of the rig file's sensor, or assumed."""
    noise = {}
    for name in channels:
        sensor = rig.sensors.get(name)
        own = float(np.hypot(sensor.noise, sensor.resolution / np.sqrt(12))) if sensor else 0.0
        most = max((float(np.abs(record.signals[name]).max()) for record in records), default=0.0)
        noise[name] = problem.floor.sigma.get(name) or own or ASSUMED * most or 1.0
    return noise
