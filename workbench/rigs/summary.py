"""A rig in a few lines, and as a table of its numbers for a notebook."""

from html import escape
from typing import TYPE_CHECKING

from ..base.units import from_si

if TYPE_CHECKING:
    from .number import Number
    from .rig import Rig

_HEADS = ("number", "value", "unit", "bounds", "meaning", "source")


def summary(rig: "Rig") -> str:
    """Name and title; kinds of valve and jack; mass, stroke, supply and control period."""
    loop = f", {rig.corrector} spool loop" if rig.valve_kind.correctors else ""
    kinds = f"{rig['n']:g} {rig.valve} valve{'s' if rig['n'] > 1 else ''}{loop}, {rig.jack} jack"
    kinds += f", {rig.line_valve.title}" if rig.line_valve else ""
    numbers = [rig.numbers["M"], rig.numbers["S"], rig.numbers["Ps"], rig.period]
    values = ", ".join(f"{number.name} {number.shown:.4g} {number.unit}" for number in numbers)
    effects = f"; effects {', '.join(use.name for use in rig.effects)}" if rig.effects else ""
    return f"<Rig {rig.name}: {rig.title}\n {kinds}{effects}\n {values}>"


def html_table(rig: "Rig") -> str:
    """Every number of the plant with unit, bounds, meaning and source."""
    rows = [_cells(number, rig.specs[number.name].meaning) for number in rig.numbers.values()]
    head = "".join(f"<th>{name}</th>" for name in _HEADS)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    title = f"<p><b>{escape(rig.name)}</b> {escape(rig.title)}</p>"
    return f"{title}<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _cells(number: "Number", meaning: str) -> tuple[str, ...]:
    bounds = ""
    if number.low is not None and number.high is not None:
        low, high = (float(from_si(value, number.unit, number.si)) for value in (number.low, number.high))
        bounds = f"{low:.4g} to {high:.4g}"
    return number.name, f"{number.shown:.6g}", number.unit, bounds, meaning, number.source
