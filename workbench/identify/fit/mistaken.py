"""Columns that are mistaken for others: a sign, two pressures that changed places, a unit, a logger that is late.

A few windows in which the command moves most are predicted by the rig as declared. A signal that moves against its
prediction may be the wrong way round, one that moves with it but many times as far may have another unit, one that
moves as predicted some time later may be of another logger; two pressures that move against their predictions may have
changed places; where every signal does, it may be the command: turned, it has to make those that it drives follow
better than before, which a pump that stands still then does not, however much nearer to a jack at rest that is.

Half a swing late looks like a wrong sign. So each of these is undone and the rig's numbers are fitted to the windows:
what cures them is named with what to write, and nothing less is. A row or two late shows about the fitted rig alone. A
force that nothing on the rig makes is one that it cannot have.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...plant import build
from ...records import Campaign
from ...rigs.rig import Rig
from ..data.noise_floor import NoiseFloor
from .impossible import check_ranges
from .initial_states import predicted_states
from .late import Lags, apart, lags_of
from .mistakes import Mistake, doubtful, scaled, shifted, swapped, turned
from .model import Model
from .rehearsal import Rehearsal, Tried
from .unfelt import unfelt_force
from .windows import Windows, cut_windows

_WINDOWS, _FITTED = 6, 3  # that are looked at, and fitted
_MOVES = 1.0  # chi2 about the mean: what moves less tells no sign
_WRONG = -0.3  # correlation of what is measured with what is predicted: below it a column is the wrong way round
_DRIVEN = ("current", "spool", "velocity", "position")  # go with the command, whatever the load does
_FOLLOWS = 0.9  # correlation of what follows the command: below it the command may be the wrong way round
_ALIKE, _TIMES = 0.7, 4.0  # correlation and gain of a column that is in another unit
_FACTORS = (*(10.0**power for power in range(-6, 7) if power), 14.5038, 1 / 14.5038, 25.4, 1 / 25.4)
_NEAR = 3.0  # times
_FALLS = 2.0  # times: the fall of chi2 that undoing it has to bring
_BY_FACTOR = 10.0  # the same of a factor, which leaves what else is missing: a rig that moves less has no wrong unit
_UNSURE = 0.15  # of a correlation: two swings of a signal that are as much alike may both be the one
_SAME, _SHARE = 1.5, 0.01  # chi2, or share of the misfit without it, that a shift may leave where it cures
_REFINED, _STILL = 4, 0.005  # times that a shift is found anew about a fit, or until by less than so many rows
_PRESSURES = {"pa", "pb", "load_pressure"}  # late behind a line they are not mistaken: that is an effect
_MISFIT, _SURE = 0.05, 4.0  # chi2 above 1, or so many of its deviations, that is a misfit
_APART = 0.3  # rows between the lags of two loggers about a fit, at least


def mistaken(campaign: Campaign, rig: Rig, floor: NoiseFloor) -> Mistake | None:
    """The sign, exchange, factor or shift without which the fitted rig follows its records, or a force that it cannot
    have; None without one. Where signals move against their predictions and nothing cures that: what it may be.

    Raises InputError for a clock, a command, a pressure or a position that is in no range of the rig's.
    """
    check_ranges(campaign, rig)
    if unfelt := unfelt_force(campaign, rig, floor):
        words, remedy = unfelt
        return Mistake("foreign", ("force",), words, lambda record: record, remedy)
    records = [
        record for record in (*campaign.train, *campaign.heldout) if np.ptp(record.signals.get("command", [0.0])) > 0
    ]
    if not records:
        return None
    plant = build(rig)
    windows = _liveliest(cut_windows(plant, records, floor), _WINDOWS)
    model = Model(plant, windows.names, brief=True)
    correlations, gains = _likeness(model, windows)
    suspects = [
        each
        for each in _suspects(correlations, gains)
        if each.signals != ("command",) or _driven(_likeness(model, _without(windows, each))[0]) > _driven(correlations)
    ]
    moving = tuple(name for name in windows.names if name in correlations)
    lags = lags_of(model, windows, model.starts(windows, plant.p), plant.p)
    late = _late(moving, lags, bool(suspects))
    rehearsal, few = Rehearsal(model, rig), _liveliest(windows, _FITTED)
    trials = _Trials(rehearsal, few, moving, floor, rehearsal.fit(few))
    tried, cures = trials.of((*suspects, *late))
    if not suspects and not cures:
        _, cures = trials.of(trials.by_rows(), trials.plain)
    if cures:
        best, mistake = _likeliest(cures)
        return replace(mistake, chi2=(trials.plain.chi2, best))
    suspects = [each for each, fit in tried if each in suspects and (each.kind != "scaled" or trials.falls(each, fit))]
    declared = _chi2(model, windows) if suspects else 0.0
    if not any(_chi2(model, _without(windows, each)) < declared / _FALLS for each in suspects):
        return None
    least = min(fit.chi2 for _, fit in tried)
    if trials.all_late(float(np.median([lags.best(name, 1)[0] for name in moving]))) < least / _FALLS:
        return None
    return doubtful([each for each, _ in tried], (trials.plain.chi2, least))


def _late(moving: Sequence[str], lags: Lags, doubted: bool) -> list[Mistake]:
    """Groups of signals that move as predicted some time later than others do, and those that move against it then:
    a swing is nearly as much like the half before it, which is tried where something is wrong anyway."""
    if not moving:
        return []
    along, against = ({name: lags.best(name, sign) for name in moving} for sign in (1, -1))
    shifts = apart({name: lag for name, (lag, _) in along.items()})
    sets = [shifts, *({name: lag for name, lag in shifts.items() if lag == one} for one in set(shifts.values()))]
    found = [shifted(each) for place, each in enumerate(sets) if each and each not in sets[:place]]
    unsure = _UNSURE if doubted or shifts else 0.0
    more = {name: against[name][1] - along[name][1] for name in moving}
    loose = [name for name in moving if more[name] > -unsure]
    for group in dict.fromkeys(
        tuple(name for name in loose if of(name))
        for of in (lambda name: more[name] > 0, lambda name: name in ("pa", "pb"), lambda _: True)
    ):
        both = apart({name: (against if name in group else along)[name][0] for name in moving})
        signs = {name: -1.0 if name in group else 1.0 for name in moving}
        others = _turned_or_swapped(signs) if group and both else []
        found += [shifted(both, each) for each in others if each.signals != ("command",)]
    return found


@dataclass(frozen=True)
class _Trials:
    """Fits of a rig's numbers to a few windows without one mistake after the other, beside the `plain` one to them as
    they are; `moving` signals tell."""

    rehearsal: Rehearsal
    windows: Windows
    moving: tuple[str, ...]
    floor: NoiseFloor
    plain: Tried

    @property
    def _near(self) -> float:
        """chi2 up to which a mistake is all that was wrong with the records."""
        return max(_SAME, 1 + _SHARE * (self.plain.chi2 - 1))

    @property
    def _gate(self) -> float:
        """chi2 of the windows that says that nothing is missing."""
        return 1 + max(_MISFIT, _SURE * self.floor.deviation(self.windows.samples_by_signal))

    def of(
        self, mistakes: Sequence[Mistake], start: Tried | None = None
    ) -> tuple[list[tuple[Mistake, Tried]], list[tuple[float, Mistake]]]:
        """Each mistake that was tried, by as much as it fits best, with the fit without it; chi2 of those that cure.
        Fits go on from a fit `start`, or begin with the numbers that the rig declares."""
        tried, cures = list[tuple[Mistake, Tried]](), list[tuple[float, Mistake]]()
        for each in mistakes:
            enough = self._near if each.late else 0.0  # a sign, place or unit that cures is no shift; all are tried
            if any(chi2 < enough and (chi2 < _SAME or not own.late) for chi2, own in cures):
                break
            tried.append(self._refined(each, start))
            cures += [(fit.chi2, own) for own, fit in tried[-1:] if self._cures(own, fit)]
        return tried, cures

    def by_rows(self) -> list[Mistake]:
        """Shifts of so few rows that only the fitted rig shows them: where its lags lie apart, either part."""
        if not self._near <= self.plain.chi2 < np.inf:
            return []
        lags = lags_of(self.rehearsal.model, self.windows, self.plain.x0, self.plain.p)
        own = {name: lags.best(name, 1)[0] for name in self.moving}
        order = sorted(own, key=lambda name: own[name])
        gap, k = max(((own[order[k]] - own[order[k - 1]], k) for k in range(1, len(order))), default=(0.0, 0))
        if gap <= _APART * lags.period:
            return []
        parts = sorted(((order[k:], gap), (order[:k], -gap)), key=lambda part: len(part[0]))
        return [shifted({name: late for name in self.moving if name in part}) for part, late in parts]

    def _refined(self, mistake: Mistake, start: Tried | None = None) -> tuple[Mistake, Tried]:
        """A mistake and the fit without it; where signals are shifted, by as much as the fitted rig says."""
        fit = self.rehearsal.fit(_without(self.windows, mistake), start)
        for _ in range(_REFINED if mistake.late and fit.chi2 < np.inf else 0):
            lags = lags_of(self.rehearsal.model, _without(self.windows, mistake), fit.x0, fit.p)
            late = self._later(mistake.late, lags)
            change = max(abs(late.get(name, 0.0) - mistake.late[name]) for name in mistake.late)
            if not late or change < _STILL * lags.period:
                break
            mistake, before = shifted(late, mistake.beside), fit
            fit = self.rehearsal.fit(_without(self.windows, mistake), fit)
            if not fit.chi2 < max(before.chi2 / _FALLS, self._near):  # each time, where the shift is what is wrong
                break
        return mistake, fit

    def _later(self, late: Mapping[str, float], lags: Lags) -> dict[str, float]:
        """Signals that are late by what is left of their lags against the others', less those that are not."""
        own = {name: lags.best(name, 1)[0] for name in self.moving}
        rest = np.mean([lag for name, lag in own.items() if name not in late] or [0.0])
        groups = {one: [own[name] for name in late if late[name] == one] for one in set(late.values())}
        more = {one: one + float(np.mean(group) - rest) for one, group in groups.items()}
        return {name: more[one] for name, one in late.items() if abs(more[one]) > _APART * lags.period}

    def falls(self, mistake: Mistake, fit: Tried, plain: Tried | None = None) -> bool:
        """Whether the fit without a mistake is so much better than a plain one that this may have been one."""
        times = _BY_FACTOR if mistake.kind == "scaled" else _FALLS
        return fit.chi2 < (plain or self.plain).chi2 / times and fit.chi2 < np.inf

    def _cures(self, mistake: Mistake, fit: Tried) -> bool:
        """Whether the fitted rig follows the records without a mistake: its signals are predicted, and where they are
        shifted nothing else is left that counts, nor does a drive or a line that is slow explain as much."""
        undone = _without(self.windows, mistake)
        if not self.falls(mistake, fit):
            return False
        follows = _likeness(self.rehearsal.model, undone, fit)[0]
        asked = _DRIVEN if mistake.signals == ("command",) else mistake.signals
        if min((follows[name] for name in asked if name in follows), default=0.0) < _FOLLOWS:
            return False
        if not mistake.late:
            return True
        if not self.falls(mistake, fit, self.rehearsal.fit(self.windows, fit)):
            return False  # the plain fit was caught on its way, and these numbers do as well without a shift
        if mistake.beside or fit.chi2 >= self._near:
            return fit.chi2 < self._near
        return self._no_logger(mistake) - 1 > _FALLS * (max(fit.chi2, self._gate) - 1)

    def _no_logger(self, mistake: Mistake) -> float:
        """The least chi2 of what makes signals late without another logger."""
        every = self.all_late(max(mistake.late.values(), key=abs))
        return min(every, self.rehearsal.with_lines(self.windows)) if set(mistake.late) <= _PRESSURES else every

    def all_late(self, late: float) -> float:
        """chi2 where all signals are late, by `late` [s] at first: behind a drive or a valve that is slow, or since the
        command's logger is early, which is the same to records."""
        return self._refined(shifted(dict.fromkeys(self.moving, late)))[1].chi2


def _likeliest(undone: Sequence[tuple[float, Mistake]]) -> tuple[float, Mistake]:
    """The suspect of the least chi2; but a jack whose ends are alike is mirrored by a turned command: of that and of
    pressures that changed places beside a turned position the first counts, where the records tell them apart badly."""
    least, best = min(undone, key=lambda pair: pair[0])
    mirrored = next((pair for pair in undone if len(pair[1].signals) > 2 and pair[1].kind == "swapped"), None)
    command = next((pair for pair in undone if pair[1].signals == ("command",)), None)
    if mirrored is None or command is None or max(mirrored[0], command[0]) > _FALLS * least:
        return least, best
    return command[0], replace(command[1], words=f"{command[1].words}, or as well {mirrored[1].words}")


def _likeness(model: Model, windows: Windows, fit: Tried | None = None) -> tuple[dict[str, float], dict[str, float]]:
    """Correlations and gains of measured over predicted signals about their means in each window; those that move. As
    declared, or by a fit."""
    x0, p = (model.starts(windows, model.plant.p), model.plant.p) if fit is None else (fit.x0, fit.p)
    parts = model.predict(windows, x0, p)
    sums = np.zeros((3, len(windows.names)))
    for group, predicted in zip(windows.groups, parts, strict=True):
        y, m = (np.where(group.weight > 0, np.nan_to_num(v), 0.0) * group.weight for v in (predicted, group.measured))
        y, m = (v - v.mean(axis=1, keepdims=True) for v in (y, m))
        sums += [np.einsum("wrs,wrs->s", a, b) for a, b in ((y, m), (y, y), (m, m))]
    both, predicted, measured = sums
    moves = np.minimum(predicted, measured) > _MOVES * windows.samples
    size = np.sqrt(np.maximum(predicted * measured, 1e-300))
    names = [(i, name) for i, name in enumerate(windows.names) if moves[i]]
    correlations, gains = ({name: float(both[i] / over[i]) for i, name in names} for over in (size, predicted))
    return correlations, gains


def _driven(correlations: Mapping[str, float]) -> float:
    """The least correlation of a signal that goes with the command, of those that move; that of an opposite if none."""
    return min((correlations[name] for name in _DRIVEN if name in correlations), default=-1.0)


def _suspects(correlations: Mapping[str, float], gains: Mapping[str, float]) -> list[Mistake]:
    """What may have happened where signals move against what is predicted, many times as far, or not with it."""
    factors = [
        scaled(name, factor)
        for name, correlation in correlations.items()
        if correlation > _ALIKE and not 1 / _TIMES < gains[name] < _TIMES
        for factor in _FACTORS
        if 1 / _NEAR < gains[name] / factor < _NEAR
    ]
    return [*factors, *_turned_or_swapped(correlations)]


def _turned_or_swapped(correlations: Mapping[str, float]) -> list[Mistake]:
    wrong = [name for name, correlation in correlations.items() if correlation < _WRONG]
    driven = [correlations[name] for name in _DRIVEN if name in correlations]
    suspects = [turned("command")] if driven and (min(driven) < _FOLLOWS or max(driven) < _WRONG) else []
    both = {"pa", "pb"} <= set(wrong)
    if wrong == ["pa", "pb"]:
        return [swapped(), *suspects]
    own = [turned(*wrong)] if wrong else []
    own += [swapped(*(name for name in wrong if name not in ("pa", "pb")))] if both else []
    return [*suspects, *own] if len(driven) > 1 and max(driven) < _WRONG else [*own, *suspects]


def _liveliest(windows: Windows, count: int) -> Windows:
    """The windows in which the command moves most."""
    moves = [np.ptp(windows.records[i].signals["command"][first:end]) for i, first, end in windows.spans]
    return windows.some(np.sort(np.argsort(moves)[-count:]).tolist())


def _without(windows: Windows, mistake: Mistake) -> Windows:
    """The windows with a mistake undone in every record that has its signals."""
    return replace(windows, records=tuple(map(mistake.undone, windows.records))).some(range(windows.count))


def _chi2(model: Model, windows: Windows) -> float:
    squares = predicted_states(model, windows, model.plant.p)[1]
    return float(squares.sum()) / windows.samples
