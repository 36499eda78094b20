"""What learning on a platform shows: the measured response, that it converges, how the errors fall, the motion."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.gain_phase import gain_db
from ...base.words import counted, spanned
from ...loop.learning import Iteration, Learned, low_pass, rms
from ...loop.platform.learning import Left, MatrixFilter, acceleration_error
from ...loop.platform.measured import REALIZATIONS, MatrixResponse
from ...loop.platform.setup import PlatformSetup
from ...loop.platform.steps import SHOWN, UNITS
from ...report import Curve, Figure, Mark, Page, Panel, Section, Table
from ...rigs.platform import AXES
from ..common.judged import gas_words
from ..common.metric_table import MetricView
from .options import PlatformLearnConfig
from .page import errors_figure, record_figure

_MOST_PAYLOADS = 12  # that figures and tables show


@dataclass(frozen=True, eq=False)
class PlatformLearning:
    """The experiment, the platform as built, numbers of the drawn payloads, the measured response, what an iteration
    leaves by payload, the filter, and what was learned by payload."""

    config: PlatformLearnConfig
    setup: PlatformSetup
    payloads: list[dict[str, float]]
    measured: MatrixResponse
    left: Mapping[str, Left]
    learning: MatrixFilter
    learned: dict[str, Learned]

    def most(self, left: np.ndarray) -> float:
        """The largest of what is left [k] of a drive's error behind Q."""
        return float((low_pass(self.measured.f, self.learning.cutoff) * left).max())

    def acceleration(self, learned: Learned, iteration: Iteration) -> float:
        """RMS over all axes of the error of the true acceleration in the band of Q, m/s2 at the joints."""
        error = learned.reference[: len(iteration.true)] - iteration.true
        return rms(acceleration_error(self.learning, error))

    @property
    def promise(self) -> str:
        """The convergence condition in words."""
        name, most = max(((name, self.most(each.radius)) for name, each in self.left.items()), key=lambda item: item[1])
        norm = max(self.most(each.norm) for each in self.left.values())
        return (
            f"converges up to {self.learning.cutoff:.3g} Hz: the spectral radius of Q (I - L G) is at most {most:.2f} "
            f"({name}), and must be below 1; its largest singular value is at most {norm:.2f}"
        )


def platform_learning_page(found: PlatformLearning, metrics: Mapping[str, Any]) -> tuple[Page, Figure]:
    """The report and its telling figure."""
    picture = _errors(found)
    first = next(iter(found.learned.values()))
    sections = [
        Section("The error", [picture, _falls(found, metrics), _iterations(metrics)]),
        Section("Before the first iteration", [f"It {found.promise}.", _contraction(found)]),
        Section("The measured response", [_response(found)]),
        Section("The motion", [_motion(found, first), _axes(found, first)]),
    ]
    title = f"Learning the drive file of {found.config.motion.title} on {found.setup.platform.name}"
    return Page(title, _verdict(found, metrics), sections), picture


def _verdict(found: PlatformLearning, metrics: Mapping[str, Any]) -> str:
    declared, *drawn = metrics["learned"]
    said = (
        f"The error under {found.config.controller.name} falls by {declared['fall_db']:.1f} dB on the declared payload"
    )
    if drawn:
        said += f", and by {spanned(each['fall_db'] for each in drawn)} dB on {counted(len(drawn), 'drawn one')}"
    said += f"; that of the acceleration by {spanned(each['acceleration_fall_db'] for each in metrics['learned'])} dB."
    tripped = [name for name, each in found.learned.items() if each.iterations[0].tripped]
    return said + (f" The motion itself trips a guard: {', '.join(tripped)}." if tripped else "")


def _errors(found: PlatformLearning) -> Figure:
    shown = dict(list(found.learned.items())[:_MOST_PAYLOADS])
    note = "RMS over all axes of the measured pose in the band of Q, angles times the radius of the joints."
    return errors_figure("The error from one time to the next", shown, lambda e: 1e3 * np.asarray(e), "mm", note)


def _falls(found: PlatformLearning, metrics: Mapping[str, Any]) -> Table:
    numbers: list[Mapping[str, float]] = [found.setup.platform, *found.payloads]  # type: ignore[list-item]
    lines = []
    for own, said, beforehand in zip(numbers, metrics["learned"], metrics["convergence"], strict=True):
        payload = [own["mass"], *(1e3 * own[key] for key in ("cx", "cy", "cz")), own["Iyy"]]
        falls = [beforehand["radius"], said["fall_db"], said["acceleration_fall_db"]]
        lines.append([said["rig"], *(float(f"{each:.4g}") for each in payload), *falls, said["stopped"]])
    heads = ["payload", "mass [kg]", "cx [mm]", "cy [mm]", "cz [mm]", "Iyy [kg m2]", "radius [1]"]
    note = (
        "Radius: the largest spectral radius of Q (I - L G), told beforehand: for the declared payload as the "
        "measurement leaves it possible in 95 % of draws, for the others by what the linear model says a payload "
        "changes. Acceleration: true values, in the band of Q."
    )
    return Table("Payloads", [*heads, "fall [dB]", "of the acceleration [dB]", "stopped because"], lines, note)


def _iterations(metrics: Mapping[str, Any]) -> Table:
    keys = (
        *("rig", "iteration", "error_rms", "error_db", "true_error_rms", "acceleration_error_rms", "gain", "kept"),
        *("peak_command", "cavitation_s", "lowest_pressure_bar", "tripped"),
    )
    note = "Errors are as the sensors have them in the band of Q, true ones as the plant has them."
    note += gas_words(metrics["rows"])
    return MetricView().table("Iterations", metrics["rows"], keys, note, heads={"rig": "payload"})


def _contraction(found: PlatformLearning) -> Figure:
    f = found.measured.f
    q = low_pass(f, found.learning.cutoff)
    shown = list(found.left.items())[:_MOST_PAYLOADS]
    names = [f"{name}, 95 %" if i == 0 else name for i, (name, _) in enumerate(shown)]
    radius = [Curve(name, f, q * each.radius) for name, (_, each) in zip(names, shown, strict=True)]
    norm = [Curve(name, f, q * each.norm) for name, (_, each) in zip(names, shown, strict=True)]
    ends, mark = (0.0, 1.05), [Mark(1.0, "converges below")]
    panels = [
        Panel("spectral radius [1]", radius, y_range=ends, marks=mark),
        Panel("largest singular value [1]", norm, y_range=ends),
        Panel("Q [1]", [Curve("Q", f, q, "dash")], y_range=ends),
    ]
    return Figure("What an iteration leaves: Q (I - L G)", "frequency [Hz]", panels, log_x=True)


def _response(found: PlatformLearning) -> Figure:
    measured, f = found.measured, found.measured.f
    gains = np.abs(measured.response)
    own = [Curve(axis, f, gain_db(gains[:, i, i])) for i, axis in enumerate(AXES)]
    beside = gains * (1 - np.eye(len(AXES)))
    deviation = np.maximum(measured.deviation.max(axis=(1, 2)), 1e-6)
    others = [
        Curve("largest from one axis to another", f, gain_db(beside.max(axis=(1, 2)))),
        Curve("largest deviation of an entry", f, gain_db(deviation), "dot"),
    ]
    note = (
        f"Orthogonal multisines on all axes, {REALIZATIONS} realizations of six experiments. The deviation says what "
        "differs between them: noise, and what is not linear."
    )
    panels = [Panel("each axis to itself [dB]", own), Panel("gain [dB]", others)]
    return Figure("From the pose asked for to the pose measured", "frequency [Hz]", panels, log_x=True, note=note)


def _motion(found: PlatformLearning, learned: Learned) -> Figure:
    """The axis that moves most, on the declared payload."""
    weights, period = found.setup.platform.geometry.weights, found.setup.platform.period
    axis = int(np.argmax(np.abs(learned.reference).max(axis=0)))
    scale, unit = SHOWN[axis] / weights[axis], UNITS[axis]
    waves = (learned.reference, learned.best.drive, learned.iterations[0].true, learned.best.true)
    title, of = f"{AXES[axis].capitalize()}, declared payload", (f"{AXES[axis]} [{unit}]", unit)
    command = np.abs(learned.best.command).max(axis=1)
    waves = [scale * each[:, axis] for each in waves]
    return record_figure(title, of, period, waves, command, "true values", "largest command [1]")


def _axes(found: PlatformLearning, learned: Learned) -> Table:
    weights, lines = found.setup.platform.geometry.weights, []
    for i, axis in enumerate(AXES):
        scale = SHOWN[i] / weights[i]
        left = [
            scale * rms((learned.reference[: len(it.true)] - it.true)[:, i])
            for it in (learned.iterations[0], learned.best)
        ]
        lines.append([axis, UNITS[i], scale * float(np.abs(learned.reference[:, i]).max()), *left])
    heads = ["axis", "unit", "largest wanted", "RMS error, first", "learned"]
    return Table("Each axis, declared payload", heads, lines, "True values, without the sensors' noise.")
