"""What the main lands draw from the supply, from signals of a run."""

import casadi as ca
import numpy as np

from ...rigs.rig import Rig
from ..orifice import exponential_lap, root


def supply_power(rig: Rig, spool: np.ndarray, pa: np.ndarray, pb: np.ndarray, supply: np.ndarray) -> np.ndarray:
    """Power [W] [k] that the main lands take at spool [m] and pressures [Pa], all [k]: supply times flow out of it.

    At null it is the leakage of the lap. The pilot's flow does not count, nor an effect that changes lap or lands.
    """
    z, a, b, feed = signals = [ca.SX.sym(name) for name in ("z", "a", "b", "feed")]
    eps = ca.SX(rig["eps"])
    flow = exponential_lap(z, eps) * root(feed - a) + exponential_lap(-z, eps) * root(feed - b)
    power = ca.Function("power", signals, [rig["n"] * rig["K3"] * flow * feed])
    return np.array(power(*(np.atleast_2d(of) for of in (spool, pa, pb, supply)))).ravel()
