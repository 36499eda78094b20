"""How long after a move `jackbench live` shows the picture: sliders and a corner, dragged in Chromium.

    .ci/live_speed.py [EXPERIMENT] [--pictures FOLDER]

Each move of the mouse counts from its event to the first frame that is painted with its number or a newer one. What
server and browser compute for a picture is also given in CPU time, all their threads together, which says more where
the machine has other work. docs/how/live.png is the first picture of first_loop.
"""

import argparse
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from browser import Tab, browser

ROOT = Path(__file__).parents[1]
_MOVES, _APART = 60, 1 / 60  # of the mouse, and s between them: as often as a screen shows
_WATCH = """
window.pictures = [];
document.addEventListener("picture", (event) => window.pictures.push(event.detail));
"""
_IDLE = "document.getElementById('status').textContent.startsWith('at rest')"


def cpu_ms(process: int) -> float:
    """CPU time [ms] of a process and of those that it started, which still run (Linux)."""
    numbers = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            after_name = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:  # it has ended
            continue
        numbers[int(folder.name)] = int(after_name[1]), int(after_name[11]) + int(after_name[12])
    family = {process}
    while more := {pid for pid, (parent, _) in numbers.items() if parent in family} - family:
        family |= more
    return 1e3 / os.sysconf("SC_CLK_TCK") * sum(numbers[pid][1] for pid in family if pid in numbers)


@contextmanager
def live(experiment: str) -> Iterator[tuple[str, int]]:
    """The address of a live page, and its server's process."""
    words = [sys.executable, "-m", "workbench.cli", "live", experiment]
    process = subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield process.stdout.readline().split()[0], process.pid
    finally:
        process.terminate()
        process.wait(10)


def drag(tab: Tab, place: Sequence[float], span: float) -> None:
    """Press at a place, go to and fro over a span of pixels, let go."""
    x, y = place
    tab.mouse("mousePressed", x, y)
    for i in range(_MOVES):
        began = time.monotonic()
        tab.mouse("mouseMoved", x + span * np.sin(2 * np.pi * i / _MOVES), y)
        time.sleep(max(0.0, _APART - time.monotonic() + began))
    tab.mouse("mouseReleased", x, y)


def slider(name: str) -> str:
    """Where the thumb of a slider is, [x, y]."""
    return f"""(() => {{
      const range = document.getElementById({name!r}).parentElement.querySelector("input[type=range]");
      range.scrollIntoView({{ block: "nearest" }});
      const box = range.getBoundingClientRect();
      return [box.left + 8 + (box.width - 16) * range.value, box.top + box.height / 2];
    }})()"""


def corner(name: str) -> str:
    """Where the tag of a corner is, [x, y]."""
    return f"""(() => {{
      const box = document.querySelector('.handle[data-name="{name}"]').getBoundingClientRect();
      return [box.left + box.width / 2, box.top + box.height / 2];
    }})()"""


def measure(tab: Tab, server_process: int, what: str, place: str, span: float) -> None:
    """Drag and print the times."""
    tab.until(_IDLE)
    tab.run("window.pictures.length = 0")
    processes = server_process, tab.process
    before = [cpu_ms(process) for process in processes]
    drag(tab, tab.run(place), span)
    spent = [cpu_ms(process) - start for process, start in zip(processes, before, strict=True)]
    tab.until(_IDLE)
    pictures = tab.run("window.pictures")
    cpu = " + ".join(f"{each / len(pictures):.0f}" for each in spent)
    late = np.array([ms for picture in pictures for ms in picture["late"]])
    server = np.array([picture["server"] for picture in pictures])
    half, most = np.quantile(late, [0.5, 0.95])
    numbers = f"{half:5.0f} ms median, {most:5.0f} ms 95 %; server {np.median(server):4.0f} ms; CPU {cpu} ms"
    print(f"{what:34s} {len(late):3d} moves, {len(pictures):3d} pictures: {numbers}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("experiment", nargs="?", default="position_step")
    parser.add_argument("--pictures", type=Path, help="also leave the page at 1440 and 390 px in this folder")
    options = parser.parse_args()
    with live(options.experiment) as (address, server), browser() as tab:
        tab.open(address, 1440, 900)
        tab.run(_WATCH)
        tab.until(_IDLE)
        choices = tab.run("[...document.getElementById('controller').options].map((o) => o.value)")
        name = next((name for name in choices if re.fullmatch(r"p-dp.*", name)), choices[0])
        tab.run(f"((s) => {{ s.value = {name!r}; s.dispatchEvent(new Event('change')); }})(controller)")
        if options.pictures:
            tab.until(_IDLE)
            options.pictures.mkdir(parents=True, exist_ok=True)
            tab.picture(options.pictures / "live-1440.png")
        measure(tab, server, f"{name}: gain", slider("n-gain"), 30)
        measure(tab, server, "mass", slider("n-rig.M"), 40)
        measure(tab, server, "operating position", slider("n-rig.position"), 60)
        if tags := tab.run("[...document.querySelectorAll('.handle')].map((tag) => tag.dataset.name)"):
            measure(tab, server, f"corner {tags[0]}, on the Bode plot", corner(tags[0]), 40)
        if options.pictures:
            tab.picture(options.pictures / "live-moved.png")
            tab.open(address, 390, 844)
            tab.until(_IDLE)
            tab.picture(options.pictures / "live-390.png")
            tab.picture(options.pictures / "live-390-whole.png", whole=True)


if __name__ == "__main__":
    main()
