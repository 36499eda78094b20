"""The report of a trace."""

from typing import Any

import numpy as np

from ..identify.trace import Trace
from ..report import Curve, Figure, Page, Panel, Section, Table


def trace_page(found: Trace, answer: dict[str, Any]) -> tuple[Page, Figure]:
    """The page and its telling figure."""
    names = list(answer["rms"])
    rows = [[name, *answer["rms"][name].values()] for name in names]
    table = Table("Held-out error", ["signal", "before", "after", "noise floor"], rows)
    ratio = [[row[k] / row[3] for k in (1, 2)] for row in rows]
    places = np.arange(1.0, len(names) + 1)
    curves = [Curve(label, places, np.array(ratio)[:, k], "markers") for k, label in enumerate(("before", "after"))]
    picture = Figure("Error over noise", "signal", [Panel("error / noise [1]", curves, log_y=True)])
    name = found.case.campaign.path.resolve().name
    page = Page(f"Trace of {name} on {found.case.rig.name}", found.verdict, [Section("Error", [picture, table])])
    return page, picture
