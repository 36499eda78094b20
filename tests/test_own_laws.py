"""A user's own controllers: benched without a linear view, refused in a sentence where they break the protocol."""

import json

import numpy as np
import pytest

import workbench as wb
from controllers import P, PressureFeedback
from workbench.cli import main
from workbench.commands.run.config import load_config
from workbench.control.controller_type import controller
from workbench.loop.rows import linear_loops, loop_setup
from workbench.rigs.rig import load_rig

LAW = """
from controllers.p import P


class Law:
    Design = P.Design
    measures = ("position",)

    def __init__(self, design, period):
        self.gain, self.offset = design.gain, 0.0

    def reset(self, reference, measurement, command):
        self.offset = command - self.wanted(reference, measurement)

    def wanted(self, reference, measurement):
        return self.gain * (reference - measurement["position"])

    def compute(self, reference, measurement):
        return self.wanted(reference, measurement) + self.offset

    def update(self, realised):
        pass
"""
EXPERIMENT = """
experiment = "step"
rig = "jack-10t"
scenarios = ["position-10mm"]

[controllers.mine]
use = "mine.py:Law"
gain = {value = 3.0, unit = "1/m"}
[[controllers.mine.compensators]]
use = "controllers.pressure:PressureFeedback"
gain = {value = 1.6e-4, unit = "1/bar"}
corner = {value = 0.25, unit = "Hz"}

[bode]
low_hz = 1
high_hz = 20
points = 3
amplitudes_mm = [2]
"""
BENCH = EXPERIMENT.replace('"step"', '"bench"\nrigs = ["nominal"]').replace(
    "amplitudes_mm = [2]", "amplitudes_percent = [1]"
)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "mine.py").write_text(LAW)
    (tmp_path / "step.toml").write_text(EXPERIMENT)
    (tmp_path / "bench.toml").write_text(BENCH)
    return tmp_path


def test_margins_by_sines_are_those_of_the_linear_loop(folder):
    setup = loop_setup(load_rig("jack-10t"))
    spec = load_config(folder / "step.toml").controllers[0]
    linear = linear_loops(P(gain=3.0) + PressureFeedback(gain="1.6e-4 1/bar", corner="0.25 Hz"), setup)
    sines = linear_loops(spec, setup)
    assert (linear.margins, sines.margins, sines.stable) == ("linear", "sine", True)
    for one, other in ((sines.null, linear.null), (sines.moving, linear.moving)):
        assert one.ms == pytest.approx(other.ms, rel=0.01)
        assert one.gain_margin_db == pytest.approx(other.gain_margin_db, abs=0.15)
        assert one.phase_margin_deg == pytest.approx(other.phase_margin_deg, abs=1)
        assert one.closed is None


@pytest.mark.parametrize("name", ["step", "bench"])
def test_a_law_without_a_linear_view_is_run_and_benched(folder, name):
    command = {"step": "run", "bench": "bench"}[name]
    assert main([command, str(folder / f"{name}.toml"), "--out", str(folder / "out")]) == 0
    row = json.loads((folder / "out" / "metrics.json").read_text())["rows"][0]
    assert (row["margins"], row["stable"], row["f3db_hz"]) == ("sine", True, None)
    assert 1.5 < row["ms"] < 2.5
    assert row["settling_s"] < 0.5
    assert (folder / "out" / "report.html").stat().st_size > 10_000


JERKY = LAW.replace("return self.gain * (reference", "return 0.01 * self.gain * np.sign(reference")


@pytest.mark.parametrize(
    ("text", "gain", "stable"), [(JERKY.replace("\nfrom", "\nimport numpy as np\nfrom"), 1.0, None), (LAW, 1.0, False)]
)
def test_where_sines_give_no_margins_there_are_none(folder, text, gain, stable, capsys):
    (folder / "mine.py").write_text(text)
    loop = wb.ClosedLoop("jack-10t", controller(f"{folder / 'mine.py'}:Law", gain=gain))
    bench = wb.benchmark([loop])
    row = bench.rows[0]
    assert (row["margins"], row["ms"], row["gain_margin_db"], row["phase_margin_deg"]) == ("none", None, None, None)
    assert row["stable"] is stable
    assert bench.outcome.metrics["noise"][0]["command_rms"] is None
    assert np.isfinite(loop.step("1 mm", "0.1 s")["position"]).all()
    assert loop.margins().ms is None
    assert repr(loop.margins())
    assert repr(bench)
    with pytest.raises(wb.InputError, match=r"Law has no linear view"):
        loop.poles()
