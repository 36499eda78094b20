"""The paper's linear model of the three-stage valve (its figure 2): a block diagram with one gain a stage.

Rigid oil and weightless spools: the armature is of second order, the nozzles drive the pilot spool as an integrator,
the pilot lands drive the main spool as another, the feedback spring and the spool loop close the two loops:

    (J s^2 + phi s + Knet + Kr2 L^2) theta = Km i - Kr2 L z2
    S2 s z2 = Kq1 theta,      Kq1 = l Kbuse pi Dbuse sqrt(Pn - Pr)
    S3 s z3 = Kq2 z2,         Kq2 = K2 sqrt((Ps - Pr)/2), twice that inside the lap
    i = imax Kp (command - z3/z3max)

Pn is the nozzle pressure at null: K1 and Kf2 in, nozzle out.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..base.errors import InputError
from ..rigs.rig import Rig

if TYPE_CHECKING:
    import control


@dataclass(frozen=True)
class ValveBlocks:
    """`pilot`: current [A] -> pilot spool [m]; `valve`: command [1] -> main spool [m]; `state_space`: the same."""

    null_pressure: float
    pilot: "control.TransferFunction"
    valve: "control.TransferFunction"
    state_space: "control.StateSpace"


def null_pressure(rig: Rig) -> float:
    """Nozzle-chamber pressure Pn [Pa] with the flapper centred.

    (K1 + Kf2)^2 (Ps - Pn) = (Kbuse pi Dbuse xo)^2 (Pn - Pr)
    """
    inlet = (rig["K1"] + rig["Kf2"]) ** 2
    nozzle = (rig["Kbuse"] * np.pi * rig["Dbuse"] * rig["xo"]) ** 2
    return float((inlet * rig["Ps"] + nozzle * rig["Pr"]) / (inlet + nozzle))


def valve_blocks(rig: Rig, at_null: bool = False) -> ValveBlocks:
    """The block diagram from a rig's numbers; `at_null` takes the pilot lands inside their lap, where gain doubles.

    Raises InputError for a rig without a three-stage valve or whose spool loop is not proportional.
    """
    import control

    if not rig.valve_kind.has_pilot or rig.valve_kind.correctors[rig.corrector]:
        raise InputError(f"rig {rig.name}: the block diagram needs a three-stage valve with a proportional spool loop")
    pressure = null_pressure(rig)
    nozzle = rig["l"] * rig["Kbuse"] * np.pi * rig["Dbuse"] * np.sqrt(pressure - rig["Pr"])
    lands = rig["K2"] * np.sqrt((rig["Ps"] - rig["Pr"]) / 2) * (2 if at_null else 1)
    spring = rig["Kr2"] * rig["L"]
    first, second, inertia = nozzle / rig["S2"], lands / rig["S3"], rig["J"]
    drive = rig["Km"] * rig["imax"] * rig["Kp"] / inertia
    a = np.array(
        [
            [0, 1, 0, 0],
            [
                -(rig["Knet"] + spring * rig["L"]) / inertia,
                -rig["phi"] / inertia,
                -spring / inertia,
                -drive / rig["z3max"],
            ],
            [first, 0, 0, 0],
            [0, 0, second, 0],
        ]
    )
    states = ["theta", "w", "z2", "z3"]
    valve = control.StateSpace(
        a, [[0], [drive], [0], [0]], [[0, 0, 0, 1]], 0, inputs=["command"], outputs=["spool"], states=states
    )
    forward = rig["Km"] * first / inertia
    armature = [1, -a[1, 1], -a[1, 0], spring * first / inertia]
    loop = forward * second * rig["imax"] * rig["Kp"]
    return ValveBlocks(
        pressure,
        control.TransferFunction([forward], armature),
        control.TransferFunction([loop], [*armature, loop / rig["z3max"]]),
        valve,
    )
