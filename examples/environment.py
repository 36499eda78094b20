"""A Gymnasium environment under a hand-written policy. One learns how an episode goes."""

from pathlib import Path

import gymnasium
import numpy as np

import workbench as wb

env = gymnasium.make("envs:JackPosition-v0")
observation, info = env.reset(seed=1)

errors, rewards = [], []
for _ in range(400):
    action = np.clip(4.0 * info["error"], -1, 1)  # P on the position error [m]
    observation, reward, terminated, truncated, info = env.step(np.array([action], np.float32))
    errors.append(info["error"])
    rewards.append(float(reward))
    if terminated or truncated:
        break

steps = np.arange(len(errors), dtype=float)
panels = [
    wb.Panel("error [mm]", [wb.Curve("P", steps, np.array(errors) * 1e3)]),
    wb.Panel("reward [1]", [wb.Curve("P", steps, np.array(rewards))]),
]
Path("out").mkdir(exist_ok=True)
wb.Figure("An episode of JackPosition-v0", "step", panels).save("out/environment.png")
print(f"{len(steps)} steps, return {sum(rewards):.1f}, last error {errors[-1] * 1e3:.2f} mm")
