"""Gas comes out of the oil where a chamber is sucked: no pressure below a vacuum, no oil lost, no energy made."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, strategies as st
from random_plants import oil

from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.linear.platform_modes import platform_equilibrium
from workbench.plant import build, build_platform
from workbench.plant.effects.library.hose import mean_volume
from workbench.plant.valve import VALVES
from workbench.rigs.oil import ATMOSPHERE, CAVITATES
from workbench.rigs.platform.platform_file import load_platform
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig, rig_text

RIGS = ("jack-10t", "festo-tp511", "crane", "pump-rig", "two-way-pump-rig")


def played(rig, command, push, seconds=0.3, tolerance=1e-7, **numbers):
    """Outputs by name, and the run, of commands and pushes [N] as functions of time, from rest at mid stroke."""
    plant = build(rig)
    rest = equilibrium(plant)
    t = np.linspace(0.0, seconds, 6001)
    u = np.tile(rest.u, (t.size, 1))
    u[:, plant.input("command")], u[:, plant.input("disturbance")] = command(t), push(t)
    run = Engine(plant, tolerance).run(rest.x, t, u, plant.parameter_values(**numbers))
    assert run.ok
    outputs = plant.observe(run.x, u, plant.parameter_values(**numbers))
    return dict(zip(plant.outputs, outputs.T, strict=True)), run


HOSES = ("lumped", "turbulent")


def hosed(name, formula):
    """A rig, with the hoses of a formula at usual numbers if there is one."""
    return replace(load_rig(name), effects=(EffectUse("line.hose", formula, {}),) if formula else ())


@pytest.mark.parametrize(("name", "hose"), list(product(RIGS, ("", *HOSES))))
def test_no_chamber_falls_below_a_vacuum(name, hose):
    """Pulled and pushed by more than its supply can hold, and under full commands back and forth; nor does a line."""
    rig = hosed(name, hose)
    force, lows = 1.5 * rig["Ps"] * max(rig.areas), []
    for command, push in (
        (lambda t: 0.0 * t, lambda t: np.where(t < 0.15, -force, force)),
        (lambda t: np.sign(np.sin(2 * np.pi * 9 * t)), lambda t: 0.0 * t),
    ):
        seen, _ = played(rig, command, push)
        lows.append(seen["lowest_pressure"].min())
        vacuum = max(ATMOSPHERE - rig["Pr"], 0)
        assert np.all(np.minimum(seen["pa"], seen["pb"]) + vacuum >= seen["lowest_pressure"])
    assert 0 < min(lows) < CAVITATES


@pytest.mark.parametrize("hose", HOSES)
@pytest.mark.parametrize("name", ["jack-10t", "festo-tp511"])
@pytest.mark.parametrize("tolerance", [1e-5, 1e-7])
def test_a_column_that_runs_on_when_the_piston_stands_on_its_stop_empties_no_chamber(name, hose, tolerance):
    """Of a chamber that it empties, less and less is oil."""
    seen, run = played(hosed(name, hose), lambda t: 0.0 * t + 1, lambda t: 0.0 * t, 0.5, tolerance)
    assert np.isfinite(run.x).all()
    assert seen["lowest_pressure"].min() > 0


BARE = {"ChA": 0.0, "ChB": 0.0, "M": 300.0, "line.hose.f": 100.0}
SHUT = {
    "jack-10t": ({"K3": 1e-7, "line.hose.f": 30.0}, 4.0, 0.1),
    "pump-rig": (BARE, 0.6, 0.03),  # its direction valves are off
    "two-way-pump-rig": (BARE | {"D": 1e-9, **dict.fromkeys(("Cp", "Kd", "Kv", "Kr"), 0.0)}, 0.6, 0.03),
}  # numbers that shut it, the speed of the piston, how much gas there is in a line or a chamber at least


@pytest.mark.parametrize("hose", HOSES)
@pytest.mark.parametrize("name", SHUT)
def test_a_hose_and_its_chamber_keep_their_oil_behind_a_closed_valve_while_gas_is_in_them(name, hose):
    """V/w of both, within the share that pressure makes of the oil that goes from one to the other."""
    rig, (closed, speed, gas), emptied = hosed(name, hose), SHUT[name], 0.0
    plant, t = build(rig), np.linspace(0, 0.1, 20_001)
    shut = {**closed, "Cl": 0.0, "line.hose.r": 0.1}
    rated = VALVES[rig.valve].rated_flow(rig.with_values(**{key: shut[key] for key in ("K3", "D") if key in shut}))
    loss = (
        {"line.hose.loss": 0.05 * float(rated / VALVES[rig.valve].rated_flow(rig)) ** 2} if hose == "turbulent" else {}
    )
    start = equilibrium(plant).x
    start[plant.state("v")] = speed
    u = np.zeros((t.size, len(plant.inputs)))
    run = Engine(plant, 1e-9).run(start, t, u, plant.parameter_values(**shut, **loss))
    assert np.abs(run.x[:, plant.state("v")]).max() <= speed  # nothing gives energy
    line = 0.1 * mean_volume(rig)
    lines = (1, ("P1", "line.hose.PA")), (-1, ("P2", "line.hose.PB"))
    for (side, ends), area, dead in zip(lines, rig.areas, rig.dead_volumes, strict=True):
        chamber = dead + area * (rig["S"] / 2 + side * run.x[:, plant.state("x")])
        pressed, rooms = zip(*(oil(rig, run.x[:, plant.state(name)]) for name in ends), strict=True)
        kept = [
            volume * np.exp(np.maximum(pressure - ATMOSPHERE, 0) / rig["beta"]) / room
            for volume, pressure, room in zip((chamber, line), pressed, rooms, strict=True)
        ]
        assert np.ptp(sum(kept)) < 3e-3 * sum(kept)[0]
        assert np.ptp(kept[1]) > 0.05 * kept[1][0]
        emptied = max(emptied, *(room.max() - 1 for room in rooms))
    assert emptied > gas


def test_a_pull_of_40_kn_on_a_closed_valve_leaves_a_vacuum_that_carries_it():
    """The chambers carry what they can: nearly all of the pull is the pressure of the full one."""
    rig = load_rig("jack-10t").with_values(M=200.0)
    seen, run = played(rig, lambda t: 0.0 * t, lambda t: np.where(t > 0.02, -80e3, 0.0), Cl=0.0, K3=1e-7)
    late = run.t > 0.25
    assert seen["lowest_pressure"].min() > 0
    assert seen["jack_force"][late].mean() == pytest.approx(-80e3, rel=0.05)


def test_a_closed_valve_keeps_the_oil_and_the_energy_while_a_chamber_is_empty():
    """As tests/test_plant.py has it of a liquid: V exp(P/beta) stays while it is one, V/w where gas fills it, and the
    energy of mass, oil and gas, -p dV of each chamber."""
    rig = load_rig("jack-10t")
    plant = build(rig)
    rest = equilibrium(plant)
    p = plant.parameter_values(K3=0.0, Cl=0.0, b=0.0)
    start = rest.x.copy()
    start[plant.state("v")] = 4.0
    t = np.linspace(0, 0.1, 20_001)
    run = Engine(plant, 1e-9).run(start, t, np.tile(rest.u, (t.size, 1)), p)
    x, v = run.x[:, plant.state("x")], run.x[:, plant.state("v")]
    stored = 0.5 * rig["M"] * v**2
    emptied = 0.0
    for name, side in (("P1", 1), ("P2", -1)):
        state = run.x[:, plant.state(name)]
        pressure, room = oil(rig, state)
        volume = rig["V0"] + rig["Aj"] * (rig["S"] / 2 + side * x)
        liquid = state > ATMOSPHERE
        left = volume * np.where(liquid, np.exp((state - ATMOSPHERE) / rig["beta"]), 1 / room)
        assert left == pytest.approx(left[0], rel=2e-5)
        emptied = max(emptied, room.max() - 1)
        work = np.diff(volume) * (pressure[1:] + pressure[:-1]) / 2
        stored = stored - np.append(0.0, np.cumsum(work))
    assert emptied > 0.005
    assert stored == pytest.approx(stored[0], rel=1e-3)


@given(st.floats(-5e8, 4e7), st.sampled_from(("jack-10t", "crane")))
def test_pressure_and_stiffness_of_the_oil_fall_smoothly(state, name):
    """dp/ds is continuous, positive, 1 of a liquid; and above 1 atm the pressure is the state itself, to the bit."""
    rig, plant = load_rig(name), PLANTS[name]
    x = plant.start
    u = np.zeros(len(plant.inputs))

    def pressure(s):
        x[plant.state("P1")] = s
        return float(plant.observe(x, u)[0, plant.output("pa")])

    assert pressure(state) == pytest.approx(float(oil(rig, state)[0]), rel=1e-9, abs=1e-3)
    saturated = min(ATMOSPHERE, rig["Pr"])
    if state >= saturated:
        assert pressure(state) == state
    slopes = [(pressure(s + 1) - pressure(s - 1)) / 2 for s in (state - 50, state + 50)]
    assert 0 < slopes[0] < 1 + 1e-6
    assert slopes[1] - slopes[0] == pytest.approx(0.0, abs=100 / 2e4 + 1e-6)  # the knee is 0.2 bar wide


PLANTS = {name: build(replace(load_rig(name), sensors={})) for name in ("jack-10t", "crane")}


def test_gas_and_vapour_are_numbers_of_the_rig(tmp_path):
    """More gas keeps the pressure up, a volatile oil keeps it above its vapour's; and a file holds both."""
    rig = load_rig("jack-10t")
    text = rig_text(rig)
    assert "gas" not in rig.numbers
    assert "Pv" not in text
    numbers = '\n[oil]\ngas = {value = 0.5, unit = "%"}\nPv = {value = 0.2, unit = "bar"}'
    (tmp_path / "other.toml").write_text(text.replace("\n[oil]", numbers))
    other = load_rig(tmp_path / "other.toml")
    assert (other["gas"], other["Pv"]) == pytest.approx((0.005, 2e4))
    (tmp_path / "again.toml").write_text(rig_text(other))
    assert load_rig(tmp_path / "again.toml").numbers == other.numbers
    lows = []
    for each in (rig, other, other.with_values(Pv=0.0)):
        plant = build(each)
        x = plant.start
        x[plant.state("P1")] = -5e8
        lows.append(plant.observe(x, np.zeros(len(plant.inputs)))[0, plant.output("lowest_pressure")])
    assert lows[1] > 2e4 > lows[0] > lows[2] > 0


def test_the_valve_s_own_chambers_stay_full():
    """That is why they are liquids: fed from the supply at all times, and hardly swept."""
    rng = np.random.default_rng(3)
    rig = load_rig("jack-10t")
    plant = build(rig)
    rest = equilibrium(plant)
    t = np.linspace(0, 0.4, 4001)
    commands = [np.sign(np.sin(2 * np.pi * f * t)) for f in (5, 30, 100, 200)]
    commands += [np.repeat(rng.uniform(-1, 1, 401), 10)[: t.size]]
    columns = [plant.state(name) for name in ("Pg2", "Pd2", "Pg3", "Pd3")]
    for command in commands:
        u = np.tile(rest.u, (t.size, 1))
        u[:, 0] = command
        assert Engine(plant).run(rest.x, t, u).x[:, columns].min() > 70e5


def test_a_platform_s_jacks_have_it_too():
    platform = load_platform("hexapod")
    plant = build_platform(platform)
    rest = platform_equilibrium(plant, None)
    t = np.linspace(0, 0.25, 1001)
    u = np.tile(rest.u, (t.size, 1))
    u[:, :6] = np.where(np.sin(2 * np.pi * 8 * t) > 0, 1.0, -1.0)[:, None]
    run = Engine(plant).run(rest.x, t, u)
    lowest = plant.observe(run.x[::5], u[::5])[:, plant.output("lowest_pressure")]
    assert 0 < lowest.min() < CAVITATES
