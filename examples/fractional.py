"""A fractional system: stability, norm, steps, a state space of it; a fractional PID on a jack. One learns both."""

from pathlib import Path

import numpy as np

import workbench as wb
from controllers import FractionalPid, LapInverse, PressureFeedback

s = wb.FractionalTransferFunction.s
plant = 1 / (0.8 * s**2.2 + 0.5 * s**0.9 + 1)  # Podlubny, IEEE Trans. Automatic Control 44(1), 1999
law = 20.5 + 3.7343 * s**1.15  # his controller for it
loop = (plant * law).feedback()
print(f"G = {plant}: {plant.stability().reason}; H2 norm {float(plant.h2_norm()):.4f}")
print(f"closed loop, gain {abs(loop(0)):.3f} at rest: {loop.stability().reason}")

space = loop.oustaloup(0.01, 10)
print(f"by Oustaloup's cells: {space}")
print(f"by least squares: {loop.least_squares(0.01, 10, states=8)}")
f = np.geomspace(0.01, 10, 50)
print(f"fitted with two poles in s^q: {wb.fit_fractional(f, plant.response(f), zeros=0, poles=2)}")

rig = wb.load_rig("jack-10t")
damping = PressureFeedback(gain="2e-4 1/bar", corner="1 Hz", column="314 mm")
for integral, derivative in ((1.0, 1.0), (0.6, 0.8)):
    orders = {"integral_order": integral, "derivative_order": derivative}
    pid = FractionalPid(gain="4 1/m", integral_time="2 s", derivative_time="10 ms", **orders)
    margins = wb.ClosedLoop(rig, pid + damping + LapInverse(excess=0.0016, width=0.0021)).margins()
    print(
        f"jack under PI^{integral:g} D^{derivative:g}: Ms {margins.ms:.2f}, margin {margins.phase_margin_deg:.0f} deg"
    )

Path("out").mkdir(exist_ok=True)
t = np.linspace(0, 10, 1001)
curves = [wb.Curve("plant", t, plant.step(t)), wb.Curve("closed loop", t, loop.step(t))]
wb.Figure("steps of a fractional system", "time [s]", [wb.Panel("output [1]", curves)]).save("out/fractional.png")
