"""The gallery: reports that their commands made when the site was built, each with a picture of its first screen."""

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from hashlib import sha256
from html import escape
from pathlib import Path

from browser import CHROMIUM, browser

from .examples import source_digest
from .readme import ROOT

_NARROW, _WIDE, _HEIGHT, _SCALE = 390, 1100, 820, 0.5
_PROBLEM = """
  [...document.querySelectorAll(".plot")].some((plot) => !plot.querySelector("svg")) ? "a plot is not drawn" :
  document.documentElement.scrollWidth > innerWidth ? "it is wider than the window" : ""
"""
_AT_ONCE = 2
_LONGEST = 600  # s of a command
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


def parts(cache: Path) -> dict[str, str]:
    """The cards of the gallery, and those of the front page; `cache`/site/reports gets the reports and their pictures.

    A command runs again where it, or the code that it runs on, has changed. Raises RuntimeError for one that fails, and
    for a report that a browser does not show whole.
    """
    sources, site = source_digest(), cache / "site" / "reports"
    site.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        folders = list(pool.map(lambda shown: _made(shown, cache / shown.name, sources), GALLERY))
    if shutil.which(CHROMIUM):
        _photograph([folder for folder in folders if not (folder / "screen.png").exists()])
    for shown, folder in zip(GALLERY, folders, strict=True):
        pictures = [folder / "screen.png", folder / "figure.png"]  # of a browser, or else of the command
        shutil.copyfile(folder / "out" / "report.html", site / f"{shown.name}.html")
        shutil.copyfile(next(picture for picture in pictures if picture.exists()), site / f"{shown.name}.png")
    return {"part_gallery.md": _cards(GALLERY), "part_gallery_first.md": _cards(GALLERY[:_FIRST])}


def _made(shown: Shown, folder: Path, sources: bytes) -> Path:
    """The folder of a report that was made by its command, with its main figure."""
    key = sha256(shown.command.encode() + sources).hexdigest()
    kept = folder / "key.txt"
    if not kept.exists() or kept.read_text("utf-8") != key:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        words = shown.command.split()[1:]
        _call([sys.executable, "-m", "workbench.cli", *words, "--out", "out", "--picture", "figure.png"], folder)
        kept.write_text(key, "utf-8")
    return folder


def _photograph(folders: Sequence[Path]) -> None:
    """A picture of each report's first screen, once a browser has shown the report whole at two widths."""
    with browser() as tab:
        for folder in folders:
            for width in (_NARROW, _WIDE):
                tab.open((folder / "out" / "report.html").as_uri(), width, _HEIGHT)
                if problem := tab.run(_PROBLEM):
                    raise RuntimeError(f"{folder.name}, {width} px wide: {problem}")
            tab.picture(folder / "screen.png", scale=_SCALE)


def _call(words: Sequence[str], folder: Path) -> None:
    """Run a command as a user would, who has trusted nothing. Raises RuntimeError where it fails."""
    inherited = {name: value for name, value in os.environ.items() if name != "JACKBENCH_TRUSTED"}
    environment = {**inherited, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    run = subprocess.run(
        words, cwd=folder, env=environment, capture_output=True, text=True, timeout=_LONGEST, check=False
    )
    if run.returncode:
        raise RuntimeError(f"{' '.join(words)}: {(run.stderr.strip() or run.stdout.strip())[-2000:]}")


def _cards(chosen: Sequence[Shown]) -> str:
    """Cards that lead to their reports; plain HTML, since a report is no page of the site."""
    return f'<div class="gallery">\n{"".join(map(_card, chosen))}</div>\n'


def _card(shown: Shown) -> str:
    at, title = f"reports/{shown.name}", escape(shown.title)
    return (
        f'<div class="shot"><a href="{at}.html"><img src="{at}.png" alt="the report: {title}" loading="lazy">'
        f"<strong>{title}</strong></a><p>{escape(shown.sees)}</p><code>{escape(shown.command)}</code></div>\n"
    )
