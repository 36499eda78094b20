"""CasADi, imported when a graph is first built: what only reads an experiment, or lists controllers, does not wait."""

from typing import Any


def __getattr__(name: str) -> Any:
    import casadi

    return getattr(casadi, name)
