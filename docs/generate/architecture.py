"""The pictures of the architecture, drawn from the code: rooms and their imports, and the ways through them."""

import ast
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cache
from html import escape
from importlib import import_module
from pathlib import Path

from .readme import ROOT
from .runs import Cell, Run, run_all

_PACKAGE = ROOT / "workbench"
_WAYS = {
    "a sample of a loop": (
        ("workbench.loop.sampled_loop", "SampledLoop", "reads the sensors, late and with noise"),
        ("workbench.control.law", "Law", "the law computes the command"),
        ("workbench.engine.guard_rules", "", "the guard limits it, or trips"),
        ("workbench.engine.delay_line", "", "it acts after the computing delay"),
        ("workbench.engine", "Engine", "the plant is integrated over one period"),
    ),
    "a recording": (
        ("workbench.records", "load_campaign", "files become SI signals, each with its role"),
        ("workbench.identify.data.noise_floor", "noise_floor", "the noise of each signal"),
        ("workbench.identify.trace.problem", "estimation_problem", "windows, numbers and initial states"),
        ("workbench.identify.trace.tracer", "trace", "fits, scores and refits of every effect"),
        ("workbench.identify.trace.rule", "", "named, tied, incomplete, unknown or none"),
        ("workbench.commands.trace.page", "trace_page", "the report"),
    ),
    "a control law": (
        ("workbench.control.protocol", "number", "numbers with units and bounds"),
        ("workbench.control.load_class", "load_class", "named in a file by module and class"),
        ("workbench.loop.tuning.search", "search", "its numbers are searched"),
        ("workbench.loop.rows", "", "it is judged: margins, steps, the envelope"),
        ("workbench.control.export.program", "Program", "it leaves as C and Structured Text"),
    ),
}
_TRACE = {
    "a trace, until nothing is missing": (
        ("workbench.identify.trace.problem", "estimation_problem", "1 windows, their roles, and the noise floor"),
        ("workbench.identify.trace.refit", "fit_rig", "2 the rig alone"),
        ("workbench.identify.trace.locate", "locate_fault", "3 the equation that lacks something"),
        ("workbench.identify.trace.shortlist", "score_effects", "4 the score of every effect"),
    ),
    "one pass after another": (
        ("workbench.identify.trace.follow", "Follower", "5 where a refit starts"),
        ("workbench.identify.trace.refit", "refit", "5 the rig with one effect more"),
        ("workbench.identify.trace.rule", "named", "6 what passes, what is named"),
        ("workbench.identify.trace.joint", "refit_pairs", "6 two effects, where none is named alone"),
    ),
    "when all is decided": (
        ("workbench.identify.trace.refit", "heldout_errors", "7 records that nothing was chosen by"),
        ("workbench.identify.trace.verdict", "judge_search", "8 the verdict"),
        ("workbench.identify.trace.shapes", "best_reshaping", "8 the shape of what is left"),
    ),
}
_STYLE = (
    "<style>text{font:13px sans-serif;fill:#222}rect{fill:#eef3f8;stroke:#4a6a8a}"
    ".small{font-size:11px;fill:#555}path{fill:none;stroke:#4a6a8a;opacity:.55}</style>"
)


def pictures() -> dict[str, str]:
    """Every picture as SVG."""
    return {"rooms.svg": _rooms(), "ways.svg": _ways(_WAYS), "trace.svg": _ways(_TRACE)}


@cache
def ranks() -> list[list[str]]:
    """The rooms of each rank of import-linter's layers, from the top."""
    linter = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]
    return [rank.split(" | ") for contract in linter["contracts"] for rank in contract.get("layers", ())]


def imports() -> Counter[tuple[str, str]]:
    """How many imports each room of the workbench has from each other one."""
    found: Counter[tuple[str, str]] = Counter()
    for path in sorted(_PACKAGE.rglob("*.py")):
        parts = path.relative_to(_PACKAGE).with_suffix("").parts
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom) and (room := _room(node, parts)) and room != parts[0]:
                found[parts[0], room] += 1
    return found


def _room(node: ast.ImportFrom, parts: tuple[str, ...]) -> str:
    """The room that an import in the module `parts` of the workbench leads to; none where that is outside."""
    named = (node.module or "").split(".")
    if node.level:
        base = parts[: len(parts) - node.level]
        target = [*base, *named]
    elif named[0] == "workbench":
        target = named[1:]
    else:
        return ""
    rooms = {name for rank in ranks() for name in rank}
    return target[0] if target and target[0] in rooms else ""


def _rooms() -> str:
    places = {
        name: (60 + 190 * place + 95 * (2 - len(rank)), 20 + 52 * row)
        for row, rank in enumerate(ranks())
        for place, name in enumerate(rank)
    }
    lines = []
    for (above, below), count in sorted(imports().items()):
        if above in places and below in places:
            (x0, y0), (x1, y1) = places[above], places[below]
            side = 130 + 12 * (y1 - y0) // 52
            lines.append(
                f'<path d="M{x0 + 130} {y0 + 15} C{x0 + side + 60} {y0 + 15} {x1 + side + 60} {y1 + 15} '
                f'{x1 + 130} {y1 + 15}" stroke-width="{min(1 + count / 40, 5):.1f}"><title>{above} imports {count} '
                f"times from {below}</title></path>"
            )
    boxes = [_box(x, y, 130, 30, name) for name, (x, y) in places.items()]
    return _svg(560, 60 + 52 * len(ranks()), [*lines, *boxes])


def _ways(ways: Mapping[str, Sequence[tuple[str, str, str]]]) -> str:
    """Each way as a column of boxes."""
    parts = []
    for column, (title, steps) in enumerate(ways.items()):
        x = 10 + 300 * column
        parts.append(f'<text x="{x}" y="20" font-weight="bold">{escape(title)}</text>')
        for row, (module, name, what) in enumerate(steps):
            y = 35 + 70 * row
            parts += [_box(x, y, 280, 46, _named(module, name), what)]
            if row:
                parts.append(f'<path d="M{x + 140} {y - 24} V{y}" stroke-width="2"/>')
    return _svg(910, 60 + 70 * max(map(len, ways.values())), parts)


def _named(module: str, name: str) -> str:
    """A step's module and function. Raises AttributeError or ImportError where the code has it no more."""
    thing = import_module(module)
    if name:
        getattr(thing, name)
    return module.removeprefix("workbench.") + (f": {name}" if name else "")


def _box(x: float, y: float, width: float, height: float, title: str, below: str = "") -> str:
    text = f'<text x="{x + 8}" y="{y + 19}">{escape(title)}</text>'
    small = f'<text class="small" x="{x + 8}" y="{y + 37}">{escape(below)}</text>' if below else ""
    return f'<rect x="{x}" y="{y}" width="{width}" height="{height}" rx="4"/>{text}{small}'


def _svg(width: float, height: float, parts: list[str]) -> str:
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}">'
    return "\n".join([head, _STYLE, *parts, "</svg>"])


def parts(cache: Path, run: bool) -> dict[str, str]:
    """How far the walks are and how large the code is; a sentence alone where that has not run."""
    walks = Run("walks", (Cell("shell", "", 'python "$PYTHONPATH/.ci/walks.py"'),), cache)
    if run:
        run_all([walks])
    left = walks.left()
    return {"part_walks.md": f"```text\n{left[0]['printed']}```\n" if left else "`make docs` counts them.\n"}


def write(folder: Path) -> None:
    """Leave the pictures in a folder."""
    for name, text in pictures().items():
        (folder / name).write_text(text, "utf-8")
