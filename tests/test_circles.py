"""No module leads back to itself by what it imports, wherever in it the import stands."""

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "workbench"
SHOW = ("report.figures", "report.table"), "report.show"  # a figure and a table show themselves in a notebook


def modules():
    paths = {path.relative_to(PACKAGE).with_suffix(""): path for path in PACKAGE.rglob("*.py")}
    return {".".join(p for p in name.parts if p != "__init__"): path for name, path in paths.items()}


def imported(name, path, known):
    """The modules of the package that one imports; for the eyes of a type checker alone does not count."""
    room = name.split(".") if path.stem == "__init__" else name.split(".")[:-1]
    for node in walked(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = ".".join([*room[: len(room) - node.level + 1], *([node.module] if node.module else [])])
            for alias in node.names:
                yield f"{base}.{alias.name}" if f"{base}.{alias.name}" in known else base


def walked(node):
    for child in ast.iter_child_nodes(node):
        if not (isinstance(child, ast.If) and "TYPE_CHECKING" in ast.dump(child.test)):
            yield child
            yield from walked(child)


def test_no_module_leads_back_to_itself():
    known = modules()
    graph = {name: {to for to in imported(name, path, known) if to in known} - {name} for name, path in known.items()}
    for name in SHOW[0]:
        graph[name].discard(SHOW[1])
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        raise AssertionError(" imports ".join(reversed(error.args[1]))) from None
