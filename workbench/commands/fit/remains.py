"""What a fitted closed loop leaves of its held-out records in one run: how much drifts, how fast the rest is, and
whether it goes with the load."""

from typing import Any

import numpy as np

from ...base.signals import SIGNALS
from ...base.units import from_si
from ...identify.fit.predict import predict_whole
from ...identify.fit.servo import PUSHES
from ...identify.trace.problem import EstimationProblem
from ...plant import build
from ...rigs.rig import Rig

_SLOW = 0.1  # Hz, below which an error is a drift
_LOST = 0.1  # of a record that cannot be compared, from which on nothing is told of it
_LITTLE = 0.2  # of the noise: a rest that is no more has no frequency


def remains(problem: EstimationProblem, found: Rig) -> dict[str, Any]:
    """`remains`, of a rig with an inner loop whose controlled signal is compared; nothing of others, or where a record
    cannot be run through.

    RMS over the held-out records in the unit that people read: what is `left` in a free run, and what of it is a
    `drift` slower than 0.1 Hz. `below_hz`: below it lies half of the power of the rest, white noise taken out;
    `with_load`: the share of the rest that goes with the measured load and its rate, None without one.
    """
    loop = problem.rig.inner
    if loop is None or loop.controls not in problem.heldout.names:
        return {}
    name, plant, sums, powers = loop.controls, build(found), np.zeros(4), list[tuple[np.ndarray, np.ndarray]]()
    loaded = any(PUSHES in record.signals for record in problem.heldout.records)
    for record in problem.heldout.records:
        error = predict_whole(plant, record, problem.floor).error(name)
        if np.isnan(error).mean() > _LOST:
            return {}
        error = np.interp(record.t, record.t[~np.isnan(error)], error[~np.isnan(error)])
        spectrum, f = np.fft.rfft(error), np.fft.rfftfreq(error.size, record.period)
        drift = np.fft.irfft(np.where(f < _SLOW, spectrum, 0.0), error.size)
        rest = error - drift
        sums += [error.size, error @ error, drift @ drift, _with_load(rest, record.signals.get(PUSHES))]
        powers.append((f, np.abs(spectrum) ** 2 / error.size))
    count, left, slow, shared = sums
    unit, si = SIGNALS[name].unit, SIGNALS[name].si
    shown = [float(from_si(np.sqrt(value / count), unit, si)) for value in (left, slow)]
    return {
        "remains": {
            "signal": name,
            "unit": unit,
            "left": shown[0],
            "drift": shown[1],
            "below_hz": _below(powers, problem.floor.sigma[name]),
            "with_load": float(shared / max(left - slow, 1e-300)) if loaded else None,
        }
    }


def remains_sentence(of: dict[str, Any]) -> str:
    """What remains in words."""
    load = "" if of["with_load"] is None else f", and {100 * of['with_load']:.0f} % of it goes with the measured load"
    fast = "" if of["below_hz"] is None else f"; half of the rest lies below {of['below_hz']:.2g} Hz{load}"
    return (
        f" In one run through the held-out records {of['left']:.3g} {of['unit']} is left, of which "
        f"{of['drift']:.3g} drifts slower than {_SLOW:g} Hz{fast}."
    )


def _with_load(rest: np.ndarray, load: np.ndarray | None) -> float:
    """Squares of an error [n] that a load [n] and its rate explain."""
    if load is None or not np.ptp(load):
        return 0.0
    columns = np.column_stack((load, np.gradient(load)))
    basis = np.linalg.svd(columns - columns.mean(axis=0), full_matrices=False)[0]
    return float(np.sum((basis.T @ rest) ** 2))


def _below(powers: list[tuple[np.ndarray, np.ndarray]], sigma: float) -> float | None:
    """The frequency [Hz] below which half of the power beyond drift and white noise lies; None where there is none."""
    f, power = (np.concatenate(parts) for parts in zip(*powers, strict=True))
    order = np.argsort(f)
    beyond = np.where(f >= _SLOW, power - sigma**2, 0.0)[order]
    whole = np.cumsum(beyond)
    if whole[-1] <= _LITTLE * sigma**2 * f.size:
        return None
    return float(f[order][np.argmax(whole >= 0.5 * whole[-1])])
