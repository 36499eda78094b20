"""Gymnasium environments of the jack: importing this package registers them.

    env = gymnasium.make("envs:JackPosition-v0", task="position-sensors")
    many = gymnasium.make_vec("envs:JackForce-v0", num_envs=256, task="force")

hexapod          Hexapod-v0: a platform on six jacks, brought into a pose
bench            JackBench-v0, in a folder of its own: what a policy adds to a tuned law, rewarded as a bench judges it
single, vector   one jack, and many side by side; thin shells over the core, documented as Gymnasium does
one_lane         spaces and checks; what the single ones share: episode, pictures
stable_baselines the vector environments as Stable-Baselines3 takes them
episodes         the episodes of N lanes, of whatever environment: reset, step, end
core             those of one jack: what is asked of it, all that is random, drawn at its reset, reward
loops            under them, N loops of the workbench: plant, law, sensors, guards and late drives, compiled
references       the families that references are drawn from
observation      the channels of an observation and their full scales
picture          an episode so far, drawn
task             a task's TOML, read strictly; the bundled ones are in tasks/
speed            steps per second
"""

import gymnasium

IDS = {
    "JackPosition-v0": ("envs.single:JackPosition", "envs.vector:JackPositionVector"),
    "JackForce-v0": ("envs.single:JackForce", "envs.vector:JackForceVector"),
    "Hexapod-v0": ("envs.hexapod:Hexapod", "envs.hexapod:HexapodVector"),
    "JackBench-v0": ("envs.bench.environments:JackBench", "envs.bench.environments:JackBenchVector"),
}


def register() -> None:
    """Tell Gymnasium about the environments; a second call changes nothing."""
    for name, (single, vector) in IDS.items():
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point=single,
                vector_entry_point=vector,
                order_enforce=False,  # the environments themselves refuse a step before a reset
            )


register()

__all__ = ["register"]
