"""The names of the doors: what `workbench`, `controllers` and `envs` offer to Python."""

import inspect

import workbench

from .markdown import page

_INTRODUCTION = """`import workbench as wb` gives these names; each loads its module when it is first used. Numbers are
SI, or text with a unit where a docstring says so. Further names are those of the rooms, `workbench.loop`,
`workbench.linear` and so on, which their docstrings list. Controllers come from `controllers`, see
[](controllers.md); `import envs` registers the environments, see [](../environments.md)."""


def pages() -> dict[str, str]:
    """The page of the door `workbench`, name by name."""
    parts = [part for name in sorted(workbench.__all__, key=str.lower) for part in _entry(name)]
    return {"api.md": page("workbench", _INTRODUCTION, _summary(), *parts)}


def _summary() -> str:
    rows = [f"   ~workbench.{name}" for name in sorted(workbench.__all__, key=str.lower)]
    return "\n".join(["```{eval-rst}", ".. autosummary::", "", *rows, "```"])


def _entry(name: str) -> list[str]:
    thing = getattr(workbench, name)
    kind, options = "autodata", ["   :no-value:"]
    if inspect.isclass(thing):
        kind, options = "autoclass", ["   :members:"]
    elif callable(thing):
        kind, options = "autofunction", []
    return [f"## {name}", "\n".join(["```{eval-rst}", f".. {kind}:: workbench.{name}", *options, "```"])]
