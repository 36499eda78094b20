"""Columns that are mistaken for others: a sign, two pressures that changed places, a unit, a logger that is late.

A few windows in which the command moves most are predicted by the rig as declared. A signal that moves against its
prediction may be the wrong way round, one that moves with it but many times as far may have another unit, one that
moves as predicted some time later may be of another logger; two pressures that move against their predictions may have
changed places; where every signal does, it may be the command: turned, it has to make those that it drives follow
better than before, which a pump that stands still then does not, however much nearer to a jack at rest that is.

Half a swing late looks like a wrong sign. So each of these is undone and the rig's numbers are fitted to the windows:
what cures them is named with what to write, and nothing less is. A force that nothing on the rig makes is one that it
cannot have.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...base.errors import InputError
from ...base.words import agreed, listed
from ...plant import build
from ...records import Campaign, Record
from ...rigs.rig import Rig
from ..data.noise_floor import NoiseFloor
from .impossible import check_ranges
from .initial_states import predicted_states
from .late import Lags, apart, earlier, lags_of
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
_UNSURE = 0.15  # of a correlation: two swings of a signal that are as much alike may both be the one
_SAME, _SHARE = 1.5, 0.01  # chi2, or share of the misfit without it, that a shift may leave where it cures
_REFINED, _STILL = 4, 0.02  # times that a shift is found anew about a fit, or until by less than so many rows
_PRESSURES = {"pa", "pb", "load_pressure"}  # late behind a line they are not mistaken: that is an effect


@dataclass(frozen=True)
class Mistake:
    """What may have happened, in words; how to undo it in a record; what to write to mend it.

    kind: "turned", "swapped", "scaled", "shifted" or "foreign", what the rig cannot have, of `signals`; or "doubtful":
    several, none of which cures it. `late` [s]: of those signals that are shifted, and what is wrong `beside` that.
    chi2 of the rig, fitted to a few windows, before and after it is undone, where that tells.
    """

    kind: str
    signals: tuple[str, ...]
    words: str
    undone: Callable[[Record], Record]
    remedy: str
    late: Mapping[str, float] = field(default_factory=dict)
    beside: "Mistake | None" = None
    chi2: tuple[float, float] | None = None

    def told(self, rig: str) -> str:
        """What may have happened to the records of a rig, and what says so."""
        if self.chi2 is None:
            return self.words
        before, after = (f"{chi2:.3g}" for chi2 in self.chi2)
        without = "at best" if self.kind == "doubtful" else "without that"
        return f"{self.words}: chi2 of {rig}, fitted to a few windows, is {before} as they are and {after} {without}"


def check_columns(campaign: Campaign, rig: Rig, floor: NoiseFloor) -> None:
    """Raises InputError for columns that are not what they are called, naming what they seem to be."""
    mistake = mistaken(campaign, rig, floor)
    if mistake is not None:
        raise InputError(f"{campaign.path}: {mistake.told(rig.name)}; {mistake.remedy}")


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
    late = _late(moving, lags_of(model, windows, model.starts(windows, plant.p), plant.p), bool(suspects))
    if not suspects and not late:
        return None
    rehearsal = Rehearsal(model, rig)
    few = _liveliest(windows, _FITTED)
    plain = rehearsal.fit(few)
    tried, cures = list[tuple[Mistake, Tried]](), list[tuple[float, Mistake]]()
    for each in (*suspects, *late):
        enough = _near(plain) if each.late else 0.0  # a sign, a place or a unit that cures is no shift; all are tried
        if any(chi2 < enough and (chi2 < _SAME or not own.late) for chi2, own in cures):
            break
        tried.append(_refined(rehearsal, few, moving, each))
        cures += [(fit.chi2, own) for own, fit in tried[-1:] if _cures(rehearsal, few, own, plain, fit)]
    if cures:
        least, mistake = _likeliest(cures)
        return replace(mistake, chi2=(plain.chi2, least))
    declared = _chi2(model, windows)
    if not any(_chi2(model, _without(windows, each)) < declared / _FALLS for each in suspects):
        return None
    return _doubtful([each for each, _ in tried], (plain.chi2, min(fit.chi2 for _, fit in tried)))


def _late(moving: Sequence[str], lags: Lags, doubted: bool) -> list[Mistake]:
    """Groups of signals that move as predicted some time later than others do, and those that move against it then:
    a swing is nearly as much like the half before it, which is tried where something is wrong anyway."""
    if not moving:
        return []
    along, against = ({name: lags.best(name, sign) for name in moving} for sign in (1, -1))
    shifts = apart({name: lag for name, (lag, _) in along.items()})
    sets = [shifts, *({name: lag for name, lag in shifts.items() if lag == one} for one in set(shifts.values()))]
    found = [_shifted(each) for place, each in enumerate(sets) if each and each not in sets[:place]]
    unsure = _UNSURE if doubted or shifts else 0.0
    more = {name: against[name][1] - along[name][1] for name in moving}
    loose = [name for name in moving if more[name] > -unsure]
    for turned in dict.fromkeys(
        tuple(name for name in loose if of(name))
        for of in (lambda name: more[name] > 0, lambda name: name in ("pa", "pb"), lambda _: True)
    ):
        both = apart({name: (against if name in turned else along)[name][0] for name in moving})
        signs = {name: -1.0 if name in turned else 1.0 for name in moving}
        others = _turned_or_swapped(signs) if turned and both else []
        found += [_shifted(both, each) for each in others if each.signals != ("command",)]
    return found


def _refined(rehearsal: Rehearsal, windows: Windows, moving: Sequence[str], mistake: Mistake) -> tuple[Mistake, Tried]:
    """A mistake and the fit without it; where signals are shifted, by as much as the fitted rig says."""
    fit = rehearsal.fit(_without(windows, mistake))
    for _ in range(_REFINED):
        if not mistake.late or not np.isfinite(fit.chi2):
            break
        lags = lags_of(rehearsal.model, _without(windows, mistake), fit.x0, fit.p)
        own = {name: lags.best(name, 1)[0] for name in moving}
        late = dict(mistake.late)
        rest = np.mean([lag for name, lag in own.items() if name not in late])
        more = {one: np.mean([own[name] for name in late if late[name] == one]) - rest for one in set(late.values())}
        if max(map(abs, more.values())) < _STILL * lags.period:
            break
        mistake = _shifted({name: one + float(more[one]) for name, one in late.items()}, mistake.beside)
        fit = rehearsal.fit(_without(windows, mistake))
    return mistake, fit


def _cures(rehearsal: Rehearsal, windows: Windows, mistake: Mistake, plain: Tried, fit: Tried) -> bool:
    """Whether the fitted rig follows the records without a mistake: its signals are predicted, and where they are
    shifted nothing else is left that counts, nor does a lag of lines behind pressures explain as much."""
    undone = _without(windows, mistake)
    if not fit.chi2 < plain.chi2 / _FALLS or not fit.chi2 < np.inf:
        return False
    follows = _likeness(rehearsal.model, undone, fit)[0]
    asked = _DRIVEN if mistake.signals == ("command",) else mistake.signals
    if min((follows[name] for name in asked if name in follows), default=0.0) < _FOLLOWS:
        return False
    if not mistake.late:
        return True
    lines = not mistake.beside and set(mistake.late) <= _PRESSURES
    return fit.chi2 < _near(plain) and not (lines and rehearsal.with_lines(windows) < _FALLS * fit.chi2)


def _near(plain: Tried) -> float:
    """chi2 up to which a mistake is all that was wrong with the records, of the fit to them as they are."""
    return max(_SAME, 1 + _SHARE * (plain.chi2 - 1))


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
    scaled = [
        _scaled(name, factor)
        for name, correlation in correlations.items()
        if correlation > _ALIKE and not 1 / _TIMES < gains[name] < _TIMES
        for factor in _FACTORS
        if 1 / _NEAR < gains[name] / factor < _NEAR
    ]
    return [*scaled, *_turned_or_swapped(correlations)]


def _turned_or_swapped(correlations: Mapping[str, float]) -> list[Mistake]:
    wrong = [name for name, correlation in correlations.items() if correlation < _WRONG]
    driven = [correlations[name] for name in _DRIVEN if name in correlations]
    suspects = [_turned("command")] if driven and (min(driven) < _FOLLOWS or max(driven) < _WRONG) else []
    both = {"pa", "pb"} <= set(wrong)
    if wrong == ["pa", "pb"]:
        return [_swapped(), *suspects]
    own = [_turned(*wrong)] if wrong else []
    own += [_swapped(*(name for name in wrong if name not in ("pa", "pb")))] if both else []
    return [*suspects, *own] if len(driven) > 1 and max(driven) < _WRONG else [*own, *suspects]


def _scaled(name: str, factor: float) -> Mistake:
    how = f"{factor:.3g} times too large" if factor > 1 else f"{1 / factor:.3g} times too small"
    return Mistake(
        "scaled",
        (name,),
        f"{name} looks {how}",
        lambda r: _changed(r, lambda s: {name: s[name] / factor} if name in s else {}),
        f"give its unit or scale under [signals.{name}]",
    )


def _swapped(*turned: str) -> Mistake:
    """Pressures that changed places, and signals whose sign is wrong beside that."""
    signs = f", and the sign of {' and '.join(turned)} wrong" if turned else ""
    remedy = f", and turn the other by scale = -1 under [signals.{turned[0]}]" if turned else ""
    return Mistake(
        "swapped",
        ("pa", "pb", *turned),
        f"pa and pb look swapped{signs}",
        lambda r: _changed(
            r, lambda s: {"pa": s["pb"], "pb": s["pa"]} | {name: -s[name] for name in turned if name in s}
        ),
        f"exchange the two columns under [signals]{remedy}",
    )


def _turned(*names: str) -> Mistake:
    return Mistake(
        "turned",
        names,
        f"the sign of {' and '.join(names)} looks wrong",
        lambda r: _changed(r, lambda s: {name: -s[name] for name in names if name in s}),
        f"turn it by scale = -1 under [signals.{names[0]}]",
    )


def _shifted(late: Mapping[str, float], beside: Mistake | None = None) -> Mistake:
    """Signals that are late, each by its own [s], and what is wrong beside that."""
    groups = {one: [name for name in late if late[name] == one] for one in dict.fromkeys(late.values())}
    told = [
        f"{listed(names)} {agreed('look', len(names))} {abs(1e3 * one):.2g} ms {'late' if one > 0 else 'early'}"
        for one, names in groups.items()
    ]
    words = f"{listed(told)}, as from a second logger"
    remedy = f"shift {'them' if len(late) > 1 else 'it'} by as much against the command, or record all by one logger"
    if beside is None:
        return Mistake("shifted", tuple(late), words, lambda r: earlier(r, late), remedy, late)
    signals = tuple(dict.fromkeys((*late, *beside.signals)))
    words, remedy = f"{words}, and {beside.words}", f"{remedy}; {beside.remedy}"
    return Mistake("shifted", signals, words, lambda r: beside.undone(earlier(r, late)), remedy, late, beside)


def _doubtful(mistakes: Sequence[Mistake], chi2: tuple[float, float]) -> Mistake:
    """Mistakes of which none cures what is wrong."""
    words = list(dict.fromkeys(each.words for each in mistakes))
    none = "one of these, none of which cures it" if len(words) > 1 else "which does not cure it"
    signals = tuple(dict.fromkeys(name for each in mistakes for name in each.signals))
    remedy = "check the sign, the unit, the place and the clock of every column, then the rig file"
    return Mistake("doubtful", signals, f"{'; or '.join(words)}: {none}", lambda r: r, remedy, chi2=chi2)


def _changed(record: Record, change: Callable[[Mapping[str, np.ndarray]], Mapping[str, np.ndarray]]) -> Record:
    """The record with some of its signals changed, where it carries them."""
    try:
        return replace(record, signals={**record.signals, **change(record.signals)})
    except KeyError:
        return record


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
