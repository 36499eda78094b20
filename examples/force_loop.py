"""A force loop on a specimen whose far end moves away. One learns on_load_cell and scenarios."""

from pathlib import Path

import workbench as wb
from controllers import P, PressureFeedback, VelocityCompensation

rig = wb.load_rig("jack-10t").with_values(ks=1e7, cs=1e3)  # a specimen of 10 kN/mm

plain = P(gain=3.9) + PressureFeedback(gain="2.15e-4 1/bar", corner="10 Hz")
compensated = plain + VelocityCompensation(gain="0.07 s/m", corner="20 Hz")
loops = {c.name: wb.ClosedLoop(rig, c.on_load_cell("10 kN/mm")) for c in (plain, compensated)}

runs = {name: loop.follow("force-moving-end") for name, loop in loops.items()}

curves = [wb.Curve(name, run.t, run["force"] / 1e3) for name, run in runs.items()]
Path("out").mkdir(exist_ok=True)
wb.Figure("20 kN held while the far end moves", "time [s]", [wb.Panel("force [kN]", curves)]).save("out/force_loop.png")
for name, run in runs.items():
    print(f"{name}: IAE {run.metrics['iae']:.0f} N s, settled {run.metrics['settling_s']} s after the end stands")
