"""Records that the worst of all plants still takes, each simulated on every corner of what is uncertain."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...base.errors import InputError
from ...control.controller_spec import ControllerSpec
from ...engine import Engine
from ...plant import build
from ...records.excitation import Excitation
from ...rigs.number import Number
from ...rigs.rig import Rig
from ..excite.study import SMALLER, TRIES, DriveSimulation, drive, play, trouble
from ..record.study import standard_set

MARGIN = 0.05  # of a limit, that no plant may come nearer to
_DOUBT = 1.2  # of the travel that the datasheet's flow says
_WORST = ("M", "beta", "Ps", "K3")  # whose ends decide how far, how fast and how hard a record moves


def corners(rig: Rig) -> Iterator[Rig]:
    """The rig, and each of the numbers that decide at either end of its bounds."""
    yield rig
    for name in _WORST:
        number = rig.numbers.get(name)
        if number is not None and number.low is not None and number.high is not None:
            yield from (rig.with_values(**{name: end}) for end in (number.low, number.high))


def doubted(rig: Rig) -> Rig:
    """The rig with a guard that knows that the valve may have another flow than the datasheet says: none at all, but
    not the other way."""
    limit = Number("flow_error", _DOUBT, "1", "1", "commissioning: the valve is not known yet")
    return replace(rig, limits={**rig.limits, "flow_error": limit})


def standard_records(rig: Rig, loop: ControllerSpec) -> list[Excitation]:
    """The standard records in a loop, as `safe` leaves them."""
    return safe(rig, loop, list(standard_set(replace(drive(rig), loop=loop)).values()))


def safe(rig: Rig, loop: ControllerSpec, waves: Sequence[Excitation], found: Rig | None = None) -> list[Excitation]:
    """Records as large as every corner takes them in a loop, and the rig as `found`, where it is known. Raises
    InputError where one is not taken at any size."""
    ready, others = replace(drive(rig), loop=loop), [*list(corners(rig))[1:], *([found] if found else [])]
    plants = [ready, *(replace(ready, rig=each, engine=Engine(build(each))) for each in others)]
    return [_smaller(plants, wave) for wave in waves]


def _smaller(plants: Sequence[DriveSimulation], wave: Excitation) -> Excitation:
    for factor in SMALLER ** np.arange(TRIES):
        trial = wave.scaled(float(factor))
        if all(_is_taken(plant, trial) for plant in plants):
            return trial
    raise InputError(f"{wave.name}: some plant within the datasheet's bounds takes it at no size; narrow the bounds")


def _is_taken(plant: DriveSimulation, wave: Excitation) -> bool:
    run, rig = play(plant, wave), plant.rig
    signals = run.record.signals
    far = np.abs(signals["position"] - rig.middle).max() > (1 - MARGIN) * rig.limit("stroke")
    fast = np.abs(signals["velocity"]).max() > (1 - MARGIN) * rig.limit("speed")
    return trouble(run) is None and not far and not fast
