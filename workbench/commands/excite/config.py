"""What an excitation is asked for."""

from dataclasses import dataclass

from ...records.excitation import SIMPLE, Spacing, Spectrum

KINDS = (*SIMPLE, "chirp", "multisine")
VALVE_TEST, FORCE_TEST = "valve-test", "force-test"
SETS = (VALVE_TEST, FORCE_TEST)  # the records of a sheet, a folder of them


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
