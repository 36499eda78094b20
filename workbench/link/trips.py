"""Why a motion at a live rig ended at a limit: which one, its value, the reading beside it, when, in which motion."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..rigs.limited import limits_of, nearest_limit
from ..rigs.rig import Rig

_SPEED_OVER = 5e-3  # s: over which a speed is told from positions
_NAMES = {"speed": "velocity", "position": "position", "force": "force", "pressure": "pa pb"}
"""What a guard's reason begins with, and the signals that it is about."""


@dataclass(frozen=True)
class Trip:
    """A trip `by` "guard" or "rig" in a `motion`, `t` [s] after that began. `limit`: the signal; `value`, `reading`:
    the end of the limit and what was read, SI; `whose` the limit is; None where no signal has a limit. `reason`: in
    words, without the motion."""

    by: str
    limit: str | None
    value: float | None
    reading: float | None
    whose: str | None
    t: float
    reason: str
    motion: str

    @property
    def words(self) -> str:
        """In a sentence."""
        where = f" of {self.motion}" if self.motion else ""
        return f"the {self.by} tripped {self.t:.4g} s into the run{where}: {self.reason}"

    def table(self) -> dict[str, Any]:
        """The trip, as metrics.json has it."""
        return asdict(self)


def trip(rig: Rig, t: np.ndarray, signals: Mapping[str, np.ndarray], why: str | None, motion: str) -> Trip:
    """The trip of a motion with signals [k] at t [k] s up to it: `why` the guard says, or None where the rig did, which
    says nothing."""
    over = max(1, round(_SPEED_OVER / rig.period.value))
    seen = dict(signals)
    if "velocity" not in seen and len(t) > over:
        step = np.maximum(t[over:] - t[:-over], rig.period.value)
        seen["velocity"] = np.concatenate((np.zeros(over), (seen["position"][over:] - seen["position"][:-over]) / step))
    names = {**_NAMES, **{limit.signal: limit.signal for limit in rig.further_limits}}
    about = next((own for begins, own in names.items() if (why or "").startswith(begins)), None)
    limits = tuple(each for each in limits_of(rig) if about is None or each.signal in about.split())
    late = {name: values[-2 * over :] for name, values in seen.items()}
    nearest = nearest_limit(limits, late)
    by, words = ("rig", "it does not say why") if why is None else ("guard", why)
    if nearest is None:
        return Trip(by, None, None, None, None, float(t[-1]), words, motion)
    limit, value = nearest.limit, nearest.value
    text = limit.shown(value) + (", on the way there" if nearest.share < 1 else "")
    words += f"; nearest to its limit was {limit.text(value)}" if about is None else f"; {limit.signal} was {text}"
    return Trip(by, limit.signal, limit.end(value), value, limit.whose, float(t[-1]), words, motion)
