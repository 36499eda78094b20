"""The records that a plan compares: steps, triangles, sines and multisines of one length, each as the rig takes it."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.signals import SIGNALS
from ...base.units import from_si
from ...loop.drive_simulation import DriveSimulation, within_limits
from ...loop.standard_records import Design, designed
from ...records.excitation import Excitation, excitation_text
from ...rigs.rig import Rig

SECONDS = 6.0  # of every record: what they tell is compared for the same time on the rig
_REACH = 0.6  # of the stroke limit, peak of what the reference does
_FASTEST = 0.2  # of the control rate, the highest line


@dataclass(frozen=True)
class PlannedRecord:
    """A member of the family as the rig takes it: what `jackbench excite` is asked for, and what the drive plays."""

    name: str
    design: Design
    played: Excitation

    @property
    def peak(self) -> float:
        """Largest command [1] or displacement of the reference [mm], as the design has it."""
        signal = SIGNALS[self.design.signal]
        wave = getattr(self.played, self.design.signal)
        return float(from_si(np.abs(wave - wave[0]).max(), signal.unit, signal.si))

    @property
    def row(self) -> dict[str, Any]:
        """What a drive plays, as metrics.json has it."""
        design = self.design
        band = None if design.band is None else list(design.band)
        seconds = design.seconds * design.repeat
        return {"kind": design.kind, "signal": design.signal, "peak": self.peak, "seconds": seconds, "band": band}

    @property
    def text(self) -> str:
        """The file that a drive plays."""
        return excitation_text(self.played)


def family(rig: Rig) -> dict[str, Design]:
    """The designs by name, as large as they are wished."""
    top = _FASTEST / rig.period.value
    reach = _REACH * rig.limit("stroke") * 1e3

    def sine(amplitude: float, hertz: float) -> Design:
        return Design("multisine", "command", amplitude, 2.0, 3, (hertz, hertz + 0.5), 1)

    return {
        "steps-large": Design("steps", "command", 0.4, 1.5, 4),
        "steps-small": Design("steps", "command", 0.05, 1.5, 4),
        "steps-position": Design("steps", "reference", reach, 6.0),
        "triangle-fast": Design("triangle", "command", 0.4, 0.75, 8),
        "triangle-slow": Design("triangle", "command", 0.2, 3.0, 2),
        "triangle-creep": Design("triangle", "command", 0.03, 6.0),
        "triangle-position": Design("triangle", "reference", reach, 6.0),
        "sine-1hz": sine(0.4, 1.0),
        "sine-1hz-small": sine(0.04, 1.0),
        "sine-5hz": sine(0.4, 5.0),
        "sine-20hz": sine(0.4, min(20.0, top / 2)),
        "multisine-slow": Design("multisine", "command", 0.6, 2.0, 3, (0.5, min(20.0, top)), 20),
        "multisine-fast": Design("multisine", "command", 0.3, 2.0, 3, (5.0, min(250.0, top)), 50),
        "multisine-small": Design("multisine", "command", 0.03, 2.0, 3, (1.0, min(100.0, top)), 50),
    }


def planned(drive: DriveSimulation, name: str, design: Design) -> PlannedRecord | None:
    """The design as large as the rig takes it in simulation; None where it takes it at no size."""
    played = within_limits(drive, designed(design, drive.rig))
    return None if played is None else PlannedRecord(name, design, played)
