"""The sines on drawn plants: which share of them arrives, and how far off the others are."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.numbers import finite, quantile
from ...control.protocol import Controller
from ...engine import Engine
from ...linear.equilibria import Equilibria, equilibria
from ...linear.operating_point import far_end
from ...loop.batch import play_lanes
from ...loop.robustness.drawn_plants import PlantDraw, draw_plants
from ...loop.sines import AMPLITUDE, PHASE, SineErrors, sine, sine_errors
from ...plant import build
from ...rigs.rig import Rig
from .options import Sine, SinesConfig

_SHARE = 0.99  # of the plants, whose errors a row gives besides the worst


@dataclass(frozen=True)
class SinePlants:
    """Drawn plants of a rig with its computing delay, at rest at `points`."""

    rig: Rig
    engine: Engine
    draw: PlantDraw
    points: Equilibria


def sine_plants(config: SinesConfig, rig: Rig) -> SinePlants:
    """Plants that follow from the seed. Raises InputError where the nominal one has no operating point."""
    engine, largest = Engine(build(rig)), max(each.amplitude for each in config.sines)
    reach = max(0.0, config.stroke * rig.limit("stroke") - largest)
    draw = draw_plants(rig, engine.plant, config.factors, config.plants, config.conditions.seed, (-reach, reach))
    points = equilibria(engine.plant, draw.p, draw.position, None, None, **far_end(engine.plant, draw.position))
    return SinePlants(rig, engine, draw, points)


def sines_on_plants(config: SinesConfig, plants: SinePlants, controller: Controller, asked: Sine) -> dict[str, Any]:
    """Errors [plants] of amplitude [1] and phase [rad], the third harmonic [1], and which have tripped."""
    period = plants.rig.period.value
    reference = sine(asked.amplitude, asked.frequency, period)
    parts = []
    for _, lanes in play_lanes(
        plants.engine,
        plants.rig,
        controller,
        plants.points,
        plants.draw.p,
        reference,
        ("position",),
        config.conditions.noise,
    ):
        y = lanes.signals["position"]
        errors = sine_errors(y - y[:, :1], asked.amplitude, asked.frequency, period)
        parts.append((errors.amplitude, errors.phase, errors.third, (lanes.trip > 0) | lanes.failed))
    amplitude, phase, third, tripped = (np.concatenate(part) for part in zip(*parts, strict=True))
    return {"amplitude": amplitude, "phase": phase, "third": third, "tripped": tripped}


def plants_row(plants: SinePlants, asked: Sine, columns: dict[str, Any]) -> dict[str, Any]:
    """What share arrives in time; the errors that 99 % of the plants stay below, and the plant that is furthest off.

    A plant that trips counts as off by everything; an error is None where such a plant decides it.
    """
    tripped = np.asarray(columns["tripped"], bool)
    errors = SineErrors(*(np.asarray(columns[key]) for key in ("amplitude", "phase", "third")))
    amplitude, phase = (
        np.where(tripped | np.isnan(part), np.inf, np.abs(part)) for part in (errors.amplitude, errors.phase)
    )
    within = errors.within & ~tripped
    worst = int(np.argmax(np.maximum(amplitude / AMPLITUDE, phase / np.radians(PHASE))))
    return {
        "frequency": asked.frequency,
        "amplitude": asked.amplitude,
        "plants": len(within),
        "within": int(within.sum()),
        "within_percent": float(100 * within.mean()),
        "tripped": int(tripped.sum()),
        "amplitude_p99_percent": quantile(100 * amplitude, _SHARE),
        "phase_p99_deg": quantile(np.degrees(phase), _SHARE),
        "amplitude_worst_percent": finite(100 * amplitude.max()),
        "phase_worst_deg": finite(np.degrees(phase.max())),
        "worst": plants.draw.plant(worst, plants.rig),
    }
