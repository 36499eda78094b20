"""An excitation as it is asked for, and the rows that a drive plays."""

from dataclasses import dataclass

from ..base.errors import InputError, nearest
from ..base.signals import SIGNALS
from ..base.units import from_si, to_si
from ..records.excitation import MOST_ROWS, SIMPLE, Excitation, Spacing, Spectrum, chirp, excitation, multisine
from ..rigs.rig import Rig

KINDS = (*SIMPLE, "chirp", "multisine")


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
