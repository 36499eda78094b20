"""A linear plant of one's own: an axis from volts to millimetres, and three loops on it."""

from pathlib import Path

import control

import workbench as wb
from controllers import LinearCrone, LinearLqg, PidLead

s = control.tf("s")
w, damping = 2 * 3.1416 * 18, 0.12
axis = 55 / s / (1 + 0.004 * s) / (1 + 2 * damping * s / w + s**2 / w**2)  # mm per V

plant = wb.linear_plant(
    axis, period="1 ms", stroke="300 mm", name="axis", command=10.0, position="mm", delay="1.5 ms", noise="5 um"
)
print(plant)

for controller in (
    PidLead(gain=11.5, integral_time="10 s", lead_time="3 ms", lead_ratio=3),
    LinearLqg(error="20 mm"),
    LinearCrone(crossover="4 Hz", phase_margin="70 deg", roll_off="40 Hz"),
):
    loop = wb.ClosedLoop(plant, controller)
    step = loop.step("10 mm", duration="1 s")
    print(loop.margins())
    print(step.metrics)
Path("out").mkdir(exist_ok=True)
step.plot().save("out/linear_plant.png")
