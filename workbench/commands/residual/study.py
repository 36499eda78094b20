"""The residual of a campaign: what a rig's model leaves unexplained of the held-out records."""

from dataclasses import replace
from typing import Any

import numpy as np

from ...base.signals import SIGNALS
from ...base.units import from_si
from ...identify.data.noise_floor import NoiseFloor
from ...identify.data.scored_floor import scored_floor
from ...identify.data.whiteness import Whiteness, whiteness
from ...identify.fit.checked_columns import check_columns
from ...identify.fit.predict import Prediction, predict_free, predict_whole, predict_windows
from ...identify.fit.session_numbers import session_plants
from ...identify.fit.windows import WINDOW, compared
from ...records import Campaign, Record
from ...records.campaign import FREE_RUN
from ...report import Curve, Figure, Page, Panel, Section, Table
from ...report.table import Cell
from ...rigs.rig import Rig
from ..common.design_numbers import Subject
from ..common.error_page import GIVEN, SCORED, beside_floor
from ..common.outcome import Outcome, Progress, Stage
from .free_run import free_run_rows, free_run_section, free_run_sentence, free_runs

_SHOWN = 1.0  # s, of the telling figure
_MENDED = "What was mended, and what failed"


def run_residual(campaign: Campaign, rig: Rig, stage: Stage, progress: Progress, free_run: bool = False) -> Outcome:
    """Predict every held-out record and compare, signal by signal; `free_run` adds one run through each record.

    Held-out records that repeat a command are held against one free run by their mean.
    """
    floor = scored_floor(campaign, rig)
    plants = session_plants(campaign, rig)
    for record in campaign.heldout:
        compared(plants[record.name], record, floor)  # a refusal comes before any progress line
    check_columns(campaign, rig, floor)
    predictions, whole = [], campaign.score == FREE_RUN
    for record in campaign.heldout:
        progress(f"{record.name}: " + ("one free run" if whole else f"windows of {WINDOW:g} s"))

        def compute(record: Record = record) -> dict[str, Any]:
            prediction = (predict_whole if whole else predict_windows)(plants[record.name], record, floor)
            return {"signals": prediction.signals, "failed": list(prediction.failed)}

        stored = stage(f"predict-{record.name.replace('/', '-')}", compute)
        predictions.append(Prediction(record, stored["signals"], tuple(stored["failed"])))
    rows = [row for prediction in predictions for row in _rows(prediction, floor)]
    if free_run:
        free = [predict_free(plants[record.name], record, floor) for record in campaign.heldout]
        for row, other in zip(rows, (row for prediction in free for row in _rows(prediction, floor)), strict=True):
            row["free_run_rms"] = other["rms"]
    runs = free_runs(plants, campaign.heldout, floor) if free_run else []
    metrics: dict[str, Any] = {"rows": rows, "chi2": chi2(predictions, floor)}
    if free_run:
        metrics["free_run"] = free_run_rows(runs)
    tables = {f"residual-{p.record.name.replace('/', '-')}": _table(p) for p in predictions}

    def draw() -> tuple[Page, Figure]:
        page = _page(campaign, rig, floor, predictions, metrics, [free_run_section(runs)] if runs else [])
        said = f"{page.verdict} {free_run_sentence(runs)}" if runs else page.verdict
        return replace(page, verdict=said), _telling(predictions, rows)

    return Outcome(metrics, draw, tables, subject=Subject(rig))


def chi2(predictions: list[Prediction], floor: NoiseFloor) -> float | None:
    """Mean over signals and samples of (error / sigma)^2; 1 is the noise floor. None where a window failed."""
    if any(prediction.failed for prediction in predictions):
        return None
    squares = [(p.error(name) / floor.sigma[name]) ** 2 for p in predictions for name in p.signals]
    return float(np.nanmean(np.concatenate(squares)))


def _rows(prediction: Prediction, floor: NoiseFloor) -> list[dict[str, Any]]:
    """One row a signal of one record, in the units that people read."""
    rows = []
    for name in prediction.signals:
        signal = SIGNALS[name]
        error = prediction.error(name)
        rms = float(np.sqrt(np.nanmean(error**2))) if np.isfinite(error).any() else None
        unit_rms = None if rms is None else float(from_si(rms, signal.unit, signal.si))
        sigma = float(from_si(floor.sigma[name], signal.unit, signal.si))
        ratio = None if unit_rms is None else unit_rms / sigma
        row = {"record": prediction.record.name, "signal": name, "unit": signal.unit}
        rows.append(row | {"rms": unit_rms, "floor": sigma, "ratio": ratio})
    return rows


def _table(prediction: Prediction) -> dict[str, np.ndarray]:
    """Measured, model and error by column, in the units that people read."""
    columns = {"t [s]": prediction.record.t, "command [1]": prediction.record.signals["command"]}
    for name, values in prediction.signals.items():
        label, unit, si = SIGNALS[name].label, SIGNALS[name].unit, SIGNALS[name].si
        columns[f"measured {label}"] = from_si(prediction.record.signals[name], unit, si)
        columns[f"model {label}"] = from_si(values, unit, si)
        columns[f"error {label}"] = from_si(prediction.error(name), unit, si)
    return columns


def _page(
    campaign: Campaign,
    rig: Rig,
    floor: NoiseFloor,
    predictions: list[Prediction],
    metrics: dict[str, Any],
    more: list[Section],
) -> Page:
    rows = metrics["rows"]
    free = "free_run_rms" in rows[0]
    summary = Table(
        "Error by record and signal",
        ["record", "signal", "unit", "RMS error", "noise floor", "error / floor", *(["free-run RMS"] * free)],
        [_summary_row(row) for row in rows],
        note=SCORED[campaign.score == FREE_RUN],
    )
    sections = [Section("Error", [summary, noise_table(floor)]), *more]
    sections += [Section(p.record.name, [_figure(p, name) for name in p.signals]) for p in predictions]
    sections.append(Section("Is it noise?", _whiteness_figures(floor, predictions)))
    notes = [f"{r.name}: {note}" for r in campaign.records for note in r.notes]
    part = "run" if campaign.score == FREE_RUN else "window"
    failed = [f"{p.record.name}: the model failed in the {part} from {t:g} s" for p in predictions for t in p.failed]
    if notes or failed:
        sections.append(Section(_MENDED, [*failed, *notes]))
    if rig.recordings:
        sections.append(Section("Recordings", [rig.recordings]))
    return Page(f"Residual of {campaign.path.resolve().name} on {rig.name}", _verdict(rig, metrics), sections)


def _summary_row(row: dict[str, Any]) -> list[Cell]:
    floor = row["floor"]
    errors = [beside_floor(row[key], floor) for key in ("rms", "floor")]
    free = [beside_floor(row["free_run_rms"], floor)] if "free_run_rms" in row else []
    return [row["record"], row["signal"], row["unit"], *errors, row["ratio"], *free]


def noise_table(floor: NoiseFloor) -> Table:
    """The noise floor of every signal, and where it is from."""
    rows = []
    for name, sigma in floor.sigma.items():
        signal = SIGNALS[name]
        shown = float(from_si(sigma, signal.unit, signal.si))
        rows.append([name, signal.unit, beside_floor(shown, shown), floor.kappa[name], floor.source[name]])
    return Table("Noise floor", ["signal", "unit", "sigma", "autocorrelation factor", "from"], rows)


def _whiteness_figures(floor: NoiseFloor, predictions: list[Prediction]) -> list[Figure]:
    """Spectrum and autocorrelation of each signal's residual, pooled over the held-out records."""
    figures = []
    for name, sigma in floor.sigma.items():
        carriers = [p for p in predictions if name in p.signals]
        errors = [p.error(name) for p in carriers]
        if not errors or not all(np.isfinite(e).any() for e in errors):
            continue
        period = carriers[0].record.period
        residual = whiteness(errors, period, floor.kappa[name])
        signal = SIGNALS[name]
        to_unit = float(from_si(1.0, signal.unit, signal.si) - from_si(0.0, signal.unit, signal.si))
        figures += [_spectrum(name, residual, to_unit, sigma * np.sqrt(2 * period)), _autocorrelation(name, residual)]
    return figures


def _spectrum(name: str, residual: Whiteness, to_unit: float, level: float) -> Figure:
    shown = slice(1, None)
    return Figure(
        f"{name}: spectrum of the residual",
        "frequency [Hz]",
        [
            Panel(
                f"{name} [{SIGNALS[name].unit}/sqrt(Hz)]",
                [
                    Curve("residual", residual.f[shown], np.sqrt(residual.density[shown]) * to_unit),
                    Curve("white noise of the floor", residual.f[[1, -1]], np.full(2, level * to_unit), "dash"),
                ],
                log_y=True,
            )
        ],
        log_x=True,
    )


def _autocorrelation(name: str, residual: Whiteness) -> Figure:
    band = (np.full(len(residual.lag), -residual.band), np.full(len(residual.lag), residual.band))
    curve = Curve("residual", residual.lag[1:], residual.autocorrelation[1:])
    noise = Curve("95 % band of the noise", residual.lag, np.zeros(len(residual.lag)), "dot", band=band)
    return Figure(f"{name}: autocorrelation of the residual", "lag [s]", [Panel("autocorrelation [1]", [curve, noise])])


def _verdict(rig: Rig, metrics: dict[str, Any]) -> str:
    if metrics["chi2"] is None:
        return f'The model of {rig.name} fails in parts of the held-out records; see "{_MENDED}".'
    worst = max((r for r in metrics["rows"] if r["ratio"] is not None), key=lambda r: r["ratio"])
    return (
        f"chi2 = {metrics['chi2']:.3g} (1 is the noise floor): the model of {rig.name} leaves {worst['rms']:.3g} "
        f"{worst['unit']} RMS in {worst['signal']} of {worst['record']}, {worst['ratio']:.3g} times the noise."
    )


def _telling(predictions: list[Prediction], rows: list[dict[str, Any]]) -> Figure:
    """The signal that the verdict is about, in the second in which its error is largest."""
    worst = max(rows, key=lambda row: -1.0 if row["ratio"] is None else row["ratio"])
    prediction = next(each for each in predictions if each.record.name == worst["record"])
    record, squares = prediction.record, np.nan_to_num(prediction.error(worst["signal"])) ** 2
    samples = min(round(_SHOWN / record.period), len(squares))
    first = int(np.argmax(np.convolve(squares, np.ones(samples), "valid")))
    shown = float(record.t[first]), float(record.t[first + samples - 1])
    note = f"The second with the largest error, of {record.t[-1]:.3g} s; a double click shows all of it."
    return replace(_figure(prediction, worst["signal"]), x_range=shown, note=note)


def _figure(prediction: Prediction, name: str) -> Figure:
    signal, t = SIGNALS[name], prediction.record.t

    def shown(values: np.ndarray) -> np.ndarray:
        return from_si(values, signal.unit, signal.si)

    command = Curve("command", t, prediction.record.signals["command"], color=GIVEN)
    measured = Curve("measured", t, shown(prediction.record.signals[name]))
    model = Curve("model", t, shown(prediction.signals[name]))
    residual = Curve("residual", t, shown(prediction.error(name)))
    return Figure(
        f"{prediction.record.name}: {name}",
        "time [s]",
        [
            Panel("command [1]", [command]),
            Panel(signal.label, [measured, model]),
            Panel(f"measured - model [{signal.unit}]", [residual]),
        ],
    )
