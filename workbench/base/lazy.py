"""Names of a package whose modules are loaded when they are first used."""

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any


def lazy_names(
    package: str, homes: Mapping[str, Sequence[str]], shown: Callable[[Any], Any] = lambda value: value
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` of a package, from its modules' public names: "fit.model" -> ("Model",).

    `shown` takes what a name stands for and gives what the package shows. No name may be that of a module beside it:
    once loaded, the module would stand in its place.
    """
    modules = {name: module for module, names in homes.items() for name in names}

    def load(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return shown(getattr(import_module(f".{modules[name]}", package), name))

    return load, lambda: sorted(modules)
