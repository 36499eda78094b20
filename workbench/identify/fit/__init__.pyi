from .determined import (
    Combination as Combination,
    Determination as Determination,
    FreeParameter as FreeParameter,
    determine as determine,
)
from .free_parameters import Candidate as Candidate, uncertain as uncertain
from .initial_states import fit_states as fit_states, predicted_states as predicted_states
from .model import Model as Model
from .predict import (
    Prediction as Prediction,
    predict_free as predict_free,
    predict_whole as predict_whole,
    predict_windows as predict_windows,
    predictions as predictions,
)
from .repeats import (
    FreeRunComparison as FreeRunComparison,
    against_mean as against_mean,
    mean_of as mean_of,
    repeated as repeated,
)
from .solver import Fit as Fit, fit_numbers as fit_numbers
from .unexplained import unexplained_signals as unexplained_signals
from .windows import Windows as Windows, cut_windows as cut_windows, delayed as delayed
