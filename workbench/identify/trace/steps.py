"""Which step a trace is at, of how many, and how long that step will take yet."""

from collections import defaultdict
from collections.abc import Callable
from time import perf_counter

from ...base.checkpoint import Progress

_READ_BACK = 0.05  # s: what takes less was read back from a stage, and says nothing of how long others take
_MINUTE = 100.0  # s: from which on minutes are said


class TraceProgress:
    """Says a trace's steps as they come.

    What a trace has to do it learns on the way: a second effect, pairs or a shape to be learned add steps. So it says
    how many there are at least. The time left is that of the step: of what remains in it, each as long as those of its
    kind took until now; nothing is said before one was done. An item that takes longer than others counts as more.
    """

    def __init__(self, report: Progress, clock: Callable[[], float] = perf_counter) -> None:
        self._report, self._clock = report, clock
        self._number = self._least = 0
        self._what, self._kind, self._left, self._since = "", "", 0.0, clock()
        self._took: defaultdict[str, float] = defaultdict(float)  # seconds, by kind
        self._did: defaultdict[str, float] = defaultdict(float)  # items

    def begin(self, what: str, kind: str, items: float = 1, ahead: int = 0) -> None:
        """A step of so many `items` of a kind, with so many steps `ahead` that are known of."""
        self._number += 1
        self._least = max(self._least, self._number + ahead)
        self._what, self._kind, self._left, self._since = what, kind, items, self._clock()
        self.say()

    def done(self, items: float = 1) -> None:
        """So many items more of the step are done."""
        took, self._since, self._left = self._clock() - self._since, self._clock(), max(0.0, self._left - items)
        if took > _READ_BACK:
            self._took[self._kind] += took
            self._did[self._kind] += items

    def remain(self, items: float) -> None:
        """The step has so many items left, as it turned out."""
        self._left = items

    def say(self, now: str = "") -> None:
        """The step, what it is at `now`, and the time left."""
        what = f"{self._what}: {now}" if now else self._what
        known = f" of at least {self._least}" if self._least > self._number else ""
        self._report(f"step {self._number}{known}: {what}{self._time()}")

    def _time(self) -> str:
        if not (self._did[self._kind] and self._left):
            return ""
        left = self._left * self._took[self._kind] / self._did[self._kind]
        return f", about {left / 60:.0f} min left" if left > _MINUTE else f", about {max(1, round(left))} s left"
