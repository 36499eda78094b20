"""Free runs of the held-out records, effect by effect: the fitted rig alone, then with one more of what was added."""

from dataclasses import dataclass
from typing import Any

from ..fit.predict import Prediction, predictions
from ..trace.findings import Trace
from ..trace.refit import FittedModel, heldout_errors
from .errors import rms_of

ALONE = "fitted rig alone"


@dataclass(frozen=True)
class AddedEffect:
    """What was `added` last, and the RMS error [signal's unit] of all held-out records, by signal."""

    added: str
    rms: dict[str, float | None]

    def json(self) -> dict[str, Any]:
        """The effect's entry in metrics.json."""
        return {"added": self.added, "rms": self.rms}


def steps(trace: Trace) -> list[AddedEffect]:
    """One step for the rig alone and one for each effect that was added; none where records are not run through."""
    if not (trace.problem.free_run and trace.effects):
        return []
    models = [trace.base, *(fit.refitted for fit in trace.effects)]
    names = [ALONE, *(fit.candidate.effect.title for fit in trace.effects)]
    return [AddedEffect(name, _rms(trace, model)) for name, model in zip(names, models, strict=True)]


def _rms(trace: Trace, model_fit: FittedModel) -> dict[str, float | None]:
    own = _predicted(trace, model_fit)
    return {label: row["after"] for label, row in rms_of(trace.problem.floor, own, own).items()}


def _predicted(trace: Trace, model_fit: FittedModel) -> list[Prediction]:
    errors = heldout_errors(trace.problem, model_fit)
    return predictions(model_fit.model, trace.problem.heldout, errors.x0, model_fit.fit.p)
