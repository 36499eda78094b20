"""Large graphs kept in the user's cache folder: to read one takes a tenth of the time of making it."""

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path

import casadi as ca
import numpy as np

from ..base.private_cache import store, stored
from ..plant import Plant

_LARGE = 3000  # instructions of the rates: below, a graph is made as fast as it is read


def attempt_of(plant: Plant, make: Callable[[Plant], ca.Function]) -> ca.Function:
    """What `make` makes of a plant, from the cache where it has been made before.

    The key holds the plant's rates and the sizes of its states, which are all that a graph of the engine takes of it,
    and the sources that make it.
    """
    if plant.f.n_instructions() < _LARGE:
        return make(plant)
    parts = [make.__name__, plant.f.serialize(), str(np.asarray(plant.scale).tobytes()), *_sources()]
    name = f"{hashlib.sha256(chr(0).join(parts).encode()).hexdigest()}.graph"
    if content := stored(name):
        return ca.Function.deserialize(content.decode())
    graph = make(plant)
    store(name, graph.serialize().encode())
    return graph


@cache
def _sources() -> tuple[str, ...]:
    folder = Path(__file__).parent
    return (
        ca.CasadiMeta.version(),
        *((folder / f"{name}.py").read_text(encoding="utf-8") for name in ("rosenbrock", "sparse_lu")),
    )
