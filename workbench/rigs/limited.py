"""The signals of a rig that stay within limits, and whose each limit is: the rig file's, the live rig's, a default."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.signals import SIGNALS, Signal
from .number import Number

if TYPE_CHECKING:
    from .rig import Rig

FILE = "the rig file"
HELLO = "the live rig's hello"
BY_DEFAULT = "1.3 times the supply, by default"
PRESSURE_SHARE = 1.3


@dataclass(frozen=True)
class SignalLimit:
    """A signal that may be no further than `size` from its `middle`, SI, and whose limit that is; `rest`: where it is
    at rest, its middle unless another is given."""

    signal: str
    middle: float
    size: float
    whose: str = ""
    rest: float | None = None

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest value."""
        return self.middle - self.size, self.middle + self.size

    def share(self, values: np.ndarray) -> np.ndarray:
        """How much of the way from rest to the limit values [..] are: beyond it above 1."""
        away, (low, high) = values - self._rest, self.ends
        return np.where(away >= 0, away / (high - self._rest), away / (low - self._rest))

    def end(self, value: float) -> float:
        """The end of the limit on a value's side of rest."""
        return self.ends[int(value >= self._rest)]

    def shown(self, value: float) -> str:
        """A value of the signal in the unit that people are shown, the SI one where no signal of a rig has its name."""
        return self._as.text(float(f"{value:.4g}"))

    def text(self, value: float) -> str:
        """A value beside the end of the limit that it is nearer to."""
        return f"{self.signal} {self.shown(value)} of {self.shown(self.end(value))} ({self.whose})"

    def holds(self, values: float | np.ndarray, change: float | np.ndarray) -> Any:
        """Whether values are inside, and will be at the next sample if they change on as they did."""
        (low, high), ahead = self.ends, values + change
        return (low <= values) & (values <= high) & (low <= ahead) & (ahead <= high)

    @property
    def beyond(self) -> str:
        """Why a guard trips at it, in words."""
        return f"{self.signal} beyond {' to '.join(map(self.shown, self.ends))} ({self.whose})"

    @property
    def numbers(self) -> tuple[Number, Number]:
        """Its ends as numbers of a table."""
        names, own = (f"least_{self.signal}", self.signal), self._as
        least, most = (Number(*each, own.unit, own.si, self.whose) for each in zip(names, self.ends, strict=True))
        return least, most

    @property
    def _as(self) -> Signal:
        return SIGNALS.get(self.signal, Signal(self.signal, "1", "1", ""))

    @property
    def _rest(self) -> float:
        return self.middle if self.rest is None else self.rest


def is_told(limit: Number) -> bool:
    """Whether its source says whose a limit is, as those of a rig that was joined do."""
    return limit.source.startswith((HELLO, BY_DEFAULT, FILE))


def whose(limit: Number) -> str:
    """Whose a limit is."""
    if is_told(limit):
        return limit.source
    return f"{FILE}: {limit.source}" if limit.source else FILE


def limits_of(rig: "Rig") -> tuple[SignalLimit, ...]:
    """Limits of position, velocity, force, where there is one the pressure of each chamber, and what a live rig limits
    further."""
    own = rig.limits
    about = (("position", rig.middle, "stroke"), ("velocity", 0.0, "speed"), ("force", 0.0, "force"))
    limits = [SignalLimit(signal, middle, own[name].value, whose(own[name])) for signal, middle, name in about]
    if (high := own.get("pressure")) is not None:
        low = own["least_pressure"].value if "least_pressure" in own else -high.value
        middle, size = (high.value + low) / 2, (high.value - low) / 2
        limits += [SignalLimit(chamber, middle, size, whose(high)) for chamber in ("pa", "pb")]
    return (*limits, *rig.further_limits)


@dataclass(frozen=True)
class Nearest:
    """The limit that signals came nearest to: the value, its share of the way to the limit, and the lane, where there
    are some."""

    limit: SignalLimit
    value: float
    share: float
    lane: int


def nearest_limit(limits: tuple[SignalLimit, ...], signals: Mapping[str, np.ndarray]) -> Nearest | None:
    """The signal of `signals` [.., k] nearest to its limit, or furthest beyond; None where none has a limit."""
    found: Nearest | None = None
    for limit in limits:
        values = signals.get(limit.signal)
        if values is None or not np.isfinite(values).any():
            continue
        shares = np.nan_to_num(limit.share(values), nan=0.0)
        place = np.unravel_index(int(np.argmax(shares)), shares.shape)
        if found is None or shares[place] > found.share:
            found = Nearest(limit, float(values[place]), float(shares[place]), int(place[0]))
    return found
