"""The figures of a valve on its benches (corner frequencies, rated flows) and their distance from a datasheet's."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...base.errors import InputError
from ...base.gain_phase import gain_db, phase_deg
from ...engine import Engine
from ...linear import equilibrium
from ...linear.crossings import corner_frequency
from ...linear.frequency_response import SteppedSine, scan, stepped_sine
from ...plant import Plant, build_pilot_bench, build_valve_bench
from ...rigs.datasheet import Datasheet, DatasheetResponse
from ...rigs.rig import Rig

_FAILED = 3.0  # error of every figure where the model cannot be simulated
_PROBE = 1.02  # corner frequencies are read off two points this factor below and above
_CLOSE = 1.1  # corners this near each other share their points
_LEAST_SLOPE = (0.7, 20.0)  # dB and deg per e-fold of frequency: a flatter curve has no corner to speak of
_BENCH_DROP = 70e5  # Pa: over both lands of the flow benches


def corner_frequencies(
    rig: Rig, response: DatasheetResponse, points: int
) -> tuple[SteppedSine, float | None, float | None]:
    """The stage's stepped sine, gain referred to its first frequency, with its -3 dB and -90 deg frequencies [Hz]."""
    plant = _bench(rig, response.stage)
    rest = equilibrium(plant, command=0.0, p=plant.without_dry_friction())
    f = np.geomspace(response.reference, 2 * max(response.f3db, response.f90), points)
    sine = scan(Engine(plant), rest.x, rest.u, f, response.amplitude * plant.inputs[0].scale, "flow")
    flow = sine.response["flow"] / np.abs(sine.response["flow"][0])
    sine = replace(sine, response={"flow": flow})
    return sine, *corners_of(sine.f, flow)


def corners_of(f: np.ndarray, flow: np.ndarray) -> tuple[float | None, float | None]:
    """-3 dB and -90 deg frequencies [Hz] of a flow [k] at f [k] Hz, referred to its first; None where it has none."""
    return corner_frequency(f, gain_db(flow), -3.0), corner_frequency(f, phase_deg(flow), -90.0)


def rated_flow(rig: Rig, stage: str, drop: float) -> float:
    """Steady flow [m^3/s] of a stage at its full input over `drop` [Pa]."""
    plant = _bench(rig, stage)
    point = equilibrium(plant, command=plant.inputs[0].scale)
    return float(plant.observe(point.x, point.u)[0, plant.output("flow")] * np.sqrt(drop / _BENCH_DROP))


class FigureErrors:
    """How far the figures of any rig of a family are from a datasheet's; benches and engines are built once.

    `names` are those of the errors: both corners of every response, and the pilot's flow. The main flow is no error
    of its own: the main lands are chosen to meet it.
    """

    def __init__(self, sheet: Datasheet, family: Callable[[np.ndarray], Rig], first: np.ndarray) -> None:
        self._sheet, self._family = sheet, family
        rig = family(first)
        self._engines = {r.stage: Engine(_bench(rig, r.stage)) for r in sheet.responses}
        self.names = [f"{r.id}_{key}" for r in sheet.responses for key in ("f3db", "f90")] + ["pilot_flow"]

    def at(self, x: np.ndarray) -> np.ndarray:
        """Logarithms of model over datasheet at the family's place x."""
        rig = self._family(x)
        try:
            errors = [error for response in self._sheet.responses for error in self._corner_errors(rig, response)]
            flow = rated_flow(rig, "pilot", self._sheet.valve["rated_drop"])
        except InputError:  # no rest or no simulation there: a search turns back
            return np.full(len(self.names), _FAILED)
        return np.array([*errors, np.log(flow / self._sheet.valve["pilot_flow"])])

    def slopes(self, x: np.ndarray, steps: np.ndarray) -> np.ndarray:
        """Derivative of the errors [errors, x] by one-sided differences over `steps`."""
        here = self.at(x)
        return np.array(
            [(self.at(x + step * (np.arange(len(x)) == k)) - here) / step for k, step in enumerate(steps)]
        ).T

    def _corner_errors(self, rig: Rig, response: DatasheetResponse) -> tuple[float, float]:
        """Errors of both corners, read off two points around each, or around both where they are close."""
        engine = self._engines[response.stage]
        plant = engine.plant
        p = np.array([rig[name] for name in plant.parameters])
        rest = equilibrium(plant, command=0.0, p=plant.without_dry_friction(p))
        low, high = sorted((response.f3db, response.f90))
        pairs = [(f / _PROBE, f * _PROBE) for f in (response.f3db, response.f90)]
        if high / low < _CLOSE:
            pairs = [(low / _PROBE, high * _PROBE)] * 2
        f = np.unique([response.reference, *pairs[0], *pairs[1]])
        amplitude = response.amplitude * plant.inputs[0].scale
        flow = stepped_sine(engine, rest.x, rest.u, f, amplitude, ["flow"], p=p).response["flow"]
        gain, phase = gain_db(flow / np.abs(flow[0])), np.degrees(np.angle(flow))
        phase = np.where(phase > 90, phase - 360, phase)  # unwrapped by hand: the first frequency is far away
        return (
            _log_error(f, gain + 3, response.f3db, pairs[0], _LEAST_SLOPE[0]),
            _log_error(f, phase + 90, response.f90, pairs[1], _LEAST_SLOPE[1]),
        )


def _bench(rig: Rig, stage: str) -> Plant:
    return build_pilot_bench(rig) if stage == "pilot" else build_valve_bench(rig)


def _log_error(f: np.ndarray, value: np.ndarray, target: float, pair: tuple[float, float], least: float) -> float:
    """Logarithm of where `value` falls through zero, over `target` [Hz]: a straight line through the pair's points."""
    a, b = (float(value[np.argmin(np.abs(f - end))]) for end in pair)
    slope = min((b - a) / np.log(pair[1] / pair[0]), -least)
    return (a + slope * np.log(target / pair[0])) / -slope
