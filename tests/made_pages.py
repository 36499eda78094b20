"""Results that nobody computed: odd fits for pages, which have to be drawn whatever was found."""

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, settings, strategies as st

from workbench.identify.fit.solver import Fit
from workbench.report import Page, render

ODD = (0.0, 1e-300, 1e300, np.inf, np.nan)  # variances
NUMBERS = (0.0, 0.4, 1.0, 1e9, -3.0, np.nan, np.inf)
MARKUP = "<b>it<b> & more"  # a name of a folder too
TESTS = Path(__file__).parent

made_result = settings(
    print_blob=False,
    deadline=None,
    max_examples=int(os.environ.get("FUZZ_PAGES", "5")),
    phases=(Phase.explicit, Phase.reuse, Phase.generate, Phase.target),  # a page is slow to draw: nothing is shrunk
    suppress_health_check=list(HealthCheck),
)
beyond_all = pytest.mark.filterwarnings("ignore::RuntimeWarning")  # what is drawn of odd numbers is asked here
odd_numbers = st.sampled_from((None, *NUMBERS))


def drawn(page: Page) -> str:
    """The page as HTML, in which no name is markup."""
    text = render(page)
    assert MARKUP not in text
    return text


def odd_fit(draw: st.DrawFn, fit: Fit) -> Fit:
    """Intervals that are no numbers, numbers at an end of their range or beyond all."""
    covariance, x = fit.covariance.copy(), fit.x.copy()
    for place in range(len(fit.free)):
        if draw(st.booleans()):
            covariance[place, place] = draw(st.sampled_from(ODD))
        x[place] = draw(st.sampled_from((0.0, 0.0, 0.5, -40.0)))
    ends = tuple(free.name for free in fit.free if draw(st.integers(0, 4)) == 0)
    return replace(fit, covariance=covariance, x=x, at_bounds=ends)


def plain_fit(free: Any, p: np.ndarray, windows: int, n: int) -> Fit:
    """A fit that left all numbers where they were."""
    k = len(free)
    nothing = np.zeros((windows, k, k)), np.zeros((windows, k))
    ones = np.ones(windows)
    return Fit(tuple(free), np.zeros(k), p, np.zeros((windows, n)), ones, 1, 0.01 * np.eye(k), *nothing, ones, ())


def rms(draw: st.DrawFn, names: Any) -> dict[str, Any]:
    """Errors of signals, of which some are nowhere measured or cannot be simulated."""
    kept = [name for name in names if draw(st.integers(0, 3))]
    sizes = st.sampled_from((None, 0.0, 1.0, 1e9))
    return {
        name: {"before": draw(sizes), "after": draw(sizes), "floor": draw(st.sampled_from((0.1, None)))}
        for name in kept
    }
