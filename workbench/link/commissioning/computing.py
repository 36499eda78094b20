"""How long a commissioning may compute: CPU time, less what the rig takes; a busy machine takes none of it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ...base.process_pool import cpu_time

TRACES = (0.6, 0.85)  # of the time, by which the search of each round's trace ends: controllers are searched after it
AGAIN = 0.6  # of the time, up to which another round may begin


class Computing:
    """A time to compute, `seconds` [s] of CPU time from now on, worker processes' too; `cut`: what it ended, in
    words."""

    def __init__(self, seconds: float, clock: Callable[[], float] = cpu_time) -> None:
        self.seconds, self._clock, self._began, self._waited = seconds, clock, clock(), 0.0
        self.cut: list[str] = []

    @property
    def spent(self) -> float:
        """Until now [s]."""
        return self._clock() - self._began - self._waited

    @contextmanager
    def waits(self) -> Iterator[None]:
        """What takes time and does not count: the rig plays."""
        began = self._clock()
        try:
            yield
        finally:
            self._waited += self._clock() - began

    def over(self, share: float, what: str) -> Callable[[], bool]:
        """Whether a share of the time is over; what that ends is remembered."""

        def is_over() -> bool:
            late = self.spent > share * self.seconds
            if late and what not in self.cut:
                self.cut.append(what)
            return late

        return is_over
