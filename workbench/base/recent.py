"""What was asked for last, as far as it finds room: caches of things that may be large."""

from collections.abc import Callable, Hashable
from threading import Lock
from typing import Generic, TypeVar

K = TypeVar("K", bound=Hashable)
V = TypeVar("V")


class Recent(Generic[K, V]):
    """Values by key, of a `size` each and of `room` together at most: the oldest go."""

    def __init__(self, room: float, size: Callable[[V], float]) -> None:
        self.room = room
        self._size, self._kept, self._lock = size, dict[K, V](), Lock()

    def __contains__(self, key: K) -> bool:
        return key in self._kept

    def get(self, key: K, make: Callable[[], V]) -> V:
        """The value of a key, made where it is not there."""
        value = self._kept.get(key)
        if value is None:
            value = make()
        self.keep(key, value)
        return value

    def keep(self, key: K, value: V) -> None:
        """Have a value be the latest."""
        with self._lock:
            self._kept.pop(key, None)
            self._kept[key] = value
            while sum(map(self._size, self._kept.values())) > self.room:
                del self._kept[next(iter(self._kept))]
