"""The names of the doors: what `workbench`, `controllers` and `envs` offer to Python."""

import inspect
import re

import workbench

from .markdown import page, plain, table

_INTRODUCTION = """`import workbench as wb` gives these names; each loads its module when it is first used. Numbers are
SI, or text with a unit where a docstring says so. Further names are those of the rooms, `workbench.loop`,
`workbench.linear` and so on, which their docstrings list. Controllers come from `controllers`, see
[](controllers.md); `import envs` registers the environments, see [](../environments.md)."""

_SWITCHED = """## controllers.Switched

```{eval-rst}
.. autoclass:: controllers.Switched
   :members:
```"""


def pages() -> dict[str, str]:
    """The page of the door `workbench`, name by name."""
    parts = [part for name in sorted(dir(workbench), key=str.lower) for part in _entry(name)]
    return {"api.md": page("Python", _INTRODUCTION, _summary(), *parts, _SWITCHED)}


def _summary() -> str:
    """Every name with the first sentence of its docstring."""
    rows = [
        [f"{{py:obj}}`~workbench.{name}`", plain(_sentence(name))] for name in sorted(dir(workbench), key=str.lower)
    ]
    return table(("name", "what it is"), rows)


def _sentence(name: str) -> str:
    """Of data its value's names."""
    thing = getattr(workbench, name)
    if not callable(thing):
        return ", ".join(map(str, thing))
    return re.split(r"\.(?=\s+[A-Z`]|$)|\n\n", inspect.getdoc(thing) or "", maxsplit=1)[0].removesuffix(".")


def _entry(name: str) -> list[str]:
    thing = getattr(workbench, name)
    kind, options = "autodata", ["   :no-value:"]
    if inspect.isclass(thing):
        kind, options = "autoclass", ["   :members:"]
    elif callable(thing):
        kind, options = "autofunction", []
    return [f"## {name}", "\n".join(["```{eval-rst}", f".. {kind}:: workbench.{name}", *options, "```"])]
