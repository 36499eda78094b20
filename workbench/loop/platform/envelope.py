"""What a platform's loops do where the payload is another than they were designed for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...control.platform_controller import PlatformSpec
from .loop import run_platform
from .rows import step_row
from .setup import PlatformSetup, platform_setup
from .steps import AxisStep
from .transfer import platform_transfer


@dataclass(frozen=True)
class Judged:
    """A controller on a payload that is not the declared one: linear stability and sensitivity, the largest settling
    time [s] over steps (None where one does not settle), the trip if any, surge into pitch at 5 Hz [percent]."""

    controller: str
    variation: str
    stable: bool
    ms: float | None
    settling_s: float | None
    tripped: str | None
    coupling_percent: float | None


def judge_variations(
    setup: PlatformSetup,
    controllers: Sequence[PlatformSpec],
    variations: Mapping[str, Mapping[str, float]],
    steps: Sequence[AxisStep],
    seed: int | None,
) -> list[Judged]:
    """Every controller on every variation, SI values of the payload by name; laws, directions and guards stay those of
    the declared platform."""
    results = []
    for name, values in variations.items():
        other = platform_setup(setup.platform.with_values(**values))
        other = other.known_as(setup)
        results += [_judged(spec, name, other, steps, seed) for spec in controllers]
    return results


def _judged(spec: PlatformSpec, name: str, setup: PlatformSetup, steps: Sequence[AxisStep], seed: int | None) -> Judged:
    controller = spec.build(setup.platform.period, setup.directions)
    transfer = platform_transfer(setup, controller, np.geomspace(0.5, 60.0, 60))
    if not transfer.stable:
        return Judged(spec.name, name, False, None, None, None, None)
    runs = [run_platform(setup, controller, step.pose(setup.platform.period), seed) for step in steps]
    rows = [step_row(spec.name, step, setup, run, transfer) for step, run in zip(steps, runs, strict=True)]
    settled = [row["settling_s"] for row in rows]
    return Judged(
        spec.name,
        name,
        True,
        float(transfer.sensitivity.max()),
        None if None in settled else max(settled),
        next((run.tripped for run in runs if run.tripped), None),
        100 * transfer.coupling("pitch", "surge"),
    )
