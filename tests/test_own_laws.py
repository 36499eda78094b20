"""A user's own controllers: benched without a linear view, refused in a sentence where they break the protocol."""

import json

import numpy as np
import pytest

import workbench as wb
from controllers import P, PressureFeedback
from workbench.cli import main
from workbench.commands.run.options import load_config
from workbench.control.controller_type import controller
from workbench.loop.rows import linear_loops, loop_setup
from workbench.rigs.rig_file import load_rig

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
    told = json.loads((folder / "out" / "metrics.json").read_text())
    row = told["rows"][0]
    assert (row["margins"], row["stable"], row["f3db_hz"]) == ("sine", True, None)
    if name == "bench":  # beside what rules give from small moves
        assert [row["controller"] for row in told["rows"]] == ["mine", "automatic"]
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


BROKEN = {
    "no measures": ('measures = ("position",)', "pass", "Law.measures: None; write a tuple of the signals"),
    "measures a word": ('("position",)', '"position"', "Law.measures: 'position'; write a tuple of the signals"),
    "measures nothing": ('("position",)', "()", "Law.measures: (); write a tuple of the signals"),
    "measures a misspelt signal": ('("position",)', '("postion",)', 'no signal "postion"; did you mean "position"?'),
    "measures what the rig has not": (
        '("position",)', '("position", "velocity")', "has no velocity sensor, which ",
    ),
    "no reset": ("def reset(", "def rest(", "Law has no method reset; give it reset(reference, measurement, command)"),
    "no compute": ("def compute(", "def calculate(", "Law has no method compute; give it compute("),
    "no update": ("def update(", "def upd(", "Law has no method update; give it update(realised)"),
    "compute with one argument": (
        "def compute(self, reference, measurement)", "def compute(self, reference)", "Law.compute: too many",
    ),
    "update with two": ("def update(self, realised)", "def update(self, u, v)", "Law.update: missing a required"),
    "__init__ with one": ("def __init__(self, design, period)", "def __init__(self, design)", "Law(design, period): T"),
    "__init__ raises": ("self.gain, self.offset =", "1 / 0; self.gain, self.offset =", "Law(design, period): ZeroDiv"),
    "reset raises": ("self.offset = command -", "self.offset = {}[1] -", "Law.reset: KeyError: 1; mend the controller"),
    "compute raises": ("+ self.offset", "+ self.ofset", "Law.compute: AttributeError: 'Law' object has no"),
    "update raises": ("        pass", "        raise ValueError('no')", "Law.update: ValueError: no; mend"),
    "returns None": ("return self.wanted(reference, measurement) +", "self.wanted(reference, measurement) +", "Law."),
    "returns an array": ("+ self.offset", "+ self.offset * __import__('numpy').ones(2)", "Law.compute: returns nda"),
    "returns a complex number": ("+ self.offset", "+ self.offset * 1j", "Law.compute: returns complex, no number"),
    "returns NaN": ("+ self.offset", "+ float('nan')", "Law.compute: returns nan at the start; return the command"),
    "a linear view of two inputs too few": (
        "    def update", "    def linear(self):\n        import control\n"
        "        return control.StateSpace([], [], [], [[1.0]], 1e-3)\n\n    def update",
        "Law.linear: has 1 inputs and 1 outputs; make it a system from reference, position to the command",
    ),
    "a linear view that is none": (
        "    def update", "    def linear(self):\n        return 3\n\n    def update",
        "Law.linear: int is no state space",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_a_class_that_breaks_the_protocol_gets_a_sentence(folder, name, capsys):
    right, wrong, message = BROKEN[name]
    assert right in LAW
    (folder / "mine.py").write_text(LAW.replace(right, wrong))
    command, file = ("bench", "bench") if name in ("no compute", "compute raises", "returns NaN") else ("run", "step")
    assert main([command, str(folder / f"{file}.toml"), "--out", str(folder / "out")]) == 2
    (complaint,) = [line for line in capsys.readouterr().err.splitlines() if line.startswith("jackbench: ")]
    assert message in complaint
    assert not (folder / "out").exists()
