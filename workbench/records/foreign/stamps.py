"""Every stamp of every format as whole nanoseconds: dates and times of day in text, and counts since an epoch.

A date of three numbers, 03/04/25, stays in three until the whole clock tells their order: see `origin`.
"""

import re
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from functools import lru_cache

import numpy as np

SECOND = 10**9  # ns
DAY = 86400 * SECOND
NOTHING = np.iinfo(np.int64).min
"""The ns of a cell without a stamp, as of a NaT."""

_MONTHS = {
    name: number
    for number, names in enumerate(
        ("jan", "feb fev fév", "mar mär mrz", "apr avr", "may mai", "jun juin", "jul juil", "aug aoû aou", "sep",
         "oct okt", "nov", "dec dez déc"), 1)
    for name in names.split()
}  # fmt: skip
_ZONES = {"z": 0, "utc": 0, "gmt": 0, "wet": 0, "west": 1, "bst": 1, "cet": 1, "mez": 1, "cest": 2, "mesz": 2,
          "eet": 2, "eest": 3, "est": -5, "edt": -4, "cst": -6, "cdt": -5, "mst": -7, "mdt": -6,
          "pst": -8, "pdt": -7}  # fmt: skip
"""Hours ahead of UTC."""
_WEEKDAY = r"(?:(?:mon?|tue?|wed?|thu?|fri?|sat?|sun?|di|mi|do|fr|so|lun|mer|jeu|ven|sam|dim)[a-zäéí]*[.,]?\s+)?"
_NAME = r"(?P<{0}>[a-zäéû]{{3,9}})"
_DATES = (
    r"(?P<a>\d{1,4})(?P<sep>[./-])\s?(?P<b>\d{1,2})(?P=sep)\s?(?P<c>\d{1,4})\.?",
    rf"(?P<d1>\d{{1,2}})[. /-]{{1,2}}{_NAME.format('m1')}[., /-]{{1,2}}(?P<y1>\d{{4}}|\d\d(?!\d|:))",
    rf"{_NAME.format('m2')}[. -]{{1,2}}(?P<d2>\d{{1,2}}),?[ -](?P<y2>\d{{4}})",
    rf"(?P<y3>\d{{4}})[ -]{_NAME.format('m3')}[ -](?P<d3>\d{{1,2}})",
    r"(?P<compact>\d{8})(?=[T_ ])",
    r"(?P<y4>\d{4})-(?P<yearday>\d{3})(?=[T ])",
    r"(?P<irig>\d{3})(?=:\d\d:\d\d:)",
    r"(?P<days>\d+) days?",
)
_TIME = (
    r"(?:(?P<h>\d{1,4})[:h](?P<m>\d{2})(?::(?P<s>\d{1,2})|[.,](?P<fm>\d+))?|"
    r"(?P<hms>\d{6})(?:[.,](?P<fc>\d+))?)"
)
_ZONE = r"(?P<zone>[+-]\d{2}(?::?\d{2})?|z|[a-z]{3,4})?(?:\s*\[[\w/+-]+\])?"
_STAMP = re.compile(
    rf"{_WEEKDAY}(?:(?:{'|'.join(_DATES)})?(?:\s?[T_,;:]?\s*|-){_TIME}?|"
    rf"{_NAME.format('m5')} +(?P<d5>\d{{1,2}}) +(?P<h5>\d\d):(?P<n5>\d\d)(?::00)? (?P<y5>\d{{4}}))"
    rf"\s*(?P<half>[ap]\.?\s?m\.?)?\s*{_ZONE}\s*",
    re.IGNORECASE,
)
_SPLIT = re.compile(r"((?:.*[^\d:])?(?:\d{3}:)?\d{1,4}:\d\d):(\d\d)(?:[.,:](\d+))?(?!\d|:\d)(.*)", re.DOTALL)
ORDERS = {"day, month, year": (2, 1, 0), "month, day, year": (2, 0, 1), "year, month, day": (0, 1, 2)}


@dataclass(frozen=True)
class Stamp:
    """A cell that was read. day: since 1970, or three numbers of which each may be the day, or None without a date;
    ns: since midnight, of UTC where a zone is told, None without a time of day."""

    day: int | tuple[int, int, int] | None
    ns: int | None


def stamp_of(cell: str | None) -> Stamp | None:
    """The date, the time of day or both that a cell tells; None where it tells neither."""
    if not cell:
        return None
    if parts := _SPLIT.fullmatch(cell):  # what repeats from row to row is read once
        head, seconds, fraction, tail = parts.groups()
        base = _stamp(f"{head.strip()}:00{tail}")
        if base is None or base.ns is None or int(seconds) > 60:
            return None
        return Stamp(base.day, base.ns + int(seconds) * SECOND + int(f"{fraction or '':0<9}"[:9]))
    return _stamp(cell.strip())


def is_stamp(cell: str) -> bool:
    """Whether a cell is a date, a time of day, or both."""
    return stamp_of(cell) is not None


@lru_cache(maxsize=4096)
def _stamp(cell: str) -> Stamp | None:
    match = _STAMP.fullmatch(cell.strip().strip('"'))
    if match is None:
        return None
    part = match.groupdict()
    try:
        day, ns = _day(part), _time(part)
    except (ValueError, KeyError, OverflowError, StopIteration):  # a date that is none, a word that is no month
        return None
    alone = day is None and (ns is None or part["hms"] is not None)
    return None if alone else Stamp(day, ns)


def _day(part: dict[str, str | None]) -> int | tuple[int, int, int] | None:
    if part["a"]:
        numbers = int(part["a"]), int(part["b"] or 0), int(part["c"] or 0)
        if len(part["a"]) > 2:
            return _since_1970(*numbers)
        if not any(in_order(numbers, order) is not None for order in ORDERS):
            raise ValueError
        return numbers
    for k in "1235":
        if part[f"m{k}"]:
            year, month, day = (part[f"{name}{k}"] or "" for name in "ymd")
            number = next(_MONTHS[month[:n].lower()] for n in (4, 3) if month[:n].lower() in _MONTHS)
            return _since_1970(_century(int(year)), number, int(day))
    if compact := part["compact"]:
        return _since_1970(int(compact[:4]), int(compact[4:6]), int(compact[6:]))
    if yearday := part["yearday"] or part["irig"]:
        return _since_1970(int(part["y4"] or 1970), 1, 1) + int(yearday) - 1
    return int(part["days"]) if part["days"] else None


def _time(part: dict[str, str | None]) -> int | None:
    if part["hms"]:
        h, m, s, f = *(int(part["hms"][k : k + 2]) for k in (0, 2, 4)), part["fc"]
    elif part["h5"]:
        h, m, s, f = int(part["h5"]), int(part["n5"] or 0), 0, None
    elif part["h"] is None:
        return None
    elif part["fm"]:  # minutes and seconds with a fraction
        h, m, s, f = 0, int(part["h"]), int(part["m"] or 0), part["fm"]
    else:
        h, m, s, f = int(part["h"]), int(part["m"] or 0), int(part["s"] or 0), None
    if (m > 59 and not part["fm"]) or s > 60:
        raise ValueError
    if half := part["half"]:
        h = h % 12 + 12 * (half[0].lower() == "p")
    return 3600 * SECOND * h + 60 * SECOND * m + SECOND * s + int(f"{f or '':0<9}"[:9]) - _offset(part["zone"])


def _offset(zone: str | None) -> int:
    """ns by which a zone is ahead of UTC. Raises KeyError for letters that are none."""
    if not zone:
        return 0
    if zone[0] not in "+-":
        return _ZONES[zone.lower()] * 3600 * SECOND
    digits = zone[1:].replace(":", "")
    return int(f"{zone[0]}1") * (int(digits[:2]) * 3600 + int(digits[2:] or 0) * 60) * SECOND


def _century(year: int) -> int:
    return year if year > 99 else year + (2000 if year < 70 else 1900)


def _since_1970(year: int, month: int, day: int) -> int:
    return (date(year, month, day) - date(1970, 1, 1)).days


def in_order(numbers: tuple[int, int, int], order: str) -> int | None:
    """Days since 1970 of three numbers in an order; None where they are no date."""
    year, month, day = (numbers[place] for place in ORDERS[order])
    try:
        return _since_1970(_century(year), month, day)
    except ValueError:
        return None


@dataclass(frozen=True)
class Count:
    """Numbers that count a unit of `ns` since `zero` [days since 1970]; in the years that a recording may be of they
    lie from `low` to `high`. `words` say it, `names` are the unit in a header."""

    ns: float
    low: float
    high: float
    zero: float
    words: str
    names: tuple[str, ...] = ()

    def since_1970(self, number: np.generic) -> int:
        """ns from 1970 to a number; a whole one loses none of its digits."""
        count = int(number) * int(self.ns) if number.dtype.kind in "iu" else int(float(number) * self.ns)
        return count + int(self.zero * DAY)

    def date(self, number: float) -> str:
        """The date and time of a number, of UTC where it counts that."""
        since_1970 = timedelta(days=self.zero) + timedelta(microseconds=float(number) * self.ns / 1e3)
        return f"{datetime(1970, 1, 1) + since_1970:%Y-%m-%d %H:%M:%S}"


_UNIX = (3e8, 2.6e9)  # s, from 1979 to 2052
COUNTS = (
    Count(1e9, *_UNIX, 0.0, "s since 1970", ("s",)),
    Count(1e6, 1e3 * _UNIX[0], 1e3 * _UNIX[1], 0.0, "ms since 1970", ("ms",)),
    Count(1e3, 1e6 * _UNIX[0], 1e6 * _UNIX[1], 0.0, "us since 1970", ("us",)),
    Count(1e0, 7e17, 1e9 * _UNIX[1], 0.0, "ns since 1970", ("ns",)),
    Count(1e9, 2.9e9, 4.6e9, -24107.0, "s since 1904", ("s",)),
    Count(1e2, 1.19e17, 1.5e17, -134774.0, "100 ns since 1601"),
    Count(1e2, 6.2e17, 6.7e17, -719162.0, "100 ns since the year 1"),
    Count(DAY, 2.9e4, 5.6e4, -25569.0, "days since 1899", ("day", "d")),
    Count(DAY, 5.7e4, 8e4, -40587.0, "modified Julian days", ("day", "d")),
    Count(DAY, 7.2e5, 7.8e5, -719529.0, "days since the year 0", ("day", "d")),
    Count(DAY, 2.44e6, 2.5e6, -2440587.5, "Julian days", ("day", "d")),
)
_PERIODS = (5e2, 1e10)  # ns from row to row, of a recording


def count_of(values: np.ndarray, unit: str | None) -> Count | None:
    """What numbers [n] count that rise from row to row as a clock does; None of others. `unit` is that of a header."""
    known = values[np.isfinite(values)]
    if known.size < 2 or np.mean(np.diff(known) >= 0) < 0.99:
        return None
    step = float(known[-1] - known[0]) / (known.size - 1)
    for count in COUNTS:
        told = unit in (None, "1", *count.names)
        if told and count.low <= known[0] <= count.high and _PERIODS[0] <= step * count.ns <= _PERIODS[1]:
            return count
    return None


def counted(values: np.ndarray, count: Count, first: np.generic) -> np.ndarray:
    """Numbers [n] as ns since the number `first`; whole numbers lose none of their digits."""
    if values.dtype.kind in "iu":
        return (values - first.astype(values.dtype)).astype(np.int64) * np.int64(count.ns)
    since = (values.astype(float) - np.float64(first)) * count.ns
    return np.where(np.isfinite(since), np.nan_to_num(since).round(), NOTHING).astype(np.int64)
