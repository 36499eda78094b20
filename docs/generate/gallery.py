"""The gallery: reports that their commands made when the site was built, each with a picture of its first screen."""

import shutil
from collections.abc import Sequence, Set
from dataclasses import dataclass
from html import escape
from pathlib import Path

from browser import CHROMIUM, browser

from .runs import Cell, Run, run_all

_NARROW, _WIDE, _HEIGHT, _SCALE = 390, 1100, 820, 0.5
_PROBLEM = """
  [...document.querySelectorAll(".plot")].some((plot) => !plot.querySelector("svg")) ? "a plot is not drawn" :
  document.documentElement.scrollWidth > innerWidth ? "it is wider than the window" : ""
"""
_FIRST = 3  # reports on the front page


@dataclass(frozen=True)
class Shown:
    """A report of the gallery: the name of its file, its title, the command that makes it, and what one sees in it."""

    name: str
    title: str
    command: str
    sees: str


GALLERY = (
    Shown(
        "trace",
        "Why do model and rig disagree?",
        "jackbench trace sample",
        "The error before and after, and the effect.",
    ),
    Shown("loop", "A position loop", "jackbench run first_loop", "Its step, its margins, sines of 10 mm."),
    Shown(
        "capability", "What a rig can do", "jackbench capability jack-10t", "The envelope, and which bound holds where."
    ),
    Shown("paper", "The published model", "jackbench run paper", "Eight numbers beside the paper's."),
    Shown("residual", "The model beside recordings", "jackbench residual sample", "Every signal, and what is left."),
    Shown("fit", "The numbers of a rig", "jackbench fit sample", "Which ones the records tell, and how well."),
    Shown("plan", "What to record next", "jackbench plan sample", "Which record tells two effects apart."),
    Shown(
        "hexapod", "Six jacks under a platform", "jackbench run hexapod", "Two controllers, and a drawing that moves."
    ),
    Shown("robustness", "Drawn plants", "jackbench robustness robustness --plants 100", "How settling and Ms spread."),
    Shown("limit", "How soon could it settle?", "jackbench limit position_step", "The limit of physics for each step."),
    Shown(
        "valve", "The sheet of a valve", "jackbench valve-test jack-10t", "Flow, lap, hysteresis, frequency response."
    ),
    Shown("inverse", "A reference, corrected", "jackbench inverse inverse", "A record with and without an inverse."),
)


def parts(cache: Path, run: bool) -> dict[str, str]:
    """The cards of the gallery, and those of the front page; `cache`/site/reports gets the reports and their pictures.

    Where they `run`, those commands do that have changed, or whose code has. Raises RuntimeError for one that fails,
    and for a report that a browser does not show whole. A card whose command left nothing has words alone.
    """
    runs = {shown: _run(shown, cache / shown.name) for shown in GALLERY}
    site = cache / "site" / "reports"
    site.mkdir(parents=True, exist_ok=True)
    if run:
        run_all(list(runs.values()))
        if shutil.which(CHROMIUM):
            _photograph([ran.made for ran in runs.values() if not (ran.made / "screen.png").exists()])
    there = {shown for shown, ran in runs.items() if ran.left() is not None}
    for shown in there:
        made = runs[shown].made
        pictures = [made / "screen.png", made / "figure.png"]  # of a browser, or else of the command
        shutil.copyfile(made / "out" / "report.html", site / f"{shown.name}.html")
        shutil.copyfile(next(picture for picture in pictures if picture.exists()), site / f"{shown.name}.png")
    return {"part_gallery.md": _cards(GALLERY, there), "part_gallery_first.md": _cards(GALLERY[:_FIRST], there)}


def _run(shown: Shown, folder: Path) -> Run:
    call = f"{shown.command} --out out --picture figure.png"
    return Run(f"gallery/{shown.name}", (Cell("shell", "", call),), folder)


def _photograph(folders: Sequence[Path]) -> None:
    """A picture of each report's first screen, once a browser has shown the report whole at two widths."""
    with browser() as tab:
        for folder in folders:
            for width in (_NARROW, _WIDE):
                tab.open((folder / "out" / "report.html").as_uri(), width, _HEIGHT)
                if problem := tab.run(_PROBLEM):
                    raise RuntimeError(f"gallery/{folder.parent.name}, {width} px wide: {problem}")
            tab.picture(folder / "screen.png", scale=_SCALE)


def _cards(chosen: Sequence[Shown], there: Set[Shown]) -> str:
    """Cards that lead to the reports that are there; plain HTML, since a report is no page of the site."""
    return f'<div class="gallery">\n{"".join(_card(shown, shown in there) for shown in chosen)}</div>\n'


def _card(shown: Shown, there: bool) -> str:
    at, title = f"reports/{shown.name}", f"<strong>{escape(shown.title)}</strong>"
    picture = f'<img src="{at}.png" alt="the report: {escape(shown.title)}" loading="lazy">'
    head = f'<a href="{at}.html">{picture}{title}</a>' if there else title
    return f'<div class="shot">{head}<p>{escape(shown.sees)}</p><code>{escape(shown.command)}</code></div>\n'
