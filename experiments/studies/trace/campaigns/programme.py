"""What is played on a drawn rig, and how its records are listed in campaign.toml."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from workbench.records.campaign import FREE_RUN
from workbench.records.excitation import Excitation
from workbench.rigs.rig import Rig

from .cycles import cycle_roles, cycles, load_settings
from .excitation import excitations, loop_gain
from .play import PositionLoop
from .second_order import SECOND_ORDER

_QUANTUM = 1 / 32767  # of full command: a drive of 16 bits
_TURN, _LEAST = 1 / 1500, 0.05  # of full speed: 1 rpm; where firmware stops the motor and shuts the valves
_PAUSE = 15  # rows: under load a jack drops when its valves turn round, and a loop would turn back
_CROSSOVER = (2.0, 6.0)  # rad/s, of the position loop of a pump
_READINGS = 20  # a row of a slow rig is the mean of 20 ms
_ROLES = {"static": ["static.csv.gz"], "train": ["steps.csv.gz", "triangle.csv.gz"], "heldout": ["multisine.csv.gz"]}


@dataclass(frozen=True)
class Programme:
    """What is played: the first `resting` records do not move, the last `judging` ones are held out.

    settings: constant inputs [SI] of each record. campaign: further keys of campaign.toml. readings: of which a row is
    the mean. start: states that begin elsewhere than at mid stroke, `at_return` those at the return pressure;
    `balanced`: the others begin at an operating point, which a drive whose valves are shut has not. within: an effect
    that takes a pressure below 0, or the jack beyond its stroke, is too strong. still: at rest no loop moves the valve.
    """

    loop: PositionLoop
    played: tuple[Excitation, ...]
    campaign: Mapping[str, Any]
    resting: int = 0
    judging: int = 1
    settings: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    readings: int = 1
    start: Mapping[str, float] = field(default_factory=dict)
    at_return: tuple[str, ...] = ()
    balanced: bool = True
    within: bool = False
    still: bool = False


def programme(rig: Rig, seed: np.random.Generator, sharp: float, poor: bool) -> Programme:
    """The programme of a rig."""
    return (_valve_programme if rig.valve_kind.has_lands else _pump_programme)(rig, seed, sharp, poor)


def _valve_programme(rig: Rig, seed: np.random.Generator, sharp: float, poor: bool) -> Programme:
    """Steps, triangles and a multisine by a position loop."""
    loop = PositionLoop(loop_gain(rig, seed), _QUANTUM)
    played = excitations(rig, seed, sharp, poor)
    by_datasheet = rig.valve == SECOND_ORDER
    return Programme(loop, played, {"records": _ROLES}, resting=1, within=by_datasheet, still=by_datasheet)


def _pump_programme(rig: Rig, seed: np.random.Generator, sharp: float, poor: bool) -> Programme:
    """Cycles at loads by a position loop, as such rigs are recorded; the speed is both command and record."""
    fastest = rig["D"] * rig["nmax"] / rig["AA"]
    loop = PositionLoop(float(seed.uniform(*_CROSSOVER)) / fastest, _TURN, _LEAST, _PAUSE)
    settings = load_settings(seed)
    return Programme(
        loop,
        cycles(seed),
        {"corrector": rig.corrector, "score": FREE_RUN, "records": cycle_roles(settings)},
        settings={name: {"load_setting": pressure} for name, pressure in settings.items()},
        readings=_READINGS,
        start={"x": -rig["xmid"]},
        at_return=("P1", "P2", "Pd", "P0", "Pg"),
        balanced=False,
        within=True,
    )
