"""What a training starts from: a network that adds nothing, or one of a file."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ...base.table import ConfigTable
from ...base.units import Spec
from ...control.network import Layer, Memory, Network, read_network
from ...rigs.rig import Rig

POLICY, ON_TOP = "controllers.policy:Policy", "controllers.policy:PolicyOn"
_WIDEST, _MOST = 64, 3  # units of a hidden layer, and how many of those
_MOST_FURTHER = 8
_FLOOR = 1e-4  # of energies of inputs over their scales: what sensors' noise comes to


def with_policy(controller: Mapping[str, Any], network: Network | str) -> dict[str, Any]:
    """A controller's table with a network, or a file of one, on top; a policy by itself gets it as its own."""
    if controller.get("use") == POLICY:
        return {**controller, "network": network}
    parts = [*controller.get("compensators", []), {"use": ON_TOP, "network": network}]
    return {**controller, "compensators": parts}


def place_of_policy(controller: Mapping[str, Any]) -> tuple[str | int, ...]:
    """The way to the network that `with_policy` puts into a controller's table."""
    if controller.get("use") == POLICY:
        return ("network",)
    return ("compensators", len(controller.get("compensators", [])), "network")


def read_start(top: ConfigTable, beside: Path, rig: Rig, signal: str) -> tuple[Network, bool]:
    """The table `network` of an experiment whose controlled signal is given, or the file that it names; and whether it
    is to stay odd, without biases: what a jack whose sides are alike needs.

    Raises InputError.
    """
    if isinstance(top.values.get("network"), str):
        network = read_network(top.path("network", beside, ".npz"))
        return network, not network.numbers[network.are_biases].any()
    table = top.table("network", "hidden", "limit", "error", "pressure", "slow", "fast", "further", "remembers", "odd")
    hidden = table.numbers("hidden", "[6]")
    if len(hidden) > _MOST or any(units % 1 or not 1 <= units <= _WIDEST for units in hidden):
        raise table.complaint("hidden", f"must be units of {_MOST} layers at most, each of 1 to {_WIDEST}")
    corners = [table.quantity(key, Spec("Hz", 1e-3, rig.nyquist, f"the {key} low pass")) for key in ("slow", "fast")]
    corners += _further(table, rig.nyquist)
    scales = [table.quantity("error", Spec(rig.signal(signal).si, 1e-12, 1e12, "error that counts as 1"))]
    if {"pa", "pb"} <= rig.sensors.keys():
        scales.append(table.quantity("pressure", Spec("Pa", 1.0, 1e9, "difference of pressures that counts as 1")))
    limit = table.quantity("limit", Spec("1", 1e-6, 1.0, "command that it adds at most"))
    layers, odd = [int(units) for units in hidden], table.flag("odd", True)
    network = silent_network(signal, scales, corners, layers, limit, rig.period.value)
    if "remembers" in table:
        time = table.quantity("remembers", Spec("s", 0.05, 1e3, "how long it remembers a motion"))
        network = replace(network, memory=_nothing(network, rig.period.value / time))
    return network, odd


def _further(table: ConfigTable, nyquist: float) -> list[float]:
    """Corners of further low passes [Hz]; none without the key."""
    corners = list(table.numbers("further", "[1, 8]")) if "further" in table else []
    if any(not 1e-3 <= corner <= nyquist for corner in corners) or len(corners) > _MOST_FURTHER:
        raise table.complaint("further", f"{_MOST_FURTHER} corners at most, each from 0.001 to {nyquist:g} Hz")
    return corners


def _nothing(network: Network, forgets: float) -> Memory:
    """The memory of a network whose units are as steep whatever it remembers."""
    return Memory(np.zeros_like(network.layers[0][0]), forgets, _FLOOR)


def silent_network(
    signal: str, scales: list[float], corners: list[float], hidden: list[int], limit: float, period: float
) -> Network:
    """A network of zeros, odd in its inputs: the error over its scale, and how far the controlled signal, and with a
    second scale pa - pb, are from each of their low passes with `corners` [Hz]. `period` in s."""
    signals = (signal, "pa", "pb")[: 1 if len(scales) == 1 else 3]
    differences = np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0]])[: len(scales), : 1 + len(signals)]
    shown = np.repeat(differences / np.array(scales)[:, None], len(corners), axis=0)
    follows = np.tile(1 - np.exp(-2 * np.pi * np.array(corners) * period), len(scales))
    n = len(follows)
    error = np.zeros((1, 1 + len(signals)))
    error[0, :2] = 1 / scales[0], -1 / scales[0]
    return Network(
        signals=signals,
        A=np.diag(1 - follows),
        B=np.pad(follows[:, None] * shown, ((0, 0), (0, 1))),
        C=np.vstack((np.zeros(n), -np.eye(n))),
        D=np.vstack((error, shown)),
        shift=np.zeros(n + 1),
        bound=np.inf,
        layers=_zeros([n + 1, *hidden, 1]),
        squash="tanh",
        limit=limit,
        decision=period,
    )


def _zeros(sizes: list[int]) -> tuple[Layer, ...]:
    return tuple((np.zeros((rows, columns)), np.zeros(rows)) for columns, rows in pairwise(sizes))
