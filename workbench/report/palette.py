"""One look a curve name: the same colour and dash in every figure of a page, and in its still picture."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from .figures import Figure, Style

INK, INK_SOFT, RULE, GRID, GRID_FINE = "#1f2328", "#57606a", "#afb8c1", "#dfe3e8", "#f0f2f4"

# Okabe and Ito 2008 without yellow (invisible on white) and black (kept for what was measured), then three of
# Paul Tol's "muted" set and a brown.
PALETTE = (
    "#0072b2",
    "#d55e00",
    "#009e73",
    "#cc79a7",
    "#e69f00",
    "#56b4e9",
    "#882255",
    "#332288",
    "#999933",
    "#8c6d4f",
)

# What is given rather than computed is neutral in every report, so that the colours belong to what is being judged.
NEUTRAL = {"measured": "#24292f", "reference": "#8c959f"}

_LAPS: tuple[Style, ...] = ("line", "dash", "dot")


@dataclass(frozen=True)
class Look:
    """Colour ("#rrggbb") of a curve name, and how its curves are drawn when they are plain lines."""

    colour: str
    line: Style = "line"

    def style(self, asked: Style) -> Style:
        """The style of a curve that asks for `asked`: plain lines of the second lap of the palette are dashed."""
        return self.line if asked == "line" else asked


def looks(figures: Iterable[Figure]) -> dict[str, Look]:
    """The look of every curve name of `figures`, in order of first appearance.

    A colour that a curve states holds for its name everywhere. Names that share a figure look different as long as the
    palette and its dashed laps last; beyond the palette, a name first takes the colour of one that it never meets.
    """
    groups = [[curve for panel in figure.panels for curve in panel.curves] for figure in figures]
    stated = {curve.name: curve.color for group in groups for curve in group if curve.color}
    fixed = {name: Look(colour) for name, colour in (NEUTRAL | stated).items()}
    names = [list(dict.fromkeys(curve.name for curve in group)) for group in groups]
    assigned: dict[str, Look] = {}
    for name in (name for group in names for name in group if name not in assigned):
        known = fixed | assigned
        beside = {known[other] for group in names if name in group for other in group if other in known}
        assigned[name] = fixed.get(name) or _least_used(assigned, beside)
    return assigned


def _least_used(assigned: Mapping[str, Look], beside: set[Look]) -> Look:
    uses = Counter(assigned.values())
    every = [Look(colour, line) for line in _LAPS for colour in PALETTE]
    return min(every, key=lambda look: (look in beside, _LAPS.index(look.line), uses[look]))
