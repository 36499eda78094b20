"""What the sensors of a drawn campaign add to the truth, and what the road from the bench does to its files."""

import gzip
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.signal import lfilter

from workbench.base.signals import SIGNALS
from workbench.base.units import from_si
from workbench.loop.sensors import Disturbance
from workbench.rigs.rig import Rig

Noise = Literal["white", "tripled", "coloured"]
SCALE = (0.8, 1.25)  # of the noise that the rig file declares
WHITE, SLOW, HUM = 0.75, 0.55, 0.36  # of sigma: their squares sum to 1
MEMORY = 0.9  # of the slow part, from one sample to the next
MAINS = 50.0  # Hz
COARSE = 4.0  # of the sensor's resolution, where noise is coloured
BLEMISHES = ("nan", "drop", "units", "order", "extra")
MISSING, DROPPED = 0.002, 2  # of the cells; rows a record
OTHER_UNITS = {"pa": "psi", "pb": "psi", "spool": "um", "position": "m", "current": "A", "supply": "MPa"}


def sigmas(rig: Rig, kind: Noise, seed: np.random.Generator, readings: int = 1) -> dict[str, float]:
    """Standard deviation [SI] of the noise of every sensor, of which a row is the mean of `readings`.

    In such a mean a counter's noise is its rounding.
    """
    size = 3.0 if kind == "tripled" else 1.0
    drawn = {name: size * sensor.noise * float(seed.uniform(*SCALE)) for name, sensor in rig.sensors.items()}
    if readings == 1:
        return drawn
    mean = float(np.sqrt(readings))
    return {name: rig.sensors[name].noise if counts(rig, name) else sigma / mean for name, sigma in drawn.items()}


def counts(rig: Rig, name: str) -> bool:
    """Whether a sensor counts steps that are larger than its noise."""
    return rig.sensors[name].resolution > rig.sensors[name].noise


def noise(rows: int, period: float, kind: Noise, seed: np.random.Generator) -> np.ndarray:
    """Noise [rows] of variance 1: white, or a white part, a slow one of first order, and mains hum."""
    white = seed.standard_normal(rows)
    if kind != "coloured":
        return white
    drive = np.sqrt(1 - MEMORY**2) * seed.standard_normal(rows)
    drive[0] /= np.sqrt(1 - MEMORY**2)
    slow = np.asarray(lfilter([1.0], [1.0, -MEMORY], drive))
    hum = np.sqrt(2) * np.sin(2 * np.pi * MAINS * period * np.arange(rows) + seed.uniform(0, 2 * np.pi))
    return WHITE * white + SLOW * slow + HUM * hum


def quantised(values: np.ndarray, rig: Rig, name: str, kind: Noise) -> np.ndarray:
    """The values [n] to the resolution that the sensor has."""
    step = rig.sensors[name].resolution * (COARSE if kind == "coloured" else 1.0)
    return Disturbance(0.0, step).in_steps(values)


def write(path: Path, signals: Mapping[str, np.ndarray], blemish: Sequence[str], seed: np.random.Generator) -> None:
    """Write a record [n] SI by signal as .csv.gz, with the blemishes that were drawn for it."""
    units = OTHER_UNITS if "units" in blemish else {}
    columns = {}
    for name, values in signals.items():
        signal = SIGNALS[name]
        unit = units.get(name, signal.unit)
        columns[f"{name} [{unit}]"] = from_si(values, unit, signal.si)
    rows = len(signals["t"])
    if "nan" in blemish:
        for label in [label for label in columns if label.split()[0] not in ("t", "command", "reference")]:
            columns[label] = np.where(seed.random(rows) < MISSING, np.nan, columns[label])
    if "extra" in blemish:
        columns["oil temperature [degC]"] = 41 + 0.05 * seed.standard_normal(rows)
    labels = list(seed.permutation(list(columns))) if "order" in blemish else list(columns)
    logged = np.ones(rows, dtype=bool)
    if "drop" in blemish:
        logged[seed.integers(1, rows - 1, DROPPED)] = False
    table = [["" if np.isnan(v) else f"{v:.8g}" for v in columns[label][logged].tolist()] for label in labels]
    lines = [",".join(labels), *(",".join(cells) for cells in zip(*table, strict=True)), ""]
    path.write_bytes(gzip.compress("\n".join(lines).encode(), compresslevel=4, mtime=0))
