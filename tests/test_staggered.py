"""Force ports beside another program: the oil keeps its damping, and the two runs agree."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from controllers import P, PressureFeedback
from workbench import build_force_port, load_rig
from workbench.control.platform_controller import PlatformController
from workbench.engine.staggered import StaggeredPorts
from workbench.linear import equilibrium, linearise
from workbench.linear.platform_modes import platform_modes
from workbench.loop.platform import leg_references, platform_setup, run_platform
from workbench.plant import build
from workbench.rigs.platform import load_platform

EXAMPLE = Path(__file__).parents[1] / "examples" / "mujoco_platform.py"
STEP = 1e-3


def damping(y: np.ndarray, cycles: int = 8) -> float:
    """By the logarithmic decrement of the peaks."""
    peaks = y[1:-1][(y[1:-1] > y[:-2]) & (y[1:-1] >= y[2:])]
    return float(np.log(peaks[1] / peaks[1 + cycles]) / (2 * np.pi * cycles))


@pytest.mark.parametrize(("stale", "kept"), [(False, True), (True, False)], ids=["staggered", "a step old"])
def test_a_mass_on_a_port_keeps_its_damping_only_where_they_are_staggered(stale, kept):
    rig = load_rig("jack-10t")
    port, whole = build_force_port(rig), build(rig)
    rest = equilibrium(whole)
    values = np.linalg.eigvals(linearise(whole, rest).A)
    mode = min(values[values.imag > 0], key=lambda pole: abs(abs(pole) - 2 * np.pi * 27.4))
    x, v, force, speeds = 0.0, 0.01, 0.0, []
    state = np.array([[rest.x[whole.state(s.name)] for s in port.states]])
    ports = StaggeredPorts(port, state, np.zeros(1), STEP)
    for _ in range(600):
        before = x
        x += STEP * v
        at = (before if stale else x), v
        latest = float(ports.follow(*(np.array([value]) for value in at), rest.u[:1])["force"][0])
        v += STEP * (force if stale else latest) / rig["M"]
        force = latest
        speeds.append(v)
    true = -mode.real / abs(mode)
    if kept:
        assert damping(np.array(speeds)) == pytest.approx(true, rel=0.05)
    else:
        assert np.abs(speeds[-100:]).max() > 3 * 0.01  # it grows


@pytest.fixture(scope="module")
def bare():
    """The hexapod with legs without inertia, as tendons are."""
    return platform_setup(load_platform("hexapod").without_leg_inertia())


@pytest.fixture(scope="module")
def run_mujoco():
    pytest.importorskip("mujoco", reason="the other program is not installed")
    return runpy.run_path(str(EXAMPLE))["run_mujoco"]


def test_mujoco_keeps_the_damping_of_heave(bare, run_mujoco):
    modes = platform_modes(bare.platform, bare.engine.plant, bare.smooth, bare.p_smooth)
    heave = next(mode for mode in modes if abs(mode.shape[2]) == 1.0)
    accelerations = run_mujoco(bare, None, np.zeros((800, 6)), 0.02)
    assert damping(accelerations[:, 2]) == pytest.approx(heave.zeta, rel=0.05)


@pytest.mark.parametrize("axis", [0, 2, 4])
def test_a_closed_loop_beside_mujoco_is_that_of_one_plant(bare, run_mujoco, axis):
    spec = P(gain="3.185 1/m") + PressureFeedback(gain="2.175e-4 1/bar", corner="0.25 Hz")
    law = PlatformController([spec.build(STEP) for _ in range(6)], np.eye(6))
    rise = np.clip(np.arange(500) * STEP / 0.2, 0, 1)
    pose = np.outer(rise**3 * (10 - 15 * rise + 6 * rise**2), 0.02 * np.eye(6)[axis])
    beside, alone = run_mujoco(bare, law, leg_references(bare, pose)), run_platform(bare, law, pose)
    names = ("surge", "sway", "heave", "roll", "pitch", "yaw")
    own = np.column_stack([alone.signals[f"{name}_acceleration"] for name in names])
    assert np.abs(beside - own)[:, axis].max() < 0.03 * np.abs(own[:, axis]).max()
