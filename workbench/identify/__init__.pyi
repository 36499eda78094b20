from .data import (
    NoiseFloor as NoiseFloor,
    Whiteness as Whiteness,
    measured_response as measured_response,
    noise_floor as noise_floor,
    whiteness as whiteness,
)
from .fit.predict import Prediction as Prediction, predict_free as predict_free, predict_windows as predict_windows
from .fit.repeats import FreeRunComparison as FreeRunComparison, against_mean as against_mean
from .trace.findings import CandidateFit as CandidateFit, Trace as Trace
from .trace.problem import EstimationProblem as EstimationProblem, estimation_problem as estimation_problem
from .trace.refit import FittedModel as FittedModel, fit_rig as fit_rig
