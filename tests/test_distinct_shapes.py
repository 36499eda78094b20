"""Shapes that are others by name alone are fitted once."""

from workbench.identify.fit.free_parameters import Candidate
from workbench.identify.trace.reshape import Reshaping
from workbench.identify.trace.shapes import distinct
from workbench.plant.effects import learned


def reshaping(name: str, formula: str) -> Reshaping:
    piece = next(p for p in learned("force") if (p.name, p.formula) == (name, formula))
    return Reshaping(Candidate(piece, {}), None)


def test_a_force_that_no_load_cell_tells_apart_is_fitted_once():
    curve, other = "spline 9 in velocity", "spline 9 in velocity; spline 5 in position"
    force, load, richer = (
        reshaping(*key) for key in (("learned.force", curve), ("learned.load", curve), ("learned.force", other))
    )
    assert distinct([(force, 0.18), (load, 0.18 * (1 - 1e-9)), (richer, 0.18)]) == [force, richer]
    assert distinct([(force, 0.18), (load, 0.17)]) == [force, load]
