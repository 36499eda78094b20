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

from .examples import source_digest
from .readme import ROOT

_CHROMIUM = os.environ.get("CHROMIUM", "chromium")
_WINDOW, _SCALE = "1100,820", "0.5"
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
    Shown("trace", "Why do model and rig disagree?", "jackbench trace sample", "The error before and after; the effect."),
    Shown("loop", "A position loop", "jackbench run first_loop", "Steps, margins, sines at null and moving."),
    Shown("capability", "What a rig can do", "jackbench capability jack-10t", "The envelope, and which bound holds where."),
    Shown("paper", "The published model", "jackbench run paper", "Eight numbers beside the paper's."),
    Shown("residual", "The model beside recordings", "jackbench residual sample", "Every signal, and what the model leaves."),
    Shown("fit", "A rig's numbers, fitted", "jackbench fit sample", "Which numbers the records tell, and how well."),
    Shown("plan", "What to record next", "jackbench plan sample", "Which record tells two effects apart."),
    Shown("hexapod", "Six jacks under a platform", "jackbench run hexapod", "Two controllers, on a drawing that moves."),
    Shown("robustness", "A hundred drawn plants", "jackbench robustness robustness --plants 100", "How settling and Ms spread."),
    Shown("limit", "How soon could it settle?", "jackbench limit position_step", "The limit of physics for each step."),
    Shown("valve", "The sheet of a valve", "jackbench valve-test jack-10t", "Flow, lap, hysteresis, steps, frequency response."),
    Shown("inverse", "A drive file, corrected", "jackbench inverse inverse", "A record with and without an inverse before the loop."),
)


def parts(cache: Path) -> dict[str, str]:
    """The cards of the gallery, and those of the front page; `cache`/site/reports gets the reports and their pictures.

    A command runs again where it, or the code that it runs on, has changed. Raises RuntimeError for one that fails.
    """
    sources, site = source_digest(), cache / "site" / "reports"
    site.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        folders = list(pool.map(lambda shown: _made(shown, cache / shown.name, sources), GALLERY))
    for shown, made in zip(GALLERY, folders, strict=True):
        shutil.copyfile(made / "out" / "report.html", site / f"{shown.name}.html")
        shutil.copyfile(made / "screen.png", site / f"{shown.name}.png")
    return {"part_gallery.md": _cards(GALLERY), "part_gallery_first.md": _cards(GALLERY[:_FIRST])}


def _made(shown: Shown, folder: Path, sources: bytes) -> Path:
    """The folder of a report that was made by its command, with a picture of its first screen."""
    key = sha256(f"{shown.command} {_WINDOW} {_SCALE}".encode() + sources).hexdigest()
    kept = folder / "key.txt"
    if not kept.exists() or kept.read_text("utf-8") != key:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        words = shown.command.split()[1:]
        _call([sys.executable, "-m", "workbench.cli", *words, "--out", "out", "--picture", "screen.png"], folder)
        if browser := shutil.which(_CHROMIUM):
            _photograph(browser, folder)
        kept.write_text(key, "utf-8")
    return folder


def _photograph(browser: str, folder: Path) -> None:
    """A browser's picture of the report, in place of its main figure, which stands where there is no browser."""
    look = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--virtual-time-budget=5000"]
    size = [f"--window-size={_WINDOW}", f"--force-device-scale-factor={_SCALE}", "--screenshot=screen.png"]
    _call([browser, *look, *size, (folder / "out" / "report.html").as_uri()], folder)


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
