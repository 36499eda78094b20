"""Whether records of a closed loop are what they are called: the response follows its reference, and late."""

import numpy as np

from ...base.errors import InputError
from ...records import Campaign, Record
from ...rigs.inner_loop import POSITION
from ...rigs.rig import Rig
from ..data.causality import lead_problem, sure_lines
from ..data.frequency_response import measured_response
from ..data.white_part import white_part

_LOW = 0.1  # of the lines that are sure, the lowest: there a loop gives what it is asked
_OFF, _WRONG = 0.3, 3.0  # of the gain at low frequency: a loop that is hardly closed; a unit that is wrong
_BLOCK, _STILL = 1.0, 2.0  # s; times the noise: what moves no more than that is at rest
_GIVEN = 0.3  # of force times speed, as a correlation: what a load may give back to the jack


def check_followed(campaign: Campaign, rig: Rig) -> None:
    """Raises InputError for a response that leads its reference, is another factor of it, turned or at rest, and for a
    force that drives the jack instead of holding it."""
    loop = rig.inner
    if loop is None:
        return
    for record in (*campaign.train, *campaign.heldout):
        both = {loop.reference, loop.controls} <= set(record.names) and np.ptp(record.signals[loop.reference]) > 0
        if both and (problem := _problem(record, loop.reference, loop.controls)):
            raise InputError(f"{campaign.path}: record {record.name}: {problem}")


def _problem(record: Record, asked: str, came: str) -> str:
    """What is wrong with a record in words; "" where it can be."""
    if off := _off(record, asked, came):
        first, last = off
        return (
            f"{came} rests from {first:.3g} to {last:.3g} s while {asked} moves: the loop was off; leave that part out"
        )
    response = measured_response(record, asked, came)
    f, h = sure_lines(response)
    if not f.size:
        return ""
    low = np.argsort(f)[: max(3, int(_LOW * f.size))]
    gain = complex(np.median(np.real(h[low])), np.median(np.imag(h[low])))
    if gain.real < 0:
        return f"{came} goes against {asked}; give one of them scale = -1 under [signals]"
    if not _OFF < abs(gain) < _WRONG:
        return f"{came} is {abs(gain):.3g} times what {asked} asks for; give both their units under [signals]"
    if problem := lead_problem(response, record.period):
        return problem
    return _driving(record) if came == POSITION else ""


def _off(record: Record, asked: str, came: str) -> tuple[float, float] | None:
    """The longest time [s] over which the response rests although its reference moves as elsewhere."""
    rows = max(2, round(_BLOCK / record.period))
    count = record.t.size // rows
    moves, follows = (
        np.std(record.signals[name][: count * rows].reshape(count, rows), axis=1) for name in (asked, came)
    )
    noise = white_part(came, [record]).sigma
    off = (moves > 0.5 * moves.max(initial=0.0)) & (follows <= _STILL * noise)
    if not off.any() or count < 2:
        return None
    first, last = np.flatnonzero(off)[[0, -1]]
    return float(record.t[first * rows]), float(record.t[min((last + 1) * rows, record.t.size - 1)])


def _driving(record: Record) -> str:
    """What is wrong where a measured load gives the jack energy all the time."""
    force = record.signals.get("disturbance")
    if force is None:
        return ""
    speed = np.gradient(record.signals["position"], record.t)
    smooth = max(1, round(0.02 / record.period))
    speed = np.convolve(speed, np.ones(smooth) / smooth, mode="same")
    shared = np.corrcoef(force, speed)[0, 1]
    if shared > -_GIVEN:
        return ""
    return "force drives the jack along its motion all the time; give force scale = -1 under [signals]"
