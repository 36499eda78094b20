"""What a laboratory plays for a sheet: a valve's test on its bench, in the manner of ISO 10770-1; what is missing."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...records.excitation import Excitation
from ...rigs.rig import Rig
from .bench import ABOUT_NULL, CYCLE, CYCLES, FINE, HIGHEST, LASTS, ROUNDS, SLOW, steps, triangle
from .dynamics import SINES, STEPS
from .row import Row

_CURVE = ("main_flow", "flow_gain_extending", "flow_gain_retracting", "symmetry", "linearity", "lap", "hysteresis")
VALVE_TELLS = {
    "valve-flow": _CURVE,
    "valve-flow-null": ("flow_gain_null", "null_bias", "threshold"),
    "valve-pressure": ("pressure_gain", "leakage"),
    **{f"valve-step-{size}": (f"step_{size}",) for size in STEPS},
    **{f"valve-sine-{size}": (f"main_{size}",) for size in SINES},
}
"""Records that a valve's sheet is made of, and the lines of each; valve-pressure with the load ports blocked."""
FORCE_TELLS = {
    "force-static": ("static_error", "repeatability", "hysteresis", "zero"),
    **{f"force-sine-{size}": ("dynamic_error", "compensated_error", "band", "mass") for size in (10, 30)},
    "force-free": ("mass", "compensation_noise"),
}
"""The same of a load cell's sheet; force-free moves without a specimen, and records the acceleration."""
LOWEST, POINTS, SAMPLES = 5.0, 24, 5.0  # Hz; frequencies of a record; samples a cycle at least
_REST = 0.3  # s between two sines


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


def missing_records(rows: Sequence[Row], tells: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """Records that would tell lines of a sheet which have no value, and those lines."""
    unsaid = [row.id for row in rows if row.value is None]
    told = {
        record: [id for id in unsaid if any(id == line or id.startswith(f"{line}_") for line in lines)]
        for record, lines in tells.items()
    }
    return {record: lines for record, lines in told.items() if lines}


def _sines(size: float, period: float) -> np.ndarray:
    parts = [np.zeros(round(_REST / period))]
    for f in np.geomspace(LOWEST, min(HIGHEST, 1 / (SAMPLES * period)), POINTS).tolist():
        cycles = np.ceil(max(ROUNDS, LASTS * f))
        t = np.arange(round(cycles / f / period)) * period
        parts += [size * np.sin(2 * np.pi * f * t), np.zeros(round(_REST / period))]
    return np.concatenate(parts)
