"""Margins of every caller against a dense grid: random designs, random plants, and where poles or 0 Hz decide."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import control
import numpy as np
import pytest

import workbench as wb
from controllers import P, PidLead, PressureFeedback
from workbench.commands.live.config import load_live
from workbench.commands.live.session import Session
from workbench.commands.robustness.options import RobustnessConfig
from workbench.control.protocol import linear_view
from workbench.linear import Equilibrium
from workbench.linear.sampling import sampled_plant
from workbench.linear.state_space import sampled_response
from workbench.loop.envelope import envelope
from workbench.loop.plant_lanes import plant_lanes
from workbench.loop.robustness.linear_loops import linear_loops as loops_at, places
from workbench.loop.robustness.workers import plants_by_block
from workbench.loop.rows import LoopSetup, judge, linear_loops
from workbench.loop.sampled_lanes import sampled_lane
from workbench.plant.effects.declared import effect_use, effects_for

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
PERIOD, RIG = 1e-3, wb.load_rig("jack-10t")
ISSUE = P(gain=4.723) + PressureFeedback(gain="6.845e-5 1/bar", corner="0.851 Hz")


def reference(model, law):
    """Radius of the poles, Ms and gain margin [dB] (NaN: none) on a dense grid, of a plant's and a law's matrices."""
    gains = law.D[:, 1:]
    closed = np.block([[model.A + model.B @ (gains @ model.C), model.B @ law.C], [law.B[:, 1:] @ model.C, law.A]])
    poles = np.linalg.eigvals(closed)
    f = dense(np.concatenate((poles, model.poles(), law.poles())))
    z = np.exp(2j * np.pi * f * PERIOD)
    loop = -np.sum(sampled_response(law, z)[0, 1:] * sampled_response(model, z)[:, 0], axis=0)
    upper, turn, level = loop.imag >= 0, np.angle(-loop), 20 * np.log10(np.abs(loop))
    i = np.flatnonzero((upper[1:] != upper[:-1]) & (np.abs(np.diff(turn)) < np.pi))
    part = turn[i] / (turn[i] - turn[i + 1])
    crossings = np.abs(level[i] + part * np.diff(level)[i]).tolist()
    crossings += [abs(level[-1])] if loop[-1].real < 0 else []
    crossings += [abs(level[0])] if loop[0].real < 0 and abs(loop[1] / loop[0] - 1) < 1e-3 else []
    least = min(crossings, default=np.inf)
    return np.abs(poles).max(), np.abs(1 / (1 + loop)).max(), least if least < 120 else np.nan


def dense(poles):
    """Frequencies from 0.1 uHz to Nyquist's, 30,000 of them even on either scale, and 800 about each pole."""
    turning = poles[(poles.imag >= 0) & (np.abs(poles) > 1e-3)]
    middle, width = np.angle(turning), np.maximum(np.abs(np.log(np.abs(turning))), 1e-9)
    about = (middle[:, None] + width[:, None] * np.sinh(np.linspace(-14, 14, 800))).ravel() / (2 * np.pi * PERIOD)
    f = np.concatenate((np.geomspace(1e-7, 500, 20_000), np.linspace(0.05, 500, 10_000), about))
    return np.unique(f[(f >= 1e-7) & (f <= 500)])


def same(expected, radius, ms, gain_margin_db):
    """Stable or not without exception, Ms to 1 %, the gain margin to 0.05 dB."""
    there, ms_there, db_there = expected
    assert (there < 1 - 1e-9) == (radius < 1 - 1e-9)
    if there < 1 - 1e-9:
        assert ms == pytest.approx(ms_there, rel=0.01)
        db = np.nan if gain_margin_db is None else gain_margin_db
        assert db == pytest.approx(db_there, abs=0.05, nan_ok=True)


def same_loop(expected, loop):
    same(expected, 0.0 if loop.stable else 2.0, loop.ms, loop.gain_margin_db)


def expected_at(plant, about, controller, p):
    at = sampled_lane(plant, about, PERIOD, p).point
    measured = tuple(controller.measures)
    return reference(sampled_plant(plant, about, PERIOD, measured, p), linear_view(controller, at))


def random_design(random):
    """P, PI with a lead, either with pressure feedback: gains over two decades, stable and not."""

    def drawn(low, high):
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    law = P(gain=drawn(0.05, 12))
    if random.random() < 0.4:
        numbers = {"integral_time": drawn(0.3, 40), "lead_time": drawn(5e-4, 2e-2), "lead_ratio": drawn(1.2, 4)}
        law = PidLead(gain=drawn(0.05, 12), **numbers)
    if random.random() < 0.6:
        law = law + PressureFeedback(gain=drawn(1e-10, 1e-8), corner=drawn(0.05, 20))
    return law


@cache
def space():
    return envelope({name: wb.variation(RIG, name) for name in ("nominal", "mass-50")}, (0.0, 0.5))


@cache
def drawn_plants():
    config = RobustnessConfig.load(EXPERIMENTS / "robustness.toml", plants=3)
    return plants_by_block(config)(0.3e-3, range(3)), [place for place in places(config) if place.position is None]


@pytest.mark.parametrize("design", [ISSUE, *map(random_design, [np.random.default_rng(7)] * 16)], ids=lambda _: "")
def test_every_caller_has_the_margins_of_a_dense_grid(design):
    controller, loop = design.build(PERIOD), wb.ClosedLoop(RIG, design, ideal=True)
    setup: LoopSetup = loop.setup
    points = setup.null_smooth, setup.moving
    here = [expected_at(setup.engine.plant, about, controller, setup.smooth) for about in points]
    for expected, found in zip(here, (loop.margins().null, loop.margins().moving), strict=True):
        same_loop(expected, found)
    stable = all(radius < 1 - 1e-9 for radius, *_ in here)
    _, row = judge(design, wb.SCENARIOS["position-10mm"], setup, linear_loops(design, setup))  # as `run` has it
    assert row["stable"] is stable
    if stable:
        same((0.0, max(h[1] for h in here), np.fmin(*(h[2] for h in here))), 0.0, row["ms"], row["gain_margin_db"])
    lanes = space().varied  # as `tune` has it
    smooth = lanes.engine.plant.without_dry_friction(lanes.p)
    (_, found), *_ = space().margins(controller)
    for points, margins in zip((lanes.null, lanes.moving), found, strict=True):
        for lane in (1, 2):
            about = Equilibrium(points.x[lane], points.u[lane], 0.0)
            expected = expected_at(lanes.engine.plant, about, controller, smooth[lane])
            same(expected, margins.radius[lane], margins.ms[lane], margins.gain_margin_db[lane])
    plants, (place, *_) = drawn_plants()
    columns = loops_at(plants, {"": controller}, place)[""]
    points, plant = getattr(plants, place.point), plants.engine.plant
    smooth = plant.without_dry_friction(plants.draw.p)
    for lane in (1, 2):
        about = Equilibrium(points.x[lane], points.u[lane], 0.0)
        expected = expected_at(plant, about, controller, smooth[lane])
        same(expected, *(columns[name][lane] for name in ("radius", "ms", "gain_margin_db")))


@pytest.mark.parametrize("gain", [0.3, 1.0, 3.0, 4.5, 7.0])
def test_live_has_the_margins_of_a_dense_grid(gain):
    session, config = live()
    spec = config.steps.controllers[0]
    asked = {"controller": spec.name, "scenario": "position-10mm", "numbers": {"gain": gain}, "rig": {}}
    loop = wb.ClosedLoop(RIG, P(gain=gain) + spec.compensators[0] if spec.compensators else P(gain=gain))
    setup, controller = loop.setup, loop.controller.build(PERIOD)
    points = setup.null_smooth, setup.moving
    here = [expected_at(setup.engine.plant, about, controller, setup.smooth) for about in points]
    row = session.view(asked)["rows"][0]
    assert row["stable"] is all(radius < 1 - 1e-9 for radius, *_ in here)
    if row["stable"]:
        same((0.0, max(h[1] for h in here), np.fmin(*(h[2] for h in here))), 0.0, row["ms"], row["gain_margin_db"])


@cache
def live():
    config = load_live(EXPERIMENTS / "position_step.toml")
    return Session(config), config


# Plants of transfer functions: light modes and zeros, delays, poles at 0 and beyond it.


def linear(system, delay=0.0):
    return wb.linear_plant(system, PERIOD, stroke=1.0, delay=delay)


def random_system(random):
    s = control.tf("s")
    system = control.tf([float(np.exp(random.uniform(-2, 3)))], [1.0])
    for _ in range(random.integers(1, 4)):
        kind, w = random.integers(5), float(np.exp(random.uniform(0, 7)))
        zeta = float(np.exp(random.uniform(np.log(1e-5), 0)))
        mode = 1 / ((s / w) ** 2 + 2 * zeta * (s / w) + 1)
        near = w * float(np.exp(random.normal(0, 0.1)))
        pair = ((s / near) ** 2 + 2e-3 * (s / near) + 1) * mode
        system *= (1 / (s / w + 1), mode, pair, 10 / s, 1 / (s / w - 1) if random.random() < 0.3 else mode)[kind]
    return system


def random_rig(random):
    refused = ""
    for _ in range(5):
        try:
            return linear(random_system(random), float(random.choice([0.0, 0.4e-3, 3e-3])))
        except wb.InputError as error:  # no plant that a rig can be, such as one of too many states
            refused = str(error)
    raise AssertionError(refused)


@pytest.mark.parametrize("seed", range(40))
def test_random_linear_plants_have_the_margins_of_a_dense_grid(seed):
    random = np.random.default_rng(seed)
    rig = random_rig(random)
    for gain in np.exp(random.uniform(-6, 3, 3)).tolist():
        loop = wb.ClosedLoop(rig, P(gain=gain), ideal=True)
        about, controller = loop.setup.null_smooth, loop.controller.build(PERIOD)
        same_loop(expected_at(loop.setup.engine.plant, about, controller, loop.setup.smooth), loop.margins().null)


@pytest.mark.parametrize(("gain", "decibels"), [(1.05, 0.42), (3.0, 9.54)])
def test_zero_frequency_counts(gain, decibels):
    """10/(s - 10) is unstable below a gain of 1: at 0 Hz, where nothing turns."""
    margins = wb.ClosedLoop(linear(control.tf([10.0], [1.0, -10.0])), P(gain=gain), ideal=True).margins()
    assert margins.stable
    assert margins.gain_margin_db == pytest.approx(decibels, abs=0.01)
    assert margins.ms >= 1 / (1 - 1 / gain) / gain - 1e-3


def test_where_a_loop_is_infinite_its_sensitivity_is_zero():
    """An undamped mode in series with an integrator's lag, under P: damped by the loop alone."""
    s = control.tf("s")
    system = 20 * (s**2 + 0.4 * s + 30.0**2) / (s * (s**2 + 32.0**2))
    loop = wb.ClosedLoop(linear(system), P(gain=1.0), ideal=True)
    margins, setup = loop.margins(), loop.setup
    assert margins.stable
    same_loop(expected_at(setup.engine.plant, setup.null_smooth, loop.controller.build(PERIOD), None), margins.null)
    f, sensitivity = margins.null.f, np.abs(margins.null.sensitivity)
    assert sensitivity[np.abs(f - 32 / (2 * np.pi)).argmin()] < 1e-3


def test_a_play_in_the_pilot_changes_no_margin_at_null():
    """Its state is coupled to others in no more than a chain: modes that no basis parts."""
    (effect,) = (each for each in effects_for(RIG) if (each.name, each.formula) == ("pilot.hysteresis", "play"))
    stuck = replace(RIG, effects=(effect_use(effect, {}, "a test"),))
    law = P(gain="0.24 1/m").build(PERIOD)
    found = []
    for rig in (RIG, stuck):
        engine = wb.Engine(wb.build(rig))
        found.append(plant_lanes(rig, engine, ["own"], engine.plant.p[None], np.zeros(1)).margins(law)[0])
    plain, played = found
    assert played.ms == pytest.approx(plain.ms, rel=1e-6)
    assert played.gain_margin_db == pytest.approx(plain.gain_margin_db, abs=1e-4)
