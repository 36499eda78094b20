"""Inverses on drawn plants: the record as it is and filtered, plant by plant."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ...base.numbers import quantile
from ...base.units import from_si
from ...control.controller_spec import ControllerSpec
from ...loop.designed_inverse import ReferenceInverse
from ...loop.repeated_record import RepeatedLanes
from ...loop.robustness.drawn_plants import PlantDraw
from ...plant import build
from ...report import Curve, Figure, Panel, Section, Table
from ..common.judged import played_words
from ..common.outcome import Progress, Stage
from ..common.plant_ranges import ranges_table
from .options import InverseConfig

SHARES = {"p50": 0.5, "p99": 0.99, "worst": 1.0}


@dataclass(frozen=True, eq=False)
class DrawnErrors:
    """The drawn plants, and RMS of their true errors [plants], SI, as it is and with the inverse; infinite where the
    guard trips."""

    draw: PlantDraw
    as_it_is: np.ndarray
    inverse: np.ndarray

    @property
    def factor(self) -> np.ndarray:
        """By what the inverse divides the error [plants]; 0 where it trips."""
        return np.where(np.isinf(self.inverse), 0.0, self.as_it_is / self.inverse)


def drawn_errors(
    config: InverseConfig, spec: ControllerSpec, inverse: ReferenceInverse, stage: Stage, progress: Progress
) -> DrawnErrors | None:
    """The errors of a controller, some hundred plants a stage; None without drawn plants."""
    record, parts = config, []
    if record.drawn is None:
        return None
    for number, lanes in enumerate(record.lanes(spec, record.drawn), 1):
        parts.append(stage(f"{spec.name} drawn plants {number}", partial(_errors, record.reference, inverse, lanes)))
        progress(f"{spec.name}, drawn plants, part {number}")
    as_it_is, filtered = (np.concatenate([part[how] for part in parts]) for how in ("as it is", "inverse"))
    return DrawnErrors(record.drawn.draw(build(record.rig)), as_it_is, filtered)


def _errors(reference: np.ndarray, inverse: ReferenceInverse, lanes: RepeatedLanes) -> dict[str, np.ndarray]:
    """With the same noise."""
    errors, every = {}, np.arange(len(lanes.p))
    for how, drive in {"as it is": reference, "inverse": inverse.filtered(reference)}.items():
        played = lanes.play(0, drive, every)
        error = np.sqrt(np.mean((reference - played.true) ** 2, axis=1))
        errors[how] = np.where(played.tripped, np.inf, error)
    return errors


def drawn_rows(config: InverseConfig, drawn: Mapping[str, DrawnErrors]) -> list[dict[str, Any]]:
    """A row a controller: errors [SI] on the median, 99 % and all plants, None where one of those trips; by what the
    inverse divides them; on how many plants it makes them larger; and the plant of the least factor."""
    rows = []
    for name, errors in drawn.items():
        both = {"error_rms": errors.as_it_is, "error_rms_inverse": errors.inverse}
        least = int(np.argmin(errors.factor))
        rows.append({
            "controller": name,
            "plants": len(errors.factor),
            **{f"{key}_{q}": quantile(values, share) for key, values in both.items() for q, share in SHARES.items()},
            "factor_p50": float(np.median(errors.factor)),
            "factor_least": float(errors.factor[least]),
            "larger": int((errors.inverse > errors.as_it_is).sum()),
            "tripped": int(np.isinf(errors.as_it_is).sum()),
            "tripped_inverse": int(np.isinf(errors.inverse).sum()),
            "least": errors.draw.plant(least, config.rig),
        })  # fmt: skip
    return rows


def drawn_section(config: InverseConfig, drawn: Mapping[str, DrawnErrors]) -> Section:
    """What the report shows of them."""
    record, rows = config, drawn_rows(config, drawn)
    least = Table("The plant on which the inverse brings least", ["controller", *rows[0]["least"]],
                  [[row["controller"], *row["least"].values()] for row in rows])  # fmt: skip
    ranges = ranges_table(next(iter(drawn.values())).draw.columns(record.rig))
    return Section("Drawn plants", [_table(config, rows), _figure(config, drawn), least, ranges])


def _table(config: InverseConfig, rows: list[dict[str, Any]]) -> Table:
    signal = config.signal
    errors = [f"{key}_{q}" for key in ("error_rms", "error_rms_inverse") for q in SHARES]
    heads = [
        "controller", "plants", *(f"{how}{share} [{signal.unit}]" for how in ("", "with the inverse, ")
        for share in ("median", "99 %", "worst")), "factor, median [1]", "least factor [1]", "error larger", "tripped",
        "tripped with it",
    ]  # fmt: skip
    cells = [
        [
            *(row["controller"], row["plants"]),
            *(None if row[key] is None else float(from_si(row[key], signal.unit, signal.si)) for key in errors),
            *(row[key] for key in ("factor_p50", "factor_least", "larger", "tripped", "tripped_inverse")),
        ]
        for row in rows
    ]
    judged = played_words(config.conditions, config.rig)
    note = f"RMS of the true error; a dash where the guard trips. {judged}"
    return Table(f"Error of {config.scenario.name}", heads, cells, note)


def _figure(config: InverseConfig, drawn: Mapping[str, DrawnErrors]) -> Figure:
    """How the errors are distributed."""
    signal, curves = config.signal, []
    for name, errors in drawn.items():
        for how, values in {name: errors.as_it_is, f"{name}, inverse": errors.inverse}.items():
            values = np.sort(from_si(values[np.isfinite(values)], signal.unit, signal.si))
            curves.append(Curve(how, values, 100 * np.arange(1, len(values) + 1) / len(errors.factor)))
    return Figure(
        "Share of the plants whose error is no larger",
        f"RMS error [{signal.unit}]",
        [Panel("plants [%]", curves)],
        log_x=True,
    )
