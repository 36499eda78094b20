"""The names under which Gymnasium makes the environments."""

import gymnasium

IDS = {"JackPosition-v0": "JackPosition", "JackForce-v0": "JackForce"}


def register() -> None:
    """Tell Gymnasium about the environments; a second call changes nothing."""
    for name, kind in IDS.items():
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point=f"envs.single:{kind}",
                vector_entry_point=f"envs.vector:{kind}Vector",
                order_enforce=False,  # the environments themselves refuse a step before a reset
            )
