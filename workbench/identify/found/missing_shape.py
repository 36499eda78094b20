"""What an unknown effect looks like: the missing force, flow or drive, and the signal that it goes with."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from ...base.checkpoint import Progress, Stage
from ...base.signals import SIGNALS
from ...base.units import from_si
from ...plant.probes import probes
from ..fit.model import Model
from ..fit.windows import Windows
from ..trace.findings import Trace
from ..trace.localise import Evidence, LinearTimeVaryingModel, clear_evidence, likely_equations, localise, smoothed
from ..trace.locate import locate_fault, opened, worst
from ..trace.problem import EstimationProblem
from ..trace.refit import FittedModel, HeldoutErrors
from ..trace.shape import shape

DRAWN = 1000  # points of a disturbance
_HIDDEN = ("flapper", "lowest_pressure")
_DISPLAY_UNITS = {"m^3/s": "l/min", "Pa": "bar", "A": "mA", "N": "N", "1": "1"}
_MEANING = {
    ("drive", "current"): "pilot current",
    ("drive", "command"): "command",
    ("pilot", "current"): "current that makes torque",
    ("main", "force"): "force on the main spool",
    ("flow", "into_a"): "flow into chamber A",
    ("flow", "into_b"): "flow into chamber B",
    ("flow", "supply"): "supply pressure",
    ("force", "force"): "force on the load",
    ("force", "piston"): "force on the piston",
}
_SENSED = ("offset", "gain", "lag")


@dataclass(frozen=True)
class UnexplainedDisturbance:
    """What a model lacks in one equation, in the units that people read.

    `explained` are cross-validated R2 of a curve through each signal. `points`
    and `curve` [k, 2] are the disturbance over the signal that explains most. `partner` is another input of the same
    equation and its correlation. `sensors` are offset, gain and lag of each pressure sensor where those are off.
    `rivals` are equations whose evidence is not clearly behind, where the equation was sought here.
    """

    equation: str
    name: str = ""
    unit: str = ""
    signal: str = ""
    explained: list[list[Any]] | None = None
    points: np.ndarray | None = None
    curve: np.ndarray | None = None
    line: float | None = None
    partner: list[Any] | None = None
    sensors: list[list[Any]] | None = None
    rivals: Sequence[str] = ()


def missing_shape(trace: Trace, stage: Stage, progress: Progress) -> UnexplainedDisturbance | None:
    """What an unknown looks like before anything was learned of it, or what is left after all; None where nothing is.

    What is left beside a named effect may sit in another equation. None, too, where no likelihood tells the equation.
    """
    if trace.verdict == "unknown":
        of = trace.named, trace.heldout[1], trace.equation
    elif trace.verdict == "incomplete" and not (trace.learned and trace.at_floor):
        of = trace.final, trace.heldout[-1], None
    else:
        return None
    return unexplained_disturbance(trace.problem, *of, stage, progress)


def unexplained_disturbance(
    problem: EstimationProblem,
    model_fit: FittedModel,
    heldout: HeldoutErrors,
    equation: str | None,
    stage: Stage,
    progress: Progress,
) -> UnexplainedDisturbance | None:
    """The shape of what a fit leaves unexplained in an equation, which is sought where none is given; None where none
    is found.

    It is taken from the windows with the largest errors: see `worst`.
    """

    def compute() -> dict[str, Any]:
        progress("shape of what is missing")
        missing = [equation] if equation else _sought(problem, model_fit, heldout)
        if not missing:
            return {}
        found = _missing(problem, model_fit, *worst(problem, model_fit, heldout), missing[0])
        return asdict(replace(found, rivals=missing[1:]))

    stored = stage("shape", compute)
    return UnexplainedDisturbance(**stored) if stored else None


def _sought(problem: EstimationProblem, model_fit: FittedModel, heldout: HeldoutErrors) -> list[str]:
    """The equation that lacks something, and those not clearly behind; none where nothing is told."""
    place = locate_fault(problem, model_fit, heldout)
    if not any(gain > 0 for _, gain in place.evidence):
        return []
    clear = clear_evidence(place.evidence, problem.kappa)
    return likely_equations(place.evidence, place.parity_residuals, clear)


def _missing(
    problem: EstimationProblem, model_fit: FittedModel, windows: Windows, x0: np.ndarray, equation: str
) -> UnexplainedDisturbance:
    period = problem.train.records[0].period
    groups = opened(problem, model_fit, windows, x0)[equation]
    (best,) = localise({equation: groups}, period)
    smooth = [smoothed(*each, period, best.time) for each in zip(groups, _by_group(groups, best), strict=True)]
    rows = min(part.shape[1] for part in smooth)
    disturbance = np.concatenate([part[:, :rows] for part in smooth])
    if equation == "sensor":
        return UnexplainedDisturbance("sensor", sensors=_sensors(disturbance, problem.train.names, period))
    signals = _signals(model_fit, windows, x0, rows, period)
    moving = {name: value for name, value in signals.items() if np.isfinite(value).all() and np.ptp(value) > 0}
    return _shaped(problem, best, disturbance, moving)


def _shaped(
    problem: EstimationProblem, best: Evidence, disturbance: np.ndarray, signals: Mapping[str, np.ndarray]
) -> UnexplainedDisturbance:
    (probe,) = (probe for probe in probes(problem.rig) if probe.equation == best.equation)
    order = np.argsort(-np.mean(disturbance**2, axis=(0, 1))).tolist()
    variable = probe.inputs[order[0]]
    unit = str(_DISPLAY_UNITS.get(variable.unit, variable.unit))
    values = from_si(disturbance[..., order[0]] * variable.scale, unit, variable.unit)
    disturbance_shape = shape(variable.name, unit, values, signals, problem.train.records[0].period)
    partner = None
    if len(order) > 1:
        other = disturbance[..., order[1]]
        rho = float(np.corrcoef(values.ravel(), other.ravel())[0, 1])
        partner = [_MEANING[best.equation, probe.inputs[order[1]].name], rho]
    label = disturbance_shape.explained[0][0]
    keep = np.unique(np.linspace(0, disturbance_shape.signal.size - 1, DRAWN).astype(int))
    return UnexplainedDisturbance(
        best.equation,
        _MEANING[best.equation, variable.name],
        unit,
        label,
        [[name, value] for name, value in disturbance_shape.explained],
        np.column_stack((disturbance_shape.signal, disturbance_shape.disturbance))[keep],
        disturbance_shape.curve,
        disturbance_shape.line,
        partner,
    )


def _by_group(parts: list[LinearTimeVaryingModel], best: Evidence) -> list[np.ndarray]:
    """The amplitudes of each group's windows."""
    ends = np.cumsum([len(part.e) for part in parts])[:-1]
    return np.split(best.amplitudes, ends)


def _signals(
    model_fit: FittedModel, windows: Windows, x0: np.ndarray, rows: int, period: float
) -> dict[str, np.ndarray]:
    """The signals of the fitted model [windows, rows] by label, in the units that people read: they have no noise."""
    plant = model_fit.model.plant
    names = [name for name in plant.outputs if name not in _HIDDEN]
    parts = Model(plant, names, sessions=model_fit.model.sessions).predict(windows, x0, model_fit.fit.p)
    values = np.concatenate([part[:, :rows] for part in parts])
    signals = {"command [1]": np.concatenate([windows.commands(group).mean[:, :rows] for group in windows.groups])}
    for column, name in enumerate(names):
        signal = SIGNALS[name]
        signals[signal.label] = from_si(values[..., column], signal.unit, signal.si)
    if "spool" in names:
        signals["spool speed [mm/s]"] = np.gradient(signals["spool [mm]"], period, axis=1)
    return signals


def _sensors(disturbance: np.ndarray, compared: Sequence[str], period: float) -> list[list[Any]]:
    """Offset [bar], gain [%] and lag [ms] of each pressure sensor, from the bases that the evidence is made with."""
    mean = disturbance.mean(axis=(0, 1))
    names = [name for name in ("pa", "pb") if name in compared]
    rows = mean.reshape(len(names), len(_SENSED))
    return [
        [name, float(offset), float(gain), float(-lag * period * 1e3)]
        for name, (offset, gain, lag) in zip(names, rows, strict=True)
    ]
