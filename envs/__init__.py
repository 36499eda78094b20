"""Gymnasium environments of the jack: importing this package registers them.

    env = gymnasium.make("envs:JackPosition-v0", task="position-sensors")
    many = gymnasium.make_vec("envs:JackForce-v0", num_envs=256, task="force")

registration     the names: JackPosition-v0, JackForce-v0, JackBench-v0, Hexapod-v0
hexapod          Hexapod-v0: a platform on six jacks, brought into a pose; hexapod_core, its episodes
bench            JackBench-v0, in a folder of its own: what a policy adds to a tuned law, rewarded as a bench judges it
single, vector   one jack, and many side by side; thin shells over the core, documented as Gymnasium does
one_lane         what the single ones share: episode, checks, pictures
stable_baselines the vector environments as Stable-Baselines3 takes them
spaces           action and observation space; reset options, of which there are none
stepped          what a step gives
episodes         the episodes of N lanes, of whatever environment: reset, step, end
core             those of one jack: what is asked of it, reward
loops            under them, N loops of the workbench: plant, law, sensors, guards and late drives, compiled
timeline         all that is random in an episode, drawn at its reset
references       the families that references are drawn from
observation      the channels of an observation and their full scales
picture          an episode so far, drawn
task             a task's TOML, read strictly; the bundled ones are in tasks/
speed            steps per second
"""

from .registration import register

register()

__all__ = ["register"]
