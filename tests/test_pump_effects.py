"""What pump drives show: each effect's formula by hand, gone where it is off, seen where it is typical."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from effect_laws import evaluated

from workbench.base.errors import InputError
from workbench.base.units import to_si
from workbench.engine import Engine
from workbench.engine.emit import first_unsupported
from workbench.linear import equilibrium
from workbench.plant import build
from workbench.plant.effects import EQUATIONS, LIBRARY, PUMP_LIBRARY, applies, find, known_effects, number_effects
from workbench.plant.effects.declared import effects_for
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

NAMES = {
    "pump.leakage": "flow",
    "pump.ripple": "flow",
    "hose.compliance": "flow",
    "selector.delay": "drive",
    "selector.check": "flow",
    "accumulator.line": "flow",
    "accumulator.stiffness": "flow",
    "motor.losses": "drive",
    "load.buildup": "force",
    "load.throttle": "force",
    "jack.internal_leakage": "flow",
    "sensor.zero": "sensor",
}
by_title = pytest.mark.parametrize("effect", PUMP_LIBRARY, ids=lambda effect: effect.title)


class Cycle:
    """A stroke out against a load and back, and what each effect does to it."""

    def __init__(self):
        self.rig = load_rig("pump-rig").with_corrector("motor")
        self.base = build(self.rig)
        self.t = np.arange(151) * 0.03
        command = np.select([self.t < 2.0, self.t < 2.4, self.t < 3.9], [0.6, 0.05, -0.5], 0.0)
        self.u = np.zeros((len(self.t), len(self.base.inputs)))
        inputs = {"command": command, "direction": np.sign(command), "load_setting": np.full(151, 30e5)}
        for name, values in inputs.items():
            self.u[:, self.base.input(name)] = values
        self.x = Engine(self.base, 1e-6).run(self.base.start, self.t, self.u).x
        self.y = self.base.observe(self.x, self.u)
        self._runs = {}

    def run(self, effect):
        """The plant, and lanes: all off, typical, and each number at its ends; parameters and batch."""
        if effect.title not in self._runs:
            plant = build(self.rig, also=(effect,))
            typical = {n.name: n.typical for n in effect.numbers}
            off = typical | {n.name: n.off for n in effect.numbers if n.off is not None}
            lanes = [off, typical, *(typical | {n.name: end} for n in effect.numbers for end in (n.low, n.high))]
            p = np.array([plant.parameter_values(**{effect.key(k): v for k, v in lane.items()}) for lane in lanes])
            start = plant.start.copy()
            for i, state in enumerate(self.base.states):
                start[plant.state(state.name)] = self.x[0, i]
            engine = Engine(plant, 1e-6)
            batch = engine.run_batch(np.tile(start, (len(lanes), 1)), self.t, self.u, p)
            self._runs[effect.title] = plant, p, batch
        return self._runs[effect.title]


@pytest.fixture(scope="session")
def cycle():
    return Cycle()


def test_the_names_are_there_on_pump_rigs_alone(cycle):
    assert {effect.name: effect.equation for effect in PUMP_LIBRARY} == NAMES
    assert all(applies(effect, cycle.rig) for effect in PUMP_LIBRARY)
    assert not any(applies(effect, load_rig("jack-10t")) for effect in PUMP_LIBRARY)
    assert [effect.title for effect in known_effects()] == [effect.title for effect in (*LIBRARY, *PUMP_LIBRARY)]


def test_none_is_switched_on_in_the_rig_file(cycle):
    assert cycle.rig.effects == ()


@by_title
def test_an_effect_can_be_taken_away_and_shown(effect):
    assert effect.equation in EQUATIONS
    assert effect.source
    assert effect.shows
    assert any(number.off is not None for number in effect.numbers)
    for number in effect.numbers:
        assert number.low <= number.typical <= number.high
        assert to_si(1.0, number.shown, number.si) > 0
        assert number.meaning


@by_title
def test_off_is_the_base_plant(cycle, effect):
    """With every strength off, the plant obeys the base equations to the last digits all along its way."""
    plant, p, batch = cycle.run(effect)
    x, base, u = batch.x[0], cycle.base, cycle.u
    rows = [plant.state(state.name) for state in base.states]
    own = x[:, rows]
    rates, expected = np.array(plant.f(x.T, u.T, p[0]))[rows].T, np.array(base.f(own.T, u.T, base.p)).T
    assert np.all(np.abs(rates - expected) <= 1e-9 * np.abs(expected).max(0))
    assert np.all(np.abs(own - cycle.x) <= 2e-3 * base.scale)


@by_title
def test_a_typical_strength_is_seen(cycle, effect):
    plant, p, batch = cycle.run(effect)
    names = ("position", "pa", "pb")
    columns = [cycle.base.output(name) for name in names]
    change = np.abs(plant.observe(batch.x[1], cycle.u, p[1]) - cycle.y)[:, columns].max(axis=0)
    noise = [cycle.rig.sensors[name].noise for name in names]
    assert np.max(change / noise) > 0.5


@by_title
def test_every_number_can_be_at_its_ends(cycle, effect):
    assert cycle.run(effect)[2].ok.all()


@by_title
def test_slopes_exist_and_run_as_machine_code(cycle, effect):
    plant, p, batch = cycle.run(effect)
    x, u, v = ca.SX.sym("x", plant.n), ca.SX.sym("u", len(plant.inputs)), ca.SX.sym("p", len(plant.parameters))
    both = ca.vertcat(plant.f(x, u, v), plant.h(x, u, v))
    slopes = ca.Function("slopes", [x, u, v], [ca.jacobian(both, x), ca.jacobian(both, v)])
    assert first_unsupported(slopes) is None
    for lane, states in enumerate(batch.x):
        parts = slopes.map(len(states))(states.T, cycle.u.T, p[lane])
        assert all(np.isfinite(np.array(part)).all() for part in parts)


def test_a_rig_declares_one_by_name(cycle):
    declared = replace(cycle.rig, effects=(EffectUse("hose.compliance", "stiffening", {}),))
    assert "hose.compliance.CA" in build(declared).parameters
    with pytest.raises(InputError, match="a three-stage valve, which has no direction valves that join"):
        build(replace(load_rig("jack-10t"), effects=(EffectUse("sensor.zero", "", {}),)))


def value(name, formula, slot, passes, p=None, x=None, **offers):
    return evaluated(find(name, formula), slot, passes, p, x, **offers)


def test_the_formulas_of_leaks():
    assert value("pump.leakage", "laminar", "pump_flow", 1e-5, {"C": 1e-13}, drop=40e5, speed=1)[0] == [1e-5 - 4e-7]
    (left,) = value("pump.leakage", "orifice", "pump_flow", 1e-5, {"k": 5e-10}, drop=40e5, speed=1)[0]
    assert left == pytest.approx(1e-5 - 5e-10 * np.sqrt(40e5), rel=1e-6)
    leaks = value("jack.internal_leakage", "laminar", "leakage", (0.0, 0.0), {"C": 1e-13}, pa=30e5, pb=10e5)[0]
    assert leaks == pytest.approx([2e-7, -2e-7])
    leaks = value("jack.internal_leakage", "orifice", "leakage", (0.0, 0.0), {"k": 1e-10}, pa=10e5, pb=30e5)[0]
    assert leaks == pytest.approx([-1e-10 * np.sqrt(20e5), 1e-10 * np.sqrt(20e5)])


def test_the_formulas_of_hoses_and_accumulator():
    assert value("hose.compliance", "linear", "hoses", (1e-12, 0.0), {"CA": 2e-12, "CB": 3e-12}, pa=0, pb=0)[0] == [
        pytest.approx(3e-12),
        pytest.approx(3e-12),
    ]
    stiff = value("hose.compliance", "stiffening", "hoses", (0.0, 0.0), {"CA": 2e-12, "p": 5e6}, pa=5e6, pb=0)[0]
    assert stiff[0] == pytest.approx(1e-12)
    for flow, expected in ((1e-5, 0.25e-5), (-1e-5, -1e-5)):
        (throttled,) = value(
            "accumulator.line", "one-way throttle", "accumulator", flow, {"r": 3.0}, drop=0, pressure=0
        )[0]
        assert throttled == pytest.approx(expected)
    (turbulent,) = value("accumulator.line", "turbulent", "accumulator", 1e-5, {"k": 1e5}, drop=0, pressure=0)[0]
    assert turbulent * (1 + 1e5 * turbulent) == pytest.approx(1e-5, rel=1e-6)
    assert value("accumulator.stiffness", "less gas", "gas_stiffness", 1e9, {"s": 0.5}, pressure=6e5)[0] == [1.5e9]


def test_the_formulas_of_valves_and_motor():
    (passed,) = value("selector.check", "cracking", "delivery_drop", 5e5, {"pc": 1e5}, drop=5e5)[0]
    assert passed == pytest.approx(4e5, rel=1e-3)
    (shut,) = value("selector.check", "cracking", "delivery_drop", -5e5, {"pc": 1e5}, drop=-5e5)[0]
    assert abs(shut) < 10
    _, rates = value("selector.delay", "first order", "direction", 1.0, {"tau": 0.02}, {"d": 0.5})
    assert rates["d"] == pytest.approx(0.5 / 0.02, rel=1e-3)
    assert value("motor.losses", "dry", "motor_losses", 0.1, {"T": 0.05}, speed=100.0, drop=0)[0] == [
        pytest.approx(0.15)
    ]
    assert value("motor.losses", "viscous", "motor_losses", 0.1, {"c": 1e-3}, speed=100.0, drop=0)[0] == [
        pytest.approx(0.2)
    ]
    (rippled,), rates = value(
        "pump.ripple", "sine", "pump_flow", 1.0, {"a": 0.1, "n": 7.0}, {"angle": 0.5}, speed=3.0, drop=0
    )
    assert rippled == pytest.approx(1 + 0.1 * np.sin(3.5))
    assert rates["angle"] == 3.0


def test_a_direction_valve_of_second_order_has_its_damping():
    p, x = {"tau": 0.01, "zeta": 0.8}, {"d": 0.3, "d_rate": 0.2}
    (passed,), rates = value("selector.delay", "second order", "direction", 1.0, p, x)
    assert passed == pytest.approx(0.3, abs=1e-3)  # read out over 10 us
    # tau^2 d'' = 1 - d - 2 zeta tau d', with d' = d_rate / tau
    assert rates["d"] == pytest.approx(0.2 / 0.01, rel=1e-3)
    assert rates["d_rate"] == pytest.approx((1 - 0.3 - 2 * 0.8 * 0.2) / 0.01, rel=1e-3)


@pytest.mark.parametrize(
    ("formula", "number", "torque"),
    [("dry", ("T", 0.2), lambda w: 0.2), ("viscous", ("c", 2e-3), lambda w: 2e-3 * w)],
)
def test_losses_slow_a_motor_as_its_torques_balance(cycle, formula, number, torque):
    """Steady at 60 % voltage: km i = D dp + T0 + Tp dp + what is lost besides."""
    plant = build(cycle.rig, also=(find("motor.losses", formula),))
    p = plant.parameter_values(**{f"motor.losses.{number[0]}": number[1]})
    point = equilibrium(plant, command=0.6, p=p)
    x = dict(zip([state.name for state in plant.states], point.x, strict=True))
    drop, rig = x["Pd"] - x["P0"], cycle.rig
    lost = rig["T0"] + rig["Tp"] * drop + torque(x["w"])
    assert rig["km"] * x["im"] == pytest.approx(rig["D"] * drop + lost, rel=1e-5)
    plain = equilibrium(cycle.base, command=0.6)
    assert x["w"] < plain.x[cycle.base.state("w")] - 1.0


def test_losses_are_sought_where_a_motor_is_driven(cycle):
    names = [{effect.name for effect in effects_for(rig)} for rig in (cycle.rig, cycle.rig.with_corrector("speed"))]
    assert names[0] - names[1] == {"motor.losses"}
    assert "supply.sag" not in names[0]


@pytest.mark.parametrize("formula", ["slip", "gap and slip", "slip and leak"])
def test_a_load_builds_up_to_what_is_set_and_lets_go(formula):
    """Pressed slowly onward it ends at the set push, turned back it is gone after that travel; a leak lets it go."""
    own = [number.name for number in find("load.buildup", formula).numbers]
    p = {name: at for name, at in {"k": 2e6, "drag": 0.0, "gap": 1e-3, "tau": 20.0}.items() if name in own}
    travel, pushes = 0.0, []
    for v in (*[0.01] * 1000, *[-0.01] * 1000):
        (push,), rates = value(
            "load.buildup", formula, "loader", 0.0, p, {"s": travel}, full=8e3, position=0, velocity=v
        )
        travel += 1e-3 * rates["s"]
        pushes.append(push)
    assert max(pushes) == pytest.approx(8e3, rel=0.03)
    assert pushes[-1] == pytest.approx(0.0, abs=1e-9)
    assert travel == pytest.approx(-1e-3 if formula == "gap and slip" else 0.0, abs=1e-4)


def test_the_formulas_of_throttles_and_zero_points():
    assert value("load.throttle", "laminar", "body_force", 0.0, {"c": 2e4}, position=0, velocity=-0.01)[0] == [-200.0]
    (force,) = value("load.throttle", "orifice", "body_force", 0.0, {"d": 1e6}, position=0, velocity=-0.01)[0]
    assert force == pytest.approx(-100, rel=1e-3)
    assert value("sensor.zero", "offset", "sensor_pa", 5e5, {"a": 1e4})[0] == [5.1e5]
    assert value("sensor.zero", "offset", "sensor_pb", 5e5, {"b": -1e4})[0] == [4.9e5]


def test_a_described_number_may_be_another_one(cycle):
    """The candidate that shifts AB is the rig with that AB."""
    (candidate,) = [effect for effect in number_effects(cycle.rig) if effect.shifts == "AB"]
    shifted = build(cycle.rig, also=(candidate,))
    p = shifted.parameter_values(shifted.p, **{"number.AB.by": -3e-4})
    other = build(cycle.rig.with_values(AB=cycle.rig["AB"] - 3e-4))
    x, u = cycle.x[60], cycle.u[60]
    assert np.array(shifted.f(x, u, p)).ravel() == pytest.approx(np.array(other.f(x, u, other.p)).ravel(), rel=1e-9)


def test_candidates_reach_beyond_the_trust_of_their_numbers(cycle):
    for effect in number_effects(cycle.rig):
        number, (by,) = cycle.rig.numbers[effect.shifts], effect.numbers
        assert number.low is not None
        assert by.low <= 0 <= by.high
        assert by.low <= by.typical <= by.high
        assert not cycle.rig.specs[effect.shifts].problem(number.low + by.low)
