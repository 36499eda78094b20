"""MPC that knows the reference ahead beside one that does not. One learns follow with a function of time."""

from pathlib import Path

import numpy as np

import workbench as wb
from controllers import Mpc, PressureFeedback

rig = wb.load_rig("jack-10t")
jack = {
    "velocity_gain": "7.4037 m/s",
    "jack_frequency": "31.63 Hz",
    "jack_damping": 0.35675,
    "valve_frequency": "93.843 Hz",
    "valve_damping": 0.54507,
    "delay": "0.82424 ms",
    "inertia": "2.141e5 Pa s^2/m",
}
tuning = {"error": "261.2 mm", "command_noise": 0.8349, "command_walk": 0.001848, "pressure_noise": "3.491e5 Pa"}
limits = {"pressure": "151.7 bar", "speed": "4.5 m/s"}
damping = PressureFeedback(gain="2e-9 1/Pa", corner="1 Hz")
laws = [Mpc(preview=p, **tuning, **limits, **jack) + damping for p in ("0 ms", "80 ms")]


def there_and_back(t: np.ndarray) -> np.ndarray:
    """20 mm, from 0.2 s to 0.6 s."""
    return np.where((t > 0.2) & (t < 0.6), 0.02, 0.0)


runs = [wb.ClosedLoop(rig, law).follow(there_and_back, seconds="1 s") for law in laws]

curves = [wb.Curve(n, r.t, r["position"] * 1e3) for n, r in zip(("as it comes", "80 ms ahead"), runs, strict=True)]
reference = wb.Curve("reference", runs[0].t, runs[0]["reference"] * 1e3, "dot")
Path("out").mkdir(exist_ok=True)
wb.Figure("MPC with preview", "time [s]", [wb.Panel("position [mm]", [reference, *curves])]).save("out/mpc.png")
for curve, run in zip(curves, runs, strict=True):
    print(f"reference known {curve.name}: IAE {run.metrics['iae'] * 1e3:.2f} mm s")
