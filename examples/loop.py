"""A position loop: P with pressure feedback, a step, its metrics and margins. One learns ClosedLoop."""

from pathlib import Path

import workbench as wb
from controllers import P, PressureFeedback

rig = wb.load_rig("jack-10t")
controller = P(gain="3.7 1/m") + PressureFeedback(gain="1.6e-4 1/bar", corner="0.25 Hz")
loop = wb.ClosedLoop(rig, controller)

run = loop.step("10 mm", seed=1)

Path("out").mkdir(exist_ok=True)
run.plot("command", "pa", "pb").save("out/loop.png")
print(run.metrics)
print(loop.margins())
print(loop.bode(amplitude="5 mm", points=8))
