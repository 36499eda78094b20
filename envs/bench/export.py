"""A policy of Stable-Baselines3 as the file that `run`, `bench` and `robustness` take."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from workbench.base.errors import InputError
from workbench.base.toml_text import toml_text
from workbench.commands.train.options import POLICY_FILE
from workbench.control.network import Layer, Network
from workbench.rigs.rig_file import bundled, rig_text

from .task import BenchTask


def trained_policy(model: Any, policy: Network) -> Network:
    """The actor of a model (PPO, A2C: an MlpPolicy with tanh) with the inputs of `policy`: its mean, cut to -1..1.

    Raises InputError for an actor that is no such network.
    """
    actor = [*model.policy.mlp_extractor.policy_net, model.policy.action_net]
    layers: list[Layer] = []
    for part in actor:
        if hasattr(part, "weight"):
            layers.append((np.array(part.weight.tolist()), np.array(part.bias.tolist())))
        elif type(part).__name__ != "Tanh":
            raise InputError(
                f"the actor has a {type(part).__name__}; export takes linear layers with tanh between them"
            )
    return replace(policy, layers=tuple(layers))


def save_policy(policy: Network, task: BenchTask, folder: str | Path) -> Path:
    """Leave policy.npz and trained.toml in a folder; `run`, `bench` and `robustness` take the latter, whose path it
    returns."""
    folder, config = Path(folder), task.source
    folder.mkdir(parents=True, exist_ok=True)
    (folder / POLICY_FILE).write_bytes(policy.packed())
    rig = config.rig_name if config.rig_name in bundled() else "rig.toml"
    if rig == "rig.toml":
        (folder / rig).write_text(rig_text(config.start.rig), encoding="utf-8")
    table = config.step_table({number.name: number.start for number in config.searched}, rig)
    (folder / "trained.toml").write_text(toml_text(table), encoding="utf-8")
    return folder / "trained.toml"
