"""Clocks, commands, positions, pressures and forces that no recording of a rig has: another unit than the one that is
said."""

import numpy as np

from ...base.errors import InputError
from ...records import Campaign, Record
from ...records.campaign import WINDOWS
from ...rigs.rig import Rig
from .followed import check_followed
from .windows import WINDOW

_ROWS, _SLOW = 10, 20.0  # of a window at least; times the control period: no recording of a loop is that coarse
_CLOCKS = {"ms": 1e3, "us": 1e6}  # in a second
_FULL = 1.05  # of full command: more is another unit
_PRESSURES = ("pa", "pb", "supply")
_PRESSURE_UNITS = {"bar": 1e5, "MPa": 1e6, "psi": 6894.757, "Pa": 1.0}
_FAR = 5.0  # times the supply pressure, or below it by 50: no pressure of this rig
_BEYOND = 1.5  # times the stroke, or the limit of force: no position or force of this rig


def check_ranges(campaign: Campaign, rig: Rig) -> None:
    """Raises InputError for a clock, a command, a pressure, a position or a force that is in no range of the rig's."""
    for record in campaign.records:
        _check_clock(campaign, record, rig)
        _check_command(campaign, record)
        _check_pressures(campaign, record, rig)
        _check_position(campaign, record, rig)
        _check_force(campaign, record, rig)
    check_followed(campaign, rig)


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


def _check_force(campaign: Campaign, record: Record, rig: Rig) -> None:
    """The load cell's, also where it acts on a jack in its maker's loop; what is computed of a payload is none."""
    limit, names = rig.limit("force"), ("force", "disturbance") if rig.inner else ("force",)
    peak = max(float(np.max(np.abs(record.signals.get(name, np.zeros(1))))) for name in names)
    if peak > _BEYOND * limit:
        raise InputError(
            f"{campaign.path}: record {record.name}: force reaches {peak / 1e3:.4g} kN, {peak / limit:.3g} times the "
            "limit of the rig; check its unit under [signals.force], or force under [limits] of the rig file"
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
