"""What a study leaves behind, and what it is given to work with."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...base.checkpoint import Progress, Stage, no_checkpoint
from ...base.errors import InputError
from .drawing import Draw, Drawing, drawn, rendered

if TYPE_CHECKING:
    import numpy as np

    from ...report import Figure, Page
    from .design_numbers import Subject
    from .run_folder import RunFolder

REPORT = "report"  # the table of config.toml that says what the report says
FAULT = "report_fault"  # the key of metrics.json that says why there is no report, where none could be drawn

__all__ = ["REPORT", "Answer", "Outcome", "Progress", "Stage", "leave", "no_checkpoint"]


@dataclass(frozen=True, repr=False)
class Outcome:
    """`metrics` for metrics.json, `tables` for *.parquet (columns by name), and what draws the report.

    `files` are further files, text or bytes by name; `subject` is what the report is about. `draw` gives the report and
    its telling figure; it is called when all else has been written, so that no page costs an answer. In a notebook an
    outcome shows its verdict and that figure. What is not `dated` is made again to the byte.
    """

    metrics: Mapping[str, Any]
    draw: Draw
    tables: "Mapping[str, Mapping[str, np.ndarray]]" = field(default_factory=dict)
    files: Mapping[str, str | bytes] = field(default_factory=dict)
    subject: "Subject | None" = None
    dated: bool = True

    @cached_property
    def drawing(self) -> Drawing:
        """The report, or as much of it as could be drawn."""
        return drawn(self.draw, self.subject, self.kept)

    @property
    def kept(self) -> tuple[str, ...]:
        """The files that have the numbers."""
        return ("metrics.json", *self.files)

    @property
    def page(self) -> "Page":
        """The report."""
        return self.drawing.page

    @property
    def picture(self) -> "Figure":
        """The report's telling figure. Raises InputError where none could be drawn."""
        if self.drawing.picture is None:
            raise InputError(self.drawing.fault)
        return self.drawing.picture

    def __repr__(self) -> str:
        return f"{self.page.title}\n{self.page.verdict}"

    def _repr_html_(self) -> str:
        title, verdict = escape(self.page.title), escape(self.page.verdict)
        picture = self.drawing.picture
        return f"<p><b>{title}</b></p><p>{verdict}</p>{picture._repr_html_() if picture else ''}"

    def plot(self) -> "Figure":
        """The telling figure."""
        return self.picture

    def show(self) -> Path:
        """Open the whole report in a browser; the path of the page."""
        from ...report.show import open_page
        from .head import whole_page

        return open_page(whole_page(self.page, self.subject))

    def report(self, folder: str | Path, force: bool = False) -> Path:
        """Leave metrics.json, report.html, the tables and files in a new folder; the path of the report.

        Raises InputError where the folder exists; `force` replaces it.
        """
        from .run_folder import open_run

        identity = {"command": "report", "of": self.page.title}
        with open_run(Path(folder), identity, force) as run:
            leave(run, self, identity)
        return Path(folder) / "report.html"


class Answer:
    """What a person gets of a study in Python: numbers of its own, and the report of its `outcome`."""

    outcome: Outcome

    def plot(self) -> "Figure":
        """The report's telling figure."""
        return self.outcome.plot()

    def show(self) -> Path:
        """Open the whole report in a browser; the path of the page."""
        return self.outcome.show()

    def report(self, folder: str | Path, force: bool = False) -> Path:
        """Leave the report and its numbers in a new folder, as `Outcome.report` does; the path of the report."""
        return self.outcome.report(folder, force)


def leave(run: "RunFolder", outcome: Outcome, identity: Mapping[str, Any], command: str = "") -> "Page":
    """Write an outcome into its open run folder, and finish that; the page as it is written.

    Numbers, files and tables are on disk before anything is drawn; where no report can be drawn, one sentence takes its
    place, and stands in metrics.json too. `command` is the command line, where there was one. It, the date and the
    verdict stand in config.toml too.
    """
    from .head import finished_at, whole_page
    from .run_folder import resolved_config

    date = finished_at() if outcome.dated else ""
    for file, content in outcome.files.items():
        (run.dir / file).write_bytes(content.encode() if isinstance(content, str) else content)
    run.keep(outcome.metrics, resolved_config(identity), outcome.tables)
    page, html, fault = rendered(whole_page(outcome.page, outcome.subject, date, command), outcome.kept)
    fault = outcome.drawing.fault or fault
    told = {"title": page.title, "verdict": page.verdict, "date": date or None, "command": command or None}
    metrics = {**outcome.metrics, FAULT: fault} if fault else outcome.metrics
    run.finish(metrics, resolved_config({**identity, REPORT: told}), {}, html)
    return page
