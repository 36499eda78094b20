"""Columns that are mistaken for others: a sign, two pressures that changed places, a unit that the header does not say.

Nothing is fitted here. A few windows in which the command moves most are predicted by the rig as declared. A signal
that moves against its prediction is the wrong way round, one that moves with it but many times as far has another
unit; two pressures that do so have changed places; where every
signal does, it is the command: turned, it has to make those that it drives follow better than before, which a pump that
stands still then does not, however much nearer to a jack at rest that is. A force that nothing on the rig makes is
one that it cannot have.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...base.errors import InputError
from ...plant import build
from ...records import Campaign, Record
from ...records.campaign import WINDOWS
from ...rigs.rig import Rig
from ..data.noise_floor import NoiseFloor
from .initial_states import predicted_states
from .model import Model
from .unfelt import unfelt_force
from .windows import WINDOW, Windows, cut_windows

_ROWS, _SLOW = 10, 20.0  # of a window at least; times the control period: no recording of a loop is that coarse
_CLOCKS = {"ms": 1e3, "us": 1e6}  # in a second
_FULL = 1.05  # of full command: more is another unit
_PRESSURES = ("pa", "pb", "supply")
_PRESSURE_UNITS = {"bar": 1e5, "MPa": 1e6, "psi": 6894.757, "Pa": 1.0}
_FAR = 5.0  # times the supply pressure, or below it by 50: no pressure of this rig
_BEYOND = 1.5  # times the stroke: no position of this rig
_WINDOWS = 6
_MOVES = 1.0  # chi2 about the mean: what moves less tells no sign
_WRONG = -0.3  # correlation of what is measured with what is predicted: below it a column is the wrong way round
_DRIVEN = ("current", "spool", "velocity", "position")  # go with the command, whatever the load does
_FOLLOWS = 0.9  # correlation of what follows the command: below it the command may be the wrong way round
_ALIKE, _TIMES = 0.7, 4.0  # correlation and gain of a column that is in another unit
_FACTORS = (*(10.0**power for power in range(-6, 7) if power), 14.5038, 1 / 14.5038, 25.4, 1 / 25.4)
_NEAR = 3.0  # times
_FALLS = 2.0  # times: the fall of chi2 that undoing it has to bring


@dataclass(frozen=True)
class Mistake:
    """What may have happened, in words; how to undo it in the signals of a record; what to write to mend it.

    kind: "turned", "swapped", "scaled" or "foreign", what the rig cannot have, of `signals`; chi2 of the rig as
    declared, before and after it is undone, where that tells.
    """

    kind: str
    signals: tuple[str, ...]
    words: str
    undone: Callable[[Mapping[str, np.ndarray]], Mapping[str, np.ndarray]]
    remedy: str
    chi2: tuple[float, float] | None = None

    def told(self, rig: str) -> str:
        """What may have happened to the records of a rig, and what says so."""
        if self.chi2 is None:
            return self.words
        before, after = self.chi2
        return f"{self.words}: chi2 of {rig} as declared falls from {before:.3g} to {after:.3g} without that"


def check_columns(campaign: Campaign, rig: Rig, floor: NoiseFloor) -> None:
    """Raises InputError for columns that are not what they are called, naming what they seem to be."""
    mistake = mistaken(campaign, rig, floor)
    if mistake is not None:
        raise InputError(f"{campaign.path}: {mistake.told(rig.name)}; {mistake.remedy}")


def mistaken(campaign: Campaign, rig: Rig, floor: NoiseFloor) -> Mistake | None:
    """The sign, exchange or factor without which the rig as declared predicts its records far better, or a force that
    it cannot have; None without one.

    Raises InputError for a clock, a command, a pressure or a position that is in no range of the rig's.
    """
    for record in campaign.records:
        _check_clock(campaign, record, rig)
        _check_command(campaign, record)
        _check_pressures(campaign, record, rig)
        _check_position(campaign, record, rig)
    if unfelt := unfelt_force(campaign, rig, floor):
        words, remedy = unfelt
        return Mistake("foreign", ("force",), words, lambda _: {}, remedy)
    records = [
        record for record in (*campaign.train, *campaign.heldout) if np.ptp(record.signals.get("command", [0.0])) > 0
    ]
    if not records:
        return None
    plant = build(rig)
    windows = _liveliest(cut_windows(plant, records, floor))
    model = Model(plant, windows.names, brief=True)
    correlations, gains = _likeness(model, windows)
    suspects = [
        each
        for each in _suspects(correlations, gains)
        if each.signals != ("command",) or _driven(_likeness(model, _without(windows, each))[0]) > _driven(correlations)
    ]
    if not suspects:
        return None
    plain = _chi2(model, windows)
    undone, mistake = _likeliest([(_chi2(model, _without(windows, each)), each) for each in suspects])
    return replace(mistake, chi2=(plain, undone)) if undone < plain / _FALLS else None


def _likeliest(undone: Sequence[tuple[float, Mistake]]) -> tuple[float, Mistake]:
    """The suspect of the least chi2; but a jack whose ends are alike is mirrored by a turned command: of that and of
    pressures that changed places beside a turned position the first counts, where the records tell them apart badly."""
    least, best = min(undone, key=lambda pair: pair[0])
    mirrored = next((pair for pair in undone if len(pair[1].signals) > 2 and pair[1].kind == "swapped"), None)
    command = next((pair for pair in undone if pair[1].signals == ("command",)), None)
    if mirrored is None or command is None or max(mirrored[0], command[0]) > _FALLS * least:
        return least, best
    return command[0], replace(command[1], words=f"{command[1].words}, or as well {mirrored[1].words}")


def _check_clock(campaign: Campaign, record: Record, rig: Rig) -> None:
    times = record.period / rig.period.value
    if record.period < WINDOW / _ROWS or (times < _SLOW and campaign.score != WINDOWS):
        return
    looks = next((f"; it looks like {unit} under s" for unit, size in _CLOCKS.items() if 1 / 3 < times / size < 3), "")
    raise InputError(
        f"{campaign.path}: record {record.name}: a row every {record.period:.3g} s, and the control period of "
        f"{rig.name} is {1e3 * rig.period.value:g} ms{looks}; give its unit under [signals.t]"
    )


def _check_command(campaign: Campaign, record: Record) -> None:
    peak = float(np.max(np.abs(record.signals.get("command", np.zeros(1)))))
    if peak > _FULL:
        raise InputError(
            f"{campaign.path}: record {record.name}: command reaches {peak:.4g}, and 1 is full command; "
            f"under [signals.command] give its unit, or scale = {1 / float(f'{peak:.1g}'):.3g}"
        )


def _check_position(campaign: Campaign, record: Record, rig: Rig) -> None:
    travel = float(np.ptp(record.signals.get("position", 0.0)))
    if travel > _BEYOND * rig["S"]:
        raise InputError(
            f"{campaign.path}: record {record.name}: position goes over {1e3 * travel:.4g} mm, and the stroke is "
            f"{1e3 * rig['S']:.4g} mm; give its unit under [signals.position]"
        )


def _check_pressures(campaign: Campaign, record: Record, rig: Rig) -> None:
    supply = rig["Ps"]
    for name in _PRESSURES:
        if name not in record.signals:
            continue
        values = record.signals[name][record.valid[name]]
        peak = float(np.max(np.abs(values))) if values.size else supply
        if supply / (10 * _FAR) <= peak <= _FAR * supply:
            continue
        looks = [
            (read, meant)
            for read, a in _PRESSURE_UNITS.items()
            for meant, b in _PRESSURE_UNITS.items()
            if 0.3 * supply < peak * b / a < 1.3 * supply
        ]
        hint = "; it looks like " + " or ".join(f"{b} under {a}" for a, b in looks) if looks else ""
        raise InputError(
            f"{campaign.path}: record {record.name}: {name} reaches {peak / 1e5:.4g} bar, and the supply has "
            f"{supply / 1e5:.4g} bar{hint}; give its unit under [signals.{name}]"
        )


def _likeness(model: Model, windows: Windows) -> tuple[dict[str, float], dict[str, float]]:
    """Correlations and gains of measured over predicted signals about their means in each window; those that move."""
    parts = model.predict(windows, model.starts(windows, model.plant.p), model.plant.p)
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
        lambda s: {name: s[name] / factor} if name in s else {},
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
        lambda s: {"pa": s["pb"], "pb": s["pa"]} | {name: -s[name] for name in turned if name in s},
        f"exchange the two columns under [signals]{remedy}",
    )


def _turned(*names: str) -> Mistake:
    listed = " and ".join(names)
    return Mistake(
        "turned",
        names,
        f"the sign of {listed} looks wrong",
        lambda s: {name: -s[name] for name in names if name in s},
        f"turn it by scale = -1 under [signals.{names[0]}]",
    )


def _liveliest(windows: Windows) -> Windows:
    """The windows in which the command moves most."""
    moves = [np.ptp(windows.records[i].signals["command"][first:end]) for i, first, end in windows.spans]
    return windows.some(np.sort(np.argsort(moves)[-_WINDOWS:]).tolist())


def _without(windows: Windows, mistake: Mistake) -> Windows:
    """The windows with a mistake undone in every record that has its signals."""
    records = []
    for record in windows.records:
        try:
            records.append(replace(record, signals={**record.signals, **mistake.undone(record.signals)}))
        except KeyError:
            records.append(record)
    return replace(windows, records=tuple(records)).some(range(windows.count))


def _chi2(model: Model, windows: Windows) -> float:
    squares = predicted_states(model, windows, model.plant.p)[1]
    return float(squares.sum()) / windows.samples
