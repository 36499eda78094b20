"""Shapes that are others by name alone are fitted once, and none further once one leaves no misfit."""

from types import SimpleNamespace

import pytest

from workbench.identify.fit.free_parameters import Candidate
from workbench.identify.trace import shapes
from workbench.identify.trace.reshape import Reshaping
from workbench.identify.trace.shapes import distinct
from workbench.identify.trace.steps import TraceProgress
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


@pytest.mark.parametrize("count", [1, 2, 5])
def test_no_shape_is_fitted_once_one_leaves_no_misfit_however_many_workers(monkeypatch, count):
    names = [
        ("learned.force", "spline 9 in velocity"),
        ("learned.load", "spline 9 in velocity"),
        ("learned.force", "spline 9 in velocity; spline 5 in position"),
    ]
    wanted, fitted = [reshaping(*key) for key in names], []
    chi2 = dict(zip([each.candidate.effect.title for each in wanted], (2.0, 1.0, 1.5), strict=True))

    def workers(_work, _before, items, _stage, _done):
        fitted.extend(items)
        return [{"title": name.removeprefix("shape-1-")} for name in items]

    workers.count = count
    monkeypatch.setattr(shapes, "unpacked", lambda stored, *_: SimpleNamespace(chi2=chi2[stored["title"]]))
    context = SimpleNamespace(
        workers=workers, stage=None, problem=None, library=(), report_progress=lambda _: None,
        steps=TraceProgress(lambda _: None), is_misfit=lambda fit: fit.chi2 > 1.05,
    )  # fmt: skip
    kept = [each for each, _ in shapes._refits(context, 1, None, wanted)]
    assert kept == wanted[:2]
    assert len(fitted) == min(3, -(-2 // count) * count)
