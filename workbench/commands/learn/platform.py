"""Learning of a platform's drive file: the measured response, what it promises, the iterations on every payload."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...loop.learning import BOUND, Iteration, low_pass, rms
from ...loop.platform.learning import (
    Left,
    RepeatedMotion,
    learn_motion,
    matrix_filter,
    measured_left,
    other_left,
)
from ...loop.platform.measured import MatrixResponse, measured_response
from ...loop.platform.record import check_motion
from ...loop.platform.setup import platform_setup
from ...records.frequency_sheet import table_text
from ...report import Figure, Page
from ...rigs.platform import AXES
from ..common.outcome import Outcome, Progress, Stage
from .drawn import falls_row
from .options import LearnConfig, PlatformLearnConfig
from .page import rows, tables
from .platform_page import PlatformLearning, platform_learning_page
from .study import run_learning, staged

DECLARED = "declared"  # the payload of the file


def run_any(config: LearnConfig | PlatformLearnConfig, stage: Stage, progress: Progress) -> Outcome:
    """Learning on one jack or on a platform."""
    if isinstance(config, PlatformLearnConfig):
        return run_platform_learning(config, stage, progress)
    return run_learning(config, stage, progress)


def run_platform_learning(config: PlatformLearnConfig, stage: Stage, progress: Progress) -> Outcome:
    """The filter of the measured response, that it converges on all payloads, and what is learned on each."""
    progress("build, equilibrium")
    setup = platform_setup(config.rig, config.delay)
    check_motion(setup, config.motion.pose)
    drawn = config.drawn
    payloads = drawn.draw(setup, config.conditions.seed) if drawn else []
    seed, spec = config.conditions.noise, config.controller
    players = {DECLARED: RepeatedMotion.of(spec, setup, seed)}
    for number, payload in enumerate(payloads, 1):
        progress(f"payload {number} of {len(payloads)}")
        players[f"payload {number}"] = RepeatedMotion.of(spec, setup.with_payload(payload), seed)
    progress("measure the response, 6 x 6")
    own = players[DECLARED]
    measured = MatrixResponse(
        **stage("measured", lambda: vars(measured_response(setup, own.controller, config.sines, seed)))
    )
    left = _left(config, players, measured)
    reference = config.motion.pose * setup.platform.geometry.weights
    learning = matrix_filter(reference, setup.platform.period, measured, list(left.values()))
    q = low_pass(measured.f, learning.cutoff)
    if max(float((q * each.norm).max()) for each in left.values()) > BOUND:
        raise InputError(f"{spec.name}: no cut-off lets learning converge on all payloads; draw nearer ones")
    found = PlatformLearning(config, setup, payloads, measured, left, learning, {})
    progress(found.promise)

    def told(iteration: Iteration) -> str:
        error = rms(learning.in_band(reference[: len(iteration.measured)] - iteration.measured))
        return f"{1e3 * error:.4g} mm"

    for name, player in players.items():
        played = staged(player.play, name, told, stage, progress)
        found.learned[name] = learn_motion(learning, reference, played, config.iterations)
    metrics = _metrics(found)

    def draw() -> tuple[Page, Figure]:
        return platform_learning_page(found, metrics)

    period, weights = setup.platform.period, setup.platform.geometry.weights
    return Outcome(metrics, draw, tables(found.learned, period, weights), _drive_files(found))


def _left(
    config: PlatformLearnConfig, players: Mapping[str, RepeatedMotion], measured: MatrixResponse
) -> dict[str, Left]:
    """What an iteration leaves, by payload. Raises InputError where a payload makes the loop unstable."""
    transfers = {name: player.transfer(measured.f) for name, player in players.items()}
    left = {DECLARED: measured_left(measured)}
    declared = transfers[DECLARED]
    for name, transfer in transfers.items():
        if declared is None or transfer is None:
            raise InputError(f"{config.controller.name}: unstable, {name}; choose another, or draw nearer payloads")
        if name != DECLARED:
            left[name] = other_left(measured, declared, transfer)
    return left


def _metrics(found: PlatformLearning) -> dict[str, Any]:
    accelerations = {
        name: [found.acceleration(each, iteration) for iteration in each.iterations]
        for name, each in found.learned.items()
    }
    flat = [value for values in accelerations.values() for value in values]
    falls = np.array([each.fall_db for name, each in found.learned.items() if name != DECLARED])
    return {
        "cutoff_hz": found.learning.cutoff,
        "convergence": [
            {"rig": name, "radius": found.most(each.radius), "norm": found.most(each.norm)}
            for name, each in found.left.items()
        ],
        "learned": [
            {
                "rig": name,
                "fall_db": each.fall_db,
                "acceleration_fall_db": float(
                    20 * np.log10(accelerations[name][0] / found.acceleration(each, each.best))
                ),
                "floor": each.floor,
                "stopped": each.stopped,
            }
            for name, each in found.learned.items()
        ],
        "rows": [
            {**row, "acceleration_error_rms": value} for row, value in zip(rows(found.learned), flat, strict=True)
        ],
        "plants": [falls_row(found.config.controller.name, falls)] if len(falls) else [],
        "payloads": found.payloads,
    }


def _drive_files(found: PlatformLearning) -> dict[str, str]:
    """The learned drives, as a record of a platform's experiment takes them."""
    weights, period = found.setup.platform.geometry.weights, found.setup.platform.period
    files = {}
    for name, each in found.learned.items():
        drive = each.best.drive / weights
        columns = {"t": np.arange(len(drive)) * period} | {axis: drive[:, i] for i, axis in enumerate(AXES)}
        files[f"drive-{name.replace(' ', '')}.csv"] = table_text(columns)
    return files
