"""CRONE control: one phase margin over a band of gains, so that mass matters little. One learns variation."""

from pathlib import Path

import workbench as wb
from controllers import Crone2, PressureFeedback

rig = wb.load_rig("jack-10t")
jack = {  # as `jackbench jack-model` fits them to the damped jack
    "velocity_gain": "7.4037 m/s",
    "jack_frequency": "31.63 Hz",
    "jack_damping": 0.35675,
    "valve_frequency": "93.843 Hz",
    "valve_damping": 0.54507,
    "delay": "0.82424 ms",
}
law = Crone2(crossover="6 Hz", phase_margin="70 deg", **jack) + PressureFeedback(gain="2e-9 1/Pa", corner="1 Hz")

curves = []
for name in ("mass-50", "nominal", "mass+50"):
    loop = wb.ClosedLoop(wb.variation(rig, name), law)
    run = loop.step("10 mm", seconds="1 s")
    curves.append(wb.Curve(name, run.t, run["position"] * 1e3))
    print(f"{name}: overshoot {run.metrics['overshoot_percent']:.1f} %, Ms {loop.margins().ms:.2f}")

Path("out").mkdir(exist_ok=True)
wb.Figure("CRONE 2 on three masses", "time [s]", [wb.Panel("position [mm]", curves)]).save("out/crone.png")
