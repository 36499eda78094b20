"""The paper's figures on a rig: static flow of pilot and main stage, and their frequency responses by stepped sine."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...base.gain_phase import gain_db, phase_deg
from ...base.units import from_si
from ...base.words import counted
from ...engine import Engine
from ...linear import equilibrium, valve_blocks
from ...linear.crossings import corner_frequency
from ...linear.frequency_response import SteppedSine, linear_response, scan
from ...plant import Plant, build_pilot_bench, build_valve_bench
from ...report import Curve, Figure, FrequencyCurve, Known, Page, Panel, Section, Table, bode
from ...rigs.rig import Rig
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from ..common.sines import packed, unpacked
from .options import PaperConfig

HIGHEST = 300.0  # Hz
_FITTED = "fitted to the published curves"  # how the source of such a number begins
_CONSISTENT = "that they agree is consistency, not validation."


@dataclass(frozen=True)
class Target:
    """A published number: of the paper's own model, and the maker's range."""

    id: str
    meaning: str
    unit: str
    paper: float
    maker: str


TARGETS = (
    Target("pilot_100_f3db", "pilot, 100 %: -3 dB", "Hz", 115, "110-130"),
    Target("pilot_100_f90", "pilot, 100 %: -90 deg", "Hz", 180, "230-250"),
    Target("pilot_25_f3db", "pilot, 25 %: -3 dB", "Hz", 220, "210-230"),
    Target("pilot_25_f90", "pilot, 25 %: -90 deg", "Hz", 210, "250-280"),
    Target("main_100_f3db", "main stage, 100 %: -3 dB", "Hz", 70, "70"),
    Target("main_100_f90", "main stage, 100 %: -90 deg", "Hz", 73, "85, with a resonance"),
    Target("pilot_flow", "pilot flow at rated current", "l/min", 20, "20"),
    Target("main_flow", "main flow at full command", "l/min", 600, "600"),
)


@dataclass(frozen=True)
class Sweep:
    """One Bode plot of the paper: which bench, how large a sine, and the frequency that its gain is referred to."""

    id: str
    title: str
    build: Callable[[Rig], Plant]
    share: float
    reference: float


SWEEPS = (
    Sweep("pilot_100", "Pilot, 100 % of rated current", build_pilot_bench, 1.0, 10.0),
    Sweep("pilot_25", "Pilot, 25 % of rated current", build_pilot_bench, 0.25, 10.0),
    Sweep("main_100", "Main stage, 100 % command", build_valve_bench, 1.0, 5.0),
)


def run_paper(config: PaperConfig, stage: Stage, progress: Progress) -> Outcome:
    """Every figure and number of the paper's section on results, on the configured rig."""
    rig = config.rig
    values: dict[str, float | None] = {}
    sines: dict[str, SteppedSine] = {}
    flows = {}
    for part, build in (("pilot", build_pilot_bench), ("main", build_valve_bench)):
        progress(f"{part} flow")
        flows[part] = _flow_curve(build(rig))
        values[f"{part}_flow"] = float(flows[part][1][-1])
    for sweep in SWEEPS:
        progress(f"{sweep.title}: stepped sine")
        stored = stage(sweep.id, lambda sweep=sweep: packed(_sweep(sweep, rig, config.points), "flow"))
        sines[sweep.id] = unpacked(stored, sweep.share, "flow")
        response = sines[sweep.id].response["flow"]
        values[f"{sweep.id}_f3db"] = corner_frequency(sines[sweep.id].f, gain_db(response), -3.0)
        values[f"{sweep.id}_f90"] = corner_frequency(sines[sweep.id].f, phase_deg(response), -90.0)
    rows = [_row(target, values[target.id]) for target in TARGETS]

    def draw() -> tuple[Page, Figure]:
        return _page(rig, rows, flows, sines), _bode(SWEEPS[-1], rig, sines[SWEEPS[-1].id])

    return Outcome({"rows": rows}, draw, _tables(flows, sines), subject=Subject(rig))


def _sweep(sweep: Sweep, rig: Rig, points: int) -> SteppedSine:
    """Response referred to its gain at the sweep's first frequency."""
    plant = sweep.build(rig)
    rest = equilibrium(plant, command=0.0, p=plant.without_dry_friction())
    full = plant.inputs[0].scale
    f = np.geomspace(sweep.reference, HIGHEST, points)
    limits = {"flapper": rig["xo"]}
    if "command" in plant.outputs:
        limits["current"] = rig["imax"] * rig["isat"]
    sine = scan(Engine(plant), rest.x, rest.u, f, sweep.share * full, "flow", limits)
    flow = sine.response["flow"]
    return replace(sine, response={"flow": flow / np.abs(flow[0])})


def _flow_curve(plant: Plant) -> tuple[np.ndarray, np.ndarray]:
    """Steady flow [l/min] over the input, as a part of full, from -1 to 1."""
    part = np.linspace(-1, 1, 41)
    flow = []
    for share in part:
        point = equilibrium(plant, command=share * plant.inputs[0].scale)
        flow.append(plant.observe(point.x, point.u)[0, plant.output("flow")])
    return part, from_si(np.array(flow), "l/min", "m^3/s")


def _row(target: Target, value: float | None) -> dict[str, Any]:
    error = None if value is None else 100 * (value / target.paper - 1)
    return {"id": target.id, "value": value, "unit": target.unit, "paper": target.paper, "error_percent": error}


def _tables(
    flows: dict[str, tuple[np.ndarray, np.ndarray]], sines: dict[str, SteppedSine]
) -> dict[str, dict[str, np.ndarray]]:
    tables = {f"{part}_flow": {"share_of_full": x, "flow_l_min": y} for part, (x, y) in flows.items()}
    for name, sine in sines.items():
        columns, response = packed(sine, "flow"), sine.response["flow"]
        tables[name] = {"f_hz": sine.f, "gain_db": gain_db(response), "phase_deg": phase_deg(response)}
        tables[name] |= {key: column for key, column in columns.items() if key not in ("real", "imag")}
    return tables


def _page(
    rig: Rig, rows: list[dict[str, Any]], flows: dict[str, tuple[np.ndarray, np.ndarray]], sines: dict[str, SteppedSine]
) -> Page:
    worst = max((abs(row["error_percent"]) for row in rows if row["error_percent"] is not None), default=None)
    difference = "" if worst is None else f"; the largest difference from the paper's model is {worst:.1f} %"
    verdict = f"Rig {rig.name}: {sum(r['value'] is not None for r in rows)} of 8 published figures found{difference}."
    fitted = [name for name, number in rig.numbers.items() if number.source.startswith(_FITTED)]
    if fitted:
        verdict += (
            f" {len(fitted)} of its numbers ({', '.join(fitted)}) were fitted to these same figures: {_CONSISTENT}"
        )
    comparison = Table(
        "The paper's eight numbers",
        ["quantity", "this rig", "unit", "paper's model", "difference [%]", "maker's curve"],
        [
            [t.meaning, r["value"], t.unit, t.paper, _percent(r["error_percent"]), t.maker]
            for t, r in zip(TARGETS, rows, strict=True)
        ],
        note="Gain referred to 10 Hz (pilot) and 5 Hz (main stage). Load ports at 35 bar, lands fed at 70 bar.",
    )
    return Page(
        f"The paper's figures on {rig.name}",
        verdict,
        [
            Section("Numbers", [comparison, rig.source]),
            Section(
                "Static flow",
                [
                    _flow_figure("Pilot flow", "current / rated current", flows["pilot"], 20.0),
                    _flow_figure("Main-stage flow", "command", flows["main"], 600.0),
                ],
            ),
            Section("Frequency response", [_bode(sweep, rig, sines[sweep.id]) for sweep in SWEEPS]),
        ],
    )


def _percent(error: float | None) -> Known | None:
    """An error as the paper prints its figures: two or three digits."""
    return None if error is None else Known(error, 0.1)


def _flow_figure(title: str, x_label: str, curve: tuple[np.ndarray, np.ndarray], rated: float) -> Figure:
    published = Curve("paper, rated", np.array([-1.0, 1.0]), np.array([-rated, rated]), "markers")
    return Figure(title, f"{x_label} [1]", [Panel("flow [l/min]", [Curve("model", *curve), published])])


def _bode(sweep: Sweep, rig: Rig, sine: SteppedSine) -> Figure:
    """The nonlinear response, the paper's block diagram, and the published corners as points."""
    model = FrequencyCurve("model, stepped sine", sine.f, sine.response["flow"], "points")
    blocks = valve_blocks(rig)
    linear = linear_response(blocks.pilot if sweep.id.startswith("pilot") else blocks.valve, sine.f)
    diagram = FrequencyCurve("block diagram, linear", sine.f, linear / np.abs(linear[0]), "dash")
    plain = bode(sweep.title, [model, diagram], note=_flags(sine))
    published = {target.id: target.paper for target in TARGETS}
    corners = (("f3db", -3.0), ("f90", -90.0))
    panels = [
        Panel(
            panel.y_label,
            [
                *panel.curves,
                Curve("paper's model", np.array([published[f"{sweep.id}_{key}"]]), np.array([level]), "markers"),
            ],
            panel.log_y,
            panel.y_range,
            panel.marks,
            panel.y_step,
        )
        for panel, (key, level) in zip(plain.panels, corners, strict=True)
    ]
    return Figure(plain.title, plain.x_label, panels, plain.log_x, plain.note, plain.height)


def _flags(sine: SteppedSine) -> str:
    notes = []
    if sine.saturated.any():
        notes.append(f"The flapper meets a nozzle or the current its limit from {sine.f[sine.saturated].min():.0f} Hz")
    if sine.cavitated.any():
        notes.append(f"gas comes out of the oil in a chamber from {sine.f[sine.cavitated].min():.0f} Hz")
    if not sine.settled.all():
        notes.append(f"{counted(int((~sine.settled).sum()), 'point')} did not settle in 60 cycles")
    return ("; ".join(notes) + ".") if notes else "No saturation, no cavitation; every point settled."
