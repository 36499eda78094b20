"""Trained policies: a small network on top of another law, or by itself.

The network is an .npz file of plain arrays, such as `jackbench train` leaves and any other trainer can write with
numpy.savez; objects are not unpacked. s = (r, y) are the reference and the measured signals at a decision, SI:

    signals   [m] text     names of the measured ones, such as position, pa, pb; the controlled one first
    A, B      [n, n], [n, 2 + m]    the past, at the end of a decision: x+ = A x + B (s, v), v the command the drive got
    C, D, shift, bound     [k, n], [k, 1 + m], [k], []    inputs z = clip(C x + D s + shift, -bound, bound)
    W1, b1, W2, b2, ...    [h, k], [h], ...    tanh layers, the last one [1, h], [1] linear
    squash    [] text      "tanh" or "clip": of the last layer to -1..1
    limit     []           command [1] at 1
    decision  []           time between decisions [s], a multiple of the control period: the command is held
    V, forgets, floor   [h, k], [], []    of a network that remembers its motions; see workbench.control.network

n may be 0, and bound inf. At a start the past has been at rest. So past samples are a shift register in A, a low pass
is a row of A, and a scaled observation (signal - zero) / full scale is a row of D and an entry of shift.
"""

from typing import ClassVar, Literal

from workbench.control.law import LawController, static_law
from workbench.control.network import Network, read_network
from workbench.control.protocol import design_numbers, from_file
from workbench.control.shell import around


@design_numbers
class PolicyDesign:
    """The network."""

    network: Network = from_file(Network, ".npz", read_network, "file of the trained network")


class PolicyOn:
    """What a trained network adds to the command of another law."""

    into: ClassVar[Literal["graph"]] = "graph"
    Design = PolicyDesign

    def __init__(self, design: PolicyDesign, period: float) -> None:
        from workbench.control.network_law import network_shell

        self.shell = network_shell(design.network, period)


class Policy(LawController):
    """A trained network by itself."""

    Design = PolicyDesign

    def __init__(self, design: PolicyDesign, period: float) -> None:
        nothing = static_law([0.0, 0.0], design.network.signals[:1], period)
        super().__init__(around(nothing, PolicyOn(design, period).shell))
