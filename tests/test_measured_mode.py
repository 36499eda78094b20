"""A position loop that measures mass, oil and velocity gain: what it measures, its bumps, its margins."""

import json
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from test_compiled_loop import agree, both

from controllers.measured_mode import frozen
from controllers.policy import PolicyDesign
from workbench.cli import main
from workbench.commands.run.options import load_config
from workbench.commands.train.start import silent_network
from workbench.control.controller_spec import ControllerSpec
from workbench.loop.rig_variations import with_delay
from workbench.loop.rows import linear_loops, loop_setup
from workbench.loop.sampled_loop import SampledLoop
from workbench.rigs.rig_file import load_rig

PERIOD = 1e-3
EXPERIMENTS = Path(__file__).parents[1] / "experiments"
(SPEC,) = load_config(EXPERIMENTS / "position_mode.toml").controllers
RIG = with_delay(load_rig("jack-10t"), 0.3e-3)
BARE = replace(SPEC, compensators=())


def on(mass, beta, supply=1.0):
    return RIG.with_values(M=mass * RIG["M"], beta=beta * RIG["beta"], Ps=supply * RIG["Ps"])


def moved(rig, reference, seed=1):
    """The controller after it has run along a reference in Python, and the run."""
    setup = loop_setup(rig)
    controller = BARE.build(PERIOD)
    return controller, SampledLoop(setup.engine, rig, controller, setup.null, seed, compiled=False).run(reference)


@pytest.mark.parametrize(("mass", "beta"), [(0.5, 1.15), (1.5, 0.5)])
def test_three_moves_with_noise_tell_mass_and_oil(mass, beta):
    controller, run = moved(on(mass, beta), np.repeat([0.01, 0.0, 0.01], 300))
    assert run.tripped is None
    m, c, _, trust = controller.measured
    assert m == pytest.approx(mass, rel=0.05)
    assert c == pytest.approx(1 / beta, rel=0.25)
    assert trust > 0.75


def test_a_lower_supply_is_a_lower_velocity_gain():
    high, low = (moved(on(1.0, 1.0, supply), np.full(300, 0.01))[0].measured[2] for supply in (1.0, 0.8))
    assert low / high == pytest.approx(np.sqrt(0.8), rel=0.06)  # flow goes with the root of the pressure


def test_noise_and_a_load_at_rest_are_not_taken_for_a_plant():
    """Neither is in the reference, which stands."""
    setup = loop_setup(RIG)
    controller = BARE.build(PERIOD)
    loop = SampledLoop(setup.engine, RIG, controller, setup.null, 1, compiled=False)
    loop.run(np.zeros(300), {"disturbance": 10e3 * np.sin(np.arange(300) * 0.1)})
    assert controller.measured[3] < 0.01


def test_at_rest_a_number_that_changes_makes_no_bump():
    law = BARE.build(PERIOD).graph_law()
    signals = np.array([0.03, 0.03, 9e6, 7e6])
    (x,), (offset,) = law.starts(signals[None], np.array([0.012]))
    meter = len(x) - 6
    for taken, mass_sum in product((0.0, 0.4, 1.0), (1e-3, 1e-1)):
        after = x.copy()
        after[meter - 2 : meter] = mass_sum, 1.5 * mass_sum
        after[meter] = taken
        assert float(law.graphs.output(after, signals, offset, law.numbers)) == pytest.approx(0.012, abs=1e-12)


def test_it_runs_compiled_as_in_python():
    agree(*both(on(1.3, 0.7), SPEC, np.repeat([0.01, 0.0], 200), 3), 0.01)


def margins(mass, beta, estimate, taken):
    """The linear loops of the law frozen at an estimate (m, c, g), on a plant."""
    design = frozen(SPEC.design, taken, *estimate)
    return linear_loops(replace(SPEC, design=design), loop_setup(on(mass, beta)))


def test_knowing_nothing_its_linear_loop_is_that_of_the_fixed_law():
    start, nothing = linear_loops(SPEC, loop_setup(RIG)).null.ms, margins(1, 1, (3, 0.4, 1.1), 0.0).null.ms
    assert start == pytest.approx(nothing, rel=1e-9)


@pytest.mark.parametrize(("mass", "beta"), [(0.5, 1.15), (1.5, 0.5)])
def test_frozen_at_wrong_estimates_it_keeps_its_margins(mass, beta):
    """Mass a fifth wrong, compliance a tenth too low or a fourth too high, on the quickest and the slowest plant."""
    for wrong_m, wrong_c, taken in ((1.2, 1.25, 1), (0.8, 0.9, 1), (1.2, 0.9, 1), (0.8, 1.25, 1), (1, 1, 0.5)):
        ms = margins(mass, beta, (wrong_m * mass, wrong_c / beta, 1.0), taken).null.ms
        assert ms < 2.5


@pytest.mark.parametrize(("mass", "beta"), [(0.5, 1.15), (1.5, 0.5), (0.5, 0.5), (1.5, 1.15)])
def test_frozen_at_any_instant_of_its_moves_it_keeps_its_margins(mass, beta):
    """Every 20 ms of two moves, with noise: what it has measured by then, wrong as it may still be."""
    setup = loop_setup(on(mass, beta))
    controller = BARE.build(PERIOD)
    loop = SampledLoop(setup.engine, setup.rig, controller, setup.null, 2, compiled=False)
    for level in np.repeat([0.01, 0.0], 15):
        assert loop.run(np.full(20, level)).tripped is None
        m, c, g, _ = controller.measured
        assert margins(mass, beta, (m, c, g), float(controller.taken)).null.ms < 2.5


def test_the_linear_view_of_what_it_remembers_is_that_of_the_frozen_law():
    """The memory of a run, put into the linear views of lanes, against a law made of what the meter read."""
    controller, _ = moved(on(1.4, 0.6), np.repeat([0.01, 0.0, 0.01], 200))
    law, kept = controller.graph_law(), controller.state[list(controller.graph_law().memory)]
    at = {name: np.array([value]) for name, value in {"position": 0.02, "pa": 9e6, "pb": 8e6, "command": 0.001}.items()}
    found = law.linearised_lanes(at, kept[None])
    taken, (m, c, g, _) = float(controller.taken), controller.measured
    expected = replace(BARE, design=frozen(SPEC.design, taken, m, c, g)).build(PERIOD).graph_law().linearised_lanes(at)
    assert gain(found, 3.0) == pytest.approx(gain(expected, 3.0), rel=1e-9)
    assert gain(found, 30.0) == pytest.approx(gain(expected, 30.0), rel=1e-9)
    assert gain(law.linearised_lanes(at), 3.0) != pytest.approx(gain(found, 3.0), rel=1e-2)


def test_what_it_remembers_is_in_the_view_of_a_policy_on_top_that_holds_its_decisions():
    """Its linear view is that of another law, which has the same memory."""
    network = replace(silent_network("position", [0.01, 5e6], [3.0, 30.0], [6], 0.02, PERIOD), decision=4 * PERIOD)
    spec = BARE + ControllerSpec("policy", "controllers.policy:PolicyOn", PolicyDesign(network))
    law, (controller, _) = spec.build(PERIOD).graph_law(), moved(on(1.4, 0.6), np.repeat([0.01, 0.0, 0.01], 200))
    kept = controller.state[list(controller.graph_law().memory)][None]
    at = {name: np.array([value]) for name, value in {"position": 0.02, "pa": 9e6, "pb": 8e6, "command": 0.001}.items()}
    alone = controller.graph_law().linearised_lanes(at, kept)
    assert gain(law.linearised_lanes(at, kept), 3.0) == pytest.approx(gain(alone, 3.0), rel=1e-9)


def gain(matrices, hz):
    """From (r, y) to the command, complex [1 + m], of the first lane."""
    a, b, c, d = (part[0] for part in matrices)
    z = np.exp(2j * np.pi * hz * PERIOD)
    return c @ np.linalg.solve(z * np.eye(len(a)) - a, b) + d


MOVES = """
experiment = "robustness"
rig = "jack-10t"
plants = 12
seed = 5
step = {value = 10, unit = "mm"}
seconds = {value = 0.6, unit = "s"}
moves = 3
stroke = 0.9
positions = [0]

[within]
M = [0.5, 1.5]
beta = [0.5, 1.15]
Ps = [0.8, 1.03]

[from]
"position_tuned.toml" = ["p-dp-notch"]
"position_mode.toml" = ["p-dp-mode"]
"""


def played(tmp_path, text):
    tmp_path.mkdir()
    (tmp_path / "moves.toml").write_text(text)
    for name in ("position_tuned.toml", "position_mode.toml"):
        (tmp_path / name).write_text((EXPERIMENTS / name).read_text())
    assert main(["robustness", str(tmp_path / "moves.toml"), "--jobs", "1", "--out", str(tmp_path / "out")]) == 0
    rows = json.loads((tmp_path / "out/metrics.json").read_text())["rows"]
    return {row["controller"]: row for row in rows}


def test_after_three_moves_it_is_sooner_and_before_them_later_by_two_periods_at_most(tmp_path, capsys):
    first, after = (played(tmp_path / str(moves), MOVES.replace("moves = 3", f"moves = {moves}")) for moves in (0, 3))
    for number in ("settling_p50_s", "settling_worst_s"):
        assert first["p-dp-mode"][number] <= first["p-dp-notch"][number] + 2 * PERIOD
    assert after["p-dp-mode"]["settling_worst_s"] < 0.09 < after["p-dp-notch"]["settling_worst_s"]
    assert after["p-dp-notch"]["settling_p50_s"] == pytest.approx(first["p-dp-notch"]["settling_p50_s"], abs=0.004)
    assert all(row["tripped"] + row["unstable"] + row["hunting"] == 0 for row in (*first.values(), *after.values()))
    for row in (first["p-dp-mode"], after["p-dp-mode"]):  # wherever it then stands, null or moving
        assert row["held_unstable"] == 0
        assert row["held_ms_worst"] < 2.5
    assert first["p-dp-notch"]["held_ms_worst"] is None  # it remembers nothing


def test_moves_that_are_no_count_are_refused(tmp_path, capsys):
    (tmp_path / "moves.toml").write_text(MOVES.replace("moves = 3", "moves = 21"))
    assert main(["robustness", str(tmp_path / "moves.toml")]) == 2
    assert "moves" in capsys.readouterr().err
