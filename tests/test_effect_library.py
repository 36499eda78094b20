"""The library as a whole: what there is, where it applies, and what it does to a rig that is driven hard."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.base.units import to_si
from workbench.engine import Engine
from workbench.engine.emit import first_unsupported
from workbench.linear import equilibrium, linearise
from workbench.plant import assembly, build, build_force_port, build_pilot_bench, build_valve_bench
from workbench.plant.effects import (
    EQUATIONS,
    LIBRARY,
    PUMP_LIBRARY,
    SLOTS,
    applies,
    find,
    missing,
    numbers_of,
    valves_with,
)
from workbench.plant.effects.declared import effects_for
from workbench.plant.valve import VALVES as PLANT_VALVES
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import bundled, load_rig
from workbench.rigs.valve import VALVES

NAMES = {
    "drive.delay": ("drive", "drive timing"),
    "drive.lag": ("drive", "drive timing"),
    "drive.saturation": ("drive", ""),
    "drive.corrector": ("drive", ""),
    "pilot.hysteresis": ("pilot", "spool stick"),
    "main.stiction": ("main", "spool stick"),
    "main.rate": ("main", "spool stick"),
    "main.deadband": ("flow", ""),
    "main.asymmetry": ("flow", ""),
    "supply.sag": ("flow", ""),
    "supply.limit": ("flow", ""),
    "line.hose": ("flow", ""),
    "oil.air": ("flow", ""),
    "oil.warming": ("flow", ""),
    "jack.external_leakage": ("flow", ""),
    "jack.friction": ("force", ""),
    "jack.crossport_relief": ("flow", ""),
    "load.backlash": ("force", ""),
    "load.bias": ("force", ""),
    "load.spring": ("force", ""),
    "load.compliance": ("force", ""),
    "sensor.lag": ("sensor", ""),
    "sensor.filter": ("sensor", "drive timing"),
    "sensor.bend": ("sensor", ""),
}
"""The names that configs, code and reports use, each with its equation and family."""

SEEN_IN = {
    "drive": ("current", "spool"),
    "pilot": ("current", "spool"),
    "main": ("current", "spool"),
    "flow": ("pa", "pb", "supply"),
    "force": ("pa", "pb", "acceleration", "position", "force"),
    "sensor": ("pa", "pb", "position", "force"),
}
SECOND_ORDER = dict.fromkeys(("drive", "pilot", "main", "flow"), ("pa", "pb", "position"))
RIGS = ("jack-10t", "festo-tp511")
EDGES = (
    *(f"drive.saturation {title}{shape}" for title in ("", "command ") for shape in ("hard", "one-sided")),
    *(f"main.rate {shape}" for shape in ("symmetric", "two-sided", "demand")),
    *(f"supply.limit {shape}" for shape in ("flow", "power")),
    *(f"jack.crossport_relief {shape}" for shape in ("linear", "orifice")),
)  # at off they have an edge, no slope
HARD = (0.4, -0.4, 0.05, -0.02, 0.8, -0.8)  # command, for 25 ms each
SMALL = {  # typical is what a 10 t jack shows: what a training cylinder would
    "supply.sag": 10.0,
    "jack.external_leakage": 0.1,
    "jack.friction": 0.1,
    "load.bias": 0.02,
    "load.spring": 0.1,
    "load.compliance": 50.0,
    "jack.crossport_relief": 0.05,
    "sensor.bend": 5.0,
}
SLOW = {"oil.warming.warmth"}  # begins where these few moves would not bring it
OPENS = {"p0": 3e5}  # Pa: no relief valve of a 10 t jack opens on a rig of 44 bar
TIGHT = 1e-7  # of the engine, where its usual 1e-5 leaves more about a knock than what is compared
by_title = pytest.mark.parametrize("effect", LIBRARY, ids=lambda effect: effect.title)


class Hard:
    """A rig under hard steps of the command, and what each effect does to it, each run once."""

    def __init__(self, name):
        self.rig = load_rig(name)
        self.base = build(self.rig)
        self.t = np.arange(len(HARD) * 25 + 1) * 1e-3
        self.u = np.zeros((len(self.t), len(self.base.inputs)))
        self.u[:, 0] = np.append(np.repeat(HARD, 25), 0.0)
        self.x = Engine(self.base, back_end="interpreted").run(equilibrium(self.base).x, self.t, self.u).x
        self.y = self.base.observe(self.x, self.u)
        self.exact = self.play(self.base, self.x[0], self.base.p)
        self._runs = {}

    def play(self, plant, start, p):
        """States where the moment of a knock is resolved, of chambers that were sucked."""
        return Engine(plant, TIGHT, back_end="interpreted").run(start, self.t, self.u, p).x

    def run(self, effect):
        """The plant, and lanes: all off, typical for this rig, and each number at its ends; parameters and batch."""
        if effect.title not in self._runs:
            plant = build(self.rig, also=(effect,))
            off = {n.name: n.off for n in effect.numbers if n.off is not None}
            typical = {n.name: n.typical for n in effect.numbers}
            lanes = [typical | {n.name: end} for n in effect.numbers for end in (n.low, n.high)]
            lanes = [off, strong(effect, self.rig), *lanes]
            p = np.array([plant.parameter_values(**{effect.key(k): v for k, v in lane.items()}) for lane in lanes])
            start = np.tile(self._start(plant, effect), (len(lanes), 1))
            self._runs[effect.title] = (
                plant,
                p,
                Engine(plant, back_end="interpreted").run_batch(start, self.t, self.u, p),
            )
        return self._runs[effect.title]

    def _start(self, plant, effect):
        """At rest; whatever is measured shows what it is."""
        start = equilibrium(plant).x if effect.equation == "sensor" else plant.start.copy()
        for i, state in enumerate(self.base.states):
            start[plant.state(state.name)] = self.x[0, i]
        for name in SLOW & {state.name for state in plant.states}:
            start[plant.state(name)] = 1.0
        return start


@pytest.fixture(scope="session", params=RIGS)
def hard(request):
    return Hard(request.param)


def strong(effect, rig):
    """Numbers that are typical for this rig."""
    factor, opens = (SMALL.get(effect.name, 1.0), OPENS) if rig.jack == "differential" else (1.0, {})
    plain = {n.name: n.typical if n.off is None else n.off + factor * (n.typical - n.off) for n in effect.numbers}
    return plain | {name: value for name, value in opens.items() if name in plain}


def test_all_names_are_there_with_their_equation_and_family():
    assert {effect.name: (effect.equation, effect.family) for effect in LIBRARY} == NAMES
    for name in NAMES:
        formulas = [effect for effect in LIBRARY if effect.name == name]
        assert len({(e.equation, e.family) for e in formulas}) == 1
        assert find(name, "") is formulas[0]
        needs = [len(e.numbers) + len(e.states) for e in formulas]
        assert needs[0] == min(needs)


@by_title
def test_an_effect_can_be_taken_away_and_shown(effect):
    assert effect.equation in EQUATIONS
    assert effect.source
    assert effect.shows
    assert any(number.off is not None for number in effect.numbers)
    for number in effect.numbers:
        inside = [number.typical, *([] if number.off is None else [number.off])]
        assert all(number.low <= value <= number.high for value in inside)
        assert number.off is None or number.off != number.typical
        assert to_si(1.0, number.shown, number.si) > 0
        assert number.meaning


@by_title
def test_off_is_the_base_plant(hard, effect):
    """With every strength off, the plant obeys the base equations to the last digits all along its way."""
    base, u = hard.base, hard.u
    skip_unless_applies(effect, hard.rig)
    plant, p, batch = hard.run(effect)
    x, rows = batch.x[0], [plant.state(s.name) for s in base.states]
    own = x[:, rows]
    rates, expected = np.array(plant.f(x.T, u.T, p[0]))[rows].T, np.array(base.f(own.T, u.T, base.p)).T
    assert np.all(np.abs(rates - expected) <= 1e-9 * np.abs(expected).max(0))
    seen, expected = plant.observe(x, u, p[0]), base.observe(own, u)
    assert np.all(np.abs(seen - expected) <= 1e-9 * np.abs(expected).max(0))
    assert np.all(np.abs(hard.play(plant, x[0], p[0])[:, rows] - hard.exact) <= 1e-3 * base.scale)


@by_title
def test_a_typical_strength_is_seen_in_the_signals_of_its_equation(hard, effect):
    rig, names = hard.rig, hard.base.outputs
    skip_unless_applies(effect, rig)
    if (effect.title, rig.name) == ("oil.warming viscosity", "festo-tp511"):
        pytest.skip("a cylinder that does not leak, and whose viscous friction is hardly above the noise")
    plant, p, batch = hard.run(effect)
    if effect.delay:
        return
    x, y = batch.x[1], hard.y
    if effect.name == "sensor.lag":
        x, y = hard.play(plant, x[0], p[1]), hard.base.observe(hard.exact, hard.u)
    change = np.sqrt(np.mean((plant.observe(x, hard.u, p[1]) - y) ** 2, axis=0))
    noises = {name: change[names.index(name)] / sensor.noise for name, sensor in rig.sensors.items() if name in names}
    seen = SEEN_IN | (SECOND_ORDER if rig.valve == "second-order" else {})
    assert max(noises.get(name, 0.0) for name in seen[effect.equation]) > 2
    if effect.name == "sensor.lag":
        assert all(value < 0.05 for name, value in noises.items() if name not in ("pa", "pb"))


@by_title
def test_every_number_can_be_at_its_ends(hard, effect):
    skip_unless_applies(effect, hard.rig)
    plant, p, batch = hard.run(effect)
    assert batch.ok.all()
    outputs = [plant.observe(x, hard.u, p[i]) for i, x in enumerate(batch.x)]
    assert all(np.isfinite(y).all() for y in outputs)
    if effect.name == "supply.sag":
        supply = plant.outputs.index("supply")
        assert all((y[:, supply] <= hard.rig["Ps"] * (1 + 1e-4)).all() for y in outputs)


@by_title
def test_slopes_exist_everywhere_and_lead_away_from_off(hard, effect):
    """An implicit step needs df/dx, a fit df/dp; at off the first step of a fit must see the effect."""
    skip_unless_applies(effect, hard.rig)
    plant, p, batch = hard.run(effect)
    x, u, v = ca.SX.sym("x", plant.n), ca.SX.sym("u", len(plant.inputs)), ca.SX.sym("p", len(plant.parameters))
    both = ca.vertcat(plant.f(x, u, v), plant.h(x, u, v))
    own = [plant.parameters.index(effect.key(n.name)) for n in effect.numbers]
    slopes = ca.Function("slopes", [x, u, v], [ca.jacobian(both, x), ca.jacobian(both, v[own])])
    assert first_unsupported(slopes) is None  # it runs as machine code
    for lane, states in enumerate(batch.x):
        here = [np.array(part) for part in slopes.map(len(states))(states.T, hard.u.T, p[lane])]
        assert all(np.isfinite(part).all() for part in here)
        if lane == 0 and not effect.delay and effect.title not in EDGES:
            steepest = np.abs(here[1].reshape(-1, len(own))).max(axis=0)  # columns repeat number by number, row by row
            assert all(s > 0 for s, n in zip(steepest, effect.numbers, strict=True) if n.off is not None)


def skip_unless_applies(effect, rig):
    if effect.title == "sensor.bend force":
        pytest.skip("the load cell of a free jack reads 0, where it does not bend")
    if not applies(effect, rig):
        pytest.skip(f"no such slot on {rig.name}")


def test_what_does_not_apply_is_refused(rig):
    training = load_rig("festo-tp511")
    named = {kind: {effect.name for effect in LIBRARY if kind in effect.valves} for kind in VALVES}
    assert named["second-order"] == set(NAMES)
    assert named["three-stage"] == set(NAMES) - {"main.rate"}
    spools = {
        "drive.corrector",
        "pilot.hysteresis",
        *(name for name in NAMES if name.startswith(("main.", "supply."))),
    }
    assert named["pump"] == named["two-way-pump"] == set(NAMES) - spools
    for effect in (*LIBRARY, *PUMP_LIBRARY):
        assert bool(effect.kinds) == bool(effect.elsewhere)
        assert all(bool(missing(effect, kind)) == (kind not in effect.valves) for kind in VALVES)
    declared = replace(training, effects=(EffectUse("drive.lag", "", {}),))
    message = (
        "drive.lag amplifier does not apply to a second-order valve, which has no pilot with a current in its model; "
        'formula "command filter" does'
    )
    with pytest.raises(InputError, match=message):
        build(declared)
    with pytest.raises(
        InputError, match=r"stiction coulomb does not apply .* current in its model; formula \"relative coulomb\" does"
    ):
        build(training, also=(find("main.stiction", ""),))
    assert build(replace(training, effects=(EffectUse("drive.lag", "command filter", {}),)))


def test_the_delay_is_a_number_of_the_plant_without_a_law(rig, plant):
    late = build(replace(rig, effects=(EffectUse("drive.delay", "", {}),)))
    assert late.delay == "drive.delay.delay"
    assert late.p[late.parameters.index("drive.delay.delay")] == 2e-3
    assert late.states == plant.states
    assert plant.delay is None


@pytest.mark.parametrize("name", RIGS)
def test_the_slots_of_a_plant_are_those_of_the_table(monkeypatch, name):
    offered = {}
    plain = assembly.Assembly.slot

    def listening(self, slot, value, **context):
        offered[slot] = tuple(context)
        return plain(self, slot, value, **context)

    monkeypatch.setattr(assembly.Assembly, "slot", listening)
    rig = load_rig(name)
    outputs = {f"sensor_{name}" for name in build(rig).outputs}
    there = {key: slot.offers for key, slot in SLOTS.items() if rig.valve in valves_with([key])}
    assert offered == {key: names for key, names in there.items() if key in outputs or not key.startswith("sensor_")}


def test_benches_leave_out_what_they_do_not_have(rig):
    """Any effect may be declared where a part of the rig is built alone; it acts there if that part has its slots."""
    first = [effect for effect in LIBRARY if find(effect.name, "") is effect and applies(effect, rig)]
    whole = replace(rig, effects=tuple(EffectUse(effect.name, effect.formula, {}) for effect in first))
    stateful = [effect.name for effect in first if effect.states]
    acting = {
        build: stateful,
        build_force_port: [name for name in stateful if name not in ("load.compliance", "load.backlash")],
        build_valve_bench: ["drive.lag", "drive.corrector", "pilot.hysteresis"],
        build_pilot_bench: ["pilot.hysteresis"],
    }
    for make, names in acting.items():
        states = [state.name for state in make(whole).states if "." in state.name]
        assert {name.rpartition(".")[0] for name in states} == set(names)


def test_a_dead_band_shows_on_the_valve_s_bench(rig):
    bench, plain = (
        build_valve_bench(replace(rig, effects=(EffectUse("main.deadband", "", {}),))),
        build_valve_bench(rig),
    )
    u = np.array([0.01])
    flows = [plant.observe(equilibrium(plant, command=0.01).x, u)[0, plant.output("flow")] for plant in (bench, plain)]
    assert flows[0] < 0.3 * flows[1]


def test_a_declared_corrector_and_an_undeclared_one_are_the_same(rig, with_corrector):
    declared = build(with_corrector(rig, "p-lead"))
    found = build(rig, also=(find("drive.corrector", "lead"),))
    values = {"drive.corrector.Td": 0.633e-3, "drive.corrector.tf": 0.548e-3}
    p = found.parameter_values(**values)
    x, u = equilibrium(declared).x + 0.01 * declared.scale, np.zeros(len(declared.inputs))
    names = ["drive.corrector.c1" if s.name == "c1" else s.name for s in declared.states]
    places = [found.state(name) for name in names]
    own = np.empty(found.n)
    own[places] = x
    assert np.array(found.f(own, u, p)).ravel()[places] == pytest.approx(np.array(declared.f(x, u, declared.p)).ravel())


def test_a_soft_mount_lowers_the_jack_s_mode_as_springs_in_series(rig, plant, rest):
    """1/k = 1/k_oil + c, with a body so light that its own mode is far above."""
    effect = find("load.compliance", "mount")
    soft = build(rig, also=(effect,))
    p = soft.parameter_values(**{effect.key("c"): 2e-8, effect.key("f"): 1000.0})
    stiffness = 1e3 * mode(plant, plant.p) ** 2
    expected = np.sqrt(1 / (1 / stiffness + 2e-8) / 1e3)
    assert mode(soft, p) == pytest.approx(expected, rel=0.01)


def mode(plant, p):
    """Angular frequency of the jack's mode [rad/s]."""
    poles = linearise(plant, equilibrium(plant, p=p), p=p).poles()
    (pole,) = (pole for pole in poles if pole.imag > 0 and 10 < abs(pole) / (2 * np.pi) < 40)
    return abs(pole)


@pytest.mark.parametrize("name", [name for name in bundled() if load_rig(name).is_jack])
def test_a_declared_hose_without_numbers_suits_the_rig_s_flow(name):
    """A lossless line of length l resonates, lumped, at c/(2 pi l), c^2 = beta/rho; rated flow is a few m/s."""
    rig = load_rig(name)
    declared = replace(rig, effects=(EffectUse("line.hose", "lumped", {}),))
    numbers = {key: numbers_of(declared)[f"line.hose.{key}"].value for key in ("r", "f", "zeta")}
    plant = build(declared)
    assert [plant.parameter_values()[plant.parameters.index(f"line.hose.{key}")] for key in numbers] == [
        *numbers.values()
    ]
    length = np.sqrt(rig["beta"] / 850) / (2 * np.pi * numbers["f"])
    assert 0.5 < length < 3
    volume = numbers["r"] * (rig["S"] / 2 * np.mean(rig.areas) + np.mean(rig.dead_volumes))
    assert 1.5 < float(PLANT_VALVES[rig.valve].rated_flow(rig)) * length / volume < 6
    said = Number("r", 0.02, "1", "1", "measured")
    own = replace(rig, effects=(EffectUse("line.hose", "lumped", {"r": said}),))
    assert numbers_of(own)["line.hose.r"].value == 0.02


def test_a_hose_is_declared_and_not_sought_where_the_rig_describes_it():
    """What a pump's hoses give is in its file; of a servo-valve's rig nothing is."""
    sought = {
        name: {each.name for each in effects_for(load_rig(name))} for name in ("pump-rig", "two-way-pump-rig", "crane")
    }
    assert [sorted(names & {"line.hose", "hose.compliance"}) for names in sought.values()] == [
        ["hose.compliance"],
        ["hose.compliance"],
        ["line.hose"],
    ]
