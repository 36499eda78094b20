from .findings import CandidateFit as CandidateFit, Pass as Pass, Trace as Trace
from .localise import Evidence as Evidence, LinearTimeVaryingModel as LinearTimeVaryingModel
from .locate import FaultLocation as FaultLocation, locate_fault as locate_fault
from .problem import EstimationProblem as EstimationProblem, estimation_problem as estimation_problem
from .refit import (
    FittedModel as FittedModel,
    HeldoutErrors as HeldoutErrors,
    fit_rig as fit_rig,
    heldout_errors as heldout_errors,
)
from .rule import Judgement as Judgement
from .shape import Shape as Shape
from .tracer import trace as trace
