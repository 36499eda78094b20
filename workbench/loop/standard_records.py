"""What a rig's drive is to play: an excitation as it is asked for, and the records that tell most of a rig in short
time, as large as it takes them: steps, triangles, a multisine.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import InputError, nearest
from ..base.signals import SIGNALS
from ..base.units import from_si, to_si
from ..linear import equilibrium
from ..plant import build
from ..records.excitation import KINDS, MOST_ROWS, SIMPLE, Excitation, Spacing, Spectrum, chirp, excitation, multisine
from ..rigs.rig import Rig
from .drive_simulation import DriveSimulation, play, trouble, within_limits

LARGEST = 0.4  # of full command: no move is faster
COMMANDS = LARGEST * np.array([0.005, 0.0125, 0.025, 0.05, 0.125, 0.25, 0.5, 1.0])  # between which speeds are straight
PUSH = 0.25  # of the force that the supply can give on the smaller side, to accelerate with
TRAVEL = 0.6  # of the stroke limit: how far a move goes, or as far as the fastest gets in TRAVEL_TIME
TRAVEL_TIME = 0.2  # s
STEPS = (
    (1.0, 0.4), (-0.2, 0.1), (-1.0, 0.2), (-0.8, 0.4), (0.05, 0.03), (0.45, 0.1), (1.0, 0.3), (-0.05, 0.05),
    (0.35, 0.15), (-0.8, 0.3),
)  # fmt: skip
"""Displacement over the travel, and the command whose steady speed it is made at."""
TRIANGLES = ((0.04, 0.25), (0.02, 0.4), (0.008, 0.7))
"""Command, and seconds from 0 to the peak: fast to so slow that friction shows."""
LASTS = 6.0  # s, at least, of steps and triangles
STEP_REST = 0.45  # s
SECONDS, REPEAT = 2.0, 4  # of the multisine: one period, and how many
SLOW, FAST, LINES, FINE = (0.5, 3.0), (5.0, 250.0), 50, 0.03  # Hz on the reference; Hz, lines and peak on the command


@dataclass(frozen=True)
class Design:
    """What `jackbench excite` is asked for: amplitude in the unit of the signal (1 or mm), band in Hz, seconds."""

    kind: str
    signal: str
    amplitude: float
    seconds: float
    repeat: int = 1
    band: tuple[float, float] | None = None
    lines: int | None = None
    spectrum: Spectrum = "flat"
    spacing: Spacing = "log"


def designed(design: Design, rig: Rig) -> Excitation:
    """The excitation that is asked for, on the rig's control period about its middle. Raises InputError."""
    if design.kind not in KINDS:
        raise InputError(f'no excitation "{design.kind}"; {nearest(design.kind, KINDS)}')
    if design.signal not in ("command", "reference"):
        raise InputError(f'signal "{design.signal}": write command or reference')
    if design.repeat < 1:
        raise InputError(f"repeat {design.repeat}: must be 1 or more")
    if design.repeat * design.seconds > MOST_ROWS * rig.period.value:
        raise InputError(f"repeat {design.repeat}: more than {MOST_ROWS} control periods in all; repeat less often")
    signal = SIGNALS[design.signal]
    size, period = float(to_si(design.amplitude, signal.unit, signal.si)), rig.period.value
    most = 1.0 if design.signal == "command" else rig.limit("stroke")
    if not 0 < size <= most:
        limit = float(from_si(most, signal.unit, signal.si))
        raise InputError(f"amplitude {design.amplitude:g} {signal.unit}: must be above 0, at most {limit:g}")
    if design.kind in SIMPLE:
        wave = SIMPLE[design.kind](size, design.seconds, period)
    elif design.band is None:
        raise InputError(f"a {design.kind} needs its band, two frequencies in Hz")
    elif design.kind == "chirp":
        wave = chirp(size, design.seconds, period, design.band, design.spacing)
    else:
        wave = multisine(size, design.seconds, period, design.band, design.spectrum, design.lines)
    return excitation(design.kind, design.signal, wave, period, rig["xmid"], design.repeat)


def standard_set(drive: DriveSimulation) -> dict[str, Excitation]:
    """Steps and triangles of 6 s, and four periods of a 2 s multisine, as large as the rig takes them.

    The reference moves at steady speeds that the table's commands give, on edges that PUSH allows, and the command of
    each speed is added: the valve opens as far as the table says, however slow the position loop is. The multisine
    moves the reference in 0.5-3 Hz, as fast as the steps, so that the valve works away from null, and adds 5-250 Hz to
    the command.
    """
    rig, period = drive.rig, drive.rig.period.value
    pace = _Pace(replace(rig, effects=()))  # a drive is set to what its rig is declared to be
    travel = min(TRAVEL * rig.limit("stroke"), pace.speed(LARGEST) * TRAVEL_TIME)
    steps = [
        np.concatenate((pace.move(part * travel, size), np.zeros(round(STEP_REST / period)))) for part, size in STEPS
    ]
    triangles = [
        pace.move(side * pace.speed(size) * seconds, size) for size, seconds in TRIANGLES for side in (1, -2, 1)
    ]
    slow = pace.multisine(travel)
    wave = multisine(FINE, SECONDS, period, (FAST[0], min(FAST[1], 0.25 / period)), lines=LINES)
    added = np.append(np.tile(wave, REPEAT), 0.0)
    designs = (
        pace.moving("steps", steps),
        pace.moving("triangle", triangles),
        replace(slow, command=slow.command + added),
    )
    excitations = {}
    for design in designs:
        fitting = within_limits(drive, design)
        if fitting is None:
            why = trouble(play(drive, design))
            raise InputError(f"rig {rig.name}: cannot play {design.name} at any size: {why}; check limits and effects")
        excitations[design.name] = fitting
    return excitations


class _Pace:
    """Speeds that a rig's commands give, and moves at them."""

    def __init__(self, rig: Rig) -> None:
        self._rig, self._period = rig, rig.period.value
        plant = build(rig)
        smooth = plant.without_dry_friction()
        commands = np.concatenate((-COMMANDS[::-1], [0.0], COMMANDS))
        speeds = [equilibrium(plant, command=c, p=smooth).speed if c else 0.0 for c in commands]
        self._commands, self._speeds = commands, np.array(speeds)
        self._acceleration = PUSH * (rig["Ps"] - rig["Pr"]) * min(rig.areas) / rig["M"]

    def speed(self, command: float) -> float:
        """Steady speed [m/s], never above half the rig's limit."""
        limit = 0.5 * self._rig.limit("speed")
        return float(np.clip(np.interp(command, self._commands, self._speeds), -limit, limit))

    def move(self, displacement: float, command: float) -> np.ndarray:
        """Velocities [n] m/s of a move at the speed of `command`, slower where its edges leave no room."""
        side = np.sign(displacement)
        speed = min(abs(self.speed(side * command)), np.sqrt(2 * self._acceleration * abs(displacement) / np.pi))
        edge = max(1, round(np.pi / 2 * speed / self._acceleration / self._period))
        flat = max(0, round(abs(displacement) / speed / self._period) - edge)
        rise = np.sin(np.pi / 2 * (np.arange(edge) + 0.5) / edge) ** 2
        shape = np.concatenate((rise, np.ones(flat), rise[::-1]))
        return displacement * shape / (shape.sum() * self._period)

    def multisine(self, travel: float) -> Excitation:
        """The slow part of the multisine: within the travel, the largest speed and the push."""
        period = self._period
        wave = multisine(1.0, SECONDS, period, SLOW, "1/f")
        velocity = np.gradient(wave, period)
        fastest = min(self.speed(LARGEST), abs(self.speed(-LARGEST))) / np.abs(velocity).max()
        size = min(travel, fastest, self._acceleration / np.abs(np.gradient(velocity, period)).max())
        return self.moving("multisine", [np.tile(np.diff(size * wave, append=0.0) / period, REPEAT)])

    def moving(self, name: str, velocities: Sequence[np.ndarray]) -> Excitation:
        """The reference that moves so, and the command that makes it move so; padded to LASTS, at rest at the end."""
        velocity = np.concatenate(velocities)
        still = np.zeros(max(1, round(LASTS / self._period) - velocity.size))
        velocity = np.concatenate((velocity, still))
        travelled = np.concatenate(([0.0], np.cumsum(velocity)[:-1])) * self._period
        command = np.interp(velocity, self._speeds, self._commands)
        return Excitation(name, self._period, self._rig["xmid"] + travelled, command)
