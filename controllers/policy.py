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

from typing import TYPE_CHECKING, ClassVar, Literal

from workbench.control.by_graph import ByGraph
from workbench.control.linear_law import static
from workbench.control.network import Network
from workbench.control.network_file import read_network
from workbench.control.protocol import design_numbers, from_file

if TYPE_CHECKING:
    from workbench.control.graph_law import GraphLaw


@design_numbers
class PolicyDesign:
    """The network."""

    network: Network = from_file(Network, ".npz", read_network, "file of the trained network")


class PolicyOn:
    """What a trained network adds to the command of another law."""

    into: ClassVar[Literal["graph"]] = "graph"
    Design = PolicyDesign

    def __init__(self, design: PolicyDesign, period: float) -> None:
        self._network, self._period = design.network, period

    def around(self, inner: "GraphLaw") -> "GraphLaw":
        """A law with the network on top."""
        from workbench.control.network_law import with_network

        return with_network(inner, self._network, self._period)


class Policy(ByGraph):
    """A trained network by itself."""

    Design = PolicyDesign

    def __init__(self, design: PolicyDesign, period: float) -> None:
        from workbench.control.graph_law import as_graph

        nothing = as_graph(static([0.0, 0.0], design.network.signals[:1]))
        super().__init__(PolicyOn(design, period).around(nothing))
        self.measures = self.graph_law().measures
