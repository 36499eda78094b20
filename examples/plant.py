"""The open loop: a plant at rest, a short opening of the valve, and what the jack does. One learns the Engine."""

from pathlib import Path

import numpy as np

import workbench as wb

rig = wb.load_rig("jack-10t")
plant = wb.build(rig)
engine = wb.Engine(plant)
rest = wb.equilibrium(plant)

t = np.arange(0, 0.5, 1e-3)
u = np.tile(rest.u, (len(t) - 1, 1))
u[(t[:-1] > 0.05) & (t[:-1] < 0.15), 0] += 0.05  # the valve command, 5 % for 0.1 s

run = engine.run(rest.x, t, u)
y = engine.outputs(run.x[:-1], u)
position, pressure = (y[:, plant.output(name)] for name in ("position", "pa"))

panels = [
    wb.Panel("position [mm]", [wb.Curve("open loop", t[:-1], position * 1e3)]),
    wb.Panel("pa [bar]", [wb.Curve("open loop", t[:-1], pressure / 1e5)]),
]
Path("out").mkdir(exist_ok=True)
wb.Figure("The jack after a pulse of the valve", "time [s]", panels).save("out/plant.png")
print(f"{plant.name}: {plant.n} states, {run.attempts} steps of the integrator")
print(
    f"the jack moved by {position[-1] * 1e3:.1f} mm; pressure A between {pressure.min() / 1e5:.0f} and "
    f"{pressure.max() / 1e5:.0f} bar"
)
