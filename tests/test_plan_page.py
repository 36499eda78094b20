"""The page of a plan where nothing needs recording still has a picture."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from workbench.commands.plan.page import plan_page


def test_where_nothing_needs_recording_the_recorded_commands_are_shown():
    record = SimpleNamespace(name="steps", t=np.arange(3.0), signals={"command": np.ones(3)})
    campaign = SimpleNamespace(path=Path("here"), train=(record,))
    problem = SimpleNamespace(campaign=campaign, rig=SimpleNamespace(name="a rig"))
    metrics = {"pairs": [], "numbers": [], "records": [], "not_compared": []}
    page, picture = plan_page(problem, (), metrics, {})
    assert "Nothing needs recording." in page.verdict
    assert "svg" in picture._repr_html_() or "<img" in picture._repr_html_()
