"""The low side: a gas accumulator behind its line, past which a check valve lets oil in. A tank is a very large one."""

import casadi as ca

from ..assembly import Assembly


def accumulator(b: Assembly, low: ca.SX) -> ca.SX:
    """Flow [m^3/s] out of the accumulator to the low side at pressure `low` [Pa]; gas polytropic, p V^kg constant."""
    gas = b.state("Pg", "Pa", b.magnitude("Pr"), number="Pr")
    line = (gas - low) / b["Rl"]
    check = b["Kc"] * ca.fmax(low - gas - b["pk"], 0)
    flow = b.slot("accumulator", line - check, drop=gas - low, pressure=gas)
    volume = b["Vg"] * (b["pg"] / gas) ** (1 / b["kg"])
    stiffness = b.slot("gas_stiffness", b["kg"] * gas / volume, pressure=gas)
    b.rate("Pg", -stiffness * flow)
    return flow
