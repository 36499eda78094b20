"""Excitations: steps, ramps, triangles, chirps and multisines, and the files that a drive plays them from.

A wave is one period on the grid of a control period: [n] samples, its peak at `amplitude`, of zero mean over the period
(a jack integrates its command), 0 at its first sample and 0 again where the next period begins.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from ..base.errors import InputError
from ..base.signals import SIGNALS
from .frequency_sheet import Columns, table_text
from .read import record_name

Spacing = Literal["linear", "log"]
Spectrum = Literal["flat", "1/f"]
LEVELS = (1.0, -1.0, 0.5, -0.5, 0.2, -0.2)  # of the amplitude, in turn: small moves show what friction and laps do
FEWEST_ROWS, MOST_ROWS = 20, 1_000_000
_CLIPPINGS = 1000  # about 0.1 s of work
_CLIP = (0.7, 0.97)  # of the peak: first and last level
_OVERSAMPLE = 8  # of the highest line, where peaks are looked for
_EVEN = 0.01  # of a period: how far the time stamps of a file may be off


@dataclass(frozen=True, eq=False)
class Excitation:
    """What a drive plays, one sample a control `period` [s].

    reference [n] m, as the position sensor reads, is what the position loop follows; command [n], -1..1, is added to
    what that loop commands: open loop, an integrating jack would drift away.
    """

    name: str
    period: float
    reference: np.ndarray
    command: np.ndarray

    @property
    def t(self) -> np.ndarray:
        """Time [n] s."""
        return np.arange(len(self.reference)) * self.period

    def scaled(self, factor: float) -> "Excitation":
        """This excitation at another size, about the reference that it begins with."""
        start = self.reference[0]
        return replace(self, reference=start + factor * (self.reference - start), command=factor * self.command)


def steps(amplitude: float, seconds: float, period: float) -> np.ndarray:
    """Steps to LEVELS and back to 0, each held for 1/8 of `seconds`."""
    rows = _rows(seconds, period)
    wave = np.zeros(rows)
    slot = rows // (len(LEVELS) + 2)
    for index, level in enumerate(LEVELS, 1):
        wave[index * slot : (index + 1) * slot] = amplitude * level
    return wave


def ramps(amplitude: float, seconds: float, period: float) -> np.ndarray:
    """Ramps to the levels of `steps`, each as long as the level is then held."""
    rows = _rows(seconds, period)
    knots = np.concatenate(([0.0], np.repeat(LEVELS, 2), [0.0]))
    slot = rows // (len(knots) - 1)
    return amplitude * np.interp(np.arange(rows), slot * np.arange(len(knots)), knots)


def triangle(amplitude: float, seconds: float, period: float) -> np.ndarray:
    """One triangle: up, down through 0, and back."""
    rows = _rows(seconds, period)
    return _at_peak(np.interp(4 * np.arange(rows) / rows, [0, 1, 3, 4], [0.0, 1.0, -1.0, 0.0]), amplitude)


def chirp(
    amplitude: float, seconds: float, period: float, band: tuple[float, float], spacing: Spacing = "log"
) -> np.ndarray:
    """A sine that sweeps the band [Hz] once, linearly or logarithmically in time, in whole cycles.

    The band moves by less than half a cycle over `seconds` for that; a slow bump takes off what mean is left.
    """
    rows = _rows(seconds, period)
    low, high = _checked(band, seconds, period)
    part = np.arange(rows) / rows
    rate = np.log(high / low)
    cycles = part * (low + (high - low) * part / 2) if spacing == "linear" else low * np.expm1(rate * part) / rate
    total = (low + high) / 2 if spacing == "linear" else (high - low) / rate
    wave = np.sin(2 * np.pi * cycles * round(total * seconds) / total)
    bump = np.sin(np.pi * part) ** 2
    return _at_peak(wave - wave.mean() / bump.mean() * bump, amplitude)


@dataclass(frozen=True)
class MultisineSpec:
    """What measures a response: largest value, SI; band [Hz], seconds of a period, number of lines, falling as 1/f."""

    amplitude: float
    band: tuple[float, float]
    seconds: float
    lines: int


def multisine(
    amplitude: float,
    seconds: float,
    period: float,
    band: tuple[float, float],
    spectrum: Spectrum = "flat",
    lines: int | None = None,
) -> np.ndarray:
    """Cosines at harmonics of 1/seconds in the band [Hz], phases chosen for a low crest factor.

    lines: about how many harmonics, spread evenly over log f (few at low frequencies, where harmonics are sparse);
    None takes all. `spectrum`: the same amplitude for each, or one that falls as 1/f. Phases: Schroeder 1970, then
    clipping in rounds (Van der Ouderaa, Schoukens and Renneboog, IEEE Trans. Instrum. Meas. 37(1), 1988).
    """
    rows = _rows(seconds, period)
    harmonic = harmonics(band, seconds, period, lines)
    sizes = np.ones(len(harmonic)) if spectrum == "flat" else harmonic[0] / harmonic
    coefficients = _low_crest(harmonic, sizes)
    fine = _synthesis(harmonic, coefficients, _fine(harmonic))
    # begin where the wave rises through 0
    turn = 2 * np.pi * harmonic * _rising_zero(harmonic, coefficients, fine)
    wave = _synthesis(harmonic, coefficients * np.exp(1j * turn), rows)
    wave[0] = 0.0  # but for rounding
    return _at_peak(wave, amplitude)


def harmonics(band: tuple[float, float], seconds: float, period: float, lines: int | None = None) -> np.ndarray:
    """Whole numbers [k]: the harmonics of 1/seconds in the band [Hz] that a multisine takes."""
    low, high = _checked(band, seconds, period)
    first, last = int(np.ceil(low * seconds - 1e-9)), int(np.floor(high * seconds + 1e-9))
    if lines is not None and lines < 1:
        raise InputError(f"{lines} lines: a multisine needs at least 1")
    every = np.arange(first, last + 1)
    if lines is None or lines >= len(every):
        return every
    return np.unique(np.round(np.geomspace(first, last, lines)).astype(int))


def crest_factor(wave: np.ndarray) -> float:
    """Peak over RMS of a wave [n]."""
    return float(np.abs(wave).max() / np.sqrt(np.mean(wave**2)))


def excitation(name: str, signal: str, wave: np.ndarray, period: float, rest: float, repeat: int = 1) -> Excitation:
    """A wave played `repeat` times as the `signal` "command" [1] or "reference" [m] about `rest` [m], closed by 0."""
    whole = np.append(np.tile(wave, repeat), 0.0)
    still = np.zeros(len(whole))
    reference, command = (whole, still) if signal == "reference" else (still, whole)
    return Excitation(name, period, rest + reference, command)


def excitation_text(played: Excitation) -> str:
    """The file that a drive plays: `t [s],reference [mm],command [1]`, without a column in which nothing happens."""
    moving = {"reference": played.reference, "command": played.command}
    return table_text({"t": played.t} | {name: values for name, values in moving.items() if np.ptp(values) > 0})


def read_excitation(path: str | Path, period: float, rest: float) -> Excitation:
    """Read a file with `t [s]` and `reference [mm]`, `command [1]` or both, sampled at the control period [s].

    `rest` [m] is held where there is no reference. Raises InputError with file, row and column.
    """
    path = Path(path)
    table = Columns(path)
    t = table.values("t", "s")
    waves = {name: table.values(name, SIGNALS[name].si) for name in ("reference", "command") if name in table}
    if not waves:
        raise InputError(f'{path}: nothing to play; add a column "reference [mm]" or "command [1]"')
    if t.size < FEWEST_ROWS:
        raise InputError(f"{path}: {t.size} rows; an excitation needs at least {FEWEST_ROWS}")
    uneven = np.flatnonzero(np.abs(np.diff(t) - period) > _EVEN * period)
    if uneven.size:
        where = table.where(int(uneven[0]) + 1, "t")
        raise InputError(f"{where}: not {period * 1e3:g} ms after the row before, as the rig's control period asks")
    command = waves.get("command", np.zeros(t.size))
    large = np.flatnonzero(np.abs(command) > 1)
    if large.size:
        raise InputError(f"{table.where(int(large[0]), 'command')}: beyond -1..1; scale it down")
    return Excitation(record_name(path), period, waves.get("reference", np.full(t.size, rest)), command)


def _rows(seconds: float, period: float) -> int:
    rows = round(seconds / period) if np.isfinite(seconds) else 0
    if not FEWEST_ROWS <= rows <= MOST_ROWS:
        limits = f"{FEWEST_ROWS} to {MOST_ROWS} control periods of {period * 1e3:g} ms"
        raise InputError(f"{seconds:g} s: a wave takes {limits}")
    return rows


def _checked(band: tuple[float, float], seconds: float, period: float) -> tuple[float, float]:
    low, high = band
    if not 1 / seconds <= low * (1 + 1e-9) or not low < high or not high < 0.5 / period:
        limits = f"from 1/{seconds:g} s = {1 / seconds:g} Hz to below {0.5 / period:g} Hz, half the control rate"
        raise InputError(f"band {low:g} to {high:g} Hz: must rise, and lie {limits}")
    return low, high


def _at_peak(wave: np.ndarray, amplitude: float) -> np.ndarray:
    return wave * (amplitude / np.abs(wave).max())


def _fine(lines: np.ndarray) -> int:
    return int(2 ** np.ceil(np.log2(_OVERSAMPLE * lines[-1])))


def _synthesis(lines: np.ndarray, coefficients: np.ndarray, rows: int) -> np.ndarray:
    """sum |c| cos(2 pi line k / rows + arg c), k = 0 .. rows - 1."""
    spectrum = np.zeros(rows // 2 + 1, dtype=complex)
    spectrum[lines] = coefficients
    return np.fft.irfft(spectrum, rows) * rows / 2


def _low_crest(lines: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Complex coefficients [k] of these sizes: the lowest crest factor met while clipping ever less."""
    power = sizes**2 / np.sum(sizes**2)
    schroeder = -2 * np.pi * np.cumsum(np.concatenate(([0.0], np.cumsum(power)[:-1])))
    coefficients = best = sizes * np.exp(1j * schroeder)
    least = np.inf
    for share in np.linspace(*_CLIP, _CLIPPINGS):
        wave = _synthesis(lines, coefficients, _fine(lines))
        crest = crest_factor(wave)
        if crest < least:
            least, best = crest, coefficients
        level = share * np.abs(wave).max()
        coefficients = sizes * np.exp(1j * np.angle(np.fft.rfft(np.clip(wave, -level, level))[lines]))
    return best


def _rising_zero(lines: np.ndarray, coefficients: np.ndarray, fine: np.ndarray) -> float:
    """The part of the period at which the wave rises through 0, by interpolation, then Newton steps."""
    after = np.roll(fine, -1)
    k = int(np.flatnonzero((fine <= 0) & (after > 0))[0])
    part = (k + fine[k] / (fine[k] - after[k])) / len(fine)
    for _ in range(6):
        turned = coefficients * np.exp(2j * np.pi * lines * part)
        part += turned.real.sum() / (2 * np.pi * lines * turned.imag).sum()
    return part


SIMPLE: dict[str, Callable[[float, float, float], np.ndarray]] = {"steps": steps, "ramps": ramps, "triangle": triangle}
KINDS = (*SIMPLE, "chirp", "multisine")
