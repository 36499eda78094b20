"""The pages that code knows: the numbers, keys, effects, controllers, commands and examples.

markdown      tables and plain text of a page
readme        CONTRIBUTING.md, as a part that a page includes
cells         the blocks of a page, and what they leave
runs          runs them, and scripts and commands, and keeps what they leave; `run_cells` is the process of each page
rig_keys      the rig file and the datasheet; the table of all numbers
files         experiments, linear plants, campaigns and tasks, by a file of each kind that has every key
readings      what the readers of such files ask of each key
effects       the library of effects
controllers   controllers and compensators with their design numbers
commands      every command with its options
examples      the scripts of examples/, run, with what they print and draw
architecture  pictures of the rooms and of the ways through them; the lengths of three walks
words         the words of the house with their meanings
gallery       reports that their commands make, with pictures of their first screens
tables        who made the tables that studies left, and when
metrics       the metrics with their units and meanings
doors         the names of `workbench`, `controllers` and `envs`
"""

from pathlib import Path
from typing import Any

from . import (
    architecture,
    commands,
    controllers,
    doors,
    effects,
    examples,
    files,
    gallery,
    metrics,
    readme,
    rig_keys,
    words,
)


def setup(app: Any) -> dict[str, bool]:
    """Have Sphinx write the pages before it reads any."""
    app.connect("builder-inited", _write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _write(app: Any) -> None:
    write_pages(Path(app.srcdir) / "reference", Path(app.srcdir) / "_build", run=not app.tags.has("words"))


def write_pages(folder: Path, cache: Path, run: bool) -> None:
    """Write every generated page into `folder`; a file that would stay the same is left alone, for Sphinx's own cache.

    `cache` keeps what the examples left, and the gallery; they `run`, or what they left is shown as far as it is there.
    """
    folder.mkdir(exist_ok=True)
    architecture.write(folder)
    pages = {
        **readme.parts(),
        **rig_keys.pages(),
        **files.pages(),
        **effects.pages(),
        **controllers.pages(),
        **commands.pages(),
        **doors.pages(),
        **metrics.pages(),
        **words.parts(),
        **examples.pages(folder, cache / "examples", run),
        **architecture.parts(cache / "walks", run),
        **gallery.parts(cache / "gallery", run),
    }
    for name, text in pages.items():
        path = folder / name
        if not path.exists() or path.read_text("utf-8") != text:
            path.write_text(text, "utf-8")
    for path in folder.glob("*.md"):
        if path.name not in pages:
            path.unlink()
