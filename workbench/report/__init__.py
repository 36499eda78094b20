"""Reports: figures as plain data, one self-contained HTML page; report.still draws pictures and loads matplotlib.

figures, table    figures and tables as plain data
digits            how many digits of a number are shown
page, chart       one HTML page; its charts
glossary          the words of the house, which a page unfolds and the site lists
index             the page that lists finished runs
still, show       pictures; figures and pages in a notebook or a browser
scene             lines that move in space, and stand still in print
palette, thin     one look a curve name; long series and outlines thinned
"""

from .digits import Known, within
from .figures import Curve, Figure, FrequencyCurve, Mark, Panel, Style, bode, gains, sensitivity
from .page import Page, Section, Table, page_looks, render, write_page
from .scene import Label, Line, Scene
from .thin import outline_points

__all__ = [
    "Curve",
    "Figure",
    "FrequencyCurve",
    "Known",
    "Label",
    "Line",
    "Mark",
    "Page",
    "Panel",
    "Scene",
    "Section",
    "Style",
    "Table",
    "bode",
    "gains",
    "outline_points",
    "page_looks",
    "render",
    "sensitivity",
    "within",
    "write_page",
]
