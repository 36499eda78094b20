"""The report of a platform: the platform as it moves, modes, steps, transfers, where it can go."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.signals import output_signal
from ...control.platform_controller import LEGS
from ...loop.platform.loop import PlatformRun
from ...loop.platform.reach import check_poses, largest_flow, static_forces
from ...loop.platform.setup import PlatformSetup
from ...loop.platform.steps import SHOWN, UNITS, AxisStep
from ...report import Curve, Figure, FrequencyCurve, Page, Panel, Scene, Section, Table, bode, gains
from ...rigs.platform import AXES, Platform
from ..common.judged import gas_words
from ..common.metric_table import MetricView
from ..common.platform_motion import PlatformRecord
from ..common.platform_scene import platform_scene
from ..common.time_figure import signal_panel
from .platform_config import PlatformConfig

if TYPE_CHECKING:
    from .platform_study import PlatformFindings

OTHERS = 3  # steps, the first ones, that are played with other payloads
_FRAME = 0.02  # s
_WATCHED = 0.4  # s: of a step in the figures
_DRAWN = 0.3  # m at the joints: as large as steps are drawn, or nothing would be seen
_SLOWER = 10  # times


def platform_page(config: PlatformConfig, setup: PlatformSetup, findings: "PlatformFindings") -> tuple[Page, Figure]:
    """The report and its telling figure."""
    figures = [
        step_figure(step, config.rig, {spec.name: findings.runs[spec.name, step.name] for spec in config.controllers})
        for step in config.steps
    ]
    scenarios = [step.name for step in config.steps]
    rows = sorted(findings.rows, key=lambda row: scenarios.index(row["scenario"]))
    page = Page(
        f"Platform {config.rig.name}",
        _verdict(config, findings),
        [
            Section(
                "The platform",
                [_steps_scene(config, setup, findings), _modes_scene(config, findings), _modes(findings)],
            ),
            Section("Steps", [_rows_table(rows), _cross_table(rows), *figures]),
            Section("Transfer", [*_transfers(findings), _sines_table(findings), _coupling_figure(findings)]),
            *_other_sections(config, findings),
            Section(
                "Where it can go",
                [
                    _reach_table(findings),
                    *_outline_figures(findings),
                    _map_figure(config, findings),
                    _worst_table(config, findings),
                ],
            ),
            Section("Numbers", [_numbers(config)]),
        ],
    )
    return page, _coupling_figure(findings)


def _other_sections(config: PlatformConfig, findings: "PlatformFindings") -> list[Section]:
    """Other payloads and the record, where the experiment has them."""
    sections = []
    if findings.envelope:
        keys = ("variation", "controller", "stable", "ms", "settling_s", "tripped", "coupling_percent")
        steps = ", ".join(step.name for step in config.steps[:OTHERS])
        note = f"Laws, directions and guards as for the declared payload; settling: the largest of {steps}."
        table = MetricView().table("Other payloads", findings.envelope, keys, note, heads={"variation": "payload"})
        sections.append(Section("Other payloads", [table]))
    if findings.played and config.record:
        sections.append(Section("A record", _record_items(config, config.record, findings)))
    return sections


def _record_items(config: PlatformConfig, record: PlatformRecord, findings: "PlatformFindings") -> list[Figure | Table]:
    weights = config.rig.geometry.weights
    axis = int(np.argmax(np.abs(record.pose * weights).max(axis=0)))
    curves, errors, weight = [], [], weights[axis]
    for name, played in findings.played.items():
        for what, run in (("first", played.first), ("best", played.best)):
            error = (played.target[: len(run.pose)] - run.pose)[:, axis] * weight
            curves.append(Curve(f"{name}, {what}", run.t, 1e3 * error))
        errors.append([name, *(1e3 * error for error in played.errors)])
    target = record.pose[:, axis] * weight
    asked = Curve("reference", np.arange(len(target)) * config.rig.period, 1e3 * target)
    panels = (Panel(f"{AXES[axis]} asked [mm]", [asked]), Panel(f"{AXES[axis]}, error [mm]", curves))
    most = max(len(row) for row in errors)
    rows = [row + [None] * (most - len(row)) for row in errors]
    note = "RMS over all axes, angles times the radius of the joints; the poses asked for are corrected in all of them."
    table = Table("Error [mm]", ["controller", *(f"played {i + 1}" for i in range(most - 1))], rows, note)
    return [Figure(record.title, "t [s]", panels), table]


def _verdict(config: PlatformConfig, findings: "PlatformFindings") -> str:
    hz = [f"{mode.hz:.1f}" for mode in findings.modes]
    words = [f"Modes at {', '.join(hz[:-1])} and {hz[-1]} Hz."]
    for name, transfer in findings.transfers.items():
        settled = [row["settling_s"] for row in findings.rows if row["controller"] == name]
        steps = "not all steps settle" if None in settled else f"all steps settle within {max(settled):.3g} s"
        if not transfer.stable:
            words.append(f"{name}: unstable.")
            continue
        coupling = 100 * transfer.coupling("pitch", "surge")
        words.append(f"{name}: {steps}, surge moves pitch by {coupling:.2g} % at 5 Hz.")
    return " ".join(words)


def _modes(findings: "PlatformFindings") -> Table:
    rows = [[i + 1, mode.hz, mode.zeta, *mode.shape.round(3).tolist()] for i, mode in enumerate(findings.modes)]
    note = "Linearised at home under gravity; shapes with angles times the radius of the joints, the largest 1."
    return Table("Modes", ["mode", "Hz", "damping", *AXES], rows, note)


def _rows_table(rows: list[dict[str, Any]]) -> Table:
    keys = ("scenario", "controller", "settling_s", "overshoot_percent", "rise_s", "peak_command", "saturated_s")
    keys += ("cavitation_s", "f3db_hz", "ms", "peak_power_w", "tripped")
    note = (
        "Settling into 2 % of the step. Ms: largest singular value of the sensitivity at the commands, linear."
        f"{gas_words(rows)}"
    )
    return MetricView().table("Steps", rows, keys, note, ("settling_s",))


def _cross_table(rows: list[dict[str, Any]]) -> Table:
    lines = [[row["scenario"], row["controller"], *(row["cross"].get(axis) for axis in AXES)] for row in rows]
    note = "Largest deviation meanwhile, in percent of the step, angles times the radius of the joints."
    return Table("What the other axes do", ["scenario", "controller", *AXES], lines, note)


def step_figure(step: AxisStep, platform: Platform, runs: Mapping[str, PlatformRun]) -> Figure:
    """A step of several loops by name: its axis, the one that moves most beside it, the largest command."""
    own, others, commands = {}, [], []
    for name, run in runs.items():
        shown = run.t <= _WATCHED
        t, pose = run.t[shown], run.pose[shown]
        own[name] = t, pose[:, step.axis]
        beside = np.delete(pose * platform.geometry.weights, step.axis, axis=1)
        others.append(Curve(name, t, 1e3 * np.abs(beside).max(axis=1)))
        commands.append(Curve(name, t, np.abs(run.sent[shown]).max(axis=1)))
    further = Panel("other axes [mm]", others), Panel("largest command", commands)
    panels = (signal_panel(output_signal(AXES[step.axis]), own), *further)
    note = "Other axes: the largest deviation of any, angles times the radius of the joints."
    return Figure(step.name, "t [s]", panels, note=note)


def _transfers(findings: "PlatformFindings") -> list[Figure]:
    figures = []
    for name, transfer in findings.transfers.items():
        curves = [FrequencyCurve(axis, transfer.f, transfer.transfer[:, i, i]) for i, axis in enumerate(AXES)]
        figures.append(bode(f"{name}: each axis to itself", curves, "Linear, at home: pose over the pose asked for."))
    return figures


def _coupling_figure(findings: "PlatformFindings") -> Figure:
    curves, floor = [], 1e-5
    for name, transfer in findings.transfers.items():
        for of, into in (("surge", "pitch"), ("pitch", "surge")):
            gain = np.abs(transfer.transfer[:, AXES.index(into), AXES.index(of)])
            curves.append(FrequencyCurve(f"{name}: {of} into {into}", transfer.f, np.maximum(gain, floor)))
    note = "Amplitude over the one asked for, angles times the radius of the joints; -30 dB is 3 %."
    return gains("What one axis does to another", curves, note=note)


def _sines_table(findings: "PlatformFindings") -> Table:
    lines = []
    for name, sines in findings.sines.items():
        for sine in sines:
            cells = []
            for part in (100 * np.abs(sine.pose), 100 * np.abs(sine.acceleration)):
                cells += [float(part[sine.axis]), float(np.delete(part, sine.axis).max())]
            lines.append([name, AXES[sine.axis], sine.hz, *cells, 100 * sine.distortion])
    heads = ["controller", "axis", "Hz", "pose [%]", "largest other [%]", "acceleration [%]", "largest other [%] "]
    note = (
        "First harmonics over what was asked for, on the whole plant; distortion: harmonics 2 to 7 of the acceleration."
    )
    return Table("Stepped sines", [*heads, "distortion [%]"], lines, note)


def _reach_table(findings: "PlatformFindings") -> Table:
    rows = [
        [axis, low * SHOWN[i], high * SHOWN[i], UNITS[i]]
        for i, (axis, (low, high)) in enumerate(findings.reach.items())
    ]
    note = "Along one axis from home, within stroke, joint angles and the forces of the jacks at rest."
    return Table("Reach", ["axis", "back", "forth", "unit"], rows, note)


def _outline_figures(findings: "PlatformFindings") -> list[Figure]:
    """One for each unit: millimetres and degrees have no axes in common."""
    figures = []
    for unit in dict.fromkeys(UNITS):
        curves = [
            Curve(f"{second} over {first}", x * SHOWN[AXES.index(first)], y * SHOWN[AXES.index(second)])
            for (first, second), (x, y) in findings.outlines.items()
            if UNITS[AXES.index(first)] == unit
        ]
        note = "The border of what is allowed in the plane of two axes through home."
        panel = Panel(f"second axis [{unit}]", curves)
        figures.append(Figure(f"Workspace, {unit}", f"first axis [{unit}]", (panel,), note=note))
    return figures


def _map_figure(config: PlatformConfig, findings: "PlatformFindings") -> Figure:
    """Stroke, force, flow and condition along each axis alone, from one end of its reach to the other."""
    share = np.linspace(-1.0, 1.0, 61)
    panels: dict[str, list[Curve]] = {name: [] for name in ("stroke [%]", "force [kN]", "flow [l/min]", "condition")}
    for i, (axis, (low, high)) in enumerate(findings.reach.items()):
        pose = np.zeros((len(share), LEGS))
        pose[:, i] = np.where(share < 0, -share * low, share * high)
        check = check_poses(config.rig, pose)
        values = (
            100 * check.stroke.max(axis=-1),
            1e-3 * np.abs(static_forces(config.rig, pose)).max(axis=-1),
            6e4 * largest_flow(config.rig, pose, config.workspace.twist),
            check.condition,
        )
        for name, value in zip(panels, values, strict=True):
            panels[name].append(Curve(axis, 100 * share, value))
    note = (
        "Values of the leg that has most, at rest; flow at all the speeds of the experiment together, signs at worst."
    )
    drawn = [Panel(name, curves) for name, curves in panels.items()]
    return Figure("Along each axis", "share of the reach [%]", drawn, note=note)


def _worst_table(config: PlatformConfig, findings: "PlatformFindings") -> Table:
    rows = [[worst.name, worst.value, worst.unit, *(worst.pose * SHOWN).round(1).tolist()] for worst in findings.worst]
    heads = [f"{axis} [{unit}]" for axis, unit in zip(AXES, UNITS, strict=True)]
    limits = ", ".join(
        f"{axis} {size * shown:.4g} {unit}"
        for axis, size, shown, unit in zip(AXES, config.workspace.box, SHOWN, UNITS, strict=True)
    )
    note = f"The largest of the corners of a box of +-({limits}) and 2000 poses inside; flow at all speeds together."
    return Table("Worst poses", ["quantity", "value", "unit", *heads], rows, note)


def _numbers(config: PlatformConfig) -> Table:
    rows = [[number.name, number.shown, number.unit, number.source] for number in config.rig.numbers.values()]
    rows += [[n.name, n.shown, n.unit, n.source] for n in config.rig.legs[0].numbers.values()]
    rows.append(["jack", config.rig.legs[0].rig.name, "", config.rig.legs[0].rig.source])
    return Table("Payload, place, joints and the first leg", ["number", "value", "unit", "source"], rows)


def _steps_scene(config: PlatformConfig, setup: PlatformSetup, findings: "PlatformFindings") -> Scene:
    stride, takes = round(_FRAME / setup.platform.period), {}
    name = config.controllers[-1].name
    for step in config.steps:
        run = findings.runs[name, step.name]
        poses = run.pose[run.t <= _WATCHED + 1e-9][::stride]
        larger = _DRAWN / (abs(step.size) * config.rig.geometry.weights[step.axis])
        takes[step.name] = poses * larger
    note = f"Steps under {name}, drawn as {_DRAWN:g} m at the joints each, and {_SLOWER} times slower."
    return platform_scene("Steps", config.rig, takes, _SLOWER * _FRAME, note, 8)


def _modes_scene(config: PlatformConfig, findings: "PlatformFindings") -> Scene:
    swing = np.sin(np.linspace(0, 4 * np.pi, 81))
    takes = {}
    for i, mode in enumerate(findings.modes):
        shape = _DRAWN / 2 * mode.shape / config.rig.geometry.weights
        takes[f"{i + 1}: {mode.hz:.1f} Hz"] = swing[:, None] * shape
    return platform_scene("Modes", config.rig, takes, 0.04, "Shapes, much larger and slower than they are.", 10)
