"""Views: every one of them shows the same plant, and the plant has the modes and gains it should have."""

from pathlib import Path

import control
import numpy as np
import pytest
from hypothesis import given, strategies as st

from workbench.base.errors import InputError
from workbench.base.gain_phase import gain_db
from workbench.commands.show.describe import describe
from workbench.control.jack_model import fit_jack_model
from workbench.engine import Engine
from workbench.linear import discretise, equilibrium, linearise, nonlinear_system, null_pressure, valve_blocks
from workbench.linear.frequency_response import linear_response
from workbench.plant import build, build_valve_bench
from workbench.rigs.rig_file import bundled, load_rig


def modes(plant, **numbers):
    """Poles at null [1/s] with some numbers changed, dry friction left out."""
    p = plant.without_dry_friction()
    for name, value in numbers.items():
        p[plant.parameters.index(name)] = value
    return linearise(plant, equilibrium(plant, command=0.0, p=p), outputs=("spool",), p=p).poles()


def oscillation(poles, near):
    """Frequency [Hz] and damping of the complex pair nearest to a frequency [Hz]."""
    pair = [pole for pole in poles if pole.imag > 0]
    pole = min(pair, key=lambda pole: abs(np.log(abs(pole) / (2 * np.pi * near))))
    return abs(pole) / (2 * np.pi), -pole.real / abs(pole)


def rates(plant, point, p=None):
    """Rates over the states' magnitudes."""
    return np.array(plant.f(point.x, point.u, plant.p if p is None else p)).ravel() / plant.scale


@pytest.mark.parametrize("name", [name for name in bundled() if "pump" not in name])  # in test_pump, test_two_way_pump
@pytest.mark.parametrize("asked", [{}, {"speed": 0.1}, {"speed": -0.2}, {"command": 0.3}, {"position": 0.05}], ids=str)
def test_an_equilibrium_is_one(name, asked):
    plant = build(load_rig(name))
    point = equilibrium(plant, **asked)
    moving = rates(plant, point)
    x = plant.state("x")
    assert moving[x] * plant.scale[x] == pytest.approx(point.speed, abs=1e-12)
    assert np.delete(moving, x) == pytest.approx(0, abs=1e-3)  # of 1e3..1e5 1/s of their own modes
    assert point.x[x] == asked.get("position", 0.0)
    if "command" not in asked:
        assert point.speed == pytest.approx(asked.get("speed", 0.0), abs=1e-12)
    else:
        assert point.u[0] == asked["command"]
        assert point.speed > 0


def test_an_equilibrium_stays_where_it_is(plant, engine, rest, moving):
    t = np.linspace(0, 0.05, 51)
    for point in (rest, moving):
        run = engine.run(point.x, t, np.tile(point.u, (51, 1)))
        drift = run.x - point.x - np.outer(t, point.speed * np.eye(plant.n)[plant.state("x")])
        assert np.all(np.abs(drift) < 2e-4 * plant.scale)


@given(force=st.floats(-8e4, 8e4), position=st.floats(-0.2, 0.2))
def test_a_held_load_is_carried_by_the_pressures(rig, plant, force, position):
    point = equilibrium(plant, position=position, disturbance=force)
    p1, p2 = point.x[plant.state("P1")], point.x[plant.state("P2")]
    assert (p1 - p2) * rig["Aj"] == pytest.approx(force, abs=1e-2)
    assert rig["Pr"] < min(p1, p2) <= max(p1, p2) < rig["Ps"]


@pytest.mark.parametrize("asked", [{"speed": 9.0}, {"disturbance": 2e5}])
def test_no_equilibrium_is_said(plant, asked):
    with pytest.raises(InputError, match="jack-10t: no equilibrium there") as caught:
        equilibrium(plant, **asked)
    assert "\n" not in str(caught.value)


def test_an_equilibrium_takes_nothing_it_does_not_use(plant):
    with pytest.raises(InputError, match='jack-10t: no input "disturbence"; did you mean "disturbance"'):
        equilibrium(plant, disturbence=1e3)
    with pytest.raises(InputError, match="jack-10t: give a speed or a command, not both"):
        equilibrium(plant, command=0.1, speed=0.1)


@pytest.mark.parametrize("which", ["rest", "moving"])
def test_linearise_is_the_slope_of_the_plant(plant, which, request):
    point = request.getfixturevalue(which)
    names = tuple(i.name for i in plant.inputs)
    model = linearise(plant, point, names, plant.outputs)
    assert model.input_labels == list(names)
    assert model.output_labels == list(plant.outputs)
    assert model.state_labels == [state.name for state in plant.states]
    x, u, p = point.x, point.u, plant.p
    steps = {"x": 1e-7 * plant.scale, "u": 1e-7 * np.array([i.scale for i in plant.inputs])}
    for function, by_x, by_u in ((plant.f, model.A, model.B), (plant.h, model.C, model.D)):
        for slopes, wanted, step in (
            (lambda d, f=function: f(x + d, u, p) - f(x - d, u, p), by_x, steps["x"]),
            (lambda d, f=function: f(x, u + d, p) - f(x, u - d, p), by_u, steps["u"]),
        ):
            found = np.column_stack([np.array(slopes(d)).ravel() / (2 * d.max()) for d in np.diag(step)])
            size = np.abs(wanted * step).max(axis=1, keepdims=True) / step + 1e-12
            assert np.all(np.abs(found - wanted) < 2e-3 * size + 1e-6 * np.abs(wanted))


def test_linearise_names_an_unknown_signal(plant, rest):
    with pytest.raises(InputError, match='no signal "positon" there; did you mean "position"'):
        linearise(plant, rest, outputs=("positon",))
    with pytest.raises(InputError, match='no signal "comand" there; did you mean "command"'):
        linearise(plant, rest, inputs=("comand",))


def test_python_control_integrates_the_same_plant(plant, rest, commanded):
    system = nonlinear_system(plant)
    assert system.state_labels == [state.name for state in plant.states]
    t = np.linspace(0, 0.02, 41)
    u = commanded(np.full(41, 0.2))
    settings = {"rtol": 1e-8, "atol": 1e-6}
    theirs = control.input_output_response(system, t, u.T, rest.x, solve_ivp_method="Radau", solve_ivp_kwargs=settings)
    ours = Engine(plant, 1e-8).run(rest.x, t, u)
    assert np.all(np.abs(theirs.states.T - ours.x) < 1e-6 * plant.scale)
    assert np.allclose(theirs.outputs.T, plant.observe(ours.x, u), rtol=1e-4, atol=1e-2)


def test_the_simulation_of_a_small_step_is_the_linear_one(plant, rest, commanded):
    t = np.linspace(0, 0.05, 101)
    model = linearise(plant, rest, outputs=("position", "velocity", "pa", "spool"))
    theirs = control.forced_response(model, t, 1e-5).outputs
    run = Engine(plant, 1e-8).run(rest.x, t, commanded(np.full(101, 1e-5)))
    rows = [plant.output(name) for name in model.output_labels]
    ours = (plant.observe(run.x, commanded(np.full(101, 1e-5))) - plant.observe(rest.x, rest.u))[:, rows].T
    assert np.all(np.abs(ours - theirs) < 0.01 * np.abs(theirs).max(axis=1, keepdims=True))


def test_hydraulic_frequency_and_damping(rig, plant):
    """27.4 Hz by formula and linearised; damping 0.020, of which 0.018 leakage and 0.0015 viscous friction."""
    volume = rig["V0"] + rig["Aj"] * rig["S"] / 2
    formula = np.sqrt(2 * rig["beta"] * rig["Aj"] ** 2 / (volume * rig["M"])) / (2 * np.pi)
    frequency, damping = oscillation(modes(plant), 27.4)
    assert formula == pytest.approx(27.4, rel=0.005)
    assert frequency == pytest.approx(formula, rel=0.005)
    assert damping == pytest.approx(0.020, abs=5e-4)
    without_friction = oscillation(modes(plant, b=0.0), 27.4)[1]
    assert damping - without_friction == pytest.approx(0.0015, abs=1e-4)
    assert without_friction == pytest.approx(0.018, abs=1e-3)


@pytest.mark.parametrize(
    ("mode", "frequency", "damping"),
    [
        ("pilot spool on its oil", 18e3, 0.1),
        ("main spool on its oil", 2.3e3, 0.13),
        ("flapper", 341, 0.35),
        ("spool loop", 114, 0.59),
        ("jack", 27.4, 0.020),
    ],
)
def test_modes_at_null(plant, mode, frequency, damping):
    assert oscillation(modes(plant), frequency) == pytest.approx((frequency, damping), rel=0.035), mode


def test_real_poles_at_null(plant):
    """One integrator, the common-mode pressures of jack and pilot lands, and the nozzle chambers."""
    poles = modes(plant)
    real = np.sort(-np.real(poles[np.abs(np.imag(poles)) < 1e-6]))
    assert real[0] == pytest.approx(0, abs=1e-6)
    assert real[1:3] / (2 * np.pi) == pytest.approx([0.58, 12.8], rel=0.02)
    assert real[3:] == pytest.approx([2.2e4], rel=0.03)
    assert len(poles) == plant.n


@pytest.mark.parametrize(
    ("numbers", "damping"),
    [
        ({"Kp": 0.638, "isat": 1.5}, 0.33),
        ({"z3max": 3.18e-3, "Kp": 2.43, "Ti": 5.9e-3, "Td": 0.93e-3, "tf": 0.44e-3}, -0.08),
    ],
    ids=["overdriven", "hunting"],
)
def test_damping_at_null_with_the_corrector(with_corrector, numbers, damping):
    """PI and lead on the rounded pilot, the modes below the spools' oil: one corrector is damped, the other hunts."""
    rig = with_corrector(load_rig("jack-10t-rounded"), "pi-lead").with_values(**numbers)
    poles = [pole for pole in modes(build_valve_bench(rig)) if pole.imag > 0 and abs(pole) < 2 * np.pi * 1000]
    assert min(-pole.real / abs(pole) for pole in poles) == pytest.approx(damping, abs=0.006)


def test_common_mode_pressures_are_not_excited_at_null(plant, rest):
    model = linearise(plant, rest, outputs=("pa", "pb"))
    f = np.array([0.1, 0.58, 3.0, 12.8])
    a, b = np.asarray(model(2j * np.pi * f))[:, 0]
    assert np.abs(a + b).max() < 1e-6 * np.abs(a - b).max()


def test_the_lap_doubles_the_flow_gain_at_null(plant, rest, moving):
    """14.6 m/s per unit command within +-eps of null, 7.1 beyond."""
    gains = [abs(linearise(plant, point, outputs=("velocity",))(2j * np.pi * 1e-3)) for point in (rest, moving)]
    assert gains == pytest.approx([14.6, 7.1], rel=0.04)
    assert gains[0] == pytest.approx(2 * gains[1], rel=0.01)


def test_null_pressure(rig, plant, rest):
    """0.605 Ps with the return at 0; the plant's nozzle chambers rest there."""
    assert null_pressure(rig.with_values(Pr=0.0)) / rig["Ps"] == pytest.approx(0.605, abs=0.002)
    pn = null_pressure(rig)
    nozzle = rig["Kbuse"] * np.pi * rig["Dbuse"] * rig["xo"]
    assert (rig["K1"] + rig["Kf2"]) ** 2 * (rig["Ps"] - pn) == pytest.approx(nozzle**2 * (pn - rig["Pr"]))
    for name in ("Pg2", "Pd2"):
        assert rest.x[plant.state(name)] == pytest.approx(pn, rel=1e-3)


def test_the_block_diagram_is_its_equations(rig):
    """The docstring's equations, solved at some frequencies for theta, z2 and z3."""
    for at_null, lap in ((False, 1), (True, 2)):
        blocks = valve_blocks(rig, at_null)
        kq1 = rig["l"] * rig["Kbuse"] * np.pi * rig["Dbuse"] * np.sqrt(blocks.null_pressure - rig["Pr"])
        kq2 = lap * rig["K2"] * np.sqrt((rig["Ps"] - rig["Pr"]) / 2)
        for f in (0.3, 30.0, 114.0, 341.0):
            s = 2j * np.pi * f
            armature = rig["J"] * s**2 + rig["phi"] * s + rig["Knet"] + rig["Kr2"] * rig["L"] ** 2
            pilot = np.array([[armature, rig["Kr2"] * rig["L"]], [-kq1, rig["S2"] * s]])
            assert blocks.pilot(s) == pytest.approx(np.linalg.solve(pilot, [rig["Km"], 0])[1], rel=1e-9)
            drive = rig["Km"] * rig["imax"] * rig["Kp"]
            whole = np.array(
                [
                    [armature, rig["Kr2"] * rig["L"], drive / rig["z3max"]],
                    [-kq1, rig["S2"] * s, 0],
                    [0, -kq2, rig["S3"] * s],
                ]
            )
            spool = np.linalg.solve(whole, [drive, 0, 0])[2]
            assert blocks.valve(s) == pytest.approx(spool, rel=1e-9)
            assert blocks.state_space(s) == pytest.approx(spool, rel=1e-9)
        assert blocks.valve.dcgain() == pytest.approx(rig["z3max"])


def test_the_block_diagram_is_the_whole_valve_at_low_frequency(rig, valve_bench):
    """Rigid oil and weightless spools cost 0.5 dB below 40 Hz, and 3 degrees below 20 Hz."""
    rest = equilibrium(valve_bench, command=0.0)
    f = np.geomspace(0.5, 40, 30)
    ratio = linear_response(valve_blocks(rig, at_null=True).valve, f) / linear_response(
        linearise(valve_bench, rest, outputs=("spool",)), f
    )
    assert np.abs(gain_db(ratio)).max() < 0.5
    assert np.abs(np.degrees(np.angle(ratio)))[f < 20].max() < 3
    assert np.abs(np.degrees(np.angle(ratio))).max() < 5


def test_the_block_diagram_refuses_another_valve():
    with pytest.raises(InputError, match="rig festo-tp511: the block diagram needs a three-stage valve"):
        valve_blocks(load_rig("festo-tp511"))


def test_a_valve_bench_gives_the_published_flow(rig):
    bench = build_valve_bench(rig)
    for command in (1.0, -1.0):
        point = equilibrium(bench, command=command)
        flow = bench.observe(point.x, point.u)[0, bench.output("flow")] * 60000
        assert flow == pytest.approx(600 * command, rel=0.01)


FITTED = load_rig(Path(__file__).parent / "festo_found.toml")  # five effects, air in the oil among them


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("asked", [{"command": -1.0}, {"command": 0.2}, {"command": 1.0}, {"speed": 0.1}], ids=str)
def test_a_rig_with_soft_oil_has_its_operating_points(asked, smooth):
    plant = build(FITTED)
    p = plant.without_dry_friction() if smooth else plant.p
    point = equilibrium(plant, p=p, **asked)
    assert np.delete(rates(plant, point, p), plant.state("x")) == pytest.approx(0.0, abs=1e-5)
    assert FITTED["Pr"] < point.x[:2].min() < point.x[:2].max() < FITTED["Ps"]


def test_a_fitted_rig_is_described():
    rows = {row["name"]: row["value"] for row in describe(FITTED)["derived"]}
    assert rows["no-load speed, extending"] == pytest.approx(0.39, abs=0.01)
    assert rows["no-load speed, retracting"] == pytest.approx(0.285, abs=0.01)


def test_the_jack_model_of_a_valve_that_is_too_fast_to_see_stays_in_range():
    plant = build(FITTED)
    rest = equilibrium(plant, p=plant.without_dry_friction())
    model = fit_jack_model(discretise(plant, rest, 1e-3, p=plant.without_dry_friction()))
    assert model.valve_frequency == pytest.approx(1000.0)
    assert model.jack_frequency == pytest.approx(43.3, abs=0.5)
