"""What parts of free runs say of fits that are made again without them: the rotation without its linearisation.

Rotation (fit/rotation.py) takes a fit for linear in its numbers as far as a left-out part moves them. A rich model that
follows a run by chance is not: before one is taken, it is fitted again without each part.
"""

import numpy as np

from ..fit.solver import fit_numbers
from ..fit.windows import BLOCKS, row_blocks
from .problem import EstimationProblem
from .refit import FittedModel


def left_out_squares(problem: EstimationProblem, model_fit: FittedModel) -> np.ndarray:
    """The squared errors [BLOCKS] of each part of the free runs with numbers fitted to the other parts; infinite where
    a run failed."""
    model, fit, train = model_fit.model, model_fit.fit, problem.train
    guess = model.starts(train, fit.p)
    squares = np.empty(BLOCKS)
    for block in range(BLOCKS):
        again = fit_numbers(model, train.without_rows(block), fit.free, fit.x, fit.p, guess, problem.kappas)
        errors = model.errors(train, again.x0, again.p)
        squares[block] = sum(float(np.sum(e[:, row_blocks(e.shape[1]) == block] ** 2)) for e in errors)
    return squares
