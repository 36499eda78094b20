"""The commands of a valve's test on its bench, in the manner of ISO 10770-1: what a laboratory plays for a sheet."""

import numpy as np

from ...records.excitation import Excitation
from ...rigs.rig import Rig
from .bench import ABOUT_NULL, CYCLE, CYCLES, FINE, HIGHEST, SLOW, steps, triangle
from .dynamics import SINES, STEPS

TESTS = (
    *("valve-flow", "valve-flow-null", "valve-pressure"),
    *(f"valve-step-{size}" for size in STEPS),
    *(f"valve-sine-{size}" for size in SINES),
)
"""Names of the records that a sheet is made of; valve-pressure with the load ports blocked."""
LOWEST, POINTS, SAMPLES = 5.0, 24, 5.0  # Hz; frequencies of a record; samples a cycle at least
_LASTS, _ROUNDS, _REST = 0.4, 24, 0.3  # s, and cycles, that a sine lasts at least; s between two


def bench_excitations(rig: Rig) -> dict[str, Excitation]:
    """Commands by record at a rig's control period; the jack is not there, and so its position is not asked for."""
    period = rig.period.value
    waves = {
        "valve-flow": triangle(1.0, CYCLE, CYCLES, period),
        "valve-flow-null": triangle(*FINE, CYCLES, period),
        "valve-pressure": triangle(ABOUT_NULL, SLOW, CYCLES, period),
    }
    waves |= {f"valve-step-{size}": steps(size / 100, period) for size in STEPS}
    waves |= {f"valve-sine-{size}": _sines(size / 100, period) for size in SINES}
    still = {name: np.full(wave.size, rig["xmid"]) for name, wave in waves.items()}
    return {name: Excitation(name, period, still[name], wave) for name, wave in waves.items()}


def missing_tests(names: list[str]) -> list[str]:
    """The records of a test that are not among those of these names."""
    return [test for test in TESTS if test not in names]


def _sines(size: float, period: float) -> np.ndarray:
    parts = [np.zeros(round(_REST / period))]
    for f in np.geomspace(LOWEST, min(HIGHEST, 1 / (SAMPLES * period)), POINTS).tolist():
        cycles = np.ceil(max(_ROUNDS, _LASTS * f))
        t = np.arange(round(cycles / f / period)) * period
        parts += [size * np.sin(2 * np.pi * f * t), np.zeros(round(_REST / period))]
    return np.concatenate(parts)
