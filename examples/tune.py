"""Search two numbers of a loop on two rigs. One learns tune, and what its result holds."""

from pathlib import Path

import workbench as wb
from controllers import P, PressureFeedback

rig = wb.load_rig("jack-10t")
start = wb.ClosedLoop(rig, P(gain=2) + PressureFeedback(gain="2.15e-4 1/bar", corner="1 Hz"))

best = wb.tune(
    start,
    over={"gain": (1, 10), "pressure-feedback.corner": ("0.2 Hz", "5 Hz")},
    rigs=["nominal", "mass+50"],
    designs=12,
)

Path("out").mkdir(exist_ok=True)
best.step("10 mm").plot().save("out/tune.png")
print(best)
print(best.search)
