"""The plant's equations against the paper's written out again in numpy, and what physics demands of its motion."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, strategies as st
from random_plants import oil

from workbench.base.errors import InputError
from workbench.base.signals import SIGNALS
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.plant import build, build_force_port, build_pilot_bench, orifice
from workbench.plant.effects import SLOTS
from workbench.plant.valve import VALVES
from workbench.rigs import valve as kinds
from workbench.rigs.rig_file import load_rig


def q(drop):
    return drop / (drop**2 + 1e6) ** 0.25


def lap(z, eps):
    return z + eps if z >= 0 else eps * np.exp(z / eps)


def pos(gap):
    return (gap + np.sqrt(gap**2 + 0.2e-6**2)) / 2


def lands(rig, gradient, z, ports, supply, drain):
    """Flow into A, out of B, and the sum that the flow force grows with."""
    a, b = ports
    ahead, back = lap(z, rig["eps"]), lap(-z, rig["eps"])
    into_a = gradient * (ahead * q(supply - a) - back * q(a - drain))
    out_of_b = gradient * (ahead * q(b - drain) - back * q(supply - b))
    push = ahead * (abs(supply - a) + abs(b - drain)) - back * (abs(supply - b) + abs(a - drain))
    return into_a, out_of_b, push


CHAMBERS = ("P1", "P2")


def pressures(rig, s):
    return {name: oil(rig, value)[0] if name in CHAMBERS else value for name, value in s.items()}


def filled(rig, state, flow, swept, volume):
    """Rate of a chamber's state."""
    room = oil(rig, state)[1]
    return rig["beta"] * room / volume * (room * flow - swept)


def valve_rates(rig, s, command, ports, supply, drain):
    """Rates of the three-stage valve's states by name, and its flows: the paper's equations away from the stops."""
    r, ps, pr = rig, rig["Ps"], rig["Pr"]
    ports = [oil(rig, port)[0] for port in ports]
    rate = {}
    error = command - s["z3"] / r["z3max"]
    demand = r["Kp"] * error
    if "c1" in s:
        rate["c1"] = (error - s["c1"]) / r["tf"]
        demand += r["Kp"] * r["Td"] * rate["c1"]
    if "c0" in s:
        demand += s["c0"]
    held = np.clip(demand, -r["isat"], r["isat"])
    if "c0" in s:
        rate["c0"] = r["Kp"] * error / r["Ti"] + 400 * (held - demand)
    stop = r["kstop"] * r["l"] * max(abs(r["l"] * s["theta"]) - r["xo"], 0) * np.sign(s["theta"])
    spring = r["Kr2"] * (s["z2"] + r["L"] * s["theta"])
    torque = r["Km"] * r["imax"] * held - r["phi"] * s["w"] - spring * r["L"] - r["Knet"] * s["theta"] - stop
    torque -= r["Sbuse"] * r["l"] * (s["Pg2"] - s["Pd2"]) + r["Fs1"] * np.tanh(s["w"] / 0.05)
    rate["theta"], rate["w"] = s["w"], torque / r["J"]
    inlet = r["K1"] + r["Kf2"]
    for name, side in (("Pg2", 1), ("Pd2", -1)):
        nozzle = r["Kbuse"] * np.pi * r["Dbuse"] * pos(r["xo"] - side * r["l"] * s["theta"])
        flow = inlet * q(ps - s[name]) - nozzle * q(s[name] - pr) - side * r["S2"] * s["v2"]
        rate[name] = r["beta"] * flow / (r["Vo2"] + side * r["S2"] * s["z2"])
    into, out, push = lands(r, r["K2"], s["z2"], (s["Pg3"], s["Pd3"]), ps, pr)
    force = r["S2"] * (s["Pg2"] - s["Pd2"]) - r["psi2"] * s["v2"] - spring - r["cff2"] * push
    rate["z2"], rate["v2"] = s["v2"], (force - r["Fs2"] * np.tanh(s["v2"] / 1e-3)) / r["M2"]
    fed = into + r["Kf3"] * q(ps - s["Pg3"]) - r["S3"] * s["v3"]
    rate["Pg3"] = r["beta"] * fed / (r["Vo3"] + r["S3"] * s["z3"])
    fed = -out + r["Kf3"] * q(ps - s["Pd3"]) + r["S3"] * s["v3"]
    rate["Pd3"] = r["beta"] * fed / (r["Vo3"] - r["S3"] * s["z3"])
    qa, qb, push = lands(r, r["K3"], s["z3"], ports, supply, drain)
    force = r["S3"] * (s["Pg3"] - s["Pd3"]) - r["psi3"] * s["v3"] - 0.43 * r["K3"] / 0.0297 * push
    rate["z3"], rate["v3"] = s["v3"], (force - r["Fs3"] * np.tanh(s["v3"] / 5e-3)) / r["M3"]
    return rate, qa, qb


def jack_rates(rig, s, u, qa, qb):
    """Rates of the jack's states, away from the end stops; both kinds of jack."""
    r, states = rig, s
    s = pressures(rig, s)
    area_a, area_b = (r["Aj"], r["Aj"]) if r.jack == "double-rod" else (r["AA"], r["AB"])
    dead_a, dead_b = (r["V0"], r["V0"]) if r.jack == "double-rod" else (r["V0A"], r["V0B"])
    leak = r["Cl"] * (s["P1"] - s["P2"])
    volume_a, volume_b = dead_a + area_a * (r["S"] / 2 + s["x"]), dead_b + area_b * (r["S"] / 2 - s["x"])
    external = r["ks"] * (s["x"] - u[1]) + r["cs"] * (s["v"] - u[2]) + u[3]
    force = area_a * s["P1"] - area_b * s["P2"] - r["b"] * s["v"] - external
    return {
        "P1": filled(r, states["P1"], r["n"] * qa - leak, area_a * s["v"], volume_a),
        "P2": filled(r, states["P2"], leak - r["n"] * qb, -area_b * s["v"], volume_b),
        "x": s["v"],
        "v": force / r["M"],
    }, external


def named(plant, x):
    return dict(zip([state.name for state in plant.states], x, strict=True))


def agree(plant, x, u, expected):
    rates = np.array(plant.f(x, u, plant.p)).ravel()
    for name, value in named(plant, rates).items():
        assert value == pytest.approx(expected[name], rel=1e-9, abs=1e-9 * plant.scale[plant.state(name)]), name


part = st.floats(-0.95, 0.95)
INSIDE = {"x": 0.9, "z2": 1.2, "z3": 1.1}  # parts of their scales that stay clear of the stops


@st.composite
def states(draw, plant):
    """A state anywhere inside the stops, with pressures from well below the return to above the supply."""
    x = np.array([draw(part) for _ in plant.states]) * plant.scale
    for i, state in enumerate(plant.states):
        x[i] = 0.5 * state.scale + 0.7 * x[i] if state.unit == "Pa" else x[i] * INSIDE.get(state.name, 1.5)
    return x


@pytest.fixture(scope="module", params=["p", "p-lead", "pi-lead"])
def rich(request, with_corrector):
    """The rounded rig, which has friction, with every corrector, a specimen and an offset of the position signal."""
    rig = with_corrector(load_rig("jack-10t-rounded"), request.param)
    return rig.with_values(Fs3=20.0, ks=1e6, cs=300.0, xmid=0.1)


@given(st.data())
def test_the_plant_is_the_papers_equations(rich, whole_plants, data):
    plant = whole_plants(rich)
    x, u = data.draw(states(plant)), np.array([data.draw(part) * 2, 0.01, 0.2, 5e3])
    s = named(plant, x)
    rates, qa, qb = valve_rates(rich, s, u[0], (s["P1"], s["P2"]), rich["Ps"], rich["Pr"])
    jack, external = jack_rates(rich, s, u, qa, qb)
    agree(plant, x, u, rates | jack)
    seen = dict(zip(plant.outputs, plant.observe(x, u)[0], strict=True))
    assert seen["position"] == pytest.approx(s["x"] + 0.1)
    assert seen["acceleration"] == pytest.approx(jack["v"], abs=1e-6)
    assert seen["force"] == pytest.approx(external)
    p = pressures(rich, s)
    assert seen["jack_force"] == pytest.approx((p["P1"] - p["P2"]) * rich["Aj"], abs=1e-6)
    lowest = min(p[name] for name in ("P1", "P2", "Pg2", "Pd2", "Pg3", "Pd3"))
    assert seen["lowest_pressure"] == pytest.approx(lowest, abs=1e-6)
    assert min(seen["pa"], seen["pb"]) > 0
    assert set(plant.outputs) <= set(SIGNALS)


@pytest.fixture(scope="module")
def whole_plants():
    made = {}

    def plant(rig):
        return made.setdefault(rig.corrector, build(rig))

    return plant


@pytest.fixture(scope="module")
def festo():
    rig = load_rig("festo-tp511").with_values(z0=0.02, Cl=1e-13)
    return rig, build(rig)


@given(st.data())
def test_a_second_order_valve_on_a_differential_jack(festo, data):
    rig, plant = festo
    x, u = data.draw(states(plant)), np.array([data.draw(part) * 2, 0.0, 0.0, 5.0])
    s = named(plant, x)
    w0 = 2 * np.pi * rig["f0"]
    p = pressures(rig, s)
    qa, qb, _ = lands(rig, rig["K3"], s["z3"], (p["P1"], p["P2"]), rig["Ps"], rig["Pr"])
    jack, _ = jack_rates(rig, s, u, qa, qb)
    moving = w0**2 * (rig["z3max"] * (u[0] + 0.02) - s["z3"]) - 2 * rig["zeta"] * w0 * s["v3"]
    agree(plant, x, u, jack | {"z3": s["v3"], "v3": moving})


@given(st.data())
def test_the_benches_hold_their_ports_at_35_bar_and_feed_the_lands_at_70(rig, valve_bench, pilot_bench, data):
    ports = {"P1": 35e5, "P2": 35e5}
    x, command = data.draw(states(valve_bench)), data.draw(part)
    rates, qa, _ = valve_rates(rig, named(valve_bench, x) | ports, command, (35e5, 35e5), 70e5, 0.0)
    agree(valve_bench, x, np.array([command]), rates)
    seen = valve_bench.observe(x, np.array([command]))[0]
    assert seen[valve_bench.output("flow")] == pytest.approx(qa)
    x = data.draw(states(pilot_bench))
    s = named(pilot_bench, x)
    into, _, push = lands(rig, rig["K2"], s["z2"], (35e5, 35e5), 70e5, 0.0)
    whole = s | {"Pg3": 35e5, "Pd3": 35e5, "z3": 0.0, "v3": 0.0}
    rates, _, _ = valve_rates(rig, whole, command / rig["Kp"], (35e5, 35e5), 70e5, 0.0)
    loaded = lands(rig, rig["K2"], s["z2"], (35e5, 35e5), rig["Ps"], rig["Pr"])[2]
    rates["v2"] += rig["cff2"] * (loaded - push) / rig["M2"]  # on its bench the pilot's own lands see 70 bar
    agree(pilot_bench, x, np.array([command * rig["imax"]]), rates)
    seen = pilot_bench.observe(x, np.array([command * rig["imax"]]))[0]
    assert seen[pilot_bench.output("flow")] == pytest.approx(into)


@pytest.fixture(scope="module")
def ported(rig):
    rig = rig.with_values(xmid=0.05)
    return rig, build(rig), build_force_port(rig)


@given(st.data())
def test_the_force_port_is_the_plant_without_its_mass(ported, data):
    rig, plant, port = ported
    x, u = data.draw(states(plant)), np.array([data.draw(part), 0.0, 0.0, 700.0])
    s = named(plant, x)
    inputs = np.array([u[0], s["x"] + 0.05, s["v"]])
    inner = np.array([s[state.name] for state in port.states])
    whole = named(plant, np.array(plant.f(x, u, plant.p)).ravel())
    for name, rate in named(port, np.array(port.f(inner, inputs, port.p)).ravel()).items():
        assert rate == pytest.approx(whole[name], rel=1e-12, abs=1e-9), name
    seen = dict(zip(port.outputs, port.observe(inner, inputs)[0], strict=True))
    outer = dict(zip(plant.outputs, plant.observe(x, u)[0], strict=True))
    assert seen["force"] == pytest.approx(rig["M"] * whole["v"] + outer["force"], abs=1e-6)
    assert {name: outer[name] for name in seen if name != "force"} == pytest.approx(
        {name: value for name, value in seen.items() if name != "force"}
    )


def test_the_force_port_follows_a_simulated_plant(rig, plant, engine, rest, commanded):
    """Driven by the motion of the whole plant, the port gives the same pressures and the force M a + load."""
    port = build_force_port(rig)
    t = np.arange(1001) * 1e-4
    u = commanded(0.05 * np.sin(2 * np.pi * 12 * t))
    whole = engine.run(rest.x, t, u)
    motion = whole.x[:, [plant.state("x"), plant.state("v")]]
    held = np.column_stack([u[:, 0], motion + 0.5e-4 * np.gradient(motion, t, axis=0)])  # the mean over each hold
    rows = [plant.state(state.name) for state in port.states]
    alone = Engine(port).run(rest.x[rows], t, held)
    assert alone.ok
    wanted = whole.x[:, rows]
    assert np.all(np.abs(alone.x - wanted) < 1e-3 * port.scale)
    seen, outer = port.observe(alone.x, held), plant.observe(whole.x, u)
    needed = rig["M"] * outer[:, plant.output("acceleration")] + outer[:, plant.output("force")]
    assert np.abs(seen[:, port.output("force")] - needed).max() < 5e-3 * np.ptp(needed)


def numbers(law, *arguments):
    """A symbolic law evaluated at numbers."""
    return float(ca.evalf(law(*(ca.SX(value) for value in arguments))))


@given(x=st.floats(-2, 2), v=st.floats(-10, 10))
def test_a_stop_pushes_back_and_never_pulls(x, v):
    force = numbers(orifice.end_stop, x, v, 1.0, 1e6, 1e4, 0.01)
    over = max(abs(x) - 1, 0)
    wanted = np.sign(x) * max(1e6 * over + 1e4 * v * np.sign(x) * over / (over + 0.01), 0)
    assert force == pytest.approx(wanted, abs=1e-6)
    assert force * x >= 0


@given(z=st.floats(-1e-4, 1e-4), drop=st.floats(-3e7, 3e7))
def test_orifices_laps_and_curtains_are_their_docstrings(z, drop):
    eps = 3.7e-6
    assert numbers(orifice.root, drop) == pytest.approx(q(drop))
    assert numbers(orifice.exponential_lap, z, eps) == pytest.approx(lap(z, eps), abs=1e-20)
    assert numbers(orifice.curtain, z) == pytest.approx(pos(z), abs=1e-15)
    assert numbers(orifice.volume, 1e-4, z) == pytest.approx(max(1e-4 + z, 5e-6))
    step = 1e-12
    slopes = [(numbers(orifice.exponential_lap, s * step, eps) - eps) / (s * step) for s in (1, -1)]
    assert slopes == pytest.approx([1, 1], abs=1e-3)  # C1


def test_oil_is_neither_made_nor_lost(rig, plant, rest, commanded):
    """What the valve and the leak bring into a chamber is what the piston sweeps and what the oil is compressed by."""
    t = np.arange(4001) * 5e-5
    run = Engine(plant, 1e-7).run(rest.x, t, commanded(0.2 * np.sin(2 * np.pi * 5 * t)))
    s = {state.name: run.x[:, i] for i, state in enumerate(plant.states)}
    flows = [
        lands(rig, rig["K3"], z, ports, rig["Ps"], rig["Pr"])[:2]
        for z, *ports in zip(s["z3"], s["P1"], s["P2"], strict=True)
    ]
    leak = rig["Cl"] * (s["P1"] - s["P2"])
    for side, pressure, inflow in ((1, "P1", [f[0] for f in flows]), (-1, "P2", [-f[1] for f in flows])):
        brought = np.trapezoid(rig["n"] * np.array(inflow) - side * leak, t)
        volume = rig["V0"] + rig["Aj"] * (rig["S"] / 2 + side * s["x"])
        compressed = np.trapezoid(volume / rig["beta"], s[pressure])
        swept = rig["Aj"] * side * (s["x"][-1] - s["x"][0])
        scale = rig["Aj"] * np.ptp(s["x"])
        assert brought == pytest.approx(swept + compressed, abs=1e-3 * scale), pressure
        assert np.abs(compressed) > 1e-2 * scale  # else this would say nothing of the oil


def test_a_closed_valve_keeps_the_oil_and_the_energy(rig, plant, rest, commanded):
    """No flow, no leak, no friction: V exp(P/beta) of each chamber stays, and so do kinetic and elastic energy."""
    p = plant.parameter_values(K3=0.0, Cl=0.0, b=0.0)
    start = rest.x.copy()
    start[plant.state("v")] = 0.3
    t = np.linspace(0, 0.2, 401)
    run = Engine(plant, 1e-8).run(start, t, commanded(np.zeros(401)), p)
    p1, p2, x, v = (run.x[:, plant.state(name)] for name in ("P1", "P2", "x", "v"))
    energy = 0.5 * rig["M"] * v**2
    for pressure, side in ((p1, 1), (p2, -1)):
        volume = rig["V0"] + rig["Aj"] * (rig["S"] / 2 + side * x)
        mass = volume * np.exp(pressure / rig["beta"])
        assert mass == pytest.approx(mass[0], rel=1e-7)
        ratio = volume / volume[0]
        energy -= volume[0] * (pressure[0] * (ratio - 1) - rig["beta"] * (ratio * np.log(ratio) - ratio + 1))
    assert np.ptp(x) > 2e-3
    assert energy == pytest.approx(energy[0], rel=1e-5)


MIRROR = {"P1": "P2", "P2": "P1", "Pg3": "Pd3", "Pd3": "Pg3", "Pg2": "Pd2", "Pd2": "Pg2"}


def test_the_opposite_command_gives_the_mirrored_motion(plant, engine, rest, commanded):
    t = np.arange(301) * 1e-3
    command = np.where(t < 0.1, 0.7, -0.25) + 0.1 * np.sin(2 * np.pi * 40 * t)
    there, back = (engine.run(rest.x, t, commanded(sign * command)) for sign in (1, -1))
    rows = [plant.state(MIRROR.get(state.name, state.name)) for state in plant.states]
    signs = np.array([1 if state.name in MIRROR else -1 for state in plant.states])
    assert np.all(np.abs(back.x[:, rows] * signs - there.x) < 1e-6 * plant.scale)


@pytest.mark.parametrize("sign", [1, -1])
def test_full_command_peaks_inside_the_stroke_and_stalls_on_the_stop(rig, plant, engine, commanded, sign):
    start = equilibrium(plant, position=-sign * rig["S"] / 2).x
    t = np.arange(601) * 1e-3
    run = engine.run(start, t, commanded(np.full(601, float(sign))))
    assert run.ok
    x, v, z2, z3 = (sign * run.x[:, plant.state(name)] for name in ("x", "v", "z2", "z3"))
    assert v.max() == pytest.approx(6.6, rel=0.01)
    force = sign * plant.observe(run.x[-1], commanded([sign]))[0, plant.output("jack_force")]
    assert force == pytest.approx((rig["Ps"] - rig["Pr"]) * rig["Aj"], rel=1e-3)
    assert 9.6 < force / 9806.65 < 10
    assert x[-1] == pytest.approx(rig["S"] / 2 + force / rig["ke"], abs=1e-6)
    assert x.max() < rig["S"] / 2 + 0.02  # the stop is stiff: no chamber empties
    assert rig["V0"] - rig["Aj"] * 0.02 > 0.05 * rig["V0"]
    assert np.abs(z2).max() < 1.05 * rig["z2max"]
    assert np.abs(z3).max() < rig["z3over"] * rig["z3max"] * 1.02


@pytest.mark.parametrize(("command", "speed"), [(1.0, 7.1), (0.5, 3.6), (0.25, 1.8)])
def test_steady_speed_without_load(rig, plant, command, speed):
    found = equilibrium(plant, command=command)
    assert found.speed == pytest.approx(speed, rel=0.025)
    drop = (rig["Ps"] - rig["Pr"] - rig["b"] * found.speed / rig["Aj"]) / 2  # a land; friction takes its part
    opening = found.x[plant.state("z3")] + rig["eps"]
    assert found.speed == pytest.approx(rig["n"] * rig["K3"] * opening * np.sqrt(drop) / rig["Aj"], rel=2e-3)


def test_every_kind_of_valve_has_numbers_and_equations():
    assert VALVES.keys() == kinds.VALVES.keys()
    assert all(VALVES[name].kind is kind for name, kind in kinds.VALVES.items())
    assert {slot for kind in kinds.VALVES.values() for slot in kind.slots} <= SLOTS.keys()


def test_a_valve_without_a_pilot_has_no_bench_for_one():
    with pytest.raises(InputError, match="second-order valve has no pilot"):
        build_pilot_bench(load_rig("festo-tp511"))


def test_a_plant_shows_itself_and_names_the_nearest_signal(plant):
    assert repr(plant).startswith("<Plant jack-10t: 14 states, ")
    assert repr(plant).endswith(" inputs command, specimen_position, specimen_velocity, disturbance>")
    with pytest.raises(InputError, match='plant jack-10t: no output "positon"; did you mean "position"'):
        plant.output("positon")
