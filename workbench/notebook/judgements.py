"""Loops over drawn plants, with faults, on sines and behind an inverse, by the code of the commands of these names."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from ..base.checkpoint import no_checkpoint
from ..base.errors import InputError, nearest
from ..base.units import quantity
from ..commands.common.drawn_record import DrawnConfig, span_of
from ..commands.common.outcome import Outcome
from ..commands.faults.options import FaultsConfig
from ..commands.faults.study import run_faults
from ..commands.inverse.options import InverseConfig
from ..commands.inverse.study import run_inverse
from ..commands.robustness.options import RobustnessConfig
from ..commands.robustness.study import run_robustness
from ..commands.sines.options import SinesConfig, asked_sines
from ..commands.sines.study import run_sines
from ..loop.capability import capability
from ..loop.fault_trial import FaultLoops
from ..loop.repeated_record import faded
from ..loop.scenarios import POSITIONS, Scenario, scenario
from ..loop.sines import ORDERS
from ..rigs.rig import Rig
from .closed_loop import ClosedLoop, Quantity
from .door import takes_keys
from .loops import loops_of_one_rig, named_controllers
from .search import SCENARIOS, checked_rigs

Loops = ClosedLoop | Sequence[ClosedLoop]
Factors = Mapping[str, tuple[float, float]]
STROKE = 0.9  # share of the stroke limit in which drawn plants are judged, as in the shipped experiments
_REST = 0.3  # s before and after a record


@takes_keys(RobustnessConfig)
def robustness(
    loops: Loops,
    plants: int = 1000,
    within: Factors | None = None,
    step: Quantity | None = None,
    seconds: Quantity = "1 s",
    seed: int = 1,
    jobs: int = 1,
    stroke: float = STROKE,
    **keys: Any,
) -> Outcome:
    """Loops of one signal on drawn plants over the whole stroke: a step with noise and computing delay, and margins.

    Parameters
    ----------
    step
        Size of the step [m or N]; 10 mm or 20 kN where none is given.
    """
    listed = loops_of_one_rig(loops, "robustness")
    first = listed[0]
    return run_robustness(
        RobustnessConfig(
            rig=first.rig,
            plants=plants,
            conditions=first.conditions(seed),
            signal=first.signal,
            step=_size(first, step),
            seconds=quantity(seconds, "s"),
            stroke=stroke,
            positions=POSITIONS,
            factors=_factors(first.rig, within, "robustness"),
            controllers=named_controllers(listed),
            **keys,
        ),
        no_checkpoint,
        _quiet,
        jobs,
    )


@takes_keys(FaultsConfig)
def faults(
    loops: Loops,
    plants: int = 100,
    within: Factors | None = None,
    step: Quantity | None = None,
    seconds: Quantity = "0.7 s",
    seed: int = 1,
    stroke: float = STROKE,
    **keys: Any,
) -> Outcome:
    """Loops of one signal through every fault of sensors, controller, drive and plant, and on plants without a fault.

    Parameters
    ----------
    step
        Size of the step [m or N] in which faults begin; 100 mm or 20 kN where none is given.
    """
    listed = loops_of_one_rig(loops, "faults")
    first = listed[0]
    if not first.rig.is_jack:
        raise InputError(f"faults: {first.rig.name} has no chambers, so that its guard has limits only; give a jack")
    size = quantity("100 mm", "m") if step is None and first.signal.name == "position" else _size(first, step)
    own = FaultLoops(
        first.signal.name, first.rig, size, _factors(first.rig, within, "faults"), named_controllers(listed)
    )
    trials = FaultsConfig(
        rig=first.rig,
        loops=(own,),
        plants=plants,
        stroke=stroke,
        seconds=quantity(seconds, "s"),
        conditions=first.conditions(seed),
        **keys,
    )
    return run_faults(trials, no_checkpoint, _quiet)


@takes_keys(SinesConfig)
def sines(
    loops: Loops,
    frequencies: Sequence[float] = (1.0, 5.0, 10.0),
    amplitude: Quantity = "10 mm",
    share: float | None = 0.8,
    harmonics: int = ORDERS[1],
    rigs: Sequence[str] = ("nominal",),
    plants: int = 0,
    within: Factors | None = None,
    seed: int = 1,
    stroke: float = STROKE,
    **keys: Any,
) -> Outcome:
    """Position loops on sines: alone, with amplitude and phase control, and with odd harmonics taken out.

    Parameters
    ----------
    frequencies
        Frequencies [k] in Hz.
    share
        Share [1] of what the weakest rig's valve gives, to which `amplitude` is cut; not cut where None.
    harmonics
        The highest odd order that is taken out.
    """
    listed = loops_of_one_rig(loops, "sines")
    first = listed[0]
    if not first.rig.is_jack or first.signal.name != "position":
        raise InputError("sines: they move the position of a jack; give loops that control one")
    if harmonics not in ORDERS:
        raise InputError(f"sines: harmonics: the highest odd order that is taken out, one of {list(ORDERS)}")
    members = checked_rigs(first, rigs, "sines")
    reach = {name: capability(rig) for name, rig in members.items()}
    size = quantity(amplitude, "m")
    asked = asked_sines(frequencies, size, share, reach, first.rig, partial(_complaint, "sines"))
    return run_sines(
        SinesConfig(
            rig=first.rig,
            rigs=members,
            reach=reach,
            amplitude=size,
            sines=asked,
            harmonics=harmonics,
            plants=plants,
            stroke=stroke,
            factors=_factors(first.rig, within, "sines"),
            conditions=first.conditions(seed),
            controllers=named_controllers(listed),
            **keys,
        ),
        no_checkpoint,
        _quiet,
    )


@takes_keys(InverseConfig)
def inverse(
    loops: Loops,
    record: str | Scenario = "position-sine-5hz",
    rigs: Sequence[str] = ("nominal",),
    preview: Quantity = "80 ms",
    length: Quantity = "300 ms",
    band: Quantity = "5 Hz",
    fade: Quantity = "1 s",
    seed: int = 1,
    plants: int | None = None,
    within: Factors | None = None,
    stroke: float = STROKE,
    **keys: Any,
) -> Outcome:
    """An inverse of each loop, designed on some rigs, and a record played with and without it.

    `ClosedLoop.inverse` gives the filter alone.

    Parameters
    ----------
    record
        A scenario or its name.
    rigs
        Names of the set on which the inverse is designed, nominal first (see RIG_SET).
    preview
        How far ahead the filter looks [s].
    length
        Length of the filter [s], above the preview.
    band
        Frequencies [Hz] within which references move.
    fade
        Time [s] over which the record comes and goes.
    stroke
        Share [1] of the stroke limit over which plants are drawn.
    """
    listed = loops_of_one_rig(loops, "inverse")
    first = listed[0]
    asked = scenario(record, "inverse") if isinstance(record, str) else record
    if asked.signal != first.signal.name:
        raise InputError(f"inverse: {asked.name} asks for a {asked.signal}, the loops control the {first.signal.name}")
    members = checked_rigs(first, rigs, "inverse")
    ahead, taps = (round(quantity(value, "s") / first.rig.period.value) for value in (preview, length))
    if not 0 <= ahead < taps:
        raise InputError("inverse: the preview must be below the length; shorten it")
    rig, blend, drawn = first.rig, quantity(fade, "s"), None
    if plants is not None:
        reference = faded(asked, _REST, blend, rig.period.value)
        span = span_of(rig, first.signal, reference, stroke, partial(_complaint, "inverse"))
        drawn = DrawnConfig(rig, plants, seed, _factors(rig, within, "inverse"), span)
    return run_inverse(
        InverseConfig(
            rig=rig,
            rigs=members,
            scenario=asked,
            signal=first.signal,
            controllers=named_controllers(listed),
            rest=_REST,
            fade=blend,
            plants=plants,
            drawn=drawn,
            conditions=first.conditions(seed),
            designed_on=tuple(members),
            preview=ahead,
            taps=taps,
            band=quantity(band, "Hz"),
            **keys,
        ),
        no_checkpoint,
        _quiet,
    )


def _size(loop: ClosedLoop, step: Quantity | None) -> float:
    """A step in SI; that of the usual scenario of the signal where none is given."""
    return scenario(SCENARIOS[loop.signal.name][0], "step").size if step is None else quantity(step, loop.signal.si)


def _complaint(where: str, key: str, what: str) -> InputError:
    return InputError(f"{where}: {key}: {what}")


def _factors(rig: Rig, within: Factors | None, where: str) -> dict[str, tuple[float, float]]:
    """Factors by the names of the rig's numbers. Raises InputError, opened by `where`."""
    factors: dict[str, tuple[float, float]] = {}
    for name, ends in (within or {}).items():
        if name not in rig.numbers:
            raise InputError(f'{where}: within: no number "{name}"; {nearest(name, rig.numbers)}')
        try:
            low, high = (float(end) for end in ends)
        except (TypeError, ValueError):
            raise InputError(f"{where}: within: {name}: write the least and the greatest, such as (0.5, 1.5)") from None
        if not 0 < low <= high:
            raise InputError(f"{where}: within: {name}: factors are above 0, the least first")
        factors[name] = (low, high)
    return factors


def _quiet(*_: Any) -> None:
    """No report of progress."""
