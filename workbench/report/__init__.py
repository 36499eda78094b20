"""Reports: figures as plain data, one self-contained HTML page; report.still draws pictures and loads matplotlib."""

from .figures import Curve, Figure, FrequencyCurve, Mark, Panel, bode
from .page import Page, Section, Table, page_looks, render, write_page

__all__ = [
    "Curve",
    "Figure",
    "FrequencyCurve",
    "Mark",
    "Page",
    "Panel",
    "Section",
    "Table",
    "bode",
    "page_looks",
    "render",
    "write_page",
]
