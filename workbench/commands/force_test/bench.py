"""A rig with its specimen, played by the engine: the records that a load cell's sheet is made of."""

from dataclasses import dataclass, field, replace

import numpy as np

from ...base.errors import InputError
from ...linear import equilibrium
from ...linear.linearisation import linear_plant
from ...loop.capability import oil_stiffness, stall_force
from ...loop.drive_simulation import drive, play, trouble, within_limits
from ...loop.sensors import logged
from ...plant import build
from ...records import Record
from ...records.excitation import Excitation
from ...rigs.rig import Rig

SHARE = 0.9  # of the cell's capacity, or of what the jack gives, up to which levels and sines go
LEVELS, REPEATS = (0.2, 0.4, 0.6, 0.8, 1.0), 3
DWELL = 2.5  # s, of a level
MOST_ASKED = 3.0  # times the deflection of the specimen
FREQUENCIES, BELOW = (1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0), 0.7  # Hz; of the mode, beyond which it rings
CLEAR = 0.05  # of the mode: how near to it a sine's third harmonic, which the lap makes, may not come
SIZES = (0.1, 0.3)  # of the same: amplitudes of sines
CYCLES, SHORTEST, REST = 16, 2.0, 1.0  # a sine lasts so many cycles, and so many seconds, with rests between
FADE = 2.0  # cycles, in which it grows, and dies away
LARGEST = 0.5  # of full command, that a sine takes
SMALLER, TRIES = 0.7, 8
FINER = 3.0  # times: how much less noise a reference cell has than the rig's own


@dataclass(frozen=True)
class CellErrors:
    """What a load cell shows beyond the force on it: an error of its span [1], what it shows without load [N], how far
    [N] it lags behind on either way, and the standard deviation [1] of its span from level to level."""

    span: float = 0.0
    zero: float = 0.0
    hysteresis: float = 0.0
    scatter: float = 0.0

    def shown(self, force: np.ndarray) -> np.ndarray:
        """The force [k] with them."""
        return (1 + self.span) * _backlash(force, self.hysteresis) + self.zero


@dataclass(frozen=True)
class ForceBench:
    """A rig with a specimen, its load cell, and the seed of its sensors' noise, which records have unless they are not
    `noisy`. Raises InputError without a specimen or a load cell."""

    rig: Rig
    seed: int
    cell: CellErrors = field(default_factory=CellErrors)
    noisy: bool = True

    def __post_init__(self) -> None:
        if not self.rig["ks"]:
            raise InputError(f"{self.rig.name}: no specimen that a force acts on; set ks in its file, such as 1e7 N/m")
        if "force" not in self.rig.sensors:
            raise InputError(f"{self.rig.name}: no force sensor; declare [sensors.force]")

    @property
    def largest(self) -> float:
        """Force [N] up to which it is tested."""
        return SHARE * min(self.rig.limit("force"), *(stall_force(self.rig, sign) for sign in (1.0, -1.0)))

    @property
    def _mode(self) -> float:
        """The mode of the mass on oil and specimen [Hz]."""
        return float(np.sqrt((oil_stiffness(self.rig) + self.rig["ks"]) / self.rig["M"])) / (2 * np.pi)

    def static_record(self) -> Record:
        """Levels up and down, three times over."""
        return self._played(self.static_wave(), 1)

    def sine_record(self, size: float, which: int) -> Record:
        """Sines of force of an amplitude, a share of the largest, at one frequency after another."""
        return self._played(self.sine_wave(size), 10 + which)

    def static_wave(self) -> Excitation:
        """The loop gives way under a force, so that it is asked for more than a level deflects the specimen."""
        way = np.concatenate(([0.0], np.tile((*LEVELS, *LEVELS[-2::-1], 0.0), REPEATS)))
        reference = np.repeat(way * self.largest / self.rig["ks"], round(DWELL / self.rig.period.value))
        wave = self._wave("force-static", reference, np.zeros(reference.size))
        first = play(drive(self.rig), wave).record.signals["force"]
        return wave.scaled(min(MOST_ASKED, self.largest / float(first.max())))

    def sine_wave(self, size: float) -> Excitation:
        """Commands whose sines of force have an amplitude of `size` of the largest."""
        command = self._sines(size)
        return self._wave(f"force-sine-{100 * size:g}", np.zeros(command.size), command)

    def waves(self) -> list[Excitation]:
        """What a live rig plays for the sheet, as large as this one takes it."""
        wanted, ready = [self.static_wave(), *(self.sine_wave(size) for size in SIZES)], drive(self.rig)
        fitting = [within_limits(ready, wave) for wave in wanted]
        if None in fitting:
            name = wanted[fitting.index(None)].name
            raise InputError(f"{self.rig.name}: its drive cannot play {name} at any size; take another specimen")
        return [wave for wave in fitting if wave is not None]

    def records(self) -> list[Record]:
        """All of them."""
        return [self.static_record(), *(self.sine_record(size, i) for i, size in enumerate(SIZES))]

    def _sines(self, size: float) -> np.ndarray:
        """Commands by the linear plant at rest, as large as the force asks for and the command allows."""
        period, plant = self.rig.period.value, build(self.rig)
        smooth = plant.without_dry_friction()
        linear = linear_plant(plant, equilibrium(plant, p=smooth), outputs=("force",), p=smooth)
        parts = [np.zeros(round(REST / period))]
        for f in (f for f in FREQUENCIES if f < BELOW * self._mode and abs(3 * f / self._mode - 1) > CLEAR):
            gain = linear.C @ np.linalg.solve(2j * np.pi * f * np.eye(len(linear.A)) - linear.A, linear.B) + linear.D
            peak = min(LARGEST, size * self.largest / float(np.abs(gain[0, 0])))
            t = np.arange(round(max(CYCLES, np.ceil(SHORTEST * f)) / f / period)) * period
            fade = np.clip(np.minimum(t, t[-1] - t) * f / FADE, 0.0, 1.0)
            parts += [peak * fade * np.sin(2 * np.pi * f * t), np.zeros(round(REST / period))]
        return np.concatenate(parts)

    def _wave(self, name: str, reference: np.ndarray, command: np.ndarray) -> Excitation:
        return Excitation(name, self.rig.period.value, self.rig["xmid"] + reference, command)

    def _played(self, wave: Excitation, which: int) -> Record:
        """The largest of sizes that the rig takes, as its sensors and a reference cell read it."""
        ready, told = drive(self.rig), None
        for factor in SMALLER ** np.arange(TRIES):
            run = play(ready, wave.scaled(float(factor)), self.seed + which)
            told = trouble(run)
            if told is None:
                true = replace(run.record, name=wave.name)
                return self._logged(true, which) if self.noisy else self._shown(true)
        raise InputError(f"{self.rig.name}: its drive cannot play {wave.name}: {told}; take another specimen")

    def _shown(self, true: Record) -> Record:
        """What the cell shows, and all else as it is."""
        at_specimen = true.signals.get("reference_force", true.signals["force"])
        shown = {"force": self.cell.shown(true.signals["force"]), "reference_force": at_specimen}
        return replace(true, signals={**true.signals, **shown}, valid={})

    def _logged(self, true: Record, which: int) -> Record:
        random = np.random.default_rng([self.seed, which])
        sensor = self.rig.sensors["force"]
        at_specimen = true.signals.get("reference_force", true.signals["force"])
        on_cell = self.cell.shown(true.signals["force"])
        held = round(DWELL / true.period)
        each = random.standard_normal(-(-on_cell.size // held))
        on_cell = on_cell * (1 + self.cell.scatter * np.repeat(each, held)[: on_cell.size])
        signals = {**true.signals, "force": on_cell}
        outputs = tuple(name for name in signals if name not in ("reference", "command"))
        own = logged(signals, self.rig, outputs, self.seed + which)
        own["reference_force"] = at_specimen + sensor.noise / FINER * random.standard_normal(at_specimen.size)
        return replace(true, signals={"command": true.signals["command"], **own}, valid={})


def _backlash(values: np.ndarray, width: float) -> np.ndarray:
    """What follows values [k] only where they have gone on by half of a width: both ways lie that width apart."""
    if not width:
        return values
    out, at = np.empty_like(values), float(values[0])
    for k, value in enumerate(values.tolist()):
        at = min(max(at, value - width / 2), value + width / 2)
        out[k] = at
    return out
