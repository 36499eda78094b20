"""The names under which Gymnasium makes the environments."""

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
