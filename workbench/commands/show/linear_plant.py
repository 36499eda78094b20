"""What follows from the numbers of a linear plant."""

from typing import Any

import numpy as np

from ...base.units import from_si
from ...rigs.linear_rig import LinearRig

_NEAR = 1e-6  # of the largest pole: a smaller one is an integrator


def plant_rows(rig: LinearRig) -> list[dict[str, Any]]:
    """Integrators, the other poles with frequency and damping, the gain from full command to the lowest derivative of
    the position that it moves for good, and the delay; rows of name, value, unit and how it was found."""
    a, b, c, _ = rig.state_matrices()
    poles = np.linalg.eigvals(a)
    slow = np.abs(poles) <= _NEAR * np.abs(poles).max(initial=1.0)
    rows = [("integrators", float(slow.sum()), "1", "poles at 0")]
    for pole in sorted(poles[~slow & (np.imag(poles) >= 0)], key=abs):
        word = "mode" if pole.imag else "pole"
        unstable = ", unstable" if pole.real > 0 else ""
        rows.append((f"{word}{unstable}", float(abs(pole) / (2 * np.pi)), "Hz", "of the model"))
        if pole.imag:
            rows.append(("its damping", float(-pole.real / abs(pole)), "1", "of the model"))
    gain, rates = _gain(a, b, c, int(slow.sum())), ("", "/s", "/s^2")
    if slow.sum() < len(rates):
        signal, rate = rig.signal("position"), rates[slow.sum()]
        shown = float(from_si(gain, signal.unit + rate, signal.si + rate))
        rows.append(("gain at full command", shown, signal.unit + rate, "the model at low frequency"))
    rows.append(("delay", rig.delay.value * 1e3, "ms", "of the command, without the computing delay"))
    if rig.fit is not None:
        rows.append(("error of the fit", 100 * rig.fit.error, "%", "rms over the sheet"))
    return [dict(zip(("name", "value", "unit", "how"), row, strict=True)) for row in rows]


def _gain(a: np.ndarray, b: np.ndarray, c: np.ndarray, integrators: int) -> float:
    """s^integrators G(s) well below the slowest other pole."""
    poles = np.abs(np.linalg.eigvals(a))
    s = 1e-4j * min((pole for pole in poles if pole > _NEAR * poles.max()), default=1.0)
    return float(np.real((c[0] @ np.linalg.solve(s * np.eye(len(a)) - a, b))[0] * s**integrators))
