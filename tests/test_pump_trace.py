"""A wrong number or a missing effect? Synthetic cycles of the pump rig in which one thing alone is not as described."""

from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.base.checkpoint import no_checkpoint
from workbench.base.process_pool import one_blas_thread
from workbench.commands.trace.metrics import trace_json
from workbench.engine import Engine
from workbench.identify.fit.free_parameters import Candidate, at_strength
from workbench.identify.fit.rest_state import rest_state
from workbench.identify.trace import estimation_problem, trace
from workbench.identify.trace.batch_refits import predicted_rise, refit_batch, refit_without
from workbench.identify.trace.context import trace_context
from workbench.identify.trace.findings import CandidateFit
from workbench.identify.trace.in_place import fewest_numbers
from workbench.identify.trace.locate import FaultLocation
from workbench.identify.trace.refit import fit_rig
from workbench.identify.trace.refits import judge, shortlist_of
from workbench.identify.trace.search import SearchResult
from workbench.identify.trace.verdict import judge_search
from workbench.plant import build
from workbench.plant.effects import applies, find, known_effects
from workbench.records import Campaign, Record
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

PERIOD, REST, STROKE, HOLD = 0.02, 60, 75, 40  # s, rows
NOISE = {"pa": 1e4, "pb": 1e4, "position": 1e-5}
TRIED = ("hose.compliance", "load.throttle", "pump.leakage")


def cycle(plant, name, share, load, seed):
    """A record of one stroke out and back at a share of full speed against a load's setting [Pa], after a rest."""
    command = np.concatenate(
        [np.zeros(REST), np.full(STROKE, share), np.zeros(HOLD), np.full(STROKE, -0.7 * share), np.zeros(HOLD)]
    )
    direction = np.sign(command)
    direction[REST + STROKE : REST + STROKE + HOLD], direction[-HOLD:] = 1.0, -1.0
    inputs = {"command": command, "direction": direction, "load_setting": np.full(command.size, load)}
    u = np.zeros((command.size, len(plant.inputs)))
    for key, values in inputs.items():
        u[:, plant.input(key)] = values
    x0 = plant.start.copy()
    x0[plant.state("x")] = -plant.p[plant.parameters.index("xmid")]
    t = PERIOD * np.arange(command.size)
    run = Engine(plant, 1e-7).run(x0, t, u)
    assert run.failed_at is None
    y, random = Engine(plant, 1e-7).outputs(run.x, u), np.random.default_rng(seed)
    measured = {key: y[:, plant.output(key)] + random.normal(0, sigma, t.size) for key, sigma in NOISE.items()}
    signals = inputs | measured
    return Record(name, t, signals, {key: np.ones(t.size, bool) for key in signals})


def campaign(truth):
    """Cycles of a plant: three to fit, one to select by, one held out."""
    settings = [(0.4, 0.0), (0.5, 20e5), (0.3, 40e5), (0.45, 30e5), (0.35, 10e5)]
    records = [cycle(truth, f"cycle {k}", *each, seed=k) for k, each in enumerate(settings)]
    still = replace(records[0].slice(None, REST * PERIOD), name="still")
    return Campaign(
        Path("synthetic"),
        "pump-rig",
        static=(still,),
        train=tuple(records[:3]),
        select=(records[3],),
        heldout=(records[4],),
        score="free-run",
        corrector="speed",
    )


def answer(truth):
    """trace.json of the described rig on cycles of the plant `truth`."""
    rig = load_rig("pump-rig").with_corrector("speed")
    library = [effect for effect in known_effects() if effect.name in TRIED]
    with one_blas_thread():
        return trace_json(
            trace(estimation_problem(campaign(truth), rig), library, no_checkpoint, lambda _: None, several=True)
        )


@pytest.fixture(scope="module")
def described():
    return load_rig("pump-rig").with_corrector("speed")


def test_a_wrong_number_is_named_with_its_interval_and_no_effect(described):
    said = answer(build(described.with_values(AB=0.8 * described["AB"])))
    assert said["effects"] == []
    (number,) = said["numbers"]
    assert number["name"] == "AB [cm^2]"
    assert number["described"] == pytest.approx(16.493)
    assert number["low"] < 0.8 * 16.493 < number["high"]
    assert number["high"] < 16.2


@pytest.mark.usefixtures("right_columns")
def test_a_missing_effect_is_named_and_no_number(described):
    said = answer(build(described, (find("hose.compliance", "linear"),)))
    assert said["effects"] == ["hose.compliance"]
    assert said["numbers"] == []


def test_what_a_fit_needs_is_predicted_by_second_order(described):
    numbers = {key: Number(key, 2e-13, "m^3/Pa", "m^3/Pa", "") for key in ("CA", "CB")}
    weak = replace(described, effects=(EffectUse("hose.compliance", "linear", numbers),))
    problem = estimation_problem(campaign(build(weak)), described)
    effects = find("hose.compliance", "linear"), find("pump.leakage", "laminar")
    known = [Candidate(effect, at_strength(effect, 0.1)) for effect in effects]
    fitted = refit_batch(problem, fit_rig(problem), known)
    squares = fitted.fit.squares.sum()
    for places in ([0], [1], [0, 1]):
        rise = refit_without(problem, fitted, places).fit.squares.sum() - squares
        assert predicted_rise(fitted, places) == pytest.approx(rise, rel=0.2, abs=4.0), places


@pytest.fixture(scope="module")
def braked(described):
    """Cycles of a load that a throttle brakes, and fits to them: the rig alone, and with friction whose break-away is
    0, which grows with the square of the speed as a throttle does."""
    numbers = {"d": Number("d", 2e7, "N s^2/m^2", "N s^2/m^2", "")}
    throttled = replace(described, effects=(EffectUse("load.throttle", "orifice", numbers),))
    friction = Candidate(find("jack.friction", "stribeck"), {"Fc": 1e4, "Fs": 0.0, "vs": 0.03})
    with one_blas_thread():
        records = campaign(build(throttled))
        base = fit_rig(problem := estimation_problem(records, described))
        return records, base, refit_batch(problem, base, [friction])


@contextmanager
def searching(records, described):
    library = [find("jack.friction", "stribeck"), find("load.throttle", "orifice")]
    problem = estimation_problem(records, described)
    with one_blas_thread(), trace_context(problem, library, no_checkpoint, lambda _: None, several=True) as context:
        yield context


def test_what_does_as_much_in_the_place_of_an_effect_ties_and_the_fewest_numbers_come_first(described, braked):
    records, base, rubbing = braked
    with searching(records, described) as context:
        assert not context.is_misfit(rubbing)
        shortlist = shortlist_of(context, 1, base)
        (fit, place) = next(fewest_numbers(context, base, rubbing, [shortlist]))
    assert [effect.name for effect in fit.effects] == ["load.throttle"]
    assert (place.name, place.tied) == ("load.throttle", ("jack.friction",))


def test_a_name_that_makes_the_held_out_error_larger_is_withdrawn_though_several_effects_are_missing(described, braked):
    records, base, rubbing = braked
    unbraked = replace(records, heldout=(cycle(build(described), "unbraked", 0.35, 10e5, seed=9),))
    with searching(unbraked, described) as context:
        judgement = judge(context, rubbing.effects[0], base, base, rubbing)
        found = CandidateFit(rubbing.known[0], 1.0, judgement, rubbing)
        place = FaultLocation("force", (("force", 1e4),), {})
        said = judge_search(context, SearchResult(base, (found,), place, ()), learns=False)
    assert judgement.passes
    assert judgement.explained > 0.99
    assert (said.verdict, said.effects, said.refuted) == ("unknown", (), (found,))
    assert said.refuted_errors is not None
    assert said.chi2[1] == said.chi2[0] < said.refuted_errors.chi2


def applicable():
    rig = load_rig("pump-rig").with_corrector("speed")
    return [effect for effect in known_effects() if applies(effect, rig)]


@pytest.mark.parametrize("effect", applicable(), ids=lambda effect: effect.title)
def test_whatever_acts_a_run_from_rest_begins_at_what_is_measured(described, effect):
    plant = build(described, (effect,))
    engine, rows = Engine(plant), np.ones(20)
    measured = {"pa": 6e5 * rows, "pb": 7e5 * rows, "position": 1e-2 * rows}
    record = Record("still", PERIOD * np.arange(20), measured, dict.fromkeys(measured, rows > 0))
    x = rest_state(engine, record, plant.p)
    seen = engine.observe(x, np.zeros(len(plant.inputs)))
    assert {key: seen[plant.output(key)] for key in measured} == pytest.approx({"pa": 6e5, "pb": 7e5, "position": 1e-2})
    assert (x[plant.state("P1")], x[plant.state("P2")]) == pytest.approx((6e5, 7e5), rel=0.1)
