"""Learning on drawn plants, by the filter of the rigs: each plant has its own iterations, side by side."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ...loop.learning import STOPS, LearningFilter, learn_lanes
from ...loop.repeated_record import RepeatedLanes
from ...loop.robustness.drawn_plants import PlantDraw
from ...plant import build
from ...report import Curve, Figure, Panel, Section, Table
from ..common.judged import played_words
from ..common.outcome import Progress, Stage
from ..common.plant_ranges import ranges_table
from .options import LearnConfig

FALL = 20.0  # dB: what learning aims at


@dataclass(frozen=True, eq=False)
class DrawnLearning:
    """The drawn plants, and what was learned on each: columns [plants] by name.

    `fall_db` of the measured error, 0 where the record itself `trips`; `taken_back`: whether an iteration made the
    error larger, or tripped; `stopped`: a place in STOPS; `error` and `floor`, RMS of the record's error and of what
    does not repeat (SI).
    """

    draw: PlantDraw
    lanes: Mapping[str, np.ndarray]


def learned_on_drawn(
    config: LearnConfig, learning: LearningFilter, stage: Stage, progress: Progress
) -> DrawnLearning | None:
    """What is learned on the drawn plants, some hundreds a stage; None without them."""
    record, parts = config, []
    if record.drawn is None:
        return None
    for number, lanes in enumerate(record.lanes(config.controller, record.drawn), 1):
        parts.append(stage(f"drawn plants {number}", partial(_columns, config, learning, lanes)))
        progress(f"drawn plants, part {number}: the error falls by {np.median(parts[-1]['fall_db']):.3g} dB, median")
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return DrawnLearning(record.drawn.draw(build(record.rig)), columns)


def _columns(config: LearnConfig, learning: LearningFilter, lanes: RepeatedLanes) -> dict[str, np.ndarray]:
    learned = learn_lanes(learning, config.reference, lanes.play, len(lanes.p), config.iterations)
    return {
        "fall_db": learned.fall_db,
        "error": learned.errors[:, 0],
        "floor": learned.floor,
        "stopped": learned.stopped,
        "taken_back": learned.taken_back,
        "trips": learned.tripped[:, 0],
    }


def falls_row(controller: str, falls: np.ndarray) -> dict[str, Any]:
    """Counts of plants whose error falls by `falls` [plants] dB, its median and the least."""
    return {
        "controller": controller,
        "plants": len(falls),
        "fallen": int((falls >= FALL).sum()),
        "fall_p50_db": float(np.quantile(falls, 0.5, method="lower")),
        "fall_least_db": float(falls.min()),
    }


def drawn_row(config: LearnConfig, drawn: DrawnLearning) -> dict[str, Any]:
    """Counts of plants, the fall of the error [dB] on the median, 99 % and all of them, and the plant of the least."""
    lanes, fall = drawn.lanes, drawn.lanes["fall_db"]
    return {
        **falls_row(config.controller.name, fall),
        "fall_p99_db": float(np.quantile(fall, 0.01, method="lower")),
        "taken_back": int(lanes["taken_back"].sum()),
        "trips": int(lanes["trips"].sum()),
        "stopped": {why or "iterations": int((lanes["stopped"] == place).sum()) for place, why in enumerate(STOPS)},
        "least": drawn.draw.plant(int(np.argmin(fall)), config.rig),
    }


def drawn_sections(config: LearnConfig, drawn: DrawnLearning) -> list[Section]:
    """What the report shows of them."""
    row, fall = drawn_row(config, drawn), drawn.lanes["fall_db"]
    heads = {
        "controller": "controller",
        "plants": "plants",
        "fallen": f"fallen by {FALL:g} dB",
        "fall_p50_db": "fall, median [dB]",
        "fall_p99_db": "on 99 %, at least [dB]",
        "fall_least_db": "least [dB]",
        "taken_back": "an iteration taken back",
        "trips": "record trips",
    }
    note = f"Counts of plants; {config.iterations} iterations at most, by the same filter on all of them. "
    table = Table("Learning", list(heads.values()), [[row[key] for key in heads]],
                  note + played_words(config.conditions, config.rig))  # fmt: skip
    share = 100 * np.arange(len(fall), 0, -1) / len(fall)
    panel = Panel("plants [%]", [Curve(config.controller.name, np.sort(fall), share)])
    figure = Figure("Share of the plants whose error falls by as much", "fall of the RMS error [dB]", [panel])
    least = Table("The plant of the least fall", list(row["least"]), [list(row["least"].values())])
    stopped = Table("Stopped because", ["reason", "plants"], [list(item) for item in row["stopped"].items()])
    return [Section("Drawn plants", [table, figure, least, stopped, ranges_table(drawn.draw.columns(config.rig))])]
