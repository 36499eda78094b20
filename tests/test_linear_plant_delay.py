"""The delay of a linear plant as one of its uncertain numbers: lanes with a delay each, draws, variations."""

import json

import numpy as np
import pytest

import workbench as wb
from controllers import LinearMpc, PidLead
from tests.test_linear_plant import CHAIN, CONTROL, SIGNALS, axis, plant_of
from workbench.base.errors import InputError
from workbench.cli import main
from workbench.control.controller_spec import ControllerSpec
from workbench.loop.envelope import envelope, steps
from workbench.loop.plant_lanes import uncertain
from workbench.loop.rows import loop_setup
from workbench.plant import build
from workbench.rigs.rig_file import rig_text

DELAYS = (1.5e-3, 0.0, 0.4e-3, 2e-3, 3.7e-3)
STEP = wb.SCENARIOS["position-10mm"]
EXPERIMENT = """experiment = "robustness"
plants = 30
seed = 1
seconds = {value = 0.6, unit = "s"}
step = {value = 10, unit = "mm"}
stroke = 1
positions = [0]
[plant]
chain = "plant.toml"
[within]
delay = [0.0001, 3]
[from]
"loops.toml" = ["pid-lead"]
"""
LOOPS = """experiment = "step"
[plant]
chain = "plant.toml"
[controllers.pid-lead]
use = "controllers.pid_lead:PidLead"
gain = {value = 12, unit = "1/m"}
integral_time = {value = 10, unit = "s"}
"""


@pytest.mark.parametrize("law", [PidLead(gain=12.0, integral_time="10 s"), LinearMpc(stroke="300 mm", speed="0.3 m/s")])
def test_plants_with_a_delay_each_run_in_lanes(law):
    nominal = axis()
    spec = wb.ClosedLoop(nominal, law).controller
    assert isinstance(spec, ControllerSpec)
    plants = {f"{delay}": wb.with_delay(nominal.with_values(delay=delay), 2e-4) for delay in DELAYS}
    lanes, controller = envelope(plants).varied, spec.build(1e-3)
    null, _ = lanes.margins(controller)
    alone = [envelope({name: plant}).varied for name, plant in plants.items()]
    each = [one.margins(controller)[0] for one in alone]
    np.testing.assert_allclose(null.ms, [margins.ms[0] for margins in each], rtol=1e-9)
    np.testing.assert_allclose(null.radius, [margins.radius[0] for margins in each], rtol=1e-9)
    np.testing.assert_allclose(null.gain_margin_db, [margins.gain_margin_db[0] for margins in each], rtol=1e-9)
    together = steps(lanes, controller, STEP, None, 0.5)
    apart = [steps(one, controller, STEP, None, 0.5) for one in alone]
    np.testing.assert_allclose(together.iae, [motion.iae[0] for motion in apart], rtol=1e-7)
    np.testing.assert_allclose(together.settling, [motion.settling[0] for motion in apart])


def test_the_delay_of_a_file_may_have_bounds_in_units_of_their_own(tmp_path):
    plant = plant_of(tmp_path, CHAIN + SIGNALS + CONTROL + '[bounds]\ndelay = ["1 ms", "2 ms"]\n')
    assert uncertain(plant, build(plant), {}) == {"delay": (1e-3, 2e-3)}
    assert plant_of(tmp_path, rig_text(plant), "again").numbers["delay"].high == 2e-3
    later = wb.with_delay(plant, 3e-4)
    assert later.numbers == plant.numbers
    assert loop_setup(later).engine.plant.lateness() == pytest.approx(1.8e-3)
    with pytest.raises(InputError, match="delay"):
        plant.with_values(delay=-1e-3)


def test_delays_are_drawn(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plant.toml").write_text(CHAIN + SIGNALS + CONTROL)
    (tmp_path / "loops.toml").write_text(LOOPS)
    (tmp_path / "robustness.toml").write_text(EXPERIMENT)
    main(["robustness", "robustness.toml", "--out", "o"])
    row = json.loads((tmp_path / "o" / "metrics.json").read_text())["rows"][0]
    assert row["tripped"] == 0
    drawn = json.dumps(json.loads((tmp_path / "o" / "metrics.json").read_text()))
    assert "delay [s]" in drawn
