"""A platform: modes, steps along its axes with what the others do, 6 x 6 transfers, where it can go."""

from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np

from ...control.platform_controller import LEGS, PlatformController, PlatformSpec
from ...linear.platform_modes import PlatformMode, platform_modes
from ...loop.platform.loop import PlatformRun
from ...loop.platform.reach import PLANES, WorstPose, outline, reach, worst_poses
from ...loop.platform.record import PlayedRecord, check_motion, play
from ...loop.platform.rows import PlatformSine, judge_platform, judge_variations, platform_sine
from ...loop.platform.setup import PlatformSetup, platform_setup
from ...loop.platform.transfer import JUDGED, PlatformTransfer
from ...rigs.platform import AXES
from ..common.outcome import Outcome, Progress, Stage
from .platform_config import PlatformConfig
from .platform_page import OTHERS, platform_page


@dataclass(frozen=True)
class PlatformFindings:
    """What was computed: modes, rows of metrics.json, runs by controller and scenario, transfers and sines by
    controller, the reach along each axis, outlines by plane, worst poses, other payloads, the record by controller."""

    modes: list[PlatformMode]
    rows: list[dict[str, Any]]
    runs: dict[tuple[str, str], PlatformRun]
    transfers: dict[str, PlatformTransfer]
    sines: dict[str, list[PlatformSine]]
    reach: dict[str, tuple[float, float]]
    outlines: dict[tuple[str, str], tuple[np.ndarray, np.ndarray]]
    worst: list[WorstPose]
    envelope: list[dict[str, Any]]
    played: dict[str, PlayedRecord]


def run_platform_study(config: PlatformConfig, stage: Stage, progress: Progress) -> Outcome:
    """Every controller in every step on the configured platform."""
    progress("build, equilibrium, modes")
    setup = platform_setup(config.rig, config.delay)
    if config.record:
        check_motion(setup, config.record.pose)
    plant, began = setup.engine.plant, process_time()
    modes = platform_modes(setup.platform, plant, setup.smooth, setup.p_smooth)
    rows, runs, transfers, sines = [], {}, {}, {}
    for spec in config.controllers:
        progress(f"{spec.name}: transfer, steps and sines")
        controller = spec.build(setup.platform.period, setup.directions)
        judged = judge_platform(setup, spec, config.steps, config.f, config.conditions.noise)
        transfers[spec.name] = judged.transfer
        runs |= {(spec.name, step): run for step, run in judged.runs.items()}
        rows += judged.rows
        sines[spec.name] = _sines(config, setup, controller, spec)
    progress("other payloads, record")
    noise = config.conditions.noise
    envelope = judge_variations(setup, config.controllers, config.variations, config.steps[:OTHERS], noise)
    played = _played(config, setup)
    progress("workspace")
    findings = PlatformFindings(
        modes,
        rows,
        runs,
        transfers,
        sines,
        reach(config.rig),
        {plane: outline(config.rig, *plane) for plane in PLANES},
        worst_poses(config.rig, config.workspace.box, config.workspace.twist),
        envelope,
        played,
    )
    metrics = _metrics(findings) | {"timing": {"study_cpu_s": process_time() - began}}
    return Outcome(metrics, lambda: platform_page(config, setup, findings), _tables(findings))


def _played(config: PlatformConfig, setup: PlatformSetup) -> dict[str, PlayedRecord]:
    if (record := config.record) is None:
        return {}
    return {
        spec.name: play(
            setup,
            spec.build(setup.platform.period, setup.directions),
            record.pose,
            record.highest,
            record.iterations,
            config.conditions.noise,
        )
        for spec in config.controllers
    }


def _sines(
    config: PlatformConfig, setup: PlatformSetup, controller: PlatformController, spec: PlatformSpec
) -> list[PlatformSine]:
    return [
        platform_sine(setup, controller, axis, hz, config.sines.amplitude)
        for hz in config.sines.frequencies
        for axis in range(LEGS)
    ]


def _metrics(findings: PlatformFindings) -> dict[str, Any]:
    return {
        "modes": [
            {"hz": mode.hz, "zeta": mode.zeta, "shape": dict(zip(AXES, mode.shape.tolist(), strict=True))}
            for mode in findings.modes
        ],
        "rows": findings.rows,
        "coupling": [
            {
                "controller": name,
                "of": of,
                "into": into,
                "hz": JUDGED,
                "percent": 100 * transfer.coupling(into, of, JUDGED),
            }
            for name, transfer in findings.transfers.items()
            for of in AXES
            for into in AXES
            if of != into and transfer.coupling(into, of, JUDGED) > 1e-4
        ],
        "sines": [{"controller": name, **sine.row()} for name, sines in findings.sines.items() for sine in sines],
        "envelope": findings.envelope,
        "record": [{"controller": name, "rms_m": played.errors} for name, played in findings.played.items()],
        "reach": {axis: list(ends) for axis, ends in findings.reach.items()},
        "worst": [
            {"quantity": worst.name, "value": worst.value, "unit": worst.unit, "pose": worst.pose.tolist()}
            for worst in findings.worst
        ],
    }


def _tables(findings: PlatformFindings) -> dict[str, dict[str, np.ndarray]]:
    tables = {}
    for (controller, scenario), run in findings.runs.items():
        columns = {"t [s]": run.t} | {f"{axis} asked": run.reference[:, i] for i, axis in enumerate(AXES)}
        columns |= {f"command{i + 1}": run.sent[:, i] for i in range(LEGS)}
        tables[f"step-{controller}-{scenario}"] = {**columns, **run.signals}
    for controller, transfer in findings.transfers.items():
        columns = {"f_hz": transfer.f}
        for i, into in enumerate(AXES):
            for j, of in enumerate(AXES):
                columns[f"{of} to {into} real"] = np.real(transfer.transfer[:, i, j])
                columns[f"{of} to {into} imag"] = np.imag(transfer.transfer[:, i, j])
        tables[f"transfer-{controller}"] = columns
    return tables
