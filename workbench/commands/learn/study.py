"""Learning of a drive file: closed-loop responses, the filter that they give, and the iterations on every rig."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...loop.learning import (
    BOUND,
    Iteration,
    Learned,
    LearningFilter,
    learn,
    learning_filter,
    record_frequencies,
    rms,
)
from ...loop.rows import LoopSetup, linear_loops
from ...report import Figure, Page
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from .config import LearnConfig
from .drawn import drawn_row, learned_on_drawn
from .measured import measured_loop
from .page import Convergence, drive_files, figure, page, rows, shown, tables

HIGHEST = 0.25  # of the control rate: the highest cut-off that Q may have

Setups = Mapping[str, LoopSetup]


def run_learning(config: LearnConfig, stage: Stage, progress: Progress) -> Outcome:
    """The filter of the first rig, that it converges on all; what is learned on each of them and on drawn plants."""
    record = config.record
    setups, reference = record.setups(config.controller), record.reference
    convergence = _convergence(config, setups, len(reference), stage)
    progress(convergence.verdict)
    learned = {
        name: _learned(config, name, setup, convergence.learning, reference, stage, progress)
        for name, setup in setups.items()
    }
    drawn = learned_on_drawn(config, convergence.learning, stage, progress)
    metrics = {
        "cutoff_hz": convergence.learning.cutoff,
        "contraction": convergence.largest,
        "learned": [
            {"rig": name, "fall_db": each.fall_db, "floor": each.floor, "stopped": each.stopped}
            for name, each in learned.items()
        ],
        "rows": rows(learned),
        "plants": [drawn_row(config, drawn)] if drawn else [],
    }
    lanes = {"plants": drawn.draw.columns(record.rig) | dict(drawn.lanes)} if drawn else {}
    subject = Subject(record.rig, [config.controller], record.rigs)

    def draw() -> tuple[Page, Figure]:
        picture = figure(config, learned)
        return page(config, convergence, learned, picture, drawn), picture

    return Outcome(metrics, draw, tables(record, learned) | lanes, drive_files(record, learned), subject)


def _convergence(config: LearnConfig, setups: Setups, samples: int, stage: Stage) -> Convergence:
    """The filter, by the first rig's response, and the closed loops of all rigs at null and moving.

    Raises InputError for a loop that is unstable, or without a linear view, and where no cut-off converges.
    """
    period, controller = config.record.rig.period.value, config.controller
    f = record_frequencies(samples, period)
    responses: dict[str, np.ndarray] = {}
    for name, setup in setups.items():
        loops = linear_loops(controller, setup)
        for point, loop in {"null": loops.null, "moving": loops.moving}.items():
            if loop.closed is None:
                raise InputError(f"{controller.name}: no linear stable loop on {name}, {point}; choose another")
            responses[f"{name}, {point}"] = np.interp(f, loop.f, loop.closed)
    design, highest = np.array(list(responses.values())[:2]), HIGHEST / period
    if config.measure is not None:
        repeated = config.record.repeated(config.controller, next(iter(setups.values())))
        measure = config.measure
        line = stage("measured", lambda: measured_loop(config.record, measure, repeated))
        design, highest = np.interp(f, line["f"], line["response"])[None], line["f"][-1]
        responses["measured"] = design[0]
    learning = learning_filter(f, samples, design, np.array(list(responses.values())), highest)
    convergence = Convergence(learning, responses)
    if max(convergence.largest.values()) > BOUND:
        raise InputError(f"{controller.name}: no cut-off lets learning converge on all rigs; name fewer rigs")
    return convergence


def _learned(
    config: LearnConfig,
    name: str,
    setup: LoopSetup,
    learning: LearningFilter,
    reference: np.ndarray,
    stage: Stage,
    progress: Progress,
) -> Learned:
    """What is learned on one rig, each iteration a stage."""
    repeated = config.record.repeated(config.controller, setup)

    def play(number: int, drive: np.ndarray, gain: float) -> Iteration:
        def compute() -> dict[str, Any]:
            return asdict(repeated.play(number, drive, gain))

        iteration = Iteration(**stage(f"{name}-{'again' if number < 0 else number}", compute))
        error = rms(reference[: len(iteration.measured)] - iteration.measured)
        which = "the record again" if number < 0 else f"iteration {number}"
        progress(f"{name}, {which}: {shown(config.record, error):.4g} {config.record.signal.unit} RMS")
        return iteration

    return learn(learning, reference, play, config.iterations)
