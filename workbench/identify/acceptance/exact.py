"""Lines of a valve's sheet without noise: by equilibria where the valve stands, by stepped sines where it moves."""

import numpy as np

from ...plant import build_blocked_valve, build_valve_bench
from ...rigs.rig import Rig
from .bench import ABOUT_NULL, TestBench, standing
from .curve_figures import curve_rows, null_bias
from .dynamics import SINES, corner_rows
from .flow_curve import NODES, FlowCurve
from .regression import Regression

PER_MINUTE = 60000.0  # l/min of a m^3/s
_GRID = np.concatenate((-np.array(NODES[::-1]), [0.0], NODES))
_ABOUT = np.linspace(-1e-3, 1e-3, 21)  # of full command, where leakage is largest


def exact_lines(rig: Rig) -> dict[str, float]:
    """Flow, gains, lap, null bias, leakage, pilot flow and corners of a rig's valve, by line in the line's unit."""
    lines = curve_lines(rig, _GRID) | {"leakage": leakage(rig, _ABOUT), "pilot_flow": pilot_flow(rig)}
    bench = TestBench(rig, 0)
    for stage in rig.valve_kind.stages:
        for size in SINES:
            rows = corner_rows(bench.response(stage, size), f"{stage}_{size}", "", "")
            lines |= {row.id: row.value for row in rows}
    return {id: value for id, value in lines.items() if value is not None}


def curve_lines(rig: Rig, command: np.ndarray) -> dict[str, float | None]:
    """Figures of the flow [k] at which the bench stands at commands [k]."""
    flow = standing(build_valve_bench(rig), command, ("flow",))[:, 0]
    none = np.zeros((command.size, command.size))
    exact = FlowCurve(command, flow, Regression(flow, none, none, 2), "")
    return {row.id: row.value for row in curve_rows(exact)}


def curve_null(rig: Rig, command: np.ndarray) -> float:
    """The command at which no flow passes, between commands [k]."""
    return null_bias(command, standing(build_valve_bench(rig), command, ("flow",))[:, 0])


def leakage(rig: Rig, about: np.ndarray) -> float:
    """The largest flow [l/min] of the supply into blocked ports, at commands [k] from the null on."""
    command = TestBench(rig, 0).null + np.concatenate(([-ABOUT_NULL], about, [ABOUT_NULL]))
    return PER_MINUTE * float(standing(build_blocked_valve(rig), command, ("flow",)).max())


def pilot_flow(rig: Rig) -> float | None:
    """Flow [l/min] of the pilot at rated current; None without one."""
    return PER_MINUTE * TestBench(rig, 0).pilot_rated if rig.valve_kind.has_pilot else None
