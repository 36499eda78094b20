"""`jackbench sines EXPERIMENT`: which sines, by which controllers, on which rigs and drawn plants."""

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ...base.errors import InputError
from ...control.controller_spec import ControllerSpec
from ...loop.capability import Capability, capability
from ...loop.rig_variations import Conditions, Factors
from ...loop.sines import ORDERS
from ...rigs.rig import Rig
from ..common.declared import Experiment, ExperimentFile, count, declared, fraction, part, quantity, takes_experiment
from ..common.envelope_keys import MOST_PLANTS, WITHIN, read_factors
from ..common.experiment import (
    CONDITIONS,
    CONTROLLERS,
    SLOWEST,
    asked_jack,
    controlled,
    read_conditions,
    read_controllers,
)
from ..common.rig_sets import RIGS, checked_rig_set


@dataclass(frozen=True)
class Sine:
    """Frequency [Hz] and amplitude [m]."""

    frequency: float
    amplitude: float


def _asked(at: ExperimentFile) -> tuple[Sine, ...]:
    frequencies = at.top.numbers("frequencies", "[1, 5]")
    return asked_sines(frequencies, at.amplitude, at.share, at.reach, at.rig, at.top.complaint)


def _position_loops(at: ExperimentFile) -> tuple[ControllerSpec, ...]:
    specs = read_controllers(at)
    for spec in specs:
        if (signal := controlled(at, spec)) != "position":
            raise at.top.complaint("controllers", f"{spec.name} controls the {signal}; sines move the position")
    return specs


def _harmonics(at: ExperimentFile) -> int:
    highest = at.top.count("harmonics") if "harmonics" in at.top else ORDERS[0]
    if highest not in ORDERS:
        raise at.top.complaint("harmonics", f"the highest odd order that is taken out: {ORDERS[1]} or {ORDERS[2]}")
    return highest


@declared
class SinesConfig(Experiment):
    """Sines that controllers follow on each rig of a set, by name, and on drawn plants.

    `reach`: what the rigs can give. Drawn are `factors` [low, high] by name, and all other numbers that the rig gives
    bounds.
    """

    KIND = "sines"
    rig: Rig = part(asked_jack, {"rig": "a jack"})
    rigs: Mapping[str, Rig] = part(checked_rig_set, RIGS)
    reach: Mapping[str, Capability] = part(lambda at: {name: capability(rig) for name, rig in at.rigs.items()}, {})
    amplitude: float = quantity("m", 1e-6, 10.0, "amplitude of the sines")
    share: float | None = fraction(
        "of what the weakest rig's valve gives, where that is less; without it such sines are refused", default=None
    )
    sines: tuple[Sine, ...] = part(_asked, {"frequencies": "Hz"})
    harmonics: int = part(_harmonics, {"harmonics": "highest odd order that is taken out: 3 or 5; none without"})
    plants: int = count(0, MOST_PLANTS, "plants to draw; none without", default=0, asked=True)
    stroke: float = fraction("of the stroke limit over which they are drawn", default=0.0)
    factors: Factors = part(lambda at: read_factors(at.top, at.rig), WITHIN)
    conditions: Conditions = part(read_conditions, CONDITIONS)
    controllers: tuple[ControllerSpec, ...] = part(_position_loops, CONTROLLERS)

    @property
    def weakest(self) -> str:
        """The rig that gives the amplitude up to the lowest frequency."""
        return min(self.reach, key=lambda name: self.reach[name].sine_frequency(self.amplitude))


def asked_sines(
    frequencies: Sequence[float],
    amplitude: float,
    share: float | None,
    reach: Mapping[str, Capability],
    rig: Rig,
    complaint: Callable[[str, str], InputError],
) -> tuple[Sine, ...]:
    """Each frequency [Hz] with the amplitude [m], or with a `share` of what the weakest rig gives, if that is less.

    Raises the `complaint` of a key for a sine that is beyond the stroke, or beyond what the valve of a rig gives.
    """
    if min(frequencies) < SLOWEST or max(frequencies) * rig.period.value > 0.1:
        raise complaint("frequencies", f"at least {SLOWEST:g} Hz, and ten samples a cycle")
    if amplitude > rig.limit("stroke"):
        raise complaint("amplitude", f"beyond the stroke limit of {1e3 * rig.limit('stroke'):g} mm; lower it")
    sines = []
    for frequency in frequencies:
        weakest = min(reach, key=lambda name: reach[name].sine_amplitude(frequency))
        most, highest = reach[weakest].sine_amplitude(frequency), reach[weakest].sine_frequency(amplitude)
        if share is None and amplitude > most:
            raise complaint(
                "frequencies",
                f"{frequency:g} Hz: the valve of {weakest} gives {1e3 * most:.3g} mm there, and "
                f"{1e3 * amplitude:g} mm up to {highest:.3g} Hz; lower it, or give a share of what it gives",
            )
        sines.append(Sine(frequency, amplitude if share is None else min(amplitude, share * most)))
    return tuple(sines)


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    takes_experiment(parser, "a sines experiment, such as experiments/sines.toml", SinesConfig, "sines.study:run_sines")
