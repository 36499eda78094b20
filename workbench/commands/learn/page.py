"""What a learning experiment shows: that it converges, how the error falls, and the drives."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ...base.gain_phase import gain_db
from ...base.units import from_si
from ...loop.learning import Learned, LearningFilter, rms
from ...records.excitation import Excitation, excitation_text
from ...records.frequency_sheet import table_text
from ...report import Curve, Figure, Mark, Page, Panel, Section, Style, Table
from ...rigs.platform import AXES
from ..common.judged import gas_span
from ..common.metric_table import MetricView
from ..common.record_experiment import RecordExperiment
from .drawn import DrawnLearning, drawn_sections
from .options import LearnConfig

SPECTRUM_SHARE = 1.5  # of the cut-off: as far as frequency plots go


@dataclass(frozen=True, eq=False)
class Convergence:
    """The filter, and closed loops by rig and operating point, complex [k] at the filter's frequencies."""

    learning: LearningFilter
    responses: Mapping[str, np.ndarray]

    @property
    def largest(self) -> dict[str, float]:
        """The largest |Q (1 - L T)| of each loop."""
        return {name: float(self.learning.contraction(t).max()) for name, t in self.responses.items()}

    @property
    def verdict(self) -> str:
        """The convergence condition in words."""
        name, most = max(self.largest.items(), key=lambda item: item[1])
        cutoff = self.learning.cutoff
        return f"converges up to {cutoff:.3g} Hz: |Q (1 - L T)| is at most {most:.2f} ({name}), and must be below 1"


def rows(learned: Mapping[str, Learned]) -> list[dict[str, Any]]:
    """A row an iteration of each rig: SI but for what its key says."""
    return [
        {
            "rig": name,
            "iteration": number,
            "error_rms": each.error(iteration),
            "error_db": float(20 * np.log10(each.error(iteration) / each.error(each.iterations[0]))),
            "true_error_rms": rms(each.reference[: len(iteration.true)] - iteration.true),
            "true_error_peak": float(np.abs(each.reference[: len(iteration.true)] - iteration.true).max()),
            "gain": iteration.gain,
            "kept": iteration.kept,
            "peak_drive": float(np.abs(iteration.drive).max()),
            "peak_command": float(np.abs(iteration.command).max()),
            "saturated_s": iteration.saturated,
            "lowest_pressure": _pascal(iteration.chambers["lowest_pressure_bar"]),
            **iteration.chambers,
            "tripped": iteration.tripped,
        }
        for name, each in learned.items()
        for number, iteration in enumerate(each.iterations)
    ]


def tables(
    learned: Mapping[str, Learned], period: float, weights: np.ndarray | None = None
) -> dict[str, dict[str, np.ndarray]]:
    """Columns of every iteration (SI): time, reference, drive, what the sensor reads, what was true, command; of a
    platform, whose values are metres at the joints by the `weights` [6] of its axes, by axis and leg."""
    tables = {}
    for name, each in learned.items():
        for number, iteration in enumerate(each.iterations):
            rows = len(iteration.true)
            waves = {"reference": each.reference[:rows], "drive": iteration.drive[:rows]}
            waves |= {"measured": iteration.measured, "true": iteration.true}
            columns = {"t": np.arange(rows) * period}
            if weights is None:
                columns |= waves | {"command": iteration.command}
            else:
                for what, values in waves.items():
                    columns |= {f"{what}.{axis}": values[:, i] / weights[i] for i, axis in enumerate(AXES)}
                columns |= {f"command{i + 1}": iteration.command[:, i] for i in range(len(AXES))}
            tables[f"{name.replace(' ', '')}-{number}"] = columns
    return tables


def drive_files(record: RecordExperiment, learned: Mapping[str, Learned]) -> dict[str, str]:
    """The learned drives as files that a drive plays, of the position about the rig's middle."""
    files = {}
    for name, each in learned.items():
        drive = each.best.drive
        t = np.arange(len(drive)) * record.rig.period.value
        if record.signal.name == "position":
            rest = record.rig.middle + record.scenario.position(record.rig.limit("stroke"))
            played = Excitation(name, record.rig.period.value, rest + drive, np.zeros(len(drive)))
            files[f"drive-{name}.csv"] = excitation_text(played)
        else:
            files[f"drive-{name}.csv"] = table_text({"t": t, record.signal.name: drive})
    return files


def figure(config: LearnConfig, learned: Mapping[str, Learned]) -> Figure:
    """RMS of the measured error over the iterations that were kept, and what does not repeat."""
    record = config
    title = f"{record.scenario.name} by {config.controller.name}: error"
    return errors_figure(title, learned, partial(shown, record), record.signal.unit)


def errors_figure(
    title: str,
    learned: Mapping[str, Learned],
    scale: Callable[[float | np.ndarray], np.ndarray],
    unit: str,
    note: str = "",
) -> Figure:
    """RMS of the measured error over the iterations that were kept, and what does not repeat, scaled to the `unit`."""
    curves = []
    for name, each in learned.items():
        numbers, errors = np.array([(n, each.error(i)) for n, i in enumerate(each.iterations) if i.kept]).T
        curves.append(Curve(name, numbers, scale(errors)))
    floor = float(scale(max(each.floor for each in learned.values())))
    marks = [Mark(floor, "does not repeat")] if floor else []
    panel = Panel(f"RMS error [{unit}]", curves, log_y=True, marks=marks)
    return Figure(title, "iteration [1]", [panel], note=note)


def page(
    config: LearnConfig,
    convergence: Convergence,
    learned: Mapping[str, Learned],
    picture: Figure,
    drawn: DrawnLearning | None,
) -> Page:
    """The report."""
    record = config
    falls = ", ".join(f"{each.fall_db:.1f} dB in {_count(each)} on {name}" for name, each in learned.items())
    verdict = f"The error of {record.scenario.name} by {config.controller.name} falls by {falls}.{_limits(learned)}"
    sections = drawn_sections(config, drawn) if drawn else []
    return Page(
        f"Learning the drive file of {record.scenario.name} on {record.rig.name}",
        verdict,
        [
            Section("The error", [picture, _table(record, learned)]),
            Section("Before the first iteration", [f"It {convergence.verdict}.", _contraction(convergence)]),
            *(
                Section(name, [_time(record, each), _spectrum(record, convergence, each)])
                for name, each in learned.items()
            ),
            *sections,
        ],
    )


def shown(record: RecordExperiment, values: float | np.ndarray) -> np.ndarray:
    """Values of the controlled signal in the unit that people read."""
    return from_si(values, record.signal.unit, record.signal.si)


def _pascal(pressure: float | None) -> float | None:
    """A pressure [bar] in Pa; None of a plant without chambers."""
    return None if pressure is None else 1e5 * pressure


def _limits(learned: Mapping[str, Learned]) -> str:
    """Sentences on what was learned beyond what a rig can do."""
    sentences = ""
    for name, each in learned.items():
        best = each.best
        if best.chambers["cavitation_s"]:
            sentences += f" Out of reach on {name}: gas comes out of the oil in a chamber, {gas_span(best.chambers)}."
        if best.saturated:
            sentences += f" On {name} the command is limited for {best.saturated:.3g} s."
        if each.iterations[0].tripped:
            sentences += f" On {name} {each.stopped}."
    return sentences


def _count(learned: Learned) -> str:
    number = len(learned.iterations) - 1
    return f"{number} iteration{'' if number == 1 else 's'}"


def _table(record: RecordExperiment, learned: Mapping[str, Learned]) -> Table:
    keys = (
        *("rig", "iteration", "error_rms", "error_db", "true_error_rms", "true_error_peak", "gain", "kept"),
        *("peak_drive", "peak_command", "saturated_s", "cavitation_s", "lowest_pressure_bar"),
    )
    stops = "; ".join(f"{name} stopped: {each.stopped}" for name, each in learned.items())
    note = f"{stops}. Errors are as the sensor has them, true ones as the plant has them; iteration 0 plays the record."
    return MetricView.of(record.rig, record.signal).table("Iterations", rows(learned), keys, note)


def _band(learning: LearningFilter) -> np.ndarray:
    """Places of the frequencies that are drawn."""
    return np.flatnonzero((learning.f > 0) & (learning.f < SPECTRUM_SHARE * learning.cutoff))


def _contraction(convergence: Convergence) -> Figure:
    """|Q (1 - L T)| and closed loops over frequency, with Q and L."""
    learning = convergence.learning
    band = _band(learning)
    f = learning.f[band]
    each = [Curve(name, f, learning.contraction(t)[band]) for name, t in convergence.responses.items()]
    loops = [Curve(name, f, gain_db(t[band])) for name, t in convergence.responses.items()]
    filters = [Curve("Q", f, gain_db(learning.q[band]), "dash"), Curve("L", f, gain_db(learning.inverse[band]), "dot")]
    panels = [
        Panel("|Q (1 - L T)| [1]", each, y_range=(0.0, 1.05), marks=[Mark(1.0, "converges below")]),
        Panel("gain [dB]", [*loops, *filters]),
    ]
    return Figure("What an iteration leaves of the error", "frequency [Hz]", panels, log_x=True)


def _time(record: RecordExperiment, learned: Learned) -> Figure:
    waves = (learned.reference, learned.best.drive, learned.iterations[0].true, learned.best.true)
    signal, command = record.signal, learned.best.command
    period, told = record.rig.period.value, "true values, without the sensor's noise"
    return record_figure(
        "The record", (signal.label, signal.unit), period, [shown(record, each) for each in waves], command, told
    )


def record_figure(
    title: str,
    of: tuple[str, str],
    period: float,
    waves: Sequence[np.ndarray],
    command: np.ndarray,
    note: str,
    commanded: str = "command [1]",
) -> Figure:
    """What was wanted, the drive learned, and what the first and the best iteration did, `waves` [k] each in the unit
    that people read; `of`: the label of the signal, and that unit."""
    wanted, drive, first, best = waves

    def curve(name: str, values: np.ndarray, style: Style = "line") -> Curve:
        return Curve(name, np.arange(len(values)) * period, values, style)

    left = [curve(name, wanted[: len(true)] - true) for name, true in (("first", first), ("learned", best))]
    panels = [
        Panel(of[0], [curve("reference", wanted, "dot"), curve("drive", drive), curve("learned", best)]),
        Panel(f"error [{of[1]}]", left),
        Panel(commanded, [curve("learned", command)]),
    ]
    return Figure(title, "time [s]", panels, note=note)


def _spectrum(record: RecordExperiment, convergence: Convergence, learned: Learned) -> Figure:
    """Amplitude spectra of the measured error."""
    learning = convergence.learning
    band = _band(learning)

    def spectrum(values: np.ndarray) -> np.ndarray:
        amplitudes = np.fft.rfft(values, 2 * (len(learning.f) - 1)) * 2 / len(learned.reference)
        return shown(record, np.abs(amplitudes[band]))

    f, reference = learning.f[band], learned.reference
    curves = [Curve("reference", f, spectrum(reference), "dot")]
    for name, iteration in {"first": learned.iterations[0], "learned": learned.best}.items():
        curves.append(Curve(name, f, spectrum(reference[: len(iteration.measured)] - iteration.measured)))
    panel = Panel(f"amplitude [{record.signal.unit}]", curves, log_y=True)
    return Figure("Spectrum of the error", "frequency [Hz]", [panel], log_x=True)
