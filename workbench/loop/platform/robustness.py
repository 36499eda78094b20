"""Platforms drawn over what is uncertain of one (payload, pose and the numbers of each leg), and a controller on many
of them: the linear loop of each, and steps in compiled lanes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...base.errors import InputError
from ...control.platform_controller import LEGS, PlatformController
from ...control.platform_law import PlatformLaw, platform_law
from ...engine import Engine
from ...linear.platform_modes import platform_equilibrium
from ...rigs.platform import AXES
from .. import step_metrics as metrics
from ..envelope import HUNTING
from .compiled import CompiledPlatform, LegSensors
from .loop import inputs_of
from .rows import SHARE
from .setup import PlatformSetup
from .steps import AxisStep, PlatformDraw
from .transfer import platform_transfer

_CENTRE, _INERTIA = ("cx", "cy", "cz"), ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
_F = np.geomspace(0.5, 100.0, 120)  # Hz


@dataclass(frozen=True, eq=False)
class DrawnPlatform:
    """One of them: its parameters p [k] and the operating points at its pose in `setup`, whose directions and guards
    stay those of the declared platform. `numbers`: its payload and pose by name, SI."""

    number: int
    p: np.ndarray
    pose: np.ndarray
    setup: PlatformSetup
    numbers: Mapping[str, float]


def drawn_platform(setup: PlatformSetup, draw: PlatformDraw, seed: int, number: int) -> DrawnPlatform:
    """Number so and so: the same whatever others are drawn. Raises InputError where jacks cannot hold it."""
    plant, platform = setup.engine.plant, setup.platform
    random = np.random.default_rng([seed, number])
    mass, shift = random.uniform(*draw.mass), random.uniform(-draw.centre, draw.centre, 3)
    pose = random.uniform(-1.0, 1.0, LEGS) * draw.pose
    payload = {name: mass * platform[name] for name in ("mass", *_INERTIA)}
    payload |= {name: platform[name] + float(by) for name, by in zip(_CENTRE, shift, strict=True)}
    values = payload | _legs(setup, draw, random)
    p = plant.parameter_values(None, **values)
    smooth = plant.without_dry_friction(p)
    try:
        null, calm = platform_equilibrium(plant, pose, p), platform_equilibrium(plant, pose, smooth)
    except InputError as error:
        raise InputError(f"drawn platform {number}: {error}; draw over less") from None
    own = replace(setup, null=null, smooth=calm, p_smooth=smooth)
    shown = {name: payload[name] for name in ("mass", *_CENTRE)} | dict(zip(AXES, pose.tolist(), strict=True))
    return DrawnPlatform(number, p, pose, own, shown)


def _legs(setup: PlatformSetup, draw: PlatformDraw, random: np.random.Generator) -> dict[str, float]:
    """Drawn numbers of the jacks, by the names of the platform's parameters."""
    there, values = set(setup.engine.plant.parameters), dict[str, float]()
    for i, leg in enumerate(setup.platform.legs):
        for name, number in leg.rig.numbers.items():
            place, share = f"leg{i + 1}.{name}", random.uniform()
            if name in draw.factors:
                low, high = (number.value * factor for factor in draw.factors[name])
            elif number.uncertain is not None:
                low, high = number.uncertain
            else:
                continue
            if place in there:
                values[place] = low + share * (high - low)
    return values


@dataclass(frozen=True)
class LinearColumns:
    """Whether the linear loops of drawn platforms [n] are stable, their Ms, and how far a surge moves the pitch at 5 Hz
    [percent], both NaN where a loop is not."""

    stable: np.ndarray
    ms: np.ndarray
    coupling: np.ndarray


@dataclass(frozen=True)
class StepColumns:
    """A step on drawn platforms [n]: settling [s] (NaN: never), overshoot [%], how far the other axes go at most, in
    percent of the step, what tripped or failed, which of the others hunt without noise, along any axis, and the lowest
    pressure [Pa]."""

    settling: np.ndarray
    overshoot: np.ndarray
    cross: np.ndarray
    tripped: np.ndarray
    hunting: np.ndarray
    lowest: np.ndarray


def linear_columns(platforms: Sequence[DrawnPlatform], controller: PlatformController) -> LinearColumns:
    """The linear loop of each at its own pose. Raises NoLinearView."""
    rows = []
    for each in platforms:
        loop = platform_transfer(each.setup, controller, _F)
        told = (float(loop.sensitivity.max()), 100 * loop.coupling("pitch", "surge"))
        rows.append((loop.stable, *(told if loop.stable else (np.nan, np.nan))))
    stable, ms, coupling = np.array(rows, float).T
    return LinearColumns(stable.astype(bool), ms, coupling)


def step_columns(
    setup: PlatformSetup, platforms: Sequence[DrawnPlatform], controller: PlatformController, step: AxisStep,
    seed: int | None,
) -> StepColumns:  # fmt: skip
    """A step from the pose of each. Raises InputError for laws that do not run compiled."""
    law = platform_law(controller)
    if law is None:
        raise InputError("a law that is Python alone does not run on drawn platforms; leave it out")
    t, played, tripped = _played(setup, platforms, controller, law, step, seed)
    calm = played if seed is None else _played(setup, platforms, controller, law, step, None)[1]
    plant, weights = setup.engine.plant, setup.platform.geometry.weights
    axes = [plant.state(axis) for axis in AXES]
    size, period = abs(step.size) * weights[step.axis], setup.platform.period
    hunting = [
        metrics.hunting_lanes(period, calm[:, :, axis] * weight, size, HUNTING)
        for axis, weight in zip(axes, weights, strict=True)
    ]
    moved = played[:, :, axes] - played[:, :1, axes]
    y, target = moved[:, :, step.axis], np.full(len(moved), step.size)
    settled = metrics.settling_times(t, y, target, SHARE * abs(step.size))
    far = np.abs(moved).max(axis=1) * weights / size
    return StepColumns(
        np.where(tripped, np.nan, settled),
        metrics.overshoots(y, target, step.size),
        100 * np.delete(far, step.axis, axis=1).max(axis=1),
        tripped,
        np.any(hunting, axis=0) & ~tripped,
        _lowest(setup.engine, played, np.array([each.p for each in platforms])),
    )


def _lowest(engine: Engine, played: np.ndarray, p: np.ndarray) -> np.ndarray:
    """The lowest pressure [n] Pa of any jack's chamber in states [n, k, states]: where the state of one is lowest."""
    plant = engine.plant
    chambers = [plant.state(f"leg{i + 1}.{name}") for i in range(LEGS) for name in ("P1", "P2")]
    at = played[:, :, chambers].min(axis=2).argmin(axis=1)
    rows = np.take_along_axis(played, at[:, None, None], axis=1)
    outputs = engine.outputs(rows, np.zeros((1, len(plant.inputs))), p[:, None])
    return outputs[:, 0, plant.output("lowest_pressure")]


def _played(
    setup: PlatformSetup,
    platforms: Sequence[DrawnPlatform],
    controller: PlatformController,
    law: PlatformLaw,
    step: AxisStep,
    seed: int | None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times [k], states [n, k, states] and what tripped or failed [n]."""
    sensors = LegSensors.of(setup, controller.measures, seed is not None)
    loop, period = CompiledPlatform(setup, sensors, law), setup.platform.period
    lanes = []
    for each in platforms:
        pose = each.pose + step.pose(period)
        normal = sensors.draws(len(pose), seed, each.number)
        lanes.append((each.setup.null, inputs_of(setup, controller, pose, {}, normal), each.p))
    batch, out = loop.play(lanes)
    failed = batch.failed >= 0
    states = np.where(failed[:, None, None], batch.x[:, :1], batch.x[:, :-1])
    tripped = failed | np.any(out["trip"][:, -1] > 0, axis=1)
    return np.arange(states.shape[1]) * period, states, tripped
