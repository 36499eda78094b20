"""How much of what a closed loop does is the loop, its load, and noise."""

from dataclasses import replace
from typing import Any

import numpy as np

from ...base.numbers import finite
from ...base.signals import SIGNALS
from ...base.units import from_si
from ...identify.fit.servo import PUSHES
from ...identify.trace.problem import EstimationProblem
from ...identify.trace.refit import FittedModel
from ...records import Record


def shares(problem: EstimationProblem, found: FittedModel, x0: np.ndarray) -> dict[str, Any]:
    """`shares`, of a rig with an inner loop whose controlled signal is compared; nothing of others.

    RMS over the held-out windows, in the unit that people read: how far what is controlled `moves` about its mean, what
    is `left` of it, the `noise`, and what of it the measured load makes (None without one, and of windows that cannot
    be simulated). x0 [windows, n] are the fitted initial states.
    """
    loop, windows = problem.rig.inner, problem.heldout
    if loop is None or loop.controls not in windows.names:
        return {}
    name, signal = loop.controls, SIGNALS[loop.controls]
    column = windows.names.index(name)
    compared = np.concatenate([group.weight[..., column].ravel() > 0 for group in windows.groups])
    measured = np.concatenate([group.measured[..., column].ravel() for group in windows.groups])[compared]
    free = replace(windows, records=tuple(_unloaded(record) for record in windows.records))
    both = [found.model.predict(each, x0, found.fit.p) for each in (windows, free)]
    predicted, alone = (np.concatenate([part[..., column].ravel() for part in parts])[compared] for parts in both)
    loaded = any(PUSHES in record.signals for record in windows.records)
    sizes = {
        "moves": measured - measured.mean(),
        "left": predicted - measured,
        "load": predicted - alone if loaded else None,
    }
    rms = {key: None if values is None else finite(np.sqrt(np.mean(values**2))) for key, values in sizes.items()}
    rms["noise"] = problem.floor.sigma[name]
    shown = {key: None if size is None else float(from_si(size, signal.unit, signal.si)) for key, size in rms.items()}
    return {"shares": {"signal": name, "unit": signal.unit, **shown}}


def shares_sentence(of: dict[str, Any]) -> str:
    """The shares in words."""
    if of["left"] is None:
        return ""
    load = "" if of["load"] is None else f", {of['load']:.3g} of it by what was measured to push at it"
    return (
        f" {of['signal'].capitalize()} moves by {of['moves']:.3g} {of['unit']} RMS as the loop is asked{load}; "
        f"{of['left']:.3g} is left, of which the noise is {of['noise']:.3g}."
    )


def _unloaded(record: Record) -> Record:
    return replace(record, signals={k: 0 * v if k == PUSHES else v for k, v in record.signals.items()})
