"""Where a commissioning must say no: what stands in the way on the rig, what it costs, what to mend or record."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...control.shells import SineShell
from ...records import Record
from .allowed import is_of

if TYPE_CHECKING:
    from ..course import Judged

_SAGS = 0.1  # of the supply at rest: a deeper drop is told
_TAIL = 0.25  # of a step's run, at its end, over which a jack that hunts is watched
_MEND = {
    "jack.friction": "seals and guides of the jack: their preload, alignment and oil",
    "main.stiction": "the main spool: wear, silt, or dither that is too small",
    "pilot.hysteresis": "the pilot stage: its torque motor, magnetised parts, or dither that is too small",
    "main.deadband": "the lands of the main spool: their overlap",
}
"""What keeps a jack from resting, and where it is mended."""
_UNNAMED = (
    "record small moves one after the other, to and fro, with spool and current measured: friction of the jack, a "
    "spool that sticks and hysteresis of the pilot differ there"
)


@dataclass(frozen=True)
class Obstacle:
    """What stands in the way, what it costs, and what to mend or to record."""

    what: str
    costs: str
    mend: str


class Barred(Exception):
    """Something for which nothing more is played on the rig: `obstacle`."""

    def __init__(self, obstacle: Obstacle) -> None:
        super().__init__(obstacle.what)
        self.obstacle = obstacle


def cut_short(what: str, why: str) -> Obstacle:
    """The rig or its guard stopped a record."""
    return Obstacle(
        f"{what} on the rig was cut short: {why}",
        "nothing more is played: no controller is searched for a rig that was not recorded",
        "look at the rig, and at the sensor or the limit that is named, before the next try",
    )


def time_is_over(allowed: float, spent: float, before: str) -> Obstacle:
    """There is no time left [s] for a record."""
    return Obstacle(
        f"--minutes {allowed / 60:.3g}: {spent:.0f} s are spent, and {before} would take more than what is left",
        "what comes after it is not played",
        "allow more minutes",
    )


def obstacles(
    judged: Sequence["Judged"],
    goal: str,
    verdict: str,
    effects: Sequence[str],
    rest: Record,
    records: Iterable[Record],
    dither: SineShell | None,
) -> list[Obstacle]:
    """Obstacles of a goal's step as every way played it, of what a trace said (`verdict`; empty: none ended),
    of the records, and of the dither that was needed."""
    steps = [each for each in judged if is_of(each.scenario.name, goal)]
    return [
        *_stays_open(dither),
        *_hunts(steps, effects, bool(verdict)),
        *_alike(steps, verdict, effects),
        *_sags(rest, records),
    ]


def _stays_open(dither: SineShell | None) -> Iterator[Obstacle]:
    """A valve that a command of 0 does not close."""
    if dither is None:
        return
    words = f"{100 * dither.amplitude:.2g} % at {dither.frequency:g} Hz"
    yield Obstacle(
        "the valve stays open when its command is gone: hysteresis of the pilot, or a spool that sticks",
        f"without a dither of {words} on the command, which every controller here has, the jack comes to rest nowhere; "
        "switched off it drifts to the end of its stroke, so shut its supply off as well",
        f"look at {_MEND['pilot.hysteresis']}; then at {_MEND['main.stiction']}",
    )


def _hunts(steps: Sequence["Judged"], effects: Sequence[str], traced: bool) -> Iterator[Obstacle]:
    """No controller settles the goal's step, however its gains were found."""
    if not steps or any(each.row["settling_s"] is not None for each in steps):
        return
    away = 1e3 * min(_away(each) for each in steps)
    causes = [name for name in effects if name in _MEND]
    unsaid = "the records do not say why" if traced else "why is not known, for no trace of the records was finished"
    cause = f"; the records say {' or '.join(causes)}" if causes else f"; {unsaid}"
    names = ", ".join(each.controller for each in steps)
    yield Obstacle(
        f"no controller brings the jack to rest where it should ({names}){cause}",
        f"{away:.2g} mm or more of a step of {1e3 * abs(steps[0].scenario.size):g} mm are missing at its end, "
        "or the jack swings by as much",
        "; ".join(f"look at {_MEND[name]}" for name in causes) or _UNNAMED,
    )


def _away(each: "Judged") -> float:
    """How far [m] the jack still gets from its reference at the end of a step, standing or hunting."""
    signals = each.measured.record.signals
    late = slice(-max(2, round(_TAIL * len(signals["position"]))), None)
    return float(np.abs(signals["reference"][late] - signals["position"][late]).max())


def _alike(steps: Sequence["Judged"], verdict: str, effects: Sequence[str]) -> Iterator[Obstacle]:
    """Effects that no record here tells apart."""
    if verdict != "tied":
        return
    pair = next((e for e in steps if e.controller == "found" and e.row["settling_s"] is not None), None)
    costs = "what it costs is not known: the found rig's controller did not settle"
    if pair is not None:
        told = pair.prediction["settling_s"]
        costs = f"the controller of the first one settles in {pair.row['settling_s']:.3g} s, predicted "
        costs += "never" if told is None else f"{told:.3g} s"
    yield Obstacle(
        f"no record tells {' and '.join(effects)} apart",
        costs,
        "record what `jackbench plan` says for this campaign, or measure the command where it leaves the computer and "
        "where it reaches the valve",
    )


def _sags(rest: Record, records: Iterable[Record]) -> Iterator[Obstacle]:
    """A supply that larger motions draw down, in the recordings of its own sensor."""
    lowest = {each.name: _lowest(each) for each in records if "supply" in each.signals}
    level = float(np.mean(rest.signals["supply"])) if "supply" in rest.signals else 0.0
    deep = {name: value / level for name, value in lowest.items() if level > 0 and value < (1 - _SAGS) * level}
    if not deep:
        return
    least = min(deep.values())
    yield Obstacle(
        f"the supply sags to {100 * least:.0f} % of {level / 1e5:.0f} bar in {', '.join(deep)}",
        f"the valve's flow, and the fastest speed with it, falls to {100 * np.sqrt(max(least, 0.0)):.0f} % there",
        "an accumulator beside the valve, a wider line or a larger pump; until then smaller and slower motions",
    )


def _lowest(record: Record) -> float:
    """Supply [Pa] that 99 % of a record's samples exceed: noise is no sag."""
    return float(np.percentile(record.signals["supply"], 1.0))


def told(found: Sequence[Mapping[str, str]]) -> list[str]:
    """Obstacles as commission.json has them, in sentences."""
    return [f"{_capital(each['what'])}. It costs: {each['costs']}. To do: {each['mend']}." for each in found]


def _capital(text: str) -> str:
    return text[0].upper() + text[1:]
