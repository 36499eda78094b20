"""What is measured on a platform's loops, of the whole plant: steps along one axis with what the others do meanwhile,
and the power; sines along one axis, and the part of its envelope that a loop on six legs follows within 5 %.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.signals import port_pressures
from ...control.platform_controller import LEGS, PlatformController, PlatformSpec
from ...plant.platform import ACCELERATION
from ...plant.valve.supply import supply_power
from ...rigs.platform import AXES
from ..metrics import JudgedRun
from ..performance.reached import WITHIN, Followed
from ..rows import closed_numbers
from .loop import PlatformRun, run_platform
from .setup import PlatformSetup
from .steps import AxisStep
from .transfer import PlatformTransfer, platform_transfer

SHARE = 0.02  # of a step: its settling band
_F = np.geomspace(0.5, 60.0, 60)  # Hz, of linear loops on variations
_SETTLING = 0.5  # s, and two cycles: before a sine is looked at
_LOOKED_AT = 4  # cycles
_SHARES = (0.9, 0.5, 0.2, 0.05)  # of an envelope, that are tried


@dataclass(frozen=True)
class JudgedPlatform:
    """A controller on a platform: its linear loop, its runs by step, and their rows as metrics.json has them."""

    transfer: PlatformTransfer
    runs: Mapping[str, PlatformRun]
    rows: list[dict[str, Any]]


def judge_platform(
    setup: PlatformSetup, spec: PlatformSpec, steps: Sequence[AxisStep], f: np.ndarray, seed: int | None
) -> JudgedPlatform:
    """A controller in steps, and its linear loop at f [k] Hz. `seed` is that of the sensors' noise, None without.
    Raises NoLinearView."""
    controller, period = spec.build(setup.platform.period, setup.directions), setup.platform.period
    transfer = platform_transfer(setup, controller, f)
    runs = {step.name: run_platform(setup, controller, step.pose(period), seed) for step in steps}
    rows = [step_row(spec.name, step, setup, runs[step.name], transfer) for step in steps]
    return JudgedPlatform(transfer, runs, rows)


def linear_numbers(transfer: PlatformTransfer) -> dict[str, Any]:
    """Whether a linear loop is stable, its Ms, and surge into pitch at 5 Hz [%], both None of an unstable one."""
    if not transfer.stable:
        return {"stable": False, "ms": None, "coupling_percent": None}
    coupling = 100 * transfer.coupling("pitch", "surge")
    return {"stable": True, "ms": float(transfer.sensitivity.max()), "coupling_percent": coupling}


def judge_variations(
    setup: PlatformSetup,
    controllers: Sequence[PlatformSpec],
    variations: Mapping[str, Mapping[str, float]],
    steps: Sequence[AxisStep],
    seed: int | None,
) -> list[dict[str, Any]]:
    """A row of metrics.json for every controller on every variation, SI values of the payload by name; laws, directions
    and guards stay those of the declared platform. The largest settling time is None where one step does not settle."""
    rows = []
    for name, values in variations.items():
        other = setup.with_payload(values)
        for spec in controllers:
            judged = judge_platform(other, spec, steps, _F, seed)
            linear, settled = linear_numbers(judged.transfer), [row["settling_s"] for row in judged.rows]
            stable, coupling = linear["stable"], linear.pop("coupling_percent")
            played = {
                "settling_s": max(settled) if stable and None not in settled else None,
                "tripped": next((run.tripped for run in judged.runs.values() if stable and run.tripped), None),
                "coupling_percent": coupling,
            }
            rows.append({"controller": spec.name, "variation": name, **linear, **played})
    return rows


def step_row(
    controller: str, step: AxisStep, setup: PlatformSetup, run: PlatformRun, transfer: PlatformTransfer
) -> dict[str, Any]:
    """The row of a step in metrics.json: as of a jack's position step, and `cross`, how far the others go meanwhile, in
    percent of the step, angles times the radius of the joints."""
    axis, whole, weights = step.axis, run.tripped is None, setup.platform.geometry.weights
    moved = np.abs(run.pose - run.pose[0]).max(axis=0) * weights
    percent = 100 * moved / (abs(step.size) * weights[axis])
    closed = transfer.transfer[:, axis, axis] if transfer.stable else None
    linear = {"stable": transfer.stable, **closed_numbers(transfer.f, closed)}
    linear |= {"gain_margin_db": None, "phase_margin_deg": None}
    judged = JudgedRun(
        t=run.t,
        y=run.pose[:, axis],
        reference=step.size,
        before=0.0,
        target=step.size,
        size=step.size,
        band=SHARE * abs(step.size),
        commands=run.demanded,
        demanded=run.demanded,
        realised=run.sent,
        lowest_pressure=run.signals["lowest_pressure"],
        tripped=run.tripped,
        linear=linear | {"ms": float(transfer.sensitivity.max()) if transfer.stable else None},
        steps=whole,
        jumps=whole,
    )
    return {
        "controller": controller,
        "rig": setup.platform.name,
        "scenario": step.name,
        **judged.row(but=("margins", "peak_deviation", "rms_error")),
        "cross": {name: float(percent[i]) for i, name in enumerate(AXES) if i != axis},
        **power(setup, run),
    }


def power(setup: PlatformSetup, run: PlatformRun) -> dict[str, float]:
    """Largest power [W] and energy [J] that the main lands of all jacks draw in a run."""
    total = np.zeros(len(run.t))
    for i, leg in enumerate(setup.platform.legs):
        at, name = port_pressures(run.signals, f"leg{i + 1}."), f"leg{i + 1}.{{}}".format
        total += supply_power(leg.rig, run.signals[name("spool")], *at, run.signals[name("supply")])
    return {"peak_power_w": float(total.max()), "energy_j": float(np.trapezoid(total, run.t))}


@dataclass(frozen=True)
class PlatformSine:
    """A sine along `axis` at a frequency [Hz]: first harmonics of pose and acceleration [6], over those asked for,
    angles times the radius of the joints; the harmonics of the acceleration along the axis over the first. NaN where it
    tripped."""

    axis: int
    hz: float
    pose: np.ndarray
    acceleration: np.ndarray
    distortion: float

    def row(self) -> dict[str, Any]:
        """The sine's row in metrics.json: percent of the amplitude asked for, by axis."""
        axes = {
            key: {
                axis: None if np.isnan(part) else 100 * float(abs(part))
                for axis, part in zip(AXES, values, strict=True)
            }
            for key, values in (("pose_percent", self.pose), ("acceleration_percent", self.acceleration))
        }
        distortion = None if np.isnan(self.distortion) else 100 * self.distortion
        return {"axis": AXES[self.axis], "hz": self.hz, **axes, "distortion_percent": distortion}


def platform_sine(
    setup: PlatformSetup, controller: PlatformController, axis: int, hz: float, amplitude: float
) -> PlatformSine:
    """A sine of an amplitude [m] at the joints along one axis from home, without sensor noise."""
    period, weight = setup.platform.period, setup.platform.geometry.weights
    lead = np.ceil(max(2.0, _SETTLING * hz))
    t = np.arange(round((lead + _LOOKED_AT) / hz / period) + 1) * period
    pose = np.zeros((len(t), LEGS))
    size = amplitude / weight[axis]
    pose[:, axis] = size * np.sin(2 * np.pi * hz * t)
    run = run_platform(setup, controller, pose)
    if run.tripped is not None:
        nothing = np.full(LEGS, np.nan)
        return PlatformSine(axis, hz, nothing, nothing, float("nan"))
    late = run.t >= lead / hz - 1e-9
    accelerations = np.column_stack([run.signals[name] for name in ACCELERATION])[late]
    harmonics = np.array([_harmonic(run.t[late], accelerations[:, axis], n * hz) for n in range(1, 8)])
    first = np.array([_harmonic(run.t[late], run.pose[late, i], hz) for i in range(LEGS)])
    own = np.array([_harmonic(run.t[late], accelerations[:, i], hz) for i in range(LEGS)])
    asked = weight[axis] * size * -1j
    return PlatformSine(
        axis,
        hz,
        weight * first / asked,
        -weight * own / (asked * (2 * np.pi * hz) ** 2),
        float(np.linalg.norm(harmonics[1:]) / abs(harmonics[0])),
    )


def _harmonic(t: np.ndarray, y: np.ndarray, hz: float) -> complex:
    """Complex amplitude of a sine of this frequency, by least squares beside a mean."""
    turns = 2 * np.pi * hz * t
    columns = np.column_stack((np.cos(turns), np.sin(turns), np.ones_like(t)))
    a, b, _ = np.linalg.lstsq(columns, y, rcond=None)[0]
    return complex(a, -b)


def followed_along(
    setup: PlatformSetup, controller: PlatformController, axis: str, f: np.ndarray, most: np.ndarray
) -> Followed:
    """What a platform follows of amplitudes `most` [k] m or rad at f [k] Hz without noise, up to the first frequency at
    which it follows nothing; nothing corrects amplitude and phase here."""
    amplitude, error = np.full((2, f.size), np.nan)
    exact = True  # whether the error was within so far
    for k, (each, top) in enumerate(zip(f.tolist(), most.tolist(), strict=True)):
        for share in _SHARES:
            response = _response(setup, controller, axis, each, share * top)
            if np.isnan(amplitude[k]) and abs(abs(response) - 1) <= WITHIN:
                amplitude[k] = share * top
            if exact and abs(response - 1) <= WITHIN:
                error[k] = share * top
            if np.isfinite(amplitude[k]) and (not exact or np.isfinite(error[k])):
                break
        exact = bool(np.isfinite(error[k]))
        if np.isnan(amplitude[k]):
            break
    return Followed(f, amplitude, error, np.full(f.size, np.nan))


def _response(setup: PlatformSetup, controller: PlatformController, axis: str, f: float, amplitude: float) -> complex:
    """The response of the pose along the axis to a sine of an amplitude [m or rad]; NaN where it trips."""
    place = AXES.index(axis)
    sine = platform_sine(setup, controller, place, f, amplitude * float(setup.platform.geometry.weights[place]))
    return complex(sine.pose[place])
