"""The kinds of valve with their equations: one file a kind, listed in VALVES.

kind            the abstract valve: equations, a pilot stage where there is one, limits, where probes act
lands           what the lands of a spool see, give and draw
three_stage     torque motor, nozzles and flapper, pilot spool; a main spool with its position loop
second_order    a main spool with its drive as one oscillator
pump            a pump with its shaft, direction valves and low side; one that turns both ways, of the same parts
supply          the power that the main lands take

A new kind, say a pump-controlled drive:

1. rigs/valve/pump.py declares `PUMP = ValveKind(name="pump", numbers={...}, slots=(...), ...)`, the numbers of its
   `[valve]` table and the slots that its equations have; one line lists it in rigs/valve/__init__.py.
2. plant/valve/pump.py defines a subclass of `Valve` whose `flows` writes the equations with the bench `b`: b["K"] is a
   number, b.state and b.rate declare a state, b.slot lets effects act; one line lists it below.

Rig files, effects, probes, saturation in describing functions and the commands follow from these two objects.
"""

from ...rigs import valve as kinds
from .kind import ProbePoint, Valve
from .lands import Lands, PilotFlows, ValveFlows
from .pump import Pump, TwoWayPump
from .second_order import SecondOrder
from .three_stage import ThreeStage

VALVES: dict[str, Valve] = {
    valve.kind.name: valve
    for valve in (
        ThreeStage(kinds.THREE_STAGE),
        SecondOrder(kinds.SECOND_ORDER),
        Pump(kinds.PUMP),
        TwoWayPump(kinds.TWO_WAY_PUMP),
    )
}

__all__ = ["VALVES", "Lands", "PilotFlows", "ProbePoint", "Valve", "ValveFlows"]
