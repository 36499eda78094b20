"""A linear plant of one's own: an axis from volts to millimetres, and three loops on it."""

from pathlib import Path

import control
import numpy as np

import workbench as wb
from controllers import LinearCrone, LinearLqg, PidLead

w, damping = 2 * np.pi * 18, 0.12
motor, belt = [0.004, 1.0, 0.0], [1 / w**2, 2 * damping / w, 1.0]
axis = control.TransferFunction([55.0], np.polymul(motor, belt))  # mm per V

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
    step = loop.step("10 mm", seconds="1 s")
    print(loop.margins())
    print(step.metrics)
Path("out").mkdir(exist_ok=True)
step.plot().save("out/linear_plant.png")
