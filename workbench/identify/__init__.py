"""What recordings say of a rig.

data        noise floor, whiteness, measured frequency response
fit         windows, models with their slopes, and the fit of a rig's numbers
trace       from a residual to the effect that the model lacks
datasheet   valves fitted to a maker's figures

    from workbench.identify import estimation_problem, fit_rig, noise_floor
    floor = noise_floor(load_campaign("experiments/sample"))      # sigma [SI] and kappa of every measured signal
    problem = estimation_problem(campaign, rig)                   # windows to fit, windows to judge by
    model_fit = fit_rig(problem)                                  # the rig's numbers that have bounds, fitted
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .data.frequency_response import measured_response
    from .data.noise_floor import NoiseFloor, noise_floor
    from .data.whiteness import Whiteness, whiteness
    from .fit.predict import Prediction, predict_free, predict_windows
    from .fit.repeats import FreeRunComparison, against_mean
    from .trace.findings import CandidateFit, Trace
    from .trace.refit import EstimationProblem, FittedModel, estimation_problem, fit_rig

_HOMES = {
    "data.frequency_response": ("measured_response",),
    "data.noise_floor": ("NoiseFloor", "noise_floor"),
    "data.whiteness": ("Whiteness", "whiteness"),
    "fit.predict": ("Prediction", "predict_free", "predict_windows"),
    "fit.repeats": ("FreeRunComparison", "against_mean"),
    "trace.findings": ("CandidateFit", "Trace"),
    "trace.refit": ("EstimationProblem", "FittedModel", "estimation_problem", "fit_rig"),
}

__all__ = [
    "CandidateFit",
    "EstimationProblem",
    "FittedModel",
    "FreeRunComparison",
    "NoiseFloor",
    "Prediction",
    "Trace",
    "Whiteness",
    "against_mean",
    "estimation_problem",
    "fit_rig",
    "measured_response",
    "noise_floor",
    "predict_free",
    "predict_windows",
    "whiteness",
]


def __getattr__(name: str) -> Any:
    """Load a name's module when it is first used: a noise floor need not wait for the plant."""
    for module, names in _HOMES.items():
        if name in names:
            return getattr(import_module(f".{module}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
