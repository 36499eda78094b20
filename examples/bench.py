"""Two loops beside each other on a set of rigs, with the whole report. One learns benchmark."""

from pathlib import Path

import workbench as wb
from controllers import P, PressureFeedback

rig = wb.load_rig("jack-10t")
plain = wb.ClosedLoop(rig, P(gain=0.24))
damped = wb.ClosedLoop(rig, P(gain=3.7) + PressureFeedback(gain="1.6e-4 1/bar", corner="0.25 Hz"))

bench = wb.benchmark([plain, damped], rigs=["nominal", "mass+50"], scenarios=["position-10mm"])

Path("out").mkdir(exist_ok=True)
bench.plot().save("out/bench.png")
print(bench)
print(bench.report("out/bench", force=True))
