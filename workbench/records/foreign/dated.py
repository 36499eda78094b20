"""Dates and times of day in columns, block by block, as nanoseconds since the first of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...base.errors import InputError
from .stamps import DAY, NOTHING, ORDERS, in_order, stamp_of

Block = Sequence[np.ndarray]
_Key = int | tuple[int, int, int] | None


@dataclass
class Dated:
    """Stamps in text, block by block: what was decided, the first one, and the last of the block before."""

    name: str
    columns: tuple[int, ...]
    notes: list[str]
    orders: list[str] = field(default_factory=lambda: list(ORDERS))
    first: tuple[_Key, int] | None = None
    last: dict[str, tuple[_Key, int, int]] = field(default_factory=dict)  # by order: day, ns since the first, midnights

    def ns(self, block: Block, more: np.ndarray | int = 0) -> np.ndarray:
        """ns since the first stamp [rows]; `more` ns are added to each."""
        keys, of_day = self.read(block)
        known = np.flatnonzero(of_day != NOTHING)
        t = np.full(of_day.size, NOTHING)
        if not known.size:
            return t
        of_day = (of_day + more)[known]
        keys = [keys[k] for k in known]
        if self.first is None:
            self.first = keys[0], int(of_day[0])
        self.orders = self._possible(keys)
        times = {order: self._since_first(order, keys, of_day) for order in self.orders}
        if len(self.orders) > 1 and any(np.any(each[0] != times[self.orders[0]][0]) for each in times.values()):
            best = min(self.orders, key=lambda order: _broken(times[order][0], self.last.get(order)))
            self.notes.append(f'dates in "{self.name}" are {best}: in that order the clock goes on')
            self.orders = [best]
        self.last = {order: (keys[-1], int(times[order][0][-1]), times[order][1]) for order in self.orders}
        t[known] = times[self.orders[0]][0]
        return t

    def start(self) -> int | None:
        """ns from 1970 to the first stamp, where its date is told."""
        key, of_day = self.first or (None, 0)
        return None if key is None else _days(key, self.orders[0]) * DAY + of_day

    def read(self, block: Block) -> tuple[list[_Key], np.ndarray]:
        """The day of each row, and ns since its midnight [rows]."""
        keys: list[_Key] = [None] * len(block[0])
        of_day = np.zeros(len(keys), dtype=np.int64)
        for column in self.columns:
            if block[column].dtype.kind == "M":
                keys = block[column].astype("M8[D]").astype(np.int64).tolist()
            if block[column].dtype.kind in "Mm":
                more = block[column].astype("m8[ns]").astype(np.int64) if block[column].dtype.kind == "m" else 0
                of_day = np.where(np.isnat(block[column]) | (of_day == NOTHING), NOTHING, of_day + more)
                continue
            for row, cell in enumerate(block[column]):
                stamp = stamp_of(cell)
                if stamp is None:
                    of_day[row] = NOTHING
                    continue
                keys[row] = stamp.day if stamp.day is not None else keys[row]
                if stamp.ns is not None and of_day[row] != NOTHING:
                    of_day[row] += stamp.ns
        return keys, of_day

    def _possible(self, keys: Sequence[_Key]) -> list[str]:
        """The orders in which all days are days."""
        three = {key for key in (*keys, self.first[0] if self.first else None) if isinstance(key, tuple)}
        possible = [order for order in self.orders if all(in_order(key, order) is not None for key in three)]
        if not possible:
            shown = " and ".join(".".join(map(str, key)) for key in sorted(three)[:: max(1, len(three) - 1)])
            what = f'column "{self.name}": dates such as {shown} are in no one order'
            raise InputError(f"{what}; export them as 2025-12-31")
        return possible

    def _since_first(self, order: str, keys: Sequence[_Key], of_day: np.ndarray) -> tuple[np.ndarray, int]:
        """ns since the first stamp [rows], and how many midnights went by that no date tells."""
        assert self.first is not None
        day: Mapping[_Key, int] = {key: _days(key, order) for key in {*keys, self.first[0]}}
        t = np.array([day[key] - day[self.first[0]] for key in keys]) * DAY + (of_day - self.first[1])
        key, before, midnights = self.last.get(order, (keys[0], int(t[0]), 0))
        steps = np.diff(np.concatenate(([before - DAY * midnights], t)))
        same = np.array([a == b for a, b in zip((key, *keys), keys, strict=False)])
        passed = midnights + np.cumsum((steps < -DAY // 2) & same)
        return t + DAY * passed, int(passed[-1])


def _days(key: _Key, order: str) -> int:
    return (in_order(key, order) or 0) if isinstance(key, tuple) else key or 0


def _broken(t: np.ndarray, last: tuple[_Key, int, int] | None) -> tuple[int, int]:
    """How little a clock goes on: steps backwards, and the way that it makes."""
    steps = np.diff(t if last is None else np.concatenate(([last[1]], t)))
    return int(np.sum(steps < 0)), int(np.sum(np.abs(steps)))
