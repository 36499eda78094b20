"""What the sheet of a jack shows besides its lines."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...loop.performance.bounds import PerformanceEnvelope
from ...loop.performance.drive import Choice, Demands
from ...loop.performance.reached import Followed, Reached


@dataclass(frozen=True, eq=False)
class Findings:
    """What a page shows besides lines: the envelope, what the loop (or `why` none) follows of it, what the engine
    reached, measured sines (f [Hz], amplitude [m]) by record, what the drive file takes and what does it."""

    envelope: PerformanceEnvelope
    loop: ControllerSpec | None
    why: str
    followed: Followed | None
    reached: Sequence[Reached]
    measured: Mapping[str, np.ndarray]
    demands: Demands | None
    valves: Sequence[Choice]
    pumps: Sequence[Choice]
