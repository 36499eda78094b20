"""A load that rattles behind a play: where windows begin in its gap, and that a fit finds the gap, on either side."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from made_campaigns import PERIOD, commands

from workbench.base.process_pool import one_blas_thread
from workbench.engine import Engine
from workbench.identify.fit.free_parameters import Candidate, at_strength
from workbench.identify.fit.initial_states import predicted_states
from workbench.identify.fit.model import TOLERANCE
from workbench.identify.trace.problem import EstimationProblem, estimation_problem
from workbench.identify.trace.refit import fit_rig, refit
from workbench.linear import equilibrium
from workbench.plant import build
from workbench.plant.effects import find
from workbench.records import Campaign, Record
from workbench.rigs.rig_file import load_rig

RIG = load_rig("festo-tp511")
SIDES = ("measured on the rod", "measured on the load")
SIGMA = {"pa": 5e3, "pb": 5e3, "position": 5e-6, "spool": 2e-6, "acceleration": 0.2}
TRUE = {"mu": 0.7, "gap": 4e-4, "f": 90.0, "zeta": 0.3}


pytestmark = pytest.mark.usefixtures("right_columns")


def recorded(side: str, name: str, command: np.ndarray, seed: int) -> Record:
    """What the cylinder records of a command [n], simulated so well that the moments of impacts are right."""
    effect = find("load.backlash", side)
    plant = build(RIG, also=(effect,))
    p = plant.parameter_values(**{effect.key(key): value for key, value in TRUE.items()})
    t, u = PERIOD * np.arange(len(command)), np.zeros((len(command), len(plant.inputs)))
    u[:, plant.input("command")] = command
    engine = Engine(plant, 1e-8)
    y = engine.outputs(engine.run(equilibrium(plant, p=p).x, t, u, p).x, u, p)
    random = np.random.default_rng(seed)
    seen = {n: y[:, plant.output(n)] + s * random.standard_normal(len(t)) for n, s in SIGMA.items()}
    return Record(name, t, {"command": command, **seen})


@cache
def rattling(side: str) -> EstimationProblem:
    """Records of a cylinder whose load rattles, and the rig without that."""
    steps, triangle, sines = (recorded(side, f"r{seed}", each, seed) for seed, each in enumerate(commands(2.0)))
    still = recorded(side, "still", np.zeros(500), 4)
    return estimation_problem(Campaign(Path("made"), RIG.name, (still,), (steps, triangle), (sines,)), RIG)


def at_truth(side: str):
    effect, problem = find("load.backlash", side), rattling(side)
    model = problem.model((effect,))
    return problem, model, model.plant.parameter_values(None, **{effect.key(k): v for k, v in TRUE.items()})


@pytest.mark.parametrize("side", SIDES)
def test_a_window_begins_where_the_sensor_reads_it(side):
    """On the load, too: the jack is then elsewhere."""
    problem, model, p = at_truth(side)
    windows = problem.train
    ahead = np.zeros((windows.count, model.plant.n))
    (place, pace, width) = model.plant.gaps[0]
    ahead[:, place], ahead[:, pace] = p[width] / 3, 0.01
    guesses = [model.starts(windows, p, model.starts(windows, p) + ahead), *model.anywhere(windows, p, ahead)]
    for x0 in guesses:
        for group, y in zip(windows.groups, model.predict(windows, x0, p), strict=True):
            column = windows.names.index("position")
            early = group.measured[:, :6, column].mean(axis=1)
            assert y[:, 0, column] == pytest.approx(early, abs=1e-9)
    assert len({tuple(x0[0, [place, pace]]) for x0 in guesses[1:]}) == len(guesses) - 1


def test_the_true_numbers_leave_hardly_more_than_noise_where_the_load_is_measured():
    problem, model, p = at_truth("measured on the load")
    with one_blas_thread():
        _, squares = predicted_states(model, problem.train, p)
    assert squares.sum() < 1.5 * problem.train.samples


def test_a_refit_finds_the_gap_from_the_numbers_that_the_rig_declares():
    """Those that were fitted without it absorb it: it is not found beside them."""
    problem, effect = rattling("measured on the load"), find("load.backlash", "measured on the load")
    with one_blas_thread():
        alone = fit_rig(problem)
        found = refit(problem, alone, Candidate(effect, at_strength(effect, 1.0)))
    gap = found.fit.p[found.model.parameters.index("load.backlash.gap")]
    assert found.chi2 < 0.25 * alone.chi2
    assert gap == pytest.approx(TRUE["gap"], rel=0.1)


@pytest.mark.parametrize("side", SIDES)
def test_a_plant_that_rattles_is_simulated_so_well_that_impacts_are_followed(side):
    """A fifth of a second of impacts at the tolerance of a fit and at a hundredth of it."""
    _, model, p = at_truth(side)
    plant, command = model.plant, commands(0.2)[0]
    t, u = PERIOD * np.arange(len(command)), np.zeros((len(command), len(plant.inputs)))
    u[:, plant.input("command")] = command
    x0 = equilibrium(plant, p=p).x
    fitted, exact = (Engine(plant, tolerance).run(x0, t, u, p).x for tolerance in (TOLERANCE, TOLERANCE / 100))
    (place, _, width) = plant.gaps[0]
    assert np.ptp(np.sign(exact[:, place])) == 2
    assert np.abs(exact[:, place]).max() > p[width] / 2
    assert fitted[:, place] == pytest.approx(exact[:, place], abs=2e-3 * p[width])
