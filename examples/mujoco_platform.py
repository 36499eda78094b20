"""Six jacks beside MuJoCo, which integrates the platform, against the same platform as one plant. Needs mujoco."""

from importlib import import_module
from pathlib import Path

import numpy as np

import workbench as wb
from controllers import P, PressureFeedback
from workbench.control.platform_controller import PlatformController
from workbench.engine.staggered import StaggeredPorts
from workbench.loop.platform import PlatformSetup, leg_references, platform_setup, run_platform
from workbench.rigs.platform import Platform, load_platform

mujoco = import_module("mujoco")  # which says nothing of its types
STEP = 1e-3  # s: of MuJoCo and of the control


def model_of(p: Platform) -> object:
    """The payload as a free body; each leg is a tendon without mass, with a motor that pushes along it."""
    base, top = ("".join(f'<site name="{end}{i}" pos="{x} {y} {z}"/>' for i, (x, y, z) in enumerate(points))
                 for end, points in (("base", p.geometry.base), ("top", p.geometry.joints)))  # fmt: skip
    legs = "".join(f'<spatial name="{i}"><site site="base{i}"/><site site="top{i}"/></spatial>' for i in range(6))
    inertia = f'mass="{p["mass"]}" diaginertia="{p["Ixx"]} {p["Iyy"]} {p["Izz"]}" pos="{p["cx"]} {p["cy"]} {p["cz"]}"'
    return mujoco.MjModel.from_xml_string(f"""<mujoco><option timestep="{STEP}" gravity="0 0 -{p["gravity"]}"/>
        <worldbody>{base}<body pos="0 0 {p["height"]}"><freejoint/><inertial {inertia}/>{top}</body></worldbody>
        <tendon>{legs}</tendon><actuator>{"".join(f'<motor tendon="{i}"/>' for i in range(6))}</actuator></mujoco>""")


def run_mujoco(setup: PlatformSetup, law: PlatformController | None, legs: np.ndarray, heave: float = 0) -> np.ndarray:
    """Accelerations [k, 6] under references [k, 6] of the legs, from a heave speed; without a law the valves stay."""
    data, port = mujoco.MjData(model := model_of(setup.platform)), wb.build_force_port(setup.platform.legs[0].rig)
    data.qvel[2], u, accelerations = heave, setup.null.u[:6].copy(), np.zeros((len(legs), 6))
    ports = StaggeredPorts(port, setup.null.x[: 6 * port.n].reshape(6, -1), np.zeros(6), STEP)
    for k, wanted in enumerate(legs):
        mujoco.mj_step1(model, data)  # the tendons as they are now: mj_step would leave those of one step ago
        at = data.ten_length - setup.platform.middle, data.ten_velocity
        measured = (ports.follow if k else ports.outputs)(*at, u) | {"position": at[0]}
        data.ctrl[:] = measured["force"]
        if law and k == 0:
            law.reset(wanted, measured, u)
        if law:
            law.update(u := law.compute(wanted, measured, np.zeros(6)))
        mujoco.mj_step2(model, data)
        accelerations[k] = data.qacc
    return accelerations


if __name__ == "__main__":
    setup, t = platform_setup(load_platform("hexapod").without_leg_inertia()), np.arange(500) * STEP
    spec = P(gain="3.185 1/m") + PressureFeedback(gain="2.175e-4 1/bar", corner="0.25 Hz")
    law = PlatformController([spec.build(STEP) for _ in range(6)], np.eye(6))
    pose = np.outer(0.01 * (1 - np.cos(np.pi * np.clip(t / 0.2, 0, 1))), [1, 0, 0, 0, 0, 0])
    other = run_mujoco(setup, law, leg_references(setup, pose))[:, 0]
    own = run_platform(setup, law, pose).signals["surge_acceleration"]
    print(f"peak {np.abs(own).max():.2f} m/s2, apart by {100 * np.abs(other - own).max() / np.abs(own).max():.2g} %")
    Path("out").mkdir(exist_ok=True)
    panel = wb.Panel("acceleration [m/s2]", [wb.Curve("one plant", t, own), wb.Curve("MuJoCo", t, other)])
    wb.Figure("Surge of 20 mm", "t [s]", [panel]).save("out/mujoco_platform.png")
