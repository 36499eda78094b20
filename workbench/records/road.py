"""Random roads: profiles with the spectrum of ISO 8608, as a wheel meets them at a steady speed."""

import numpy as np

from ..base.errors import InputError, nearest

CLASSES = dict(zip("ABCDEFGH", 16e-6 * 4.0 ** np.arange(8), strict=True))
"""Displacement PSD [m^3] at 0.1 cycles/m, the geometric mean of each class (ISO 8608:2016, table C.1)."""
_REFERENCE = 0.1  # cycles/m; the PSD falls as the square of the spatial frequency
_MOST_SAMPLES = 10_000_000
_FINE = 100.0  # samples in a cycle of the highest frequency


def road(
    kind: str, speed: float, seconds: float, band: tuple[float, float], seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Times [k] s and heights [k] m of a road of a class "A" to "H" at a speed [m/s], between two frequencies [Hz].

    A sum of sines of random phase at whole multiples of 1/seconds: its PSD is that of the class at every line. Raises
    InputError for an unknown class, and for a band without a line.
    """
    if kind not in CLASSES:
        raise InputError(f'no road of class "{kind}"; {nearest(kind, CLASSES)}')
    if seconds * band[1] * _FINE > _MOST_SAMPLES:
        raise InputError(
            f"{seconds:g} s up to {band[1]:g} Hz is more than can be computed; shorten it or lower the band"
        )
    lines = np.arange(np.ceil(band[0] * seconds - 1e-9), np.floor(band[1] * seconds + 1e-9) + 1)
    if not 0 < band[0] < band[1] or not len(lines):
        raise InputError(f"band {band[0]:g} to {band[1]:g} Hz: must rise from above 0, and hold 1/{seconds:g} s")
    f = lines / seconds
    density = CLASSES[kind] * _REFERENCE**2 * speed / f**2  # m^2/Hz
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(f))
    count = int(np.ceil(seconds * band[1] * _FINE))
    spectrum = np.zeros(count // 2 + 1, complex)
    spectrum[lines.astype(int)] = np.sqrt(2 * density / seconds) * np.exp(1j * phase)
    heights = np.fft.irfft(spectrum, count) * count / 2
    return np.arange(count + 1) * (seconds / count), np.append(heights, heights[0])
