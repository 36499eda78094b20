"""A load cell in motion: sines of force, in the manner of ASTM E467 and ISO 4965-1.

The mass m between cell and specimen is moved by the cell, so that it indicates F + m a of a force F at the specimen.
Signals are complex amplitudes of a sine: `indicated` = (1 + g) `reference` + m `acceleration`, g an error of the span.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...records import Record
from ...rigs.rig import Rig
from .regression import Series, regress
from .row import Estimate
from .sines import SteadySine, steady_sines

_APART = 1.2  # of two frequencies that tell a mass from an error of the span
_FREQUENCIES = 3
_GROUP = 0.5  # s
_PLAIN = 5e-3  # of a frequency: how far its name may be off


@dataclass(frozen=True, eq=False)
class ForcePoint:
    """A sine of force of f [Hz]: complex amplitudes [k] N in groups of cycles, indicated, at the specimen by a
    reference where there is one, and the acceleration [m/s^2] of the cell, by `source` and known to a share `spread`.
    """

    sine: SteadySine
    indicated: np.ndarray
    reference: np.ndarray | None
    acceleration: np.ndarray | None
    source: str
    spread: float

    @property
    def f(self) -> float:
        """Frequency [Hz]."""
        return self.sine.f

    @property
    def range(self) -> float:
        """Indicated force range [N], from valley to peak."""
        return 2 * float(np.mean(np.abs(self.indicated)))

    def at_specimen(self, mass: Estimate | None) -> tuple[np.ndarray, str]:
        """Size [k] N of the force at the specimen, and by what: the reference, else the indicated less the inertia."""
        if self.reference is not None:
            return np.abs(self.reference), "reference cell"
        assert mass is not None
        assert self.acceleration is not None
        return np.abs(self.indicated - mass.value * self.acceleration), "mass times acceleration"

    def error(self, mass: Estimate | None, compensated: bool = False) -> Estimate | None:
        """The error as a share of the force range: force indicated, or that less the inertia, over the specimen's."""
        inertia = self.acceleration is not None and mass is not None
        if (compensated and (self.reference is None or not inertia)) or (self.reference is None and not inertia):
            return None
        each = self._errors(mass, compensated)
        deviation = float(np.std(each, ddof=1) / np.sqrt(each.size))
        uses_mass = compensated or self.reference is None
        if uses_mass and mass is not None and self.acceleration is not None:
            step = max(1e-6, 1e-3 * abs(mass.value))
            moved = Estimate(mass.value + step, 0.0)
            slope = float(np.mean(self._errors(moved, compensated)) - np.mean(each)) / step
            own = np.hypot(mass.deviation, self.spread * mass.value)
            deviation = float(np.hypot(deviation, slope * own))
        freedom = each.size - 1.0
        return Estimate(float(np.mean(each)), deviation, min(freedom, mass.freedom) if uses_mass and mass else freedom)

    def _errors(self, mass: Estimate | None, compensated: bool) -> np.ndarray:
        shown = self.indicated
        if compensated and mass is not None and self.acceleration is not None:
            shown = shown - mass.value * self.acceleration
        return np.abs(shown) / self.at_specimen(mass)[0] - 1


def force_points(records: Sequence[Record], rig: Rig) -> list[ForcePoint]:
    """The points of records force-sine, by frequency and record. Raises InputError for what is no sine."""
    noise = rig.sensors["force"].noise if "force" in rig.sensors else 0.0
    sines = [sine for record in records if "force" in record.signals for sine in steady_sines(record, "force", noise)]
    return [
        _point(sine, rig) for sine in sorted(sines, key=lambda sine: (float(plain_frequency(sine.f)), sine.record.name))
    ]


def plain_frequency(f: float) -> str:
    """The shortest number within 0.5 % of a frequency [Hz]: 10 for 9.99, 12.5 for 12.48."""
    rounded = (float(f"{f:.{digits}g}") for digits in range(1, 5))
    return f"{next(plain for plain in rounded if abs(plain - f) <= _PLAIN * f):.10g}"


def _point(sine: SteadySine, rig: Rig) -> ForcePoint:
    names = sine.record.names
    reference = sine.amplitudes("reference_force") if "reference_force" in names else None
    return ForcePoint(sine, sine.amplitudes("force"), reference, *_acceleration(sine, rig))


def _acceleration(sine: SteadySine, rig: Rig) -> tuple[np.ndarray | None, str, float]:
    """Acceleration: recorded, else from the position, else by the model from the pressures on the moving mass."""
    names, w = sine.record.names, 2 * np.pi * sine.f
    if "acceleration" in names:
        return sine.amplitudes("acceleration"), "accelerometer", 0.0
    if "position" in names:
        return -(w**2) * sine.amplitudes("position"), "position, twice differentiated", 0.0
    if {"pa", "pb"} <= set(names):
        push = rig.areas[0] * sine.amplitudes("pa") - rig.areas[1] * sine.amplitudes("pb") - sine.amplitudes("force")
        return push / (rig["M"] + rig["b"] / (1j * w)), "pressures, by the model's mass", _share(rig, "M")
    return None, "", 0.0


def _share(rig: Rig, name: str) -> float:
    """A number's deviation as a share: its bounds as a uniform spread."""
    number = rig.numbers[name]
    if number.low is None or number.high is None:
        return 0.0
    return (number.high - number.low) / np.sqrt(12) / number.value


def referenced_mass(points: Sequence[ForcePoint], span: Estimate | None) -> tuple[Estimate, float] | None:
    """The mass [kg] between cell and specimen by sines beside a reference, and the span's error; None where they do
    not tell the two apart. `span`: what a static test says of the latter."""
    own = [point for point in points if point.reference is not None and point.acceleration is not None]
    frequencies = np.array(sorted({point.f for point in own}))
    told = 1 + int(np.sum(np.diff(np.log(frequencies)) > np.log(_APART))) if own else 0
    if not own or (told < _FREQUENCIES and span is None):
        return None
    known = np.array([span.value if span else 0.0, 0.0])
    loose = np.array([span.deviation if span else np.inf, np.inf])
    series = [_series(point) for point in own]
    fit = regress(series, known, loose, summed=False)
    spread = max(point.spread for point in own)
    mass = float(fit.coefficients[1])
    deviation = float(np.hypot(fit.deviation(np.array([0.0, 1.0])), spread * mass))
    return Estimate(mass, deviation, fit.freedom), float(fit.coefficients[0])


def _series(point: ForcePoint) -> Series:
    """Real and imaginary parts of what is indicated beyond the reference, over the reference and the acceleration.

    Weighed by the root of the rows of a group: sensor noise leaves so much less in the amplitude of a long one.
    """
    assert point.reference is not None
    assert point.acceleration is not None
    columns = np.column_stack((point.reference, point.acceleration))
    beyond = point.indicated - point.reference
    weight = np.sqrt((point.sine.last - point.sine.first) / beyond.size)
    parts = [weight * np.concatenate((np.real(values), np.imag(values))) for values in (beyond, columns)]
    return Series(*parts, group=beyond.size * 2)


def free_mass(records: Sequence[Record], rig: Rig) -> Estimate | None:
    """The mass [kg] that a cell moves with no specimen behind it, by the recorded acceleration; None without one."""
    own = [record for record in records if {"force", "acceleration"} <= set(record.names)]
    moving = [record for record in own if np.ptp(record.signals["command"]) > 0]
    if not moving:
        return None
    series = []
    for record in moving:
        a, group = record.signals["acceleration"], max(1, round(_GROUP / record.period))
        series.append(Series(record.signals["force"], np.column_stack((a, np.ones_like(a))), group))
    fit = regress(series, np.zeros(2), np.full(2, np.inf), summed=False)
    noise = rig.sensors["acceleration"].noise if "acceleration" in rig.sensors else 0.0
    seen = np.mean([float(np.var(record.signals["acceleration"])) for record in moving])
    weakened = max(1e-3, 1 - noise**2 / float(seen))  # noise of what it goes by flattens a line
    return Estimate(fit.coefficients[0] / weakened, fit.deviation(np.array([1.0, 0.0])) / weakened, fit.freedom)


def check_reference(points: Sequence[ForcePoint], mass: Estimate | None, span: float, within: float) -> None:
    """Raises InputError where the reference lags the force at it by so much that it loses `within` of its range.

    A first-order lag that turns the phase by p has the gain cos p.
    """
    for point in points:
        if point.reference is None:
            continue
        expected = point.indicated / (1 + span)
        if mass is not None and point.acceleration is not None:
            expected = (point.indicated - mass.value * point.acceleration) / (1 + span)
        turn = -float(np.angle(np.mean(point.reference) / np.mean(expected)))
        if turn > np.arccos(1 - within):
            lost, corner = 100 * (1 - np.cos(turn)), point.f / np.tan(min(turn, 1.5))
            raise InputError(
                f"{point.sine.where}: the reference cell is {np.degrees(turn):.2g} deg behind, as of "
                f"{corner:.3g} Hz, and loses {lost:.2g} %; it is slower than the rig: take a faster one"
            )
