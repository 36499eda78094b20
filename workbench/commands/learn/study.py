"""Learning of a drive file: closed-loop responses, the filter that they give, and the iterations on every rig."""

from collections.abc import Callable, Mapping
from dataclasses import asdict

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
from .drawn import drawn_row, learned_on_drawn
from .measured import measured_loop
from .options import LearnConfig
from .page import Convergence, drive_files, figure, page, rows, shown, tables

HIGHEST = 0.25  # of the control rate: the highest cut-off that Q may have

Setups = Mapping[str, LoopSetup]
Play = Callable[[int, np.ndarray, float], Iteration]


def run_learning(config: LearnConfig, stage: Stage, progress: Progress) -> Outcome:
    """The filter of the first rig, that it converges on all; what is learned on each of them and on drawn plants."""
    record = config
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

    return Outcome(
        metrics, draw, tables(learned, record.rig.period.value) | lanes, drive_files(record, learned), subject
    )


def _convergence(config: LearnConfig, setups: Setups, samples: int, stage: Stage) -> Convergence:
    """The filter, by the first rig's response, and the closed loops of all rigs at null and moving.

    Raises InputError for a loop that is unstable, or without a linear view, and where no cut-off converges.
    """
    period, controller = config.rig.period.value, config.controller
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
        repeated = config.repeated(config.controller, next(iter(setups.values())))
        measure = config.measure
        line = stage("measured", lambda: measured_loop(config, measure, repeated))
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

    def told(iteration: Iteration) -> str:
        error = rms(reference[: len(iteration.measured)] - iteration.measured)
        return f"{shown(config, error):.4g} {config.signal.unit}"

    repeated = config.repeated(config.controller, setup)
    return learn(learning, reference, staged(repeated.play, name, told, stage, progress), config.iterations)


def staged(play: Play, name: str, told: Callable[[Iteration], str], stage: Stage, progress: Progress) -> Play:
    """`play` with each iteration a stage of a rig's `name`; `told`: its error in words."""

    def staged_play(number: int, drive: np.ndarray, gain: float) -> Iteration:
        key = f"{name.replace(' ', '')}-{'again' if number < 0 else number}"
        iteration = Iteration(**stage(key, lambda: asdict(play(number, drive, gain))))
        progress(f"{name}, {'the record again' if number < 0 else f'iteration {number}'}: {told(iteration)} RMS")
        return iteration

    return staged_play
