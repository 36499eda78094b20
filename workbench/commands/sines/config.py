"""The file of an experiment with sines: which ones, by which controllers, on which rigs and drawn plants."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...base.errors import InputError
from ...base.table import ConfigTable
from ...base.units import Spec
from ...control.controller_spec import ControllerSpec, controller_spec
from ...loop.capability import Capability, capability
from ...loop.rig_variations import Conditions
from ...loop.sines import ORDERS
from ...rigs.rig import Rig
from ..common.envelope_keys import MOST_PLANTS, read_factors
from ..common.experiment import SLOWEST, borrowed_controllers, read_conditions, read_experiment, rig_of
from ..common.rig_sets import check_variations, read_rig_set

KEYS = (
    "experiment", "rig", "rigs", "variation", "amplitude", "share", "frequencies", "harmonics", "plants", "stroke",
    "draw", "seed", "ideal", "from", "controllers",
)  # fmt: skip


@dataclass(frozen=True)
class Sine:
    """Frequency [Hz] and amplitude [m]."""

    frequency: float
    amplitude: float


@dataclass(frozen=True)
class SinesConfig:
    """Sines that controllers follow on each rig of a set, by name, and on drawn plants, as many as `plants`.

    `reach`: what the rigs can give. Odd harmonics up to the order `harmonics` are taken out. Drawn are factors [low,
    high] by name, all other numbers that the rig gives bounds, and a place within a share `stroke` of the stroke limit.
    `source` is the experiment as it was read, with its controllers.
    """

    rig: Rig
    rigs: Mapping[str, Rig]
    reach: Mapping[str, Capability]
    amplitude: float
    sines: tuple[Sine, ...]
    harmonics: int
    plants: int
    stroke: float
    factors: Mapping[str, tuple[float, float]]
    conditions: Conditions
    controllers: tuple[ControllerSpec, ...]
    source: Mapping[str, Any]

    @property
    def weakest(self) -> str:
        """The rig that gives the amplitude up to the lowest frequency."""
        return min(self.reach, key=lambda name: self.reach[name].sine_frequency(self.amplitude))


def load_sines(path: str | Path, rig: str | None = None, plants: int | None = None) -> SinesConfig:
    """Read the file; `rig` and `plants` replace what it says. Raises InputError with file and key."""
    path = Path(path)
    top = read_experiment(path)
    top.word("experiment", ["sines"])
    top.allow(*KEYS)
    nominal = rig_of(top, path, rig)
    if not nominal.is_jack:
        raise top.complaint("experiment", f"sines are judged by what a supply gives; {nominal.name} has none")
    rigs = read_rig_set(top, "rigs", top, nominal)
    check_variations(top, rigs)
    reach = {name: capability(member) for name, member in rigs.items()}
    amplitude = top.quantity("amplitude", Spec("m", 1e-6, 10.0, "amplitude of the sines"))
    share = _share(top, "share") if "share" in top else None
    specs, tables = _controllers(top, path, nominal)
    return SinesConfig(
        rig=nominal,
        rigs=rigs,
        reach=reach,
        amplitude=amplitude,
        sines=asked_sines(top.numbers("frequencies", "[1, 5]"), amplitude, share, reach, nominal, top.complaint),
        harmonics=_harmonics(top),
        plants=plants or (top.count("plants", 0, MOST_PLANTS) if "plants" in top else 0),
        stroke=_share(top, "stroke") if "stroke" in top else 0.0,
        factors=read_factors(top, nominal),
        conditions=read_conditions(top),
        controllers=specs,
        source={**{key: value for key, value in top.values.items() if key != "from"}, "controllers": tables},
    )


def _harmonics(top: ConfigTable) -> int:
    """The highest order that is taken out, 1 for none; raises InputError for one that is not looked at."""
    highest = top.count("harmonics") if "harmonics" in top else ORDERS[0]
    if highest not in ORDERS:
        raise top.complaint("harmonics", f"the highest odd order that is taken out: {ORDERS[1]} or {ORDERS[2]}")
    return highest


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


def _share(top: ConfigTable, key: str) -> float:
    share = top.positive(key)
    if share > 1:
        raise top.complaint(key, "a share, at most 1")
    return share


def _controllers(top: ConfigTable, path: Path, rig: Rig) -> tuple[tuple[ControllerSpec, ...], dict[str, Any]]:
    """The controllers of the file and of other files, and their tables. Raises InputError for a force loop."""
    own = top.optional_table("controllers")
    tables = borrowed_controllers(top.optional_table("from"), path.parent) | {name: own.table(name) for name in own}
    if not tables:
        raise top.complaint("controllers", "none; name one here or under [from]")
    specs = tuple(controller_spec(name, table) for name, table in tables.items())
    for spec in specs:
        if (signal := spec.build(rig.period.value).measures[0]) != "position":
            raise top.complaint("controllers", f"{spec.name} controls the {signal}; sines move the position")
    return specs, {name: table.values for name, table in tables.items()}
