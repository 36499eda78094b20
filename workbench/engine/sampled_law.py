"""A sampled law as the compiled run of a plant takes it: its graphs, and what decides the machine code of an instant.

Its numbers are parameters, so that other gains, rigs, limits and noise need no other machine code.
"""

from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256

import casadi as ca

from ..plant import Plant
from .guard_rules import COUPLED
from .guard_shape import GuardShape, length, places
from .tape import opcodes

OUT = ("sent", "demanded", "held", "trip")  # what every instant puts out of each jack, before the recorded outputs


class LawGraphs:
    """A law: output (x, (r, y), o, q) -> u, and advance (x, (r, y), v, o, q) -> x+.

    v is the command that the drive really got, o the constant that starts a loop without a bump, q the law's numbers.
    Two of them are the same where their graphs are.
    """

    def __init__(self, output: ca.Function, advance: ca.Function) -> None:
        self.output, self.advance = output, advance
        self._digest = sha256((output.serialize() + advance.serialize()).encode()).digest()

    @property
    def states(self) -> int:
        """How many."""
        return self.output.size1_in(0)

    @property
    def numbers(self) -> int:
        """How many."""
        return self.output.size1_in(3)

    @property
    def instructions(self) -> int:
        """How many it takes: how large it is."""
        return self.output.n_instructions() + self.advance.n_instructions()

    @property
    def calls(self) -> bool:
        """Whether it calls a kernel, which is in machine code only."""
        return "call" in opcodes(self.output)

    @cached_property
    def slopes(self) -> ca.Function:
        """(x, (r, y), v, o, q) -> df/dx, df/d(r, y), dg/dx, dg/d(r, y), df/dv, df/do, dg/do of advance f and output
        g."""
        symbols, slopes = self._slopes
        return ca.Function("slopes", list(symbols), [ca.densify(slope) for slope in slopes])

    @cached_property
    def linear(self) -> bool:
        """Whether the slopes are the same everywhere."""
        if self.calls:
            return False
        symbols, slopes = self._slopes
        return not ca.depends_on(ca.veccat(*slopes), ca.vertcat(*symbols[:4]))

    @cached_property
    def _slopes(self) -> tuple[tuple[ca.SX, ...], tuple[ca.SX, ...]]:
        """x, (r, y), v, o and q, and the slopes."""
        x, s, v, o, q = symbols = tuple(ca.SX.sym("i", self.advance.size1_in(i)) for i in range(5))
        u, after = self.output(x, s, o, q), self.advance(x, s, v, o, q)
        pairs = (after, x), (after, s), (u, x), (u, s), (after, v), (after, o), (u, o)
        return symbols, tuple(ca.jacobian(y, of) for y, of in pairs)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, LawGraphs) and self._digest == other._digest

    def __hash__(self) -> int:
        return hash(self._digest)

    def __repr__(self) -> str:
        return f"<LawGraphs of {self.states} states, {self.numbers} numbers>"


@dataclass(frozen=True)
class LawShape:
    """What decides the machine code of an instant; everything else is a parameter.

    graphs: the law's. measured: the outputs that it sees. sensors: all of the rig's, in the order of their noise.
    ahead: how many samples ahead it knows its reference. late: whole periods that a command is on its way, and with
    `split` a part of one more, over which the drive holds the older command, or `interpolated` the mean. own_delays:
    each lane has a delay of its own of up to so many whole periods. noisy: sensors have noise and resolution. recorded:
    outputs put out.

    jacks: how many the law commands. Several are the legs of a platform: (r, y) of its law are their references, what
    is added, which it adds itself, then what it `measured`, leg by leg; measured, sensors and guard are those of a leg.
    """

    graphs: LawGraphs
    measured: tuple[str, ...]
    sensors: tuple[str, ...]
    guard: GuardShape
    ahead: int = 0
    late: int = 0
    split: bool = False
    interpolated: bool = False
    own_delays: bool = False
    noisy: bool = False
    recorded: tuple[str, ...] = ()
    jacks: int = 1

    @property
    def read(self) -> tuple[str, ...]:
        """The outputs that are read: those that the law or the guard needs."""
        return self.guard.read

    @property
    def state(self) -> dict[str, slice]:
        """Places in the state of an instant: the commands that the drives hold last, those on their way, ..."""
        line, guard = self.jacks * (self.late + 1), self.jacks * length(self.guard.state)
        return places(held=self.jacks, line=line, command=self.jacks, guard=guard, law=self.graphs.states)

    @property
    def width_out(self) -> int:
        """How many numbers an instant puts out."""
        return self.jacks * len(OUT) + len(self.recorded)

    @property
    def trip(self) -> int:
        """Place of the number of a trip in the state."""
        return self.state["guard"].start + self.guard.state["trip"].start

    @property
    def numbers(self) -> dict[str, slice]:
        """Places of the parameters; of guards and sensors one jack after the other."""
        sensors, guard = self.jacks * len(self.read), self.jacks * length(self.guard.numbers)
        coupling = {"coupling": length(COUPLED)} if self.guard.leg else {}
        taps = {"taps": self.late + 1} if self.own_delays else {}
        own = {"q": self.graphs.numbers, "offset": self.jacks, "guard": guard}
        return places(**own, **coupling, part=1, **taps, noise=sensors, resolution=sensors)

    def inputs(self, plant: Plant) -> dict[str, slice]:
        """Places in the row of an instant: the references and those to come, added commands, the plant's inputs but for
        the commands, noise."""
        return places(
            reference=self.jacks * (1 + self.ahead),
            added=self.jacks,
            others=len(plant.inputs) - self.jacks,
            noise=self.jacks * len(self.sensors) if self.noisy else 0,
        )

    def output(self, jack: int, name: str) -> str:
        """The name of a jack's output among those of the plant."""
        return name if self.jacks == 1 else f"leg{jack + 1}.{name}"
