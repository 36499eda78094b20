"""What a loop is asked for: the standard scenarios by name, what the reference does and a specimen's far end; and what
the hard goals ask for, and where in the stroke: numbers that files may give.
"""

from dataclasses import dataclass
from math import inf

import numpy as np

from ..base.errors import InputError, echo, nearest

_LEAVES = 0.5  # s: when a far end starts
_ACCELERATION = 5.0  # m/s^2: how it starts and stops
_LOADED = 0.5  # s: when a load comes
_TOLD = 0.01  # of a record's energy: what is left out of it is worth a remark
_SHORT = 1e-9  # s: an instant that is computed as k periods may be a rounding error early
POSITIONS = (-0.9, -0.5, 0.0, 0.5, 0.9)  # shares of the stroke limit at which loops are judged


@dataclass(frozen=True)
class Scenario:
    """A course of the controlled signal, from where it stands, watched for `duration` [s].

    `size` (SI) is a step's; with a `rate` (SI per s) a ramp's, with a `frequency` [Hz] a sine's amplitude, with a
    `waveform` what it spans: times [s] and values (SI, deviations from the start), linear between them, held beyond;
    one with a `stands` [s] stays at `size` from then on. A recorded one may be `slowed` by a factor, which is
    `slowed_for` a rig, and have `left_out` a part of its energy, which is above the control's Nyquist frequency.
    With a `travel` [m] the specimen's far end leaves at 0.5 s, moves so far at `speed` [m/s], and stands again. A
    `load` [N] pushes at the jack from `load_at` [s] on. The jack starts at `start` [m] from mid stroke, or a
    `start_share` of the stroke limit.
    """

    name: str
    signal: str
    size: float
    duration: float
    rate: float = np.inf
    frequency: float | None = None
    travel: float = 0.0
    speed: float = 0.0
    waveform: tuple[tuple[float, ...], tuple[float, ...]] | None = None
    start: float = 0.0
    start_share: float = 0.0
    load: float = 0.0
    load_at: float = _LOADED
    stands: float | None = None
    slowed: float = 1.0
    slowed_for: str = ""
    left_out: float = 0.0

    @property
    def arrives(self) -> float | None:
        """Time [s] from which reference, far end and load stand; None where they never do."""
        if self.frequency is not None or (self.waveform is not None and self.stands is None):
            return None
        far_end = _LEAVES + self._moving if self.travel else 0.0
        return max(self.stands or abs(self.size) / self.rate, far_end, self.load_at if self.load else 0.0)

    @property
    def is_step(self) -> bool:
        """Whether all there is to it is a reference that is at its end from the start."""
        return self.arrives == 0.0

    @property
    def moves_alone(self) -> bool:
        """Whether it is a step, and nothing else than the reference happens."""
        return bool(self.is_step and self.size and not self.load and not self.travel)

    @property
    def _moving(self) -> float:
        return self.travel / self.speed + self.speed / _ACCELERATION

    @property
    def remarks(self) -> list[str]:
        """What a report says of a reference that is not what its file has."""
        remarks = []
        if self.slowed != 1:
            why = f"{self.slowed_for} cannot follow it faster"
            remarks.append(f"{self.name} is slowed by a factor of {self.slowed:.4g}: {why}.")
        if self.left_out > _TOLD:
            share = f"{100 * self.left_out:.3g} % of its energy"
            remarks.append(f"{self.name} is without {share}, above half the control rate: a low pass takes that out.")
        return remarks

    def position(self, stroke: float) -> float:
        """The position at which the jack starts [m from mid stroke], with a stroke limit [m]."""
        return self.start + self.start_share * stroke

    def reference(self, t: np.ndarray) -> np.ndarray:
        """What is asked for at t [k] s: deviations [k] from the start."""
        if self.waveform is not None:
            return np.interp(t, *self.waveform)
        if self.frequency is not None:
            return self.size * np.sin(2 * np.pi * self.frequency * t)
        if np.isinf(self.rate):
            return np.full(len(t), self.size)
        return np.sign(self.size) * np.minimum(self.rate * t, abs(self.size))

    def inputs(self, t: np.ndarray) -> dict[str, np.ndarray]:
        """Other inputs of the plant at t [k] s, by name: far end [m], its velocity [m/s], load [N], from the start."""
        load = {"disturbance": np.where(t < self.load_at - _SHORT, 0.0, self.load)} if self.load else {}
        if not self.travel:
            return load
        ramp = self.speed / _ACCELERATION
        starts, stops = (np.clip(t - at, 0, ramp) for at in (_LEAVES, _LEAVES + self._moving - ramp))
        gone = [np.clip(t - at - ramp, 0, None) for at in (_LEAVES, _LEAVES + self._moving - ramp)]
        way = _ACCELERATION / 2 * (starts**2 - stops**2) + self.speed * (gone[0] - gone[1])
        return {"specimen_position": way, "specimen_velocity": _ACCELERATION * (starts - stops), **load}


SCENARIOS = {
    scenario.name: scenario
    for scenario in (
        Scenario("position-1mm", "position", 1e-3, 3.0),
        Scenario("position-10mm", "position", 10e-3, 3.0),
        Scenario("position-100mm", "position", 100e-3, 4.0),
        Scenario("position-200mm", "position", 200e-3, 4.0),
        # at both ends of the stroke, towards the middle and away from it
        Scenario("position-10mm-at+90", "position", -10e-3, 3.0, start_share=0.9),
        Scenario("position-10mm-at-90", "position", 10e-3, 3.0, start_share=-0.9),
        Scenario("position-10mm-at+90-out", "position", 10e-3, 3.0, start_share=0.9),
        Scenario("position-10mm-at-90-out", "position", -10e-3, 3.0, start_share=-0.9),
        Scenario("position-load-20kn", "position", 0.0, 3.0, load=20e3),
        Scenario("position-ramp", "position", 100e-3, 3.0, rate=0.1),
        # all of the same speed
        *(Scenario(f"position-sine-{f}hz", "position", 10e-3 / f, 2.0, frequency=f) for f in (1, 2, 5, 10, 20, 30)),
        Scenario("force-20kn", "force", 20e3, 1.0),
        Scenario("force-moving-end", "force", 20e3, 2.5, travel=0.1, speed=0.1),
        Scenario("force-moving-end-fast", "force", 20e3, 2.0, travel=0.2, speed=0.5),
    )
}


def scenario(name: str, where: str) -> Scenario:
    """A standard scenario by name; raises InputError, opened by `where`, for an unknown one."""
    if name not in SCENARIOS:
        raise InputError(f"{where}: no scenario {echo(name)}; {nearest(name[:80], SCENARIOS)}")
    return SCENARIOS[name]


@dataclass(frozen=True)
class Limits:
    """What hard goals allow, each by the key of a metric (METRICS), in its unit: ms on every plant, ms_nominal, as
    gain_margin_db and load_left, on the nominal rig, all others on every plant.

    `seconds` of a scenario are watched. `moves`: as many steps, there and back, each watched as long, come before a
    step that is judged."""

    ms_nominal: float = 2.0
    ms: float = 2.5
    gain_margin_db: float = 6.0
    command_rms: float = 0.01
    overshoot_percent: float = inf
    load_left: float = inf
    seconds: float = 1.0
    moves: int = 0
