"""Dates and times of day as seconds: 24.12.2025 17:05:09,250, 2025-12-24T17:05:09.25, 17:05:09."""

import re
from collections.abc import Sequence

import numpy as np

_DATE = r"(?:(?P<a>\d{1,4})[./-](?P<b>\d{1,2})[./-](?P<c>\d{1,4}))"
_CLOCK = r"(?:(?P<h>\d{1,2}):(?P<m>\d{2})(?::(?P<s>\d{1,2}(?:[.,:]\d+)?))?)"
_STAMP = rf"^\s*{_DATE}?[ T]*{_CLOCK}?\s*(?P<half>[AaPp][Mm])?Z?\s*$"
_PATTERN = re.compile(_STAMP)
_MARK = re.compile("[,:]")  # before the fraction of a second
DAY = 86400.0  # s


def is_stamp(text: str) -> bool:
    """Whether a cell is a date, a time of day, or both."""
    match = _PATTERN.fullmatch(text)
    return bool(match and (match["a"] or match["h"]))


def days_and_seconds(cells: Sequence[str | None]) -> np.ndarray:
    """Days since 1970, 0 without a date, and seconds since midnight [2, n] of cells; NaN where one is neither.

    Of 03/04/2025 the day comes first, unless a second number above 12 says otherwise.
    """
    matches = [_PATTERN.fullmatch(cell or "") for cell in cells]
    known = np.array([bool(match and (match["a"] or match["h"])) for match in matches], dtype=bool)

    def part(name: str) -> np.ndarray:
        texts = [match[name] if match else None for match in matches]
        return np.array([np.nan if text is None else float(_MARK.sub(".", text)) for text in texts])

    half = np.array([(match["half"] or "").lower() if match else "" for match in matches])
    h, m, s = (np.nan_to_num(part(name)) for name in "hms")
    h = np.where(half == "", h, h % 12 + 12 * (half == "pm"))
    days = _days(part("a"), part("b"), part("c"))
    return np.where(known, (np.nan_to_num(days), 3600 * h + 60 * m + s), np.nan)


def _days(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Days [n] since 1970; NaN without a date."""
    year_first = a > 31
    month_first = ~year_first & (np.nanmax(b, initial=0.0) > 12)
    year = np.where(year_first, a, np.where(c < 100, c + 2000, c))
    month = np.where(month_first, a, b)
    day = np.where(year_first, c, np.where(month_first, b, a))
    known = np.isfinite(year) & np.isfinite(month) & np.isfinite(day)
    whole = [np.where(known, part, 1).astype(int) for part in (year, month, day)]
    dates = (whole[0] - 1970).astype("M8[Y]").astype("M8[M]") + (whole[1] - 1).astype("m8[M]")
    return np.where(known, (dates.astype("M8[D]") + (whole[2] - 1)).astype(float), np.nan)
