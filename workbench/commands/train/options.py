"""`jackbench train EXPERIMENT`: a tune experiment with a table `network`, whose weights are searched."""

import argparse
from collections.abc import Mapping
from typing import Any, Self

import numpy as np

from ...control.network import Network
from ...loop.tuning.problem import Searched
from ..common.declared import ExperimentFile, declared, part, takes_experiment
from ..common.experiment import asked_rig
from ..common.scenario_tables import read_scenarios
from ..tune.options import TuneConfig, searched_numbers
from .start import place_of_policy, read_start, with_policy

POLICY_FILE = "policy.npz"
_STEEPER = 3.0  # of a logarithm: how much a unit may become steeper or flatter by what is remembered
_REACH = 1.5  # of a weight on either side of its start, over the root of how many inputs its unit has


def _seeds(at: ExperimentFile) -> tuple[int, ...]:
    seeds = at.top.numbers("seeds", "[1, 2, 3]")
    if len(set(seeds)) < len(seeds) or any(seed % 1 or seed < 0 for seed in seeds):
        raise at.top.complaint("seeds", "must be different whole numbers, 0 or more; a run is made with each")
    return tuple(map(int, seeds))


@declared
class TrainConfig(TuneConfig):
    """A search of a network's weights, run once for each of the `seeds`; `network` is the start's."""

    KIND = "train"
    seeds: tuple[int, ...] = part(_seeds, {"seeds": "a run is made with each"})
    network: Network = part(lambda at: at.known["network"], {"network": "the start, or a file to go on from"})

    @classmethod
    def read(cls, at: ExperimentFile) -> Self:
        """What an ExperimentFile gives, its one controller with the network on top."""
        rig = asked_rig(at)
        network, odd = read_start(at.top, at.path.parent, rig, read_scenarios(at.top, rig)[0].signal)
        whole, weights = {}, []
        for name, table in at.tables.items():
            if "stiffness" in table:
                what = "a policy is trained on loops of what is measured; take stiffness out"
                raise table.complaint("stiffness", what)
            table.tables("compensators")  # complains of what is no list of tables
            whole[name] = with_policy(table.values, network)
            weights += _weights(network, odd, place_of_policy(table.values))
        top = at.top.replaced({**at.top.values, "controllers": whole})
        inside = ExperimentFile(cls, top, at.path, {**at.asked, "rig": rig}, {"network": network, "source": at.source})
        inside.known |= {"rig_name": at.rig_name, "searched": (*searched_numbers(inside), *weights)}
        return super().read(inside)

    def step_table(self, values: Mapping[str, float], rig: str) -> dict[str, Any]:
        """The step experiment on a named rig whose controller has its network from POLICY_FILE beside it."""
        table = super().step_table(values, rig)
        return {**table, "controllers": {self.name: with_policy(table["controllers"][self.name], POLICY_FILE)}}

    def trained(self, values: Mapping[str, float]) -> Network:
        """The network of a design."""
        controller = self.problem.design(values)
        *_, outermost = controller, *controller.compensators
        return outermost.design.network


load_train = TrainConfig.load


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    what = "a train experiment, such as experiments/train_p_dp.toml"
    takes_experiment(parser, what, TrainConfig, "train.study:run_train", shared=True)


def _weights(network: Network, odd: bool, place: tuple[str | int, ...]) -> list[Searched]:
    """One searched number a weight, and one a bias where the network need not stay odd."""
    now, biases = network.numbers, network.are_biases
    reach = np.concatenate([np.full(w.size + b.size, _REACH / np.sqrt(w.shape[1])) for w, b in network.layers])
    reach = np.append(reach, np.full(len(now) - len(reach), _STEEPER))  # of energies that are one over all
    searched = np.flatnonzero(~biases) if odd else np.arange(len(now))
    each = zip(searched.tolist(), *(part[searched].tolist() for part in (now - reach, now + reach, now)), strict=True)
    return [Searched((*place, k), "1", low, high, start, False) for k, low, high, start in each]
