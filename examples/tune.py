"""Search two numbers of a loop on two rigs. One learns tune, and what its result holds."""

from pathlib import Path

import workbench as wb
from controllers import LapInverse, P, PressureFeedback

rig = wb.load_rig("jack-10t")
damping = PressureFeedback(
    gain="2e-4 1/bar", corner="1 Hz", column="314 mm"
)  # half the oil columns: all over the stroke
start = wb.ClosedLoop(rig, P(gain=2) + damping + LapInverse(excess=0.0016, width=0.0021))

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
