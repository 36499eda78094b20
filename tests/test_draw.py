"""Drawn campaigns: the same from the same seed, at their own noise floor, as far off as was asked, readable."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.studies.trace.campaigns.cause import (
    LIBRARY_CAUSES,
    OTHER_FORMULA_CAUSES,
    UNNAMED_CAUSES,
    cause,
    causes_on,
)
from experiments.studies.trace.campaigns.draw import CampaignPlan, draw
from experiments.studies.trace.campaigns.noise import BLEMISHES, noise
from experiments.studies.trace.campaigns.play import PositionLoop, play, start
from experiments.studies.trace.campaigns.scene import drawn_rig
from experiments.studies.trace.campaigns.second_order import OIL, RATIO, SPEED, STALL, STROKE, VALVE, second_order_rig
from experiments.studies.trace.campaigns.strength import scaled, settle
from workbench.engine import Engine
from workbench.identify.data.noise_floor import noise_floor
from workbench.identify.fit.predict import predict_windows
from workbench.identify.trace.localise import clear_evidence, likely_equations
from workbench.identify.trace.locate import locate_fault
from workbench.identify.trace.problem import estimation_problem
from workbench.identify.trace.refit import fit_rig
from workbench.plant import build
from workbench.plant.effects import applies
from workbench.records import load_campaign
from workbench.records.excitation import Excitation
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

PERIOD, STEP = 1e-3, 1 / 32767
COULOMB = (("jack.friction", "coulomb"),)
ON_VALVES = [
    one for one in (*OTHER_FORMULA_CAUSES, *UNNAMED_CAUSES) if {"three-stage", "second-order"} & one.effect.valves
]


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drawn") / "clean"
    return folder, draw(CampaignPlan(seed=11, kind="clean"), folder)


@pytest.fixture(scope="module")
def rubbing(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drawn") / "rubbing"
    return folder, draw(CampaignPlan(21, "single", COULOMB, misfit=6.0, supply=False, blemish=BLEMISHES), folder)


def squares(rig, folder, truth, numbers, also=()):
    """Mean square of the held-out errors over the drawn sigma, by signal, of the rig with its true numbers."""
    campaign = load_campaign(folder)
    model = build(rig.with_values(**truth["true"]), also)
    model.p[:] = model.parameter_values(**numbers)
    floor = noise_floor(campaign)
    found = predict_windows(model, campaign.heldout[0], floor)
    assert not found.failed
    return {name: np.nanmean((found.error(name) / truth["sigma"][name]) ** 2) for name in found.signals}


def test_a_seed_is_a_campaign(clean, tmp_path):
    folder, truth = clean
    assert draw(CampaignPlan(seed=11, kind="clean"), tmp_path / "again") == truth
    assert draw(CampaignPlan(seed=12, kind="clean"), tmp_path / "other") != truth
    for file in folder.iterdir():
        assert (tmp_path / "again" / file.name).read_bytes() == file.read_bytes()
        other = (tmp_path / "other" / file.name).read_bytes()
        assert (other == file.read_bytes()) == (file.name == "campaign.toml")


def test_a_folder_does_not_give_the_answer_away(rubbing):
    names = {file.name for file in rubbing[0].iterdir()}
    assert names == {"campaign.toml", "static.csv.gz", "steps.csv.gz", "triangle.csv.gz", "multisine.csv.gz"}
    assert "friction" not in (rubbing[0] / "campaign.toml").read_text()


def test_a_clean_campaign_is_at_its_noise_floor_with_its_true_numbers(clean, rig):
    folder, truth = clean
    found = squares(rig, folder, truth, {})
    assert set(found) == {"current", "spool", "pa", "pb", "supply", "position", "acceleration"}
    for name, value in found.items():
        assert 0.95 < value < 1.1, name
    for name, value in truth["true"].items():
        assert rig.numbers[name].low <= value <= rig.numbers[name].high


def test_the_noise_floor_is_the_drawn_one(clean):
    folder, truth = clean
    floor = noise_floor(load_campaign(folder))
    for name, sigma in truth["sigma"].items():
        assert floor.sigma[name] == pytest.approx(sigma, rel=0.08), name


def test_a_drawn_effect_is_as_visible_as_was_asked(rubbing, rig):
    """The proxy knows a refit of the base model; without one the misfit is larger, with the effect it is gone."""
    folder, truth = rubbing
    assert truth["expected"][0] == pytest.approx(6.0, rel=0.2)
    without = squares(rig, folder, truth, {})
    within = squares(rig, folder, truth, truth["numbers"], [cause(*COULOMB[0], load_rig("jack-10t")).effect])
    assert np.mean(list(without.values())) > 4.0
    assert np.mean(list(within.values())) < 1.1


def test_blemishes_are_read_and_noted(rubbing):
    campaign = load_campaign(rubbing[0])
    records = (*campaign.static, *campaign.train, *campaign.heldout)
    assert sum("dropped" in " ".join(record.notes) for record in records) == 1
    for record in records:
        notes = " ".join(record.notes)
        assert "not compared" in notes
        assert "oil temperature" in notes
        assert {"pa", "pb", "spool", "current", "position", "acceleration"} <= set(record.signals)
        assert 50e5 < np.median(record.signals["pa"]) < 150e5
    assert "supply" not in campaign.train[0].signals


def test_few_sensors(tmp_path):
    draw(CampaignPlan(seed=31, kind="clean", few=True, poor=True), tmp_path / "few")
    record = load_campaign(tmp_path / "few").train[0]
    assert set(record.signals) == {"reference", "command", "current", "pa", "pb", "position"}
    assert np.ptp(record.signals["position"]) < 0.06


def test_coloured_noise_has_the_variance_of_white_noise():
    random = np.random.default_rng(1)
    values = noise(200_000, PERIOD, "coloured", random)
    assert np.std(values) == pytest.approx(1.0, rel=0.02)
    assert np.mean(values[1:] * values[:-1]) > 0.3
    assert np.std(noise(200_000, PERIOD, "white", random)) == pytest.approx(1.0, rel=0.02)


def edge(rows: int) -> Excitation:
    return Excitation("edge", PERIOD, np.zeros(rows), np.where(np.arange(rows) < 5, 0.0, 0.01))


def late_edge(rig, formula, periods, rows):
    """An edge at row 5 on a rig whose drive is late by so many periods."""
    delay = Number("delay", periods * PERIOD, "s", "s", "", None, None)
    engine = Engine(build(replace(rig, effects=(EffectUse("drive.delay", formula, {"delay": delay}),))))
    begin, loop = start(engine, engine.plant.p, {}), PositionLoop(0.0, STEP)
    return engine, play(engine, engine.plant.p, begin, edge(rows), loop, np.zeros(rows), {})


@pytest.mark.parametrize(
    ("periods", "formula", "seen"),
    [(0.0, "interpolated", [1.0, 1.0]), (2.0, "interpolated", [0, 0, 1]), (2.0, "shift", [0, 0, 1]),
     (1.5, "interpolated", [0, 0.5, 1]), (1.5, "shift", [0, 0, 1])],
)  # fmt: skip
def test_the_plant_meets_the_command_late(rig, periods, formula, seen):
    """The written command steps at row 5; the current of each row answers what the plant has got by then."""
    engine, motion = late_edge(rig, formula, periods, 12)
    step = motion.inputs["command"][5] - motion.inputs["command"][4]
    assert motion.inputs["command"][5] == pytest.approx(0.01, abs=2e-5)
    gain = engine.plant.p[engine.plant.parameters.index("Kp")] * engine.plant.p[engine.plant.parameters.index("imax")]
    for row, share in enumerate(seen, 5):
        spool = motion.outputs["spool"][row] / engine.plant.p[engine.plant.parameters.index("z3max")]
        met = motion.outputs["current"][row] / gain + spool - motion.inputs["command"][4]
        assert met == pytest.approx(share * step, abs=1e-9)


def test_a_command_that_is_switched_inside_a_period_acts_from_there(rig, rest):
    engine, late = late_edge(rig, "shift", 0.25, 8)
    u = rest.u.copy()
    u[0] = late.inputs["command"][4]
    x = engine.advance(late_state(late, engine, 5), u, 0.25 * PERIOD)
    u[0] = late.inputs["command"][5]
    assert engine.advance(x, u, 0.75 * PERIOD) == pytest.approx(late_state(late, engine, 6), rel=1e-12)


def late_state(motion, engine, row):
    return np.array([motion.states[state.name][row] for state in engine.plant.states])


def home(one, rig, plant):
    """The rig that has room for a cause, and its plant."""
    if applies(one.effect, rig):
        return rig, plant
    other = second_order_rig(0)
    other = other if applies(one.effect, other) else load_rig("pump-rig", corrector="speed")
    return other, build(other)


@pytest.mark.parametrize("one", [*OTHER_FORMULA_CAUSES, *UNNAMED_CAUSES], ids=lambda one: " ".join(one.key))
def test_a_foreign_effect_vanishes_where_it_is_off(one, rig, plant):
    """Whatever the base plant does, with the effect's own states where they begin."""
    rig, plant = home(one, rig, plant)
    model = build(rig, also=[one.effect])
    off = {number.name: number.typical if number.off is None else number.off for number in one.effect.numbers}
    assert any(number.off is not None for number in one.effect.numbers)
    p = model.parameter_values(**{one.effect.key(name): value for name, value in off.items()})
    names = [state.name for state in model.states]
    own = [names.index(state.name) for state in plant.states]
    random = np.random.default_rng(3)
    for _ in range(5):
        x, u = model.start + 0.2 * random.standard_normal(model.n) * model.scale, np.zeros(len(model.inputs))
        for k in set(range(model.n)) - set(own):
            x[k] = model.start[k]
        u[0] = random.uniform(-0.3, 0.3)
        expected = np.array(plant.f(x[own], u[: len(plant.inputs)], plant.p)).ravel()
        assert np.array(model.f(x, u, p)).ravel()[own] == pytest.approx(expected, rel=1e-9, abs=1e-6)
        assert model.observe(x, u, p)[0] == pytest.approx(plant.observe(x[own], u[: len(plant.inputs)])[0], rel=1e-9)


@pytest.mark.parametrize("one", ON_VALVES, ids=lambda one: " ".join(one.key))
def test_a_foreign_effect_simulates(one, rig, plant):
    """At its typical strength, from rest, through a hard step; and something comes of it."""
    rig, plant = home(one, rig, plant)
    engine = Engine(build(rig, also=[one.effect]), 1e-4, "interpreted")
    base = Engine(plant, 1e-4, "interpreted")
    rows = 40
    hard = Excitation("hard", PERIOD, np.zeros(rows), np.where(np.arange(rows) % 20 < 10, 0.3, -0.2))
    motions = [
        play(e, e.plant.p, start(e, e.plant.p, initial_states), hard, PositionLoop(0.3, STEP), np.zeros(rows), {})
        for e, initial_states in ((engine, one.initial_states), (base, {}))
    ]
    moved = [
        np.abs(motions[0].outputs[name] - motions[1].outputs[name]).max() / np.ptp(motions[1].outputs[name])
        for name in ("current", "spool", "pa", "acceleration", "position")
        if name in motions[1].outputs
    ]
    assert np.all(np.isfinite(moved))
    assert max(moved) > 1e-4


@pytest.mark.parametrize("drawn", ["jack-10t", "second-order-0"])
def test_every_named_effect_has_formulas_of_its_own_and_foreign_ones(drawn):
    rig = drawn_rig(drawn, "")
    own, others = (causes_on(rig, pool) for pool in (LIBRARY_CAUSES, OTHER_FORMULA_CAUSES))
    assert {one.effect.name for one in own} == {one.effect.name for one in others}
    assert {one.effect.name for one in OTHER_FORMULA_CAUSES} <= {one.effect.name for one in LIBRARY_CAUSES}
    assert not {one.key for one in OTHER_FORMULA_CAUSES} & {one.key for one in LIBRARY_CAUSES}
    assert not {one.effect.name for one in UNNAMED_CAUSES} & {one.effect.name for one in LIBRARY_CAUSES}
    assert all(
        one.effect.equation in one.equations for one in (*LIBRARY_CAUSES, *OTHER_FORMULA_CAUSES, *UNNAMED_CAUSES)
    )


@pytest.mark.parametrize("goal", [2.0, 6.0, 20.0])
def test_strength_is_found_where_misfit_goes_with_its_square(goal):
    one = cause(*COULOMB[0], load_rig("jack-10t"))
    typical = one.effect.numbers[0].typical
    found = settle(lambda numbers: 1 + 40 * (numbers["Fc"] / typical) ** 2, one, {}, goal)
    assert found.chi2 == pytest.approx(goal, rel=0.15)
    assert found.numbers["Fc"] == pytest.approx(found.strength * typical)


def test_a_strength_that_can_not_be_reached_is_the_nearest_that_can():
    one = cause(*COULOMB[0], load_rig("jack-10t"))
    highest = one.effect.numbers[0].high
    found = settle(lambda numbers: 1 + numbers["Fc"] / highest, one, {}, 50.0)
    assert found.numbers["Fc"] == highest
    assert scaled(one.effect, {}, 0.0)["Fc"] == 0.0


def within(values, band):
    return band[0] * 0.99 <= min(values) and max(values) <= band[1] * 1.01


def test_rigs_with_a_second_order_valve_are_of_sizes_that_people_have():
    """Each number by the physics of the others: stall force, speed of half the supply a land, mass on the oil."""
    rigs = [second_order_rig(seed) for seed in range(60)]
    assert second_order_rig(7) == rigs[7] != rigs[8]
    assert {rig.jack for rig in rigs} == {"double-rod", "differential"}
    assert within([rig["Ps"] * rig.areas[0] for rig in rigs], STALL)
    assert within([rig["S"] for rig in rigs], STROKE)
    assert within([rig["f0"] for rig in rigs], VALVE)
    assert within([a / b for a, b in (rig.areas for rig in rigs) if a != b], RATIO)
    lands = [rig["K3"] * rig["z3max"] * np.sqrt(rig["Ps"] / 2) / np.mean(rig.areas) for rig in rigs]
    assert within(lands, SPEED)
    stiffness = [
        rig["beta"] * sum(a * a / (v + a * rig["S"] / 2) for a, v in zip(rig.areas, rig.dead_volumes, strict=True))
        for rig in rigs
    ]
    assert within([np.sqrt(k / rig["M"]) / (2 * np.pi) for k, rig in zip(stiffness, rigs, strict=True)], OIL)
    for signal in ("spool", "force", "acceleration"):
        assert 10 < sum(signal in rig.sensors for rig in rigs) < 50
    assert all(rig.cell_is_idle is ("force" not in rig.sensors) for rig in rigs)
    assert all(rig.numbers[name].low is not None for rig in rigs for name in ("f0", "K3", "M", "beta", "Ps"))


@pytest.mark.parametrize(("seed", "few"), [(3, False), (4, True)])
def test_a_campaign_on_a_drawn_rig_brings_its_rig_file(tmp_path, seed, few):
    plan = CampaignPlan(seed, "clean", few=few, rig=f"second-order-{seed}")
    truth = draw(plan, tmp_path / "own")
    campaign = load_campaign(tmp_path / "own")
    own = load_rig(campaign.rig)
    assert own.numbers.keys() == drawn_rig(plan.rig, "").numbers.keys()
    signals = set(campaign.train[0].signals) - {"reference", "command"}
    assert signals == ({"pa", "position"} if few else set(own.sensors))
    for name, value in squares(own, tmp_path / "own", truth, {}).items():
        assert 0.9 < value < 1.15, name


def location(folder, rig, *without):
    """Where a drawn campaign's misfit sits, by records that lack some signals."""
    campaign = load_campaign(folder)
    less = {
        role: tuple(
            replace(record, signals={name: each for name, each in record.signals.items() if name not in without})
            for record in getattr(campaign, role)
        )
        for role in ("static", "train", "heldout")
    }
    problem = estimation_problem(replace(campaign, **less), rig)
    return problem, locate_fault(problem, fit_rig(problem))


@pytest.mark.usefixtures("right_columns")
@pytest.mark.parametrize(
    ("effect", "before"), [(("pilot.hysteresis", "magnet dahl squared"), True), (("main.deadband", "cubic"), False)]
)
def test_the_advised_record_of_the_spool_tells_what_is_before_it_from_what_is_behind_it(tmp_path, effect, before):
    """Slow triangles with reversals, steps, and a multisine: the spool by the command alone is off, or is not."""
    plan = CampaignPlan(3, "single", (effect,), misfit=300.0, rig="second-order-3")
    draw(plan, tmp_path / "own")
    rig = load_rig(load_campaign(tmp_path / "own").rig)
    problem, place = location(tmp_path / "own", rig)
    assert (place.equation == "drive") is before
    assert (place.parity_residuals["drive"] > 2.0) is before
    assert place.parity_residuals["drive"] < 1.2 or before
    problem, place = location(tmp_path / "own", rig, "spool")
    clear = clear_evidence(place.evidence, problem.kappa)
    assert "drive" not in place.parity_residuals
    assert {"drive", "flow"} >= set(likely_equations(place.evidence, place.parity_residuals, clear))
