"""Covariance of fitted numbers that holds although the model is wrong: the widest of three.

A least squares fit has covariance A^-1 B A^-1, A the information and B the scatter of the gradient. Under the model B
follows from the noise, stretched for its colour and for the misfit; under a wrong one it is what the gradients of the
windows scatter by, or those of the records, whose errors go together (the sandwich: Huber, 5th Berkeley Symposium,
1967; White, Econometrica 50(1), 1982; by clusters: Liang and Zeger, Biometrika 73(1), 1986).
"""

from collections.abc import Sequence

import numpy as np
from scipy.special import stdtrit

from .windows import Windows

_FEWEST = 4  # clusters: with fewer their scatter says nothing
_TINY = 1e-300  # a variance that rounding has made negative
_NORMAL = 1.96  # what an interval of 95 % takes of a standard deviation


def clustered(gradients: np.ndarray, windows: Windows, by_record: bool) -> np.ndarray:
    """Scatter [k, k] of the gradient by what windows [w, k], or records, scatter by; 0 with too few of them.

    Stretched by C/(C - 1) for C clusters, and so that 1.96 deviations are Student's 95 % of C - 1 degrees of freedom.
    """
    labels = np.array([index for index, *_ in windows.spans]) if by_record else np.arange(windows.count)
    parts = np.array([gradients[labels == label].sum(axis=0) for label in np.unique(labels)])
    count = len(parts)
    if count < _FEWEST:
        return np.zeros((gradients.shape[1],) * 2)
    parts = parts - parts.mean(axis=0)
    stretch = count / (count - 1) * (float(stdtrit(count - 1, 0.975)) / _NORMAL) ** 2
    return stretch * parts.T @ parts


def widest(inverse: np.ndarray, scatters: Sequence[np.ndarray], prior: np.ndarray) -> np.ndarray:
    """Covariance [k, k] of the first scatter, every number's deviation stretched to the largest of all scatters'."""
    covariances = [inverse @ (scatter + prior) @ inverse.T for scatter in scatters]
    deviations = np.sqrt([np.maximum(np.diag(covariance), _TINY) for covariance in covariances])
    stretch = deviations.max(axis=0) / deviations[0]
    return covariances[0] * np.outer(stretch, stretch)
