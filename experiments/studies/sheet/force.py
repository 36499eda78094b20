"""A drawn load cell's sheet beside its truth: what was put in, and what the records say without noise."""

import numpy as np

from workbench.commands.force_test.bench import CellErrors, ForceBench
from workbench.commands.force_test.options import with_grips
from workbench.identify.acceptance.force_test import Reference, force_sheet
from workbench.rigs.rig import Rig

from .drawn import Held, beside_truth, within_bounds

WITHIN = 0.01
_STIFFNESS, _MASS = (5e6, 2e7), (8.0, 40.0)  # N/m, kg
_SPAN, _ZERO = 5e-3, 100.0  # largest errors of the cell: of the span, and N without load


def force_lines(rig: Rig, number: int) -> list[Held]:
    """Of a rig within the bounds on a drawn specimen, with a drawn mass and errors of its cell."""
    random = np.random.default_rng([2, number])
    stiffness = float(np.exp(random.uniform(*np.log(_STIFFNESS))))
    mass, span, zero = (float(random.uniform(*ends)) for ends in (_MASS, (-_SPAN, _SPAN), (-_ZERO, _ZERO)))
    own = with_grips(within_bounds(rig, random).with_values(ks=stiffness), mass)
    noisy, exact = (
        force_sheet(ForceBench(own, number, CellErrors(span, zero), loud).records(), own, Reference(0.0, WITHIN)).rows
        for loud in (True, False)
    )
    truths = {row.id: 100 * span if row.id.startswith("compensated") else row.value for row in exact}
    return beside_truth(noisy, truths | {"mass": mass, "repeatability": None, "band": _band(own, mass, span)})


def _band(rig: Rig, mass: float, span: float) -> float:
    """Where (1 + span) (1 - m w^2/k) is off 1 by as much as is allowed."""
    share = 1 - (1 - WITHIN) / (1 + span)
    return float(np.sqrt(share * rig["ks"] / mass)) / (2 * np.pi)
