"""A valve of a rig file on its test bench, played by the engine: the records that a laboratory would take of it.

Load ports at 35 bar and lands fed at 70 bar for flow; blocked ports at the rig's supply for pressure gain and leakage.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from ...engine import Engine
from ...linear.frequency_response import AGREE, scan
from ...linear.operating_point import equilibrium
from ...loop.sensors import Disturbance
from ...plant import Plant, build_blocked_valve, build_pilot_bench, build_valve_bench
from ...records import Record
from ...rigs.rig import Rig
from .dynamics import ResponseEstimate

METER = 1e-3  # of the rated flow: noise of a sample of a flow meter, declared here: no rig file has one
PERIOD = 5e-3  # s, of what moves slowly
FAST = 2.5e-4  # s, of steps
CYCLE, CYCLES = 20.0, 2  # s, triangles
SLOW = 60.0  # s, of one on blocked ports, whose pressures are late
ABOUT_NULL = 0.02  # of full command: where pressure gain and leakage are looked at
FARTHEST = 0.6  # of full command: within which a valve has its null
FINE = (0.03, 10.0)  # of full command, s: a second triangle for the flow about null
DWELL = 0.15  # s
HIGHEST, POINTS = 300.0, 40  # Hz; of a frequency response before it is refined
ROUNDS, LASTS = 24, 0.4  # cycles, and s, that a sine lasts at least
_CIRCLE = float(np.sqrt(-2 * np.log(0.05)))  # of the deviation of either part: the 95 % circle of a complex number


@dataclass(frozen=True)
class TestBench:
    """A rig's valve with the sensors that its file declares, and a flow meter; `seed` of their noise."""

    rig: Rig
    seed: int

    @property
    def rated(self) -> float:
        """Flow [m^3/s] of one valve at full travel and 35 bar a land."""
        return self.rig["K3"] * self.rig["z3max"] * 35e5**0.5

    @property
    def null(self) -> float:
        """The command at which no flow passes, which a laboratory sets before it blocks the ports."""
        plant = build_valve_bench(self.rig)

        def flow(command: float) -> float:
            return float(standing(plant, np.array([command]), ("flow",))[0, 0])

        return float(brentq(flow, -FARTHEST, FARTHEST, xtol=1e-7))  # pyright: ignore[reportArgumentType]

    def flow_records(self) -> list[Record]:
        """Triangles to full command and about null, flow metered."""
        plant = build_valve_bench(self.rig)
        wide, fine = triangle(1.0, CYCLE, CYCLES), triangle(*FINE, CYCLES)
        return [
            self._played(plant, "valve-flow", wide, PERIOD, 1),
            self._played(plant, "valve-flow-null", fine, PERIOD, 2),
        ]

    def pressure_record(self) -> Record:
        """A triangle about null on blocked ports: port pressures, and the flow that the supply gives."""
        command = self.null + triangle(ABOUT_NULL, SLOW, CYCLES)
        return self._played(build_blocked_valve(self.rig), "valve-pressure", command, PERIOD, 3)

    def step_record(self, size: int) -> Record:
        """Steps to +- size % and back to 0."""
        command = steps(size / 100, FAST)
        return self._played(build_valve_bench(self.rig), f"valve-step-{size}", command, FAST, 10 + size)

    def response(self, stage: str, size: int) -> ResponseEstimate:
        """Flow over the input by stepped sine of size %, over its first: of the "pilot" or the "main" stage."""
        f, flow = self._amplitudes(stage, size)
        return _relative(f, flow, AGREE * np.abs(flow))

    def metered_response(self, stage: str, size: int) -> ResponseEstimate:
        """The response as a flow meter reads it, with the meter's noise over each sine."""
        f, flow = self._amplitudes(stage, size)
        most = self.rated if stage == "main" else self.pilot_rated
        deviation = METER * most * np.sqrt(2 * FAST / np.maximum(ROUNDS / f, LASTS))
        real, imaginary = deviation * self._random(200 + size + (stage == "pilot")).standard_normal((2, f.size))
        return _relative(f, flow + real + 1j * imaginary, np.hypot(AGREE * np.abs(flow), _CIRCLE * deviation))

    def _amplitudes(self, stage: str, size: int) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies [k] Hz and complex amplitudes [k] of the flow [m^3/s]."""
        plant = build_pilot_bench(self.rig) if stage == "pilot" else build_valve_bench(self.rig)
        rest = equilibrium(plant, command=0.0, p=plant.without_dry_friction())
        limits = {"flapper": self.rig["xo"]} if "flapper" in plant.outputs else {}
        first = 10.0 if stage == "pilot" else 5.0
        amplitude = size / 100 * plant.inputs[0].scale
        sine = scan(Engine(plant), rest.x, rest.u, np.geomspace(first, HIGHEST, POINTS), amplitude, "flow", limits)
        return sine.f, amplitude * sine.response["flow"]

    def pilot_flow(self) -> tuple[float, float]:
        """Flow [m^3/s] at rated current and its deviation, by a second of the meter's readings."""
        readings = self.pilot_rated * (1 + METER * self._random(4).standard_normal(round(1 / PERIOD)))
        return float(readings.mean()), float(readings.std(ddof=1) / np.sqrt(readings.size))

    @property
    def pilot_rated(self) -> float:
        """Flow [m^3/s] of the pilot at rated current."""
        plant = build_pilot_bench(self.rig)
        return float(standing(plant, np.array([plant.inputs[0].scale]), ("flow",))[0, 0])

    def _random(self, which: int) -> np.random.Generator:
        return np.random.default_rng([self.seed, which])

    def _played(self, plant: Plant, name: str, command: np.ndarray, period: float, which: int) -> Record:
        """The command [k] held for each period, from rest; row k after writing it, with noise and resolution."""
        rest = equilibrium(plant, command=float(command[0]), p=plant.without_dry_friction())
        t = np.arange(command.size + 1) * period
        u = np.append(command, command[-1])[:, None]
        run = Engine(plant).run(rest.x, t, u)
        true, random = plant.observe(run.x[:-1], u[:-1]), self._random(which)
        signals = {"command": command}
        for signal in ("spool", "flow", "pa", "pb"):
            if signal in plant.outputs and (signal == "flow" or signal in self.rig.sensors):
                signals[signal] = self._read(signal, true[:, plant.output(signal)], random)
        return Record(name, t[:-1], signals)

    def _read(self, signal: str, values: np.ndarray, random: np.random.Generator) -> np.ndarray:
        if signal == "flow":
            return values + METER * self.rated * random.standard_normal(values.size)
        sensor = self.rig.sensors[signal]
        return Disturbance(sensor.noise, sensor.resolution).readings(values, random.standard_normal(values.size))


def standing(plant: Plant, command: np.ndarray, names: tuple[str, ...]) -> np.ndarray:
    """Outputs [k, names] at the equilibria of commands [k]."""
    smooth, rows = plant.without_dry_friction(), []
    for each in command.tolist():
        rest = equilibrium(plant, command=each, p=smooth)
        rows.append([plant.observe(rest.x, rest.u)[0, plant.output(name)] for name in names])
    return np.array(rows)


def _relative(f: np.ndarray, flow: np.ndarray, radius: np.ndarray) -> ResponseEstimate:
    first = float(np.abs(flow[0]))
    return ResponseEstimate(f, flow / first, radius / first)


def triangle(peak: float, seconds: float, cycles: int, period: float = PERIOD) -> np.ndarray:
    """Triangles [k] from 0 to +- peak, so many cycles of so many seconds each."""
    rows = round(seconds / period)
    wave = np.interp(4 * np.arange(rows) / rows, [0, 1, 3, 4], [0.0, 1.0, -1.0, 0.0])
    return peak * np.tile(wave, cycles)


def steps(size: float, period: float) -> np.ndarray:
    """Steps [k] to +- size and back to 0, each held until a valve has settled."""
    held = np.zeros(round(DWELL / period))
    return np.concatenate([held + side * size for side in (0, 1, 0, -1, 0, 1, 0, -1, 0)])
