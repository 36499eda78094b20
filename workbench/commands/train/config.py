"""Train experiments: a tune experiment of one controller with a table `network`, whose weights are searched."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import echo
from ...base.table import ConfigTable
from ...control.network import Network
from ...loop.tuning.problem import Searched
from .. import COMMANDS
from ..common.experiment import read_experiment, rig_name, rig_of
from ..common.scenario_tables import read_scenarios
from ..tune.config import TuneConfig, tune_config
from .start import place_of_policy, read_start, with_policy

POLICY_FILE = "policy.npz"
_STEEPER = 3.0  # of a logarithm: how much a unit may become steeper or flatter by what is remembered
_REACH = 1.5  # of a weight on either side of its start, over the root of how many inputs its unit has


@dataclass(frozen=True)
class TrainConfig(TuneConfig):
    """A search of a network's weights, run once for each of the `seeds`; `network` is the start's."""

    seeds: tuple[int, ...]
    network: Network

    def step_table(self, values: Mapping[str, float], rig: str) -> dict[str, Any]:
        """The step experiment on a named rig whose controller has its network from POLICY_FILE beside it."""
        table = super().step_table(values, rig)
        return {**table, "controllers": {self.name: with_policy(table["controllers"][self.name], POLICY_FILE)}}

    def trained(self, values: Mapping[str, float]) -> Network:
        """The network of a design."""
        controller = self.problem.design(values)
        *_, outermost = controller, *controller.compensators
        return outermost.design.network


def load_train(path: str | Path, rig: str | None = None) -> TrainConfig:
    """Read a train experiment; `rig` replaces the one it names. Raises InputError with file and key."""
    path = Path(path)
    top = read_experiment(path)
    if (kind := top.text("experiment")) != "train":
        command = kind if kind in COMMANDS else "run"
        raise top.complaint("experiment", f'{echo(kind)} is not "train"; jackbench {command} may take it')
    seeds, named, of = _seeds(top), rig or rig_name(top), rig_of(top, path, rig)
    network, odd = read_start(top, path.parent, of, read_scenarios(top, of)[0].signal)
    controllers, whole, further = top.table("controllers"), {}, []
    for name in controllers:
        table = controllers.table(name)
        if "stiffness" in table:
            raise table.complaint("stiffness", "a policy is trained on loops of what is measured; take stiffness out")
        table.tables("compensators")  # complains of what is no list of tables
        whole[name] = with_policy(table.values, network)
        further += _weights(network, odd, place_of_policy(table.values))
    config = tune_config(top.replaced({**top.values, "controllers": whole}), named, of, tuple(further))
    shared = {entry.name: getattr(config, entry.name) for entry in fields(TuneConfig)}
    return TrainConfig(**{**shared, "source": top.values}, seeds=seeds, network=network)


def _seeds(top: ConfigTable) -> tuple[int, ...]:
    seeds = top.numbers("seeds", "[1, 2, 3]")
    if len(set(seeds)) < len(seeds) or any(seed % 1 or seed < 0 for seed in seeds):
        raise top.complaint("seeds", "must be different whole numbers, 0 or more; a run is made with each")
    return tuple(map(int, seeds))


def _weights(network: Network, odd: bool, place: tuple[str | int, ...]) -> list[Searched]:
    """One searched number a weight, and one a bias where the network need not stay odd."""
    now, biases = network.numbers, network.are_biases
    reach = np.concatenate([np.full(w.size + b.size, _REACH / np.sqrt(w.shape[1])) for w, b in network.layers])
    reach = np.append(reach, np.full(len(now) - len(reach), _STEEPER))  # of energies that are one over all
    searched = np.flatnonzero(~biases) if odd else np.arange(len(now))
    each = zip(searched.tolist(), *(part[searched].tolist() for part in (now - reach, now + reach, now)), strict=True)
    return [Searched((*place, k), "1", low, high, start, False) for k, low, high, start in each]
