"""A campaign with the rig that its records drive: which recorded signal is the rig's command."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..base.errors import InputError
from ..base.signals import SIGNALS
from ..base.units import to_si
from ..records import Campaign, Record, load_campaign
from ..records.campaign import ROLES
from .load import MEASURED
from .rig import Rig
from .rig_file import load_rig
from .schema import SHARED

SHIFT = "sensor.shift"
"""The effect by which a rig declares channels of a second logger."""
LATEST = 1.0  # s
_ABOUT = 0.02  # s to either side, or 1.5 periods, between which another function's velocity is a difference


def load_driven(folder: str | Path, rig: str | Path = "") -> tuple[Campaign, Rig]:
    """A campaign, and its rig or another one, with what drives that rig as the command. Raises InputError."""
    campaign = load_campaign(folder)
    own = load_rig(rig or campaign.rig, corrector=campaign.corrector)
    return driven(campaign, own), own


def driven(campaign: Campaign, rig: Rig) -> Campaign:
    """The campaign with the reference of the rig's inner loop, over its full command, as the command; with the velocity
    of another function that draws from its pump; with the channels that the rig declares as late put back; as it is for
    a rig with none of these.

    Raises InputError for a shift with bounds, or beyond LATEST, and for a record that lacks what drives the rig or
    draws from its pump, or goes beyond what that can be.
    """
    late = _declared_shift(rig)
    parts = {role: tuple(_driven(record.earlier(late), rig) for record in getattr(campaign, role)) for role in ROLES}
    return replace(campaign, **parts)


def _declared_shift(rig: Rig) -> dict[str, float]:
    """By how much [s] channels are recorded late, by name. Raises InputError for one that a fit should move, or that is
    later than LATEST."""
    late = {}
    for name, number in (pair for use in rig.effects if use.name == SHIFT for pair in use.numbers.items()):
        if number.low is not None:
            raise InputError(
                f"rig {rig.name}: {SHIFT}: no fit moves {name}, by which its channel is put back; leave out its bounds"
            )
        try:
            late[name] = float(to_si(number.shown, number.unit, "s"))
        except InputError as error:
            raise InputError(f"rig {rig.name}: {SHIFT}: {name}: {error}") from None
        if abs(late[name]) > LATEST:
            ends = f"{-LATEST:g} to {LATEST:g} s"
            raise InputError(f"rig {rig.name}: {SHIFT}: {name} = {late[name]:g} s is outside {ends}; check its unit")
    return late


def _driven(record: Record, rig: Rig) -> Record:
    if rig.load == MEASURED and "force" in record.signals:
        record = replace(record, signals=_force_in(record.signals), valid=_force_in(record.valid))
    record = _with_other(record, rig)
    loop = rig.inner
    name = loop.reference if loop else "command"
    if name not in record.signals:
        why = f"which the inner loop of rig {rig.name} follows" if loop else f"the input of rig {rig.name}"
        other = "add its column or map it in [signals]"
        if not loop and "reference" in record.signals:
            other = "where a controller of somebody else made it from the reference, describe that loop under [inner] "
            other += 'of the rig file ("jackbench new DIR --ask closed-loop" writes one)'
        raise InputError(f"record {record.name}: no {name}, {why}; {other}")
    if loop is None:
        return record
    signal, peak = SIGNALS[name], float(np.abs(record.signals[name]).max())
    if peak > loop.full_command:
        where = f"record {record.name}: {name} reaches {signal.text(peak)}"
        hint = f"give its unit under [signals.{name}], or a larger full_command"
        raise InputError(f"{where}, and full_command of [inner] is {signal.text(loop.full_command)}; {hint}")
    signals = {**record.signals, "command": record.signals[name] / loop.full_command}
    return replace(record, signals=signals, valid={**record.valid, "command": record.valid[name]})


def _with_other(record: Record, rig: Rig) -> Record:
    """With the velocity of another function, from its position where that was recorded."""
    if not SHARED.keys() & rig.numbers.keys() or "other_velocity" in record.signals:
        return record
    if "other_position" not in record.signals:
        why = f"of the function that draws from the pump of rig {rig.name}, too"
        raise InputError(f"record {record.name}: no other_position, {why}; map its column under [signals]")
    velocity = _slopes(record.t, record.signals["other_position"])
    valid = {**record.valid, "other_velocity": record.valid["other_position"]}
    return replace(record, signals={**record.signals, "other_velocity": velocity}, valid=valid)


def _slopes(t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Slopes [n] of samples x [n] from _ABOUT before each time to as much behind it, whose clock need not be even."""
    about = max(_ABOUT, 1.5 * float(np.median(np.diff(t))))
    first, end = np.maximum(t - about, t[0]), np.minimum(t + about, t[-1])
    return (np.interp(end, t, x) - np.interp(first, t, x)) / (end - first)


def _force_in(columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Columns by signal, the load cell's as the force that acts on the moving mass."""
    return {"disturbance" if name == "force" else name: column for name, column in columns.items()}
