"""An effect that the library lacks, in a file of one's own, and what it does to a loop. One learns effect_files."""

from dataclasses import replace
from pathlib import Path

import workbench as wb
from controllers import P, PressureFeedback
from workbench.base.trust import allow
from workbench.rigs.rig import EffectUse

EFFECT = '''
"""Effects of our rig."""
from workbench.plant.effects import effect, number

@effect("my.drag", "quadratic", equation="force", slot="body_force", source="our own", shows="fast moves",
        numbers=(number("c", 2e4, "N s^2/m^2", low=0.0, high=1e6, off=0.0, meaning="drag of the piston"),))
def drag(force, s):
    """F = c v |v|."""
    v = s["velocity"]
    return force + s.p("c") * v * abs(v)
'''
Path("out").mkdir(exist_ok=True)
file = Path("out/my_effects.py").resolve()
file.write_text(EFFECT)
allow(file)  # code that a rig names runs only where it is trusted; this is for this process alone

rig = wb.load_rig("jack-10t")
with_drag = replace(rig, effect_files=(str(file),), effects=(EffectUse("my.drag", "quadratic", {}),))
law = P(gain=3.7) + PressureFeedback(gain="2.15e-4 1/bar", corner="0.25 Hz")

runs = {name: wb.ClosedLoop(r, law).step("100 mm") for name, r in (("as declared", rig), ("with drag", with_drag))}

curves = [wb.Curve(name, run.t, run["jack_force"] / 1e3) for name, run in runs.items()]
wb.Figure("A step of 100 mm", "time [s]", [wb.Panel("jack_force [kN]", curves)]).save("out/own_effect.png")
for name, run in runs.items():
    print(f"{name}: settled in {run.metrics['settling_s']} s")
