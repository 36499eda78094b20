"""Makes a notebook of each chapter of the first hour: the same text, the same blocks, no outputs.

The site runs the blocks (docs/generate/cells.py); a test holds the notebooks to the chapters.
"""

import json
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "docs"))
from generate.cells import Cell, parts  # noqa: E402

CHAPTERS = ("close_a_loop", "bounds", "recording", "find_out_why", "tune")
FOLDER = ROOT / "examples" / "notebooks"


def notebook(page: str) -> str:
    """A page as the text of a notebook, format 4.5."""
    cells = [_cell(part, place) for place, part in enumerate(parts(page)) if isinstance(part, Cell) or part.strip()]
    kernel = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    return json.dumps({"cells": cells, "metadata": kernel, "nbformat": 4, "nbformat_minor": 5}, indent=1) + "\n"


def _cell(part: str | Cell, place: int) -> dict[str, Any]:
    shared = {"id": f"cell-{place}", "metadata": {}}
    if isinstance(part, str):
        return {"cell_type": "markdown", **shared, "source": part.strip().splitlines(keepends=True)}
    heads = {"python": "", "shell": "%%bash\n", "file": f"%%writefile {part.name}\n"}
    lines = (heads[part.kind] + part.text.rstrip("\n")).splitlines(keepends=True)
    return {"cell_type": "code", **shared, "execution_count": None, "outputs": [], "source": lines}


def main() -> int:
    """Write every notebook."""
    FOLDER.mkdir(exist_ok=True)
    for name in CHAPTERS:
        page = (ROOT / "docs" / "first_hour" / f"{name}.md").read_text("utf-8")
        (FOLDER / f"{name}.ipynb").write_text(notebook(page), "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
