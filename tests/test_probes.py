"""Probes: nothing at zero, and each one moves the rates or signals of its own equation and no others."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.plant import build
from workbench.plant.probes import probes
from workbench.rigs.number import Number
from workbench.rigs.rig_file import load_rig

MOVED = {  # per unit of input: rates or outputs that move, and by how much
    "three-stage": {
        "probe.drive.current": {"w": "Km/J", "current": 1.0},
        "probe.pilot.current": {"w": "Km/J"},
        "probe.main.force": {"v3": "1/M3"},
        "probe.flow.into_a": {"P1": "beta/V"},
        "probe.flow.into_b": {"P2": "beta/V"},
        "probe.force.force": {"v": "1/M", "acceleration": "1/M"},
        "probe.sensor.pa": {"pa": 1.0, "load_pressure": 1.0},
        "probe.sensor.pb": {"pb": 1.0, "load_pressure": -1.0},
    },
    "second-order": {
        "probe.drive.command": {"v3": "w0^2 z3max"},
        "probe.flow.into_a": {"P1": "beta/VA"},
        "probe.flow.into_b": {"P2": "beta/VB"},
        "probe.force.force": {"v": "1/M", "acceleration": "1/M"},
        "probe.sensor.pa": {"pa": 1.0, "load_pressure": 1.0},
        "probe.sensor.pb": {"pb": 1.0, "load_pressure": -1.0},
    },
}


@pytest.fixture(params=["jack-10t", "festo-tp511"])
def probed(request):
    rig = load_rig(request.param)
    return rig, build(rig), build(rig, also=probes(rig))


def value(rig, text):
    """A number of MOVED for a rig, at mid stroke."""
    if not isinstance(text, str):
        return text
    if text.startswith("beta"):
        area, dead = {"V": ("Aj", "V0"), "VA": ("AA", "V0A"), "VB": ("AB", "V0B")}[text[5:]]
        return rig["beta"] / (rig[dead] + rig[area] * rig["S"] / 2)
    if text == "w0^2 z3max":
        return (2 * np.pi * rig["f0"]) ** 2 * rig["z3max"]
    above, below = text.split("/")
    return (rig[above] if above != "1" else 1.0) / rig[below]


def test_there_is_one_an_equation(probed):
    rig, _, _ = probed
    found = [probe.equation for probe in probes(rig)]
    missing = {"pilot", "main"} if rig.valve == "second-order" else set()
    assert sorted(found) == sorted({"drive", "pilot", "main", "flow", "force", "sensor"} - missing)
    for probe in probes(rig):
        assert probe.name == f"probe.{probe.equation}"
        assert not probe.numbers
        assert not probe.states
        assert all(given.scale > 0 for given in probe.inputs)


def test_at_zero_they_are_not_there(probed):
    _, base, plant = probed
    random = np.random.default_rng(0)
    assert plant.states == base.states
    assert plant.outputs == base.outputs
    assert plant.parameters == base.parameters
    assert plant.inputs[: len(base.inputs)] == base.inputs
    for _ in range(20):
        x = base.start + 0.1 * base.scale * random.standard_normal(base.n)
        u = 0.1 * random.standard_normal(len(base.inputs))
        whole = np.append(u, np.zeros(len(plant.inputs) - len(u)))
        assert np.array_equal(np.array(plant.f(x, whole, plant.p)), np.array(base.f(x, u, base.p)))
        assert np.array_equal(plant.observe(x, whole), base.observe(x, u))


def test_each_moves_its_own_equation(probed):
    rig, base, plant = probed
    x = base.start
    x[base.state("x")] = 0.0
    zero = np.zeros(len(plant.inputs))
    names = [state.name for state in base.states] + list(base.outputs)

    def all_of(u):
        return np.append(np.array(plant.f(x, u, plant.p)).ravel(), plant.observe(x, u)[0])

    moved = {}
    for i, given in enumerate(plant.inputs[len(base.inputs) :], len(base.inputs)):
        if given.name == "probe.flow.supply":  # feeds much; has a test of its own
            continue
        u = zero.copy()
        u[i] = given.scale
        change = (all_of(u) - all_of(zero)) / given.scale
        moved[given.name] = {name: c for name, c in zip(names, change, strict=True) if abs(c) * given.scale > 1e-9}
    assert moved == {
        name: {key: pytest.approx(value(rig, text), rel=1e-6) for key, text in row.items()}
        for name, row in MOVED[rig.valve].items()
    }


def test_the_supply_probe_is_another_supply(probed):
    """Whatever the supply feeds, pilot and lands, sees Ps and the input together."""
    _, base, plant = probed
    random = np.random.default_rng(1)
    for _ in range(10):
        x = base.start + 0.1 * base.scale * random.standard_normal(base.n)
        whole = np.zeros(len(plant.inputs))
        whole[plant.input("probe.flow.supply")] = 1e5
        p = base.parameter_values(Ps=base.p[base.parameters.index("Ps")] + 1e5)
        np.testing.assert_allclose(
            np.array(plant.f(x, whole, plant.p)), np.array(base.f(x, np.zeros(len(base.inputs)), p)), rtol=1e-12, atol=0
        )
        np.testing.assert_allclose(plant.observe(x, whole), base.observe(x, np.zeros(len(base.inputs)), p), rtol=1e-12)


def test_a_load_cell_on_the_rod_tells_friction_of_the_piston_from_a_force_on_the_load():
    """Both move the mass alike; the cell reads the first, less what moves the part before it, and not the second."""
    rig = load_rig("jack-10t")
    rig = replace(rig, load="rod-cell", numbers={**rig.numbers, "Mr": Number("Mr", 30.0, "kg", "kg", "")})
    plant = build(rig, also=probes(rig))
    x, still = plant.start, np.zeros(len(plant.inputs))
    cell, moved = plant.output("force"), plant.output("acceleration")
    reads = {}
    for name in ("force", "piston"):
        u = still.copy()
        u[plant.input(f"probe.force.{name}")] = 1.0
        change = (plant.observe(x, u) - plant.observe(x, still))[0]
        assert change[moved] == pytest.approx(1 / rig["M"], rel=1e-6)
        reads[name] = change[cell]
    assert reads["piston"] == pytest.approx(1 - 30 / rig["M"], rel=1e-6)
    assert reads["force"] == pytest.approx(-30 / rig["M"], rel=1e-6)
