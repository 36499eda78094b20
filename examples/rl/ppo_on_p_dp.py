"""PPO of Stable-Baselines3 on top of the tuned p-dp, and its actor as a file that `bench` and `robustness` take.

Needs `pip install 'jackbench[rl]'`; two and a half million decisions take some minutes of one core:

    python examples/rl/ppo_on_p_dp.py [DECISIONS]
    jackbench run out/ppo/trained.toml
    jackbench robustness out/ppo/robustness.toml --plants 1000
"""
# pyright: reportMissingImports=false

import re
import sys
from pathlib import Path

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor

from envs.bench.baselines import policy_episodes
from envs.bench.environments import JackBenchVector
from envs.bench.export import save_policy, trained_policy
from envs.stable_baselines import StableBaselinesLanes
from workbench.commands.common.shipped import experiment

DECISIONS = int(float(sys.argv[1])) if len(sys.argv) > 1 else 2_400_000
LANES, EPISODE, JUDGED = 64, 200, 500

torch.set_num_threads(1)
env = JackBenchVector(LANES, autoreset_mode="SameStep")
model = PPO(
    "MlpPolicy",
    VecMonitor(StableBaselinesLanes(env)),
    n_steps=EPISODE,
    batch_size=LANES * EPISODE // 4,
    n_epochs=8,
    gamma=0.99,
    # exploring moves the jack by less than the band, 0.2 mm, or nothing is learned but to undo it
    policy_kwargs={"log_std_init": -5.5, "net_arch": {"pi": [16, 16], "vf": [64, 64]}},
    seed=1,
    device="cpu",
)
model.learn(DECISIONS)

judged = JackBenchVector(JUDGED, autoreset_mode="SameStep")
policies = {
    "p-dp alone": lambda observation: np.zeros((JUDGED, 1)),
    "p-dp + PPO": lambda observation: model.predict(observation, deterministic=True)[0],
}
print("| | return: mean, least | settling: mean, longest | overshoot | tripped |\n|---|---|---|---|---|")
for name, act in policies.items():
    mean, least, settling, longest, overshoot, tripped = policy_episodes(judged, act, seed=1000).row
    print(
        f"| {name} | {mean:.2f}, {least:.2f} | {settling:.4f} s, {longest:.3f} s | {overshoot:.1f} % | {tripped:.0%} |"
    )

task, folder = env.core.task, Path("out/ppo")
trained = save_policy(trained_policy(model, task.policy), task, folder)
text = experiment("robustness").read_text()
(folder / "robustness.toml").write_text(re.sub(r'"position_tuned.toml" = .*', '"trained.toml" = ["p-dp"]', text))
print(f"left {trained}, for run and bench, and {folder / 'robustness.toml'}")
