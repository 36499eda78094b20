"""Laws: shells stand around them as around plain Python; they run compiled as in Python; linear about a point."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from test_compiled_loop import agree
from test_controllers import CONTROLLERS, make, size

from workbench.base.errors import InputError
from workbench.commands.live.config import load_live
from workbench.commands.run.options import load_config
from workbench.control.compensators import compensated
from workbench.control.controller_type import controller
from workbench.control.law import Law, LawController
from workbench.control.piecewise_linear import CommandMap, PiecewiseLinear, interpolated
from workbench.control.protocol import graph_law, linear_view
from workbench.control.shell import Around
from workbench.engine import Engine
from workbench.linear import Equilibrium, equilibrium
from workbench.linear.equilibria import equilibria
from workbench.loop.lane_laws import lane_laws
from workbench.loop.margins import LoopLanes, linear_loop
from workbench.loop.rig_variations import variation, with_delay
from workbench.loop.sampled_lanes import sampled_lane, sampled_lanes, signals_at
from workbench.loop.sampled_loop import SampledLoop
from workbench.plant import build
from workbench.rigs.rig_file import load_rig

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
TUNED = {spec.name: spec for spec in load_config(EXPERIMENTS / "position_tuned.toml").controllers}
ALL = TUNED | {
    spec.name: spec
    for name in ("force_tuned", "position_known")
    for spec in load_config(EXPERIMENTS / f"{name}.toml").controllers
}
PERIOD = 1e-3
SCHEDULE = PiecewiseLinear(np.array([-0.25, -0.1, 0.0, 0.1, 0.25]), np.array([0.3, 0.8, 1.0, 0.9, 0.4]))
MAP = CommandMap(np.array([-0.5, -0.004, 0.0, 0.004, 0.5]), np.array([-0.5, -0.002, 0.0, 0.002, 0.5]))


class _Scheduled:
    """The pressure feedback of a controller with a schedule."""

    into = "command"

    def __init__(self, law):
        self.law, self.schedule = law, SCHEDULE


class _Map:
    into = "map"
    command_map = MAP


def scheduled(name):
    """A tuned controller, its pressure feedback with a schedule, the command through a map."""
    spec = TUNED[name]
    bare = type(spec)(spec.name, spec.use, spec.design)
    pressure = next(part for part in spec.compensators if part.use.endswith("PressureFeedback"))
    controller = compensated(bare.build(PERIOD), _Scheduled(pressure.build(PERIOD).law))
    return compensated(controller, _Map())


class Network(LawController):
    """P with a small network of error and speed, limited: no linear law, and states of its own."""

    def __init__(self, seed):
        random, hidden = np.random.default_rng(seed), 6
        numbers = {
            "inner": random.normal(0, 1, hidden * 3), "outer": random.normal(0, 0.02, hidden), "gain": 3.0, "most": 0.3
        }  # fmt: skip

        def limited(x, s, q):
            e = s.reference - s.position
            inside = ca.vertcat(e / 0.01, (s.position - x.before) / 1e-3, (s.pa - s.pb) / 1e7)
            layer = ca.tanh(ca.reshape(q.inner, hidden, 3) @ inside)
            return ca.fmin(q.most, ca.fmax(-q.most, q.gain * e + ca.dot(q.outer, layer)))

        def start(s, u):
            x = SimpleNamespace(before=s.position)
            values = SimpleNamespace(**{name: ca.DM(value) for name, value in numbers.items()})
            return [s.position], u - limited(x, s, values)

        law = Law.of(
            lambda x, s, o, q: limited(x, s, q) + o,
            lambda x, s, v, o, q: [s.position],
            start,
            states=("before",),
            numbers=numbers,
            measures=("position", "pa", "pb"),
            period=PERIOD,
        )
        super().__init__(law)


MAKERS = {
    "p": lambda: scheduled("p-dp"),
    "tvc": lambda: scheduled("tvc"),
    "pid": lambda: scheduled("pid-lead"),
    "crone3": lambda: scheduled("crone3"),
    "network": lambda: Network(0),
}


@settings(max_examples=20, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    name=st.sampled_from(sorted(MAKERS)),
    variant=st.sampled_from(["nominal", "mass-50", "beta-50"]),
    delay=st.sampled_from([0.0, 0.3e-3, 1.4e-3]),
    seed=st.one_of(st.none(), st.integers(0, 99)),
    place=st.floats(-0.2, 0.2),
    corners=st.lists(st.floats(-0.03, 0.03), min_size=2, max_size=4),
)
def test_a_graph_runs_compiled_as_its_controller_in_python(name, variant, delay, seed, place, corners):
    rig = variation(load_rig("jack-10t"), variant)
    rig = with_delay(rig, delay) if delay else rig
    engine = Engine(build(rig))
    rest = equilibrium(engine.plant, position=place)
    reference = place + np.repeat(corners, 200 // len(corners) + 1)[:200]
    runs = [
        [SampledLoop(engine, rig, MAKERS[name](), rest, seed, compiled=compiled).run(reference)]
        for compiled in (False, True)
    ]
    agree(*runs, 0.03)


@pytest.mark.parametrize("name", MAKERS)
def test_none_of_them_is_a_linear_law(name):
    controller = MAKERS[name]()
    assert graph_law(controller).matrices is None
    with pytest.raises(InputError, match="operating point"):
        linear_view(controller)


class Plain:
    """A controller in plain Python: the same, without its graph."""

    def __init__(self, inner):
        self._inner, self.measures = inner, inner.measures
        self.reset, self.compute, self.update = inner.reset, inner.compute, inner.update

    def linear(self):
        return self._inner.linear()


@pytest.mark.parametrize("name", ["p-dp-shaped", "pid-lead", "crone1", "lqg", "p-dp-force", "p-dp-flow-known"])
def test_compensators_around_plain_python_are_those_around_a_law(name):
    """The drive is slow and saturates: what is learned of it differs from what was demanded."""
    spec, random = ALL[name], np.random.default_rng(1)
    whole = spec.build(PERIOD)
    bare = replace(spec, compensators=(), stiffness=None, softest=None, stiffest=None).build(PERIOD)
    inner, shells = whole, []
    while hasattr(inner, "inner"):
        shells.append(inner.graph_law().shell)
        inner = inner.inner
    around = Plain(bare)
    for shell in reversed(shells):
        around = Around(around, shell)
    assert around.measures == whole.measures
    scale = {signal: 0.01 * size(signal) for signal in whole.measures}
    measured, sent = {signal: value * random.normal() for signal, value in scale.items()}, 0.1
    for each in (whole, around):
        each.reset(measured[whole.measures[0]], measured, sent)
    for k in range(60):
        measured = {signal: value * np.sin(0.1 * k + random.normal()) for signal, value in scale.items()}
        demanded = [each.compute(2 * scale[whole.measures[0]], measured) for each in (whole, around)]
        assert demanded[1] == pytest.approx(demanded[0], rel=1e-9, abs=1e-12)
        sent += np.clip(np.clip(demanded[0], -0.05, 0.05) - sent, -0.004, 0.004)
        whole.update(sent)
        around.update(sent)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_start_is_without_a_bump(name):
    random, controller = np.random.default_rng(2), make(name)
    for _ in range(20):
        measured = {signal: 0.1 * size(signal) * random.normal() for signal in controller.measures}
        reference, command = measured[controller.measures[0]] * random.normal(), random.uniform(-1, 1)
        controller.reset(reference, measured, command)
        assert controller.compute(reference, measured) == pytest.approx(command, abs=1e-9)


@pytest.mark.parametrize("name", sorted(TUNED))
def test_starts_in_lanes_are_those_of_each_loop(name):
    law = graph_law(TUNED[name].build(1e-3))
    random, scales = np.random.default_rng(3), np.array([size(law.measures[0]), *map(size, law.measures)])
    signals, commands = scales * random.normal(1.0, 0.3, (7, len(scales))), random.uniform(-0.2, 0.2, 7)
    x, offset = law.starts(signals, commands)
    for lane in range(7):
        own, constant = law.start(signals[lane], commands[lane])
        np.testing.assert_allclose(x[lane], np.array(own).ravel(), rtol=1e-12, atol=1e-10 * np.abs(x).max(initial=0.0))
        assert offset[lane] == pytest.approx(float(constant), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_the_matrices_of_a_linear_law_are_the_law(name):
    """With states that are filled up, and a drive that does something else than what is demanded."""
    law, random = graph_law(make(name)), np.random.default_rng(4)
    dense = law.dense()
    assert law.matrices is not None
    assert dense.states % 4 == 0
    signals, command = random.normal(size=(1, 1 + len(law.measures))), random.normal(size=1)
    (x, o), (z, _) = law.starts(signals, command), dense.starts(signals, command)
    x, z = x[0], z[0]
    for _ in range(20):
        s, v = random.normal(size=1 + len(law.measures)), random.normal()
        demanded = [float(each.graphs.output(at, s, o, each.numbers)) for each, at in ((law, x), (dense, z))]
        assert demanded[1] == pytest.approx(demanded[0], rel=1e-9, abs=1e-9)
        x = np.array(law.graphs.advance(x, s, v, o, law.numbers)).ravel()
        z = np.array(dense.graphs.advance(z, s, v, o, dense.numbers)).ravel()


def test_the_schedule_and_the_map_count_in_the_linear_view():
    plant = build(load_rig("jack-10t"))
    points = [equilibrium(plant, position=place, speed=speed) for place, speed in ((0.0, 0.0), (0.1, 0.0), (0.1, 0.5))]
    views = [linear_view(scheduled("p-dp"), sampled_lane(plant, about, PERIOD).point) for about in points]
    gains = [np.abs(view.D[0, view.input_labels.index("pa")]) for view in views]
    assert gains[1] / gains[0] == pytest.approx(0.9, rel=1e-6)
    slopes = (MAP.to[3] - MAP.to[2]) / (MAP.at[3] - MAP.at[2]), (MAP.to[4] - MAP.to[3]) / (MAP.at[4] - MAP.at[3])
    assert gains[2] / gains[1] == pytest.approx(slopes[1] / slopes[0], rel=1e-6)


@given(x=st.floats(-1, 1))
def test_a_map_and_its_inverse_are_each_others(x):
    there = x + MAP.shift(x)
    assert there + MAP.back(there) == pytest.approx(x, abs=1e-15)
    assert abs(x) < 0.5 or there == x


def test_tables_that_are_none_are_refused():
    with pytest.raises(InputError, match="increasing order"):
        PiecewiseLinear(np.array([0.0, 0.0]), np.array([1.0, 2.0]))
    with pytest.raises(InputError, match="go to themselves"):
        CommandMap(np.array([-1.0, 1.0]), np.array([-1.0, 0.9]))


@pytest.mark.parametrize("near", [0.0, -1e-17, 1e-17, 3e-18])
def test_the_slope_of_a_table_at_a_point_is_that_of_a_side(near):
    """Not of both nor of none, whatever rounding does: a law at null is judged there."""
    at, values = np.array([-0.3, -0.1, 0.0, 0.1, 0.3]), np.array([0.0, 0.1, 0.4, 0.7, 0.9])
    x = ca.SX.sym("x")
    slope = ca.Function("slope", [x], [ca.jacobian(interpolated(ca.DM(at), ca.DM(values), x), x)])
    for place, sides in (
        (-0.3, (0.0, 0.5)),
        (-0.1, (0.5, 3.0)),
        (0.0, (3.0, 3.0)),
        (0.1, (3.0, 1.0)),
        (0.3, (1.0, 0.0)),
    ):
        assert min(sides) - 1e-9 <= float(slope(place + near)) <= max(sides) + 1e-9


@pytest.mark.parametrize("name", ["p", "tvc", "network"])
def test_margins_in_lanes_are_those_of_each_operating_point(name):
    rig = with_delay(load_rig("jack-10t"), 0.3e-3)
    plant, controller = build(rig), MAKERS[name]()
    p = np.tile(plant.p, (3, 1))
    p[1, plant.parameters.index("M")] *= 0.5
    p[2, plant.parameters.index("beta")] *= 0.6
    points = equilibria(plant, p, np.array([0.0, 0.12, -0.2]), 0.1)
    sampled = sampled_lanes(plant, points, p, tuple(controller.measures), PERIOD)
    margins = LoopLanes(sampled, lane_laws(controller, sampled.signals)).margins()
    for lane in range(3):
        about = Equilibrium(points.x[lane], points.u[lane], 0.1)
        loop = linear_loop(plant, about, controller, PERIOD, p[lane])
        assert margins.stable[lane] == loop.stable
        if loop.stable:
            assert margins.ms[lane] == pytest.approx(loop.ms, rel=1e-4)
            assert margins.gain_margin_db[lane] == pytest.approx(loop.gain_margin_db, abs=1e-3)


def test_a_graph_without_states_is_linear_in_lanes_too(rig, plant):
    spec = TUNED["p"] + controller("controllers.pressure:PressureFeedback", gain="2e-4 1/bar", column="300 mm")
    law = graph_law(spec.build(PERIOD))
    assert law.states == 0
    assert law.matrices is None
    points = equilibria(plant, np.tile(plant.p, (2, 1)), np.array([0.0, 0.1]))
    at = signals_at(plant, points, np.tile(plant.p, (2, 1)))
    lanes = lane_laws(spec.build(PERIOD), at)
    for lane in range(2):
        view = linear_view(spec.build(PERIOD), {name: float(values[lane]) for name, values in at.items()})
        assert lanes.d[lane] == pytest.approx(view.D[0], rel=1e-9)


def test_designs_of_one_structure_share_their_graphs():
    def graphs(**numbers):
        feedback = controller("controllers.pressure:PressureFeedback", gain="2e-4 1/bar", column="300 mm", **numbers)
        return graph_law((TUNED["p"] + feedback).build(PERIOD)).graphs

    assert graphs(corner=1.0) is graphs(corner=2.0)
    assert graphs(corner=1.0) != graphs(corner=0.0)


def test_one_lane_is_without_states_that_no_measurement_moves(rig, plant):
    flow = load_live(EXPERIMENTS / "tune_p_dp_flow.toml").steps.controllers[0]
    shapes = []
    for lanes in (1, 2):
        p = np.tile(plant.p, (lanes, 1))
        points = equilibria(plant, p, np.linspace(0.0, 0.1, lanes))
        shapes.append(lane_laws(flow.build(PERIOD), signals_at(plant, points, p)).a.shape[1:])
    assert shapes[0] == shapes[1]
