"""What a recorded signal tells of the numbers: never less than nothing, and as much as a fit without it loses."""

from dataclasses import replace

import numpy as np
import pytest
from made_campaigns import campaign

from workbench.base.process_pool import one_blas_thread
from workbench.identify.found.channels import longer_without
from workbench.identify.trace.problem import estimation_problem
from workbench.identify.trace.refit import fit_rig
from workbench.rigs.rig_file import load_rig

RIG = load_rig("festo-tp511")


def fitted(records):
    with one_blas_thread():
        problem = estimation_problem(records, RIG)
        return problem, fit_rig(problem)


def test_an_interval_without_a_signal_is_as_long_as_foreseen():
    recorded = campaign(RIG)
    problem, found = fitted(recorded)
    sets = [["pa"], ["spool"], ["pa", "pb"], []]
    longer = longer_without(problem, found, sets)
    assert (longer > 1 - 1e-9).all()
    assert longer[3] == pytest.approx(1.0)
    assert (longer[2] >= longer[0] - 1e-9).all()  # without both no number is told better than without one
    without = {
        role: tuple(
            replace(record, signals={n: v for n, v in record.signals.items() if n not in ("pa", "pb")})
            for record in getattr(recorded, role)
        )
        for role in ("static", "train", "heldout")
    }
    _, fewer = fitted(replace(recorded, **without))
    came = np.sqrt(np.diag(fewer.fit.covariance) / np.diag(found.fit.covariance))
    ratio = longer[2] / came
    assert max(came) > 1.5
    assert np.median(np.abs(np.log(ratio))) < np.log(1.3)
