"""The page of a plan where nothing needs recording, or nothing that is recorded helps."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from workbench.commands.plan.page import _verdict, plan_page


def test_where_nothing_needs_recording_the_recorded_commands_are_shown():
    record = SimpleNamespace(name="steps", t=np.arange(3.0), signals={"command": np.ones(3)})
    campaign = SimpleNamespace(path=Path("here"), train=(record,))
    problem = SimpleNamespace(campaign=campaign, rig=SimpleNamespace(name="a rig"))
    metrics = {"pairs": [], "numbers": [], "records": [], "not_compared": []}
    page, picture = plan_page(problem, (), metrics, {})
    assert "Nothing needs recording." in page.verdict
    metrics["not_compared"] = ["main.stiction"]
    assert "Nothing that was compared needs recording." in plan_page(problem, (), metrics, {})[0].verdict
    assert "svg" in picture._repr_html_() or "<img" in picture._repr_html_()


def test_a_pair_that_no_record_splits_is_told_with_what_is_left_at_best():
    pair = {
        "effects": ["drive.delay", "drive.lag"],
        "cosine": 0.91,
        "after": {"steps": 0.95, "sine": 0.896},
        "best": None,
    }
    record = {"record": "sine", "file": "sine.csv", "tells": ["psi3"]}
    said = _verdict("p03", {"pairs": [pair], "numbers": [{}], "records": [record]})
    assert said.endswith(
        "Record next: sine.csv, which tells psi3. "
        "No record of the family tells drive.delay from drive.lag (cosine 0.91, at best 0.90 then)."
    )
    both = _verdict("p03", {"pairs": [pair, pair], "numbers": [{}], "records": [record]})
    assert both.endswith("then), nor 1 pair more.")
