"""The corrector that a paper holds responsible for its maker's resonance: what each kind in the spool loop can do."""

from dataclasses import replace
from typing import Any

import numpy as np

from ...base.gain_phase import gain_db, phase_deg
from ...identify.datasheet.corrector import REFERENCE, Corrected, Maker, SpoolLoop
from ...linear.frequency_response import SteppedSine
from ...report import Curve, Figure, FrequencyCurve, Page, Section, Table, bode
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from ..common.sines import packed, unpacked
from .options import CorrectorConfig

TITLES = {"paper_p": "P, the paper's model", "p_lead": "P + lead", "pi_lead": "PI + lead"}
FORMULAS = {"p_lead": "lead", "pi_lead": "pi-lead"}
QUARTER = 0.25  # of full command: a second look, at which nothing was fitted


def run_corrector(config: CorrectorConfig, stage: Stage, progress: Progress) -> Outcome:
    """Fit each corrector to the maker's corners and peak, and show all beside the rig as it is."""
    loops = {"paper_p": SpoolLoop(config.rig, None)}
    free = config.rig.with_values(isat=config.current_limit)
    loops |= {key: SpoolLoop(free, formula) for key, formula in FORMULAS.items()}
    numbers: dict[str, dict[str, float]] = {"paper_p": {}}
    for key in FORMULAS:
        progress(f"{TITLES[key]}: fit to the maker's curve")
        numbers[key] = stage(key, lambda key=key: loops[key].fitted(config.maker, config.least_damping))
    full, quarter = {}, {}
    for key, loop in loops.items():
        progress(f"{TITLES[key]}: stepped sine")
        full[key] = _stored(stage, f"{key}_full", loop, numbers[key], config.points, 1.0)
        quarter[key] = _stored(stage, f"{key}_quarter", loop, numbers[key], config.points, QUARTER)
    rows = [_maker(config.maker), *(_row(key, corrected) for key, corrected in full.items())]
    metrics = {
        "rows": rows,
        "quarter": [_row(key, corrected) for key, corrected in quarter.items()],
        "correctors": {key: numbers[key] for key in FORMULAS},
        "current_limit": config.current_limit,
        "least_damping": config.least_damping,
        "refused": [key for key, corrected in full.items() if corrected.null_zeta < config.least_damping],
    }

    def draw() -> tuple[Page, Figure]:
        picture = _bode("Main stage at full command", full, config.maker)
        return _page(config, full, quarter, picture), picture

    return Outcome(metrics, draw, _tables(full, quarter), subject=Subject(config.rig))


def _stored(
    stage: Stage, name: str, loop: SpoolLoop, numbers: dict[str, float], points: int, share: float
) -> Corrected:
    def compute() -> dict[str, Any]:
        corrected = loop.shown(numbers, points, share)
        return {
            "sine": packed(corrected.sine, "flow"),
            "f3db": corrected.f3db,
            "f90": corrected.f90,
            "peak": corrected.peak,
            "null_zeta": corrected.null_zeta,
        }

    d = stage(name, compute)
    return Corrected(numbers, unpacked(d["sine"], share, "flow"), d["f3db"], d["f90"], d["peak"], d["null_zeta"])


def _maker(maker: Maker) -> dict[str, Any]:
    """The peak is the middle of the range that is asked for; how the maker's valve is damped, nobody says."""
    peak = float(np.mean(maker.peak))
    return {"id": "maker", "f3db": maker.f3db, "f90": maker.f90, "peak_db": peak, "null_zeta": None}


def _row(key: str, corrected: Corrected) -> dict[str, Any]:
    return {
        "id": key,
        "f3db": corrected.f3db,
        "f90": corrected.f90,
        "peak_db": corrected.peak,
        "null_zeta": corrected.null_zeta,
    }


def _percent(value: float | None, maker: float) -> float | None:
    return None if value is None else 100 * (value / maker - 1)


def _verdict(config: CorrectorConfig, full: dict[str, Corrected]) -> str:
    maker, before, after = config.maker, full["paper_p"], full["pi_lead"]
    errors = [_percent(corrected.f90, maker.f90) for corrected in (before, after)]
    if None in errors or after.f3db is None:
        return "The paper's model or PI + lead has no corner up to 300 Hz; see the plots."
    low, high = maker.peak
    peaks = low <= full["p_lead"].peak <= high, low <= after.peak <= high
    return (
        f"A PI + lead corrector {'gives' if peaks[1] else 'does not give'} the maker's peak: "
        f"{after.f3db:.1f} Hz, {after.f90:.1f} Hz and {after.peak:+.1f} dB, damped by {after.null_zeta:.2f} at null. "
        f"The error of the phase corner goes from {errors[0]:+.1f} % to {errors[1]:+.1f} %. "
        + ("" if peaks[0] else f"P + lead does not give it: {full['p_lead'].peak:+.2f} dB at best beside both corners.")
    )


def _page(config: CorrectorConfig, full: dict[str, Corrected], quarter: dict[str, Corrected], picture: Figure) -> Page:
    maker = config.maker
    columns = [
        "spool loop",
        "-3 dB [Hz]",
        "error [%]",
        "-90 deg [Hz]",
        "error [%] ",
        "peak [dB]",
        "damping at null [1]",
    ]
    asked = [["maker's curve", maker.f3db, None, maker.f90, None, f"{maker.peak[0]:g} to {maker.peak[1]:g}", None]]

    def rows(shown: dict[str, Corrected]) -> list[list[Any]]:
        return [
            [TITLES[k], c.f3db, _percent(c.f3db, maker.f3db), c.f90, _percent(c.f90, maker.f90), c.peak, c.null_zeta]
            for k, c in shown.items()
        ]

    note = (
        f"Gain referred to {REFERENCE:g} Hz; damping: the least of the modes below 1 kHz, linearised at null. A loop "
        f"below {config.least_damping:g} is refused: its spool hunts. The correctors may drive "
        f"{config.current_limit:g} times the rated current; the paper gives no figure for the peak."
    )
    numbers = [[TITLES[key], name, value] for key in FORMULAS for name, value in full[key].numbers.items()]
    return Page(
        f"The corrector in the spool loop of {config.rig.name}",
        _verdict(config, full),
        [
            Section("At full command", [Table("Corners, peak, damping", columns, asked + rows(full), note), picture]),
            Section(
                "At a quarter of it",
                [
                    Table("Nothing was fitted here", columns, rows(quarter)),
                    _bode("Main stage at a quarter of the command", quarter, None),
                ],
            ),
            Section("The correctors", [Table("Their numbers", ["spool loop", "number", "value (SI)"], numbers)]),
        ],
    )


def _bode(title: str, loops: dict[str, Corrected], maker: Maker | None) -> Figure:
    curves = [
        FrequencyCurve(TITLES[k], corrected.sine.f, _referred(corrected.sine), "points")
        for k, corrected in loops.items()
    ]
    limited = [f"{TITLES[k]} from {c.sine.f[c.sine.saturated].min():.0f} Hz" for k, c in loops.items() if
               c.sine.saturated.any()]  # fmt: skip
    note = f"The current meets its limit: {'; '.join(limited)}." if limited else "The current meets no limit."
    figure = bode(title, curves, note)
    if maker is None:
        return figure
    points = ((maker.f3db, -3.0), (maker.f90, -90.0))
    panels = [
        replace(panel, curves=[*panel.curves, Curve("maker", np.array([f]), np.array([level]), "markers")])
        for panel, (f, level) in zip(figure.panels, points, strict=True)
    ]
    return replace(figure, panels=panels)


def _referred(sine: SteppedSine) -> np.ndarray:
    return sine.response["flow"] / np.abs(sine.response["flow"][0])


def _tables(*shares: dict[str, Corrected]) -> dict[str, dict[str, np.ndarray]]:
    tables = {}
    for share, loops in zip(("full", "quarter"), shares, strict=True):
        for key, corrected in loops.items():
            flow = _referred(corrected.sine)
            columns = {"f_hz": corrected.sine.f, "gain_db": gain_db(flow), "phase_deg": phase_deg(flow)}
            tables[f"{key}_{share}"] = columns | {
                "saturated": corrected.sine.saturated,
                "settled": corrected.sine.settled,
            }
    return tables
