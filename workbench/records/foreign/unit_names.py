"""Units as files write them: `name [unit]`, `name (unit)`, `name / unit`, `name_unit`; German and French spellings."""

import re
from functools import lru_cache

from ...base.units import converts
from .source import Heading

_SPELLED = {
    "sec": "s", "sek": "s", "seconds": "s", "second": "s", "sekunden": "s", "secondes": "s", "msec": "ms",
    "volt": "V", "volts": "V", "ampere": "A", "newton": "N", "bars": "bar", "bara": "bar", "bar(a)": "bar",
    "bar abs": "bar", "prozent": "%", "pct": "%", "percent": "%", "none": "1", "-": "1", "": "1", "[-]": "1",
    "g": "standard_gravity", "grad": "deg", "u/min": "rpm", "1/min": "rpm", "tr/min": "rpm", "degc": "degC",
    "kp": "kgf", "counts": "count", "psia": "psi", "mpa": "MPa", "kpa": "kPa", "pa": "Pa", "mm/sec": "mm/s",
    "kn": "kN", "ma": "mA",
}  # fmt: skip
GAUGE = {"barg": "bar", "bar(g)": "bar", "bar g": "bar", "bar rel": "bar", "psig": "psi", "barü": "bar"}
"""Units of pressure above the atmosphere's."""
_CELL = re.compile(r"(?P<name>.*?)\s*(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*)\)|\{(?P<curly>[^{}]*)\})\s*")
_SLASH = re.compile(r"(?P<name>.*?\S)\s*(?:/| in )\s*(?P<unit>\S+)")
_LETTER = re.compile(r"(?P<name>.*[^\W\d_]{3})[_ ](?P<unit>[VN])")  # behind a word: "x_V" is a valve's, "f N" a name
_TAIL = re.compile(
    r"(?P<name>.+)[_ ](?P<unit>bar|mbar|mpa|kpa|psi|mm|cm|um|kn|ma|ms|us|sec|volts?|mm/s|m/s|m/s2|m/s\^2)", re.I
)


def heading_of(cell: str) -> Heading:
    """A header cell with the unit that is in it; None where there is none."""
    cell = cell.strip().strip('"').strip()
    if match := _CELL.fullmatch(cell):
        inside = next(part for part in (match["square"], match["round"], match["curly"]) if part is not None)
        if is_unit(inside) or match["square"] is not None:
            return Heading(cell, plain_unit(inside))
    for pattern in (_SLASH, _TAIL, _LETTER):
        if (match := pattern.fullmatch(cell)) and is_unit(match["unit"]):
            return Heading(cell, plain_unit(match["unit"]))
    return Heading(cell)


def named(cell: str, unit: str) -> Heading:
    """A column with its unit as the file tells it beside the name; where that is nothing, the one in its name."""
    told = unit.strip().lower() not in ("", "none")
    return Heading(cell, plain_unit(unit) if told else heading_of(cell).unit)


def name_of(cell: str) -> str:
    """A header cell without its unit."""
    cell = cell.strip()
    if heading_of(cell).unit is None:
        return cell
    for pattern in (_CELL, _SLASH, _TAIL, _LETTER):
        if (match := pattern.fullmatch(cell)) and match["name"]:
            return match["name"].strip()
    return cell


def plain_unit(text: str) -> str:
    """A unit as jackbench writes it; text that is no unit comes back as it is."""
    text = text.strip().strip("[](){}").strip()
    low = text.lower()
    if low in GAUGE or text in ("Pa", "mPa"):
        return text
    text = _SPELLED.get(low, text) if not _known(text) or low in ("g", "-", "", "volt", "volts") else text
    return text.replace("²", "^2").replace("³", "^3").replace("·", "*").replace("°C", "degC").replace("°", "deg")


@lru_cache(maxsize=512)
def is_unit(text: str) -> bool:
    """Whether text is a unit, in brackets or not."""
    plain = plain_unit(text)
    return plain.lower() in GAUGE or plain == "count" or _known(plain)


@lru_cache(maxsize=512)
def _known(text: str) -> bool:
    return bool(text) and converts(text, text)
