"""Change over between a position and a force loop on the jack: no bump, and both loops hold what they are given."""

import numpy as np
import pytest

from controllers.switched import Switched
from workbench.base.table import ConfigTable
from workbench.control.controller_spec import controller_spec
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.loop.sampled_loop import SampledLoop
from workbench.plant import build

PERIOD, FADE, STIFFNESS = 1e-3, 0.02, 1e7
PRESSURE = {
    "use": "controllers.pressure:PressureFeedback",
    "gain": {"value": 1.35e-9, "unit": "1/Pa"},
    "corner": {"value": 10, "unit": "Hz"},
}
LOOP = {"use": "controllers.p:P", "gain": {"value": 3.9, "unit": "1/m"}, "compensators": [PRESSURE]}
INTEGRATING = {
    "use": "controllers.pid_lead:PidLead",
    "gain": {"value": 4.4, "unit": "1/m"},
    "integral_time": {"value": 0.2, "unit": "s"},
    "compensators": [PRESSURE],
    "stiffness": {"value": STIFFNESS, "unit": "N/m"},
}


def switched():
    loops = {
        "position": controller_spec("position", ConfigTable(LOOP, "position")),
        "force": controller_spec("force", ConfigTable(INTEGRATING, "force")),
    }
    return Switched({name: loop.build(PERIOD) for name, loop in loops.items()}, "position", FADE, PERIOD)


@pytest.fixture(scope="module")
def held(rig):
    """The rig with a specimen, its engine, and rest."""
    specimen = rig.with_values(ks=STIFFNESS, cs=1e3)
    plant = build(specimen)
    return specimen, Engine(plant), equilibrium(plant)


def test_position_to_force_and_back(held):
    """A millimetre, then 20 kN instead of the 10 kN found there, then half a millimetre: without a bump."""
    rig, engine, rest = held
    controller = switched()
    loop = SampledLoop(engine, rig, controller, rest)
    position = loop.run(np.full(600, 1e-3))
    controller.select("force")
    force = loop.run(np.full(800, 20e3))
    controller.select("position")
    back = loop.run(np.full(600, 0.5e-3))
    missing = 4.4 * (20e3 - position.record.signals["force"][-1]) / STIFFNESS
    assert_no_bump(position, force, missing)
    missing = 3.9 * (0.5e-3 - force.record.signals["position"][-1]) - force.demanded[-1]
    assert_no_bump(force, back, missing)
    assert position.record.signals["position"][-1] == pytest.approx(1e-3, rel=0.05)
    assert force.record.signals["force"][-1] == pytest.approx(20e3, rel=0.01)
    assert back.record.signals["position"][-1] == pytest.approx(0.5e-3, rel=0.05)


def assert_no_bump(before, after, missing):
    """The first command is the last one; then no period changes it by more than its part of what is missing."""
    assert after.tripped is None
    command = after.record.signals["command"]
    assert command[0] == pytest.approx(before.record.signals["command"][-1], abs=1e-12)
    assert np.abs(np.diff(command)).max() < 1.1 * PERIOD / FADE * abs(missing)
    assert np.abs(np.diff(command)).max() > 0.5 * PERIOD / FADE * abs(missing)  # the bound is no generous one


def test_a_moving_jack_is_taken_over_and_stopped(held):
    """At 0.1 m/s the position loop has a command and an error; the one that takes over needs neither to stand."""
    rig, engine, _ = held
    free = rig.with_values(ks=0.0, cs=0.0)
    engine = Engine(build(free))
    controller = Switched(
        {name: controller_spec(name, ConfigTable(LOOP, name)).build(PERIOD) for name in ("one", "other")},
        "one",
        FADE,
        PERIOD,
    )
    loop = SampledLoop(engine, free, controller, equilibrium(engine.plant))
    moving = loop.run(0.1 * PERIOD * np.arange(600))
    there = moving.record.signals["position"][-1]
    controller.select("other")
    stopped = loop.run(np.full(1000, there))
    assert stopped.record.signals["command"][0] == moving.record.signals["command"][-1] > 0.01
    assert stopped.record.signals["position"][-1] == pytest.approx(there, abs=1e-6)  # no offset is left


def test_its_linear_view_is_that_of_the_controller_in_charge():
    controller = switched()
    assert controller.measures == ("position", "pa", "pb", "force")
    asked = controller_spec("force", ConfigTable(INTEGRATING, "force")).build(PERIOD).linear()
    controller.select("force")
    law = controller.linear()
    assert controller.measures == ("force", "pa", "pb", "position")
    assert law.input_labels == ["reference", *controller.measures]
    z = np.exp(0.1j)
    assert np.asarray(law(z))[0, :4] == pytest.approx(np.asarray(asked(z))[0])
    assert np.asarray(law(z))[0, 4] == 0


def test_an_unknown_controller_is_refused():
    with pytest.raises(KeyError):
        switched().select("pressure")
