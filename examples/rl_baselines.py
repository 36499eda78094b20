"""What JackBench-v0 pays for doing nothing, anything, and an MPC. One learns rewards to beat."""

from pathlib import Path

import numpy as np

import workbench as wb
from envs.bench.baselines import controller_episodes, policy_episodes
from envs.bench.environments import JackBenchVector
from workbench.commands.common.shipped import experiment
from workbench.commands.common.step_experiment import load_steps

EPISODES = 1000

env = JackBenchVector(EPISODES, autoreset_mode="SameStep")
tuned = {spec.name: spec for spec in load_steps(experiment("position_tuned")).controllers}
random = np.random.default_rng(0)

baselines = {
    "p-dp, no policy": policy_episodes(env, lambda observation: np.zeros((EPISODES, 1))),
    "p-dp + random actions": policy_episodes(env, lambda observation: random.uniform(-1, 1, (EPISODES, 1))),
    "mpc": controller_episodes(env.core.task, tuned["mpc"], EPISODES // 2),
    "pid-lead": controller_episodes(env.core.task, tuned["pid-lead"], EPISODES // 2),
}

print("| baseline | return: mean, least | settling: mean, longest | overshoot | tripped |\n|---|---|---|---|---|")
for name, episodes in baselines.items():
    mean, least, settling, longest, overshoot, tripped = episodes.row
    print(
        f"| {name} | {mean:.2f}, {least:.2f} | {settling:.3f} s, {longest:.3f} s | {overshoot:.1f} % | {tripped:.0%} |"
    )

share = (np.arange(EPISODES) + 0.5) / EPISODES
curves = [wb.Curve(name, np.sort(episodes.returns), share) for name, episodes in baselines.items()]
Path("out").mkdir(exist_ok=True)
wb.Figure("Returns of episodes of JackBench-v0", "return", [wb.Panel("share of episodes below", curves)]).save(
    "out/rl_baselines.png"
)
