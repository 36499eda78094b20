"""What every limit shares: the motion of a rig from rest where a scenario starts, and a cache of what was found."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..base.private_cache import store, stored
from ..engine import collocation
from ..engine.collocation import Motion
from ..linear import equilibrium
from ..linear.operating_point import far_end
from ..plant import build
from ..rigs.rig import Rig
from .scenarios import Scenario

NO_CHAMBERS = "a linear plant has no chambers, which set the limit"
BELOW = "at rest a chamber is below the margin"
_SIGNALS = ("position", "force", "pa", "pb", "lowest_pressure")

T = TypeVar("T")


def motion_from(rig: Rig, scenario: Scenario, margin: float) -> tuple[Motion, float]:
    """The motion, no chamber less than `margin` [Pa] above the vapour's pressure, and the controlled signal's level
    (SI) at rest. Raises InputError where the rig has no operating point there."""
    plant, position = build(rig), scenario.position(rig.limit("stroke"))
    start = equilibrium(plant, None, None, position, None, **far_end(plant, position))
    level = float(plant.observe(start.x, start.u)[0, plant.output(scenario.signal)])
    high = np.full(plant.n, np.inf)
    high[plant.state("x")], high[plant.state("v")] = rig.limit("stroke"), rig.limit("speed")
    low = np.where([state.unit == "Pa" for state in plant.states], margin, -high)
    return Motion(plant, start.x, start.u, low, high, rig.limit("command_rate")), level


def signals_of(motion: Motion, t: np.ndarray, x: np.ndarray, u: np.ndarray) -> dict[str, np.ndarray]:
    """Of states x [k + 1, n] at t [k + 1] s, inputs u [k, m]: the time "t [s]", command and outputs [k + 1], SI."""
    every = np.append(u, u[-1:], axis=0)
    outputs, plant = motion.plant.observe(x, every), motion.plant
    named = {name: outputs[:, plant.output(name)] for name in _SIGNALS if name in plant.outputs}
    return {"t [s]": t, "command": every[:, 0], **named}


def kept(
    kind: Callable[..., T],
    find: Callable[[], T],
    motion: Motion,
    output: str,
    numbers: Sequence[np.ndarray],
    sources: Iterable[str],
) -> T:
    """What `find` finds, a dataclass of `kind` with `signals`: from the user's cache folder where it was found before.

    It follows from the motion, the output, the numbers of its task and the sources (files) that find it.
    """
    name = f"{_digest(motion, output, numbers, sources)}.limit"
    if content := stored(name):
        return _read(kind, json.loads(content))
    found: Any = find()
    store(name, json.dumps(asdict(found), default=np.ndarray.tolist).encode())
    return found


def _digest(motion: Motion, output: str, numbers: Sequence[np.ndarray], sources: Iterable[str]) -> str:
    plant = motion.plant
    given = [motion.x, motion.u, motion.low, motion.high, np.array(motion.rate), plant.p, plant.scale, *numbers]
    parts = [plant.f.serialize(), plant.h.serialize(), output, *(part.tobytes().hex() for part in given)]
    parts += [Path(source).read_text(encoding="utf-8") for source in (__file__, collocation.__file__, *sources)]
    return sha256(chr(0).join(parts).encode()).hexdigest()


def _read(kind: Callable[..., T], table: Mapping[str, Any]) -> T:
    return kind(**{**table, "signals": {name: np.array(values) for name, values in table["signals"].items()}})
