"""Every metric, declared once: key, name, unit, which way is better, meaning, resolution, and how a run gives it.

Rows of metrics.json, tables of reports, `compare`, limits and costs of searches and the reference page read METRICS: a
new metric is one line here.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from ..base.signals import Signal
from ..base.units import from_si
from . import step_metrics

SIGNAL, SIGNAL_TIME = "signal", "signal s"  # units: SI of the controlled signal, and its integral over time
PERIOD, SENSOR, STEP = "period", "sensor", "sensor over step"  # what a number is known to
STATISTICS = {
    "p50": "median",
    "p99": "99 %",
    "worst": "worst",
    "median": "median",
    "mean": "mean",
    "least": "least",
    "most": "most",
    "nominal": "on the nominal rig",
    "specimen": "on another specimen",
}
"""By the word in a key, settling_p99_s: a statistic of a metric over plants, settling_s."""
CHANGES = {"s": 1e-3, "%": 0.1, "Hz": 0.05, "dB": 0.05, "deg": 0.5, "mm": 0.01, "kN": 0.01, "% of step": 0.1}
"""By the unit in which people read a number: the least difference that counts; every one does of other units."""


@dataclass(frozen=True, eq=False)
class JudgedRun:
    """What metrics are made of, SI: times `t` [n] s, the controlled signal `y` [n] and its `reference`, where the
    signal was `before`, its `target`, the `size` between them and the settling `band`; commands as the controller
    `demanded` them and as they were `realised`, and those whose peak counts, `commands`: [n] or [n, legs]; numbers of
    the `linear` loop by key.

    `stands`: from when [s] the target stands, None where it never does; `steps` and `jumps`: whether the signal is to
    go elsewhere, and at once; `pushed`: from when [s] a load pushes, None without one. `tripped` says why the run ended
    early. `calm`: the same run without noise, which would pass for hunting; None where this one has none.
    """

    t: np.ndarray
    y: np.ndarray
    reference: float | np.ndarray
    before: float
    target: float
    size: float
    band: float
    commands: np.ndarray
    demanded: np.ndarray
    realised: np.ndarray
    lowest_pressure: np.ndarray | None
    tripped: str | None
    linear: dict[str, Any]
    stands: float | None = 0.0
    steps: bool = True
    jumps: bool = True
    pushed: float | None = None
    calm: "JudgedRun | None" = None

    @property
    def whole(self) -> bool:
        """Whether it was played to its end."""
        return self.tripped is None

    @property
    def arrives(self) -> bool:
        """Whether it was played to its end, with a target that stands."""
        return self.whole and self.stands is not None

    def row(self, but: Collection[str] = ()) -> dict[str, Any]:
        """Every metric of a run by its key, without some."""
        return {each.key: each.of(self) for each in METRICS.values() if each.of is not None and each.key not in but}


def _settling(run: JudgedRun) -> float | None:
    late = np.flatnonzero(run.t >= (run.stands or 0.0) - 1e-9)
    return step_metrics.settling_time(run.t[late], run.y[late], run.target, run.band) if run.arrives else None


def _overshoot(run: JudgedRun) -> float | None:
    return step_metrics.overshoot(run.y, run.before, run.target) if run.steps else None


def _rise(run: JudgedRun) -> float | None:
    return step_metrics.rise_time(run.t, run.y, run.before, run.target) if run.jumps else None


def _final_error(run: JudgedRun) -> float | None:
    return step_metrics.steady_state_error(run.t, run.y, run.target) if run.arrives else None


def _iae(run: JudgedRun) -> float | None:
    return step_metrics.iae(run.t, run.y, run.reference) if run.whole else None


def _saturated(run: JudgedRun) -> float:
    legs = zip(np.atleast_2d(run.demanded.T), np.atleast_2d(run.realised.T), strict=True)
    return max(step_metrics.saturated_time(run.t, *commands) for commands in legs)


def chamber_row(t: np.ndarray, lowest: np.ndarray | None) -> dict[str, float | None]:
    """What every row says of the chambers, of the lowest pressure [k] Pa of any at t [k] s; None where a plant has
    none."""
    if lowest is None:
        return {"cavitation_s": None, "lowest_pressure_bar": None}
    return {
        "cavitation_s": step_metrics.cavitation_time(t, lowest),
        "lowest_pressure_bar": float(lowest.min() / 1e5),
    }


def _oscillation(run: JudgedRun) -> float | None:
    calm = run.calm or run
    size = calm.size or _peak(calm)
    return step_metrics.residual_oscillation(calm.t, calm.y, size) if calm.arrives and size else None


def _peak(run: JudgedRun) -> float | None:
    if run.pushed is None or not run.arrives:
        return None
    return step_metrics.peak_deviation(run.y[run.t >= run.pushed - 1e-9], run.target)


def _rms_error(run: JudgedRun) -> float | None:
    return None if run.jumps or not run.whole else step_metrics.rms_error(run.y, np.asarray(run.reference))


@dataclass(frozen=True)
class Metric:
    """A number by its `key` of metrics.json. `unit`: as it is there, or SIGNAL, SIGNAL_TIME, "" of what is no number.

    `shown`: the unit in which people read it, where that is another. `known_to`: in steps of what it is known, PERIOD,
    SENSOR, STEP, or a number in the unit shown; 0 where four digits say enough. `of`: how a run gives it; None where
    another study does.
    """

    key: str
    name: str
    unit: str
    better: Literal["less", "more", ""]
    meaning: str
    known_to: str | float = 0.0
    of: Callable[[JudgedRun], Any] | None = None
    shown: str = ""

    def read_in(self, signal: Signal) -> tuple[str, float]:
        """The unit in which people read it where `signal` is controlled, and the factor from metrics.json to it."""
        if self.unit in (SIGNAL, SIGNAL_TIME):
            own = signal.unit + self.unit.removeprefix(SIGNAL)
            return own, float(from_si(1.0, signal.unit, signal.si) - from_si(0.0, signal.unit, signal.si))
        if not self.shown:
            return self.unit, 1.0
        return self.shown, float(from_si(1.0, self.shown.partition(" of ")[0], self.unit))

    def worst(self, values: np.ndarray) -> int:
        """The place of the worst of many values [n], of a NaN where there is one."""
        return int(np.argmin(values) if self.better == "more" else np.argmax(values))

    def beyond(self, value: float, limit: float) -> float:
        """By how much a value is worse than a limit; 0 or less where it keeps it."""
        return limit - value if self.better == "more" else value - limit

    def limit_words(self, limit: float, missed: bool = False) -> str:
        """A limit, "gain margin at least 6 dB", or that it is `missed`, "gain margin below 6 dB"."""
        words = ("at least", "below") if self.better == "more" else ("at most", "above")
        return f"{self.name} {words[missed]} {limit:g} {self.unit.removeprefix('1')}".rstrip()

    def head(self, signal: Signal) -> str:
        """The head of a column or axis, "settling [s]"."""
        unit = self.read_in(signal)[0]
        return f"{self.name} [{unit}]" if unit else self.name


def metric(key: str) -> Metric | None:
    """A metric, or a statistic of one over plants, "settling_p99_s" or "settling_s_most"; None of another key."""
    if key in METRICS:
        return METRICS[key]
    words = key.split("_")
    for place, word in enumerate(words):
        base = METRICS.get("_".join(words[:place] + words[place + 1 :])) if word in STATISTICS else None
        if base is not None:
            return replace(base, key=key, name=f"{base.name}, {STATISTICS[word]}", of=None)
    return None


def _linear(key: str, name: str, unit: str, better: Literal["less", "more", ""], meaning: str, step: float) -> Metric:
    return Metric(key, name, unit, better, meaning, step, lambda run: run.linear[key])


# fmt: off
METRICS = {each.key: each for each in (
    Metric("settling_s", "settling", "s", "less",
           "from where reference, far end and load stand until the signal stays within the band; null: never",
           PERIOD, _settling),
    Metric("overshoot_percent", "overshoot", "%", "less", "largest excursion beyond the target", STEP, _overshoot),
    Metric("rise_s", "rise", "s", "less", "from first reaching 10 % of the step to first reaching 90 %", PERIOD, _rise),
    Metric("steady_state_error", "final error", SIGNAL, "", "target less mean of the last 0.3 s", SENSOR, _final_error),
    Metric("iae", "IAE", SIGNAL_TIME, "less", "integral of the absolute error", 0.0, _iae),
    Metric("peak_command", "peak command", "1", "less", "largest absolute command, as a part of full opening", 0.0,
           lambda run: float(np.abs(run.commands).max())),
    Metric("saturated_s", "time limited", "s", "less", "in which the guard changed the command", PERIOD, _saturated),
    Metric("cavitation_s", "cavitation", "s", "less", "time with gas in a chamber, below 1 bar absolute", PERIOD,
           lambda run: chamber_row(run.t, run.lowest_pressure)["cavitation_s"]),
    Metric("lowest_pressure_bar", "lowest pressure", "bar", "more", "of any chamber, absolute", 0.0,
           lambda run: chamber_row(run.t, run.lowest_pressure)["lowest_pressure_bar"]),
    Metric("residual_oscillation", "lasting oscillation", "1", "less",
           "peak to peak over the last 0.3 s without noise, as a part of the step or of what a load pushes", STEP,
           _oscillation, "% of step"),
    Metric("stable", "stable", "", "", "whether the linear loop is, at null and moving; null: not known", 0.0,
           lambda run: run.linear["stable"]),
    Metric("tripped", "tripped", "", "", "why the guard ended the run; of drawn plants, on how many", 0.0,
           lambda run: run.tripped),
    _linear("f3db_hz", "-3 dB", "Hz", "more", "where the closed loop at null has fallen to -3 dB", 0.0),
    _linear("f90_hz", "-90°", "Hz", "more", "where the closed loop at null lags by 90 degrees", 0.0),
    _linear("peak_db", "peak", "dB", "less", "largest gain of the closed loop at null", 0.01),
    _linear("gain_margin_db", "gain margin", "dB", "more", "the least, at null and moving", 0.01),
    _linear("phase_margin_deg", "phase margin", "deg", "more", "the least, at null and moving", 0.1),
    _linear("ms", "Ms", "1", "less", "peak of the sensitivity function, the larger at null and moving", 0.01),
    Metric("margins", "margins by", "", "", "linear: by the linear loop; sines: by sines on the simulated one; none",
           0.0, lambda run: run.linear["margins"]),
    Metric("band", "band", SIGNAL, "", "half width of the settling band: 2 % of the step, or three standard deviations "
           "of the sensor where that is more", SENSOR, lambda run: run.band),
    Metric("peak_deviation", "peak deviation", SIGNAL, "less", "how far a load pushes the signal off its target",
           SENSOR, _peak),
    Metric("rms_error", "RMS error", SIGNAL, "less", "of a reference that moves", 0.0, _rms_error),
    Metric("times_limit", "times the limit", "1", "less", "settling over the soonest that an optimiser finds"),
    Metric("slowed", "slowed", "1", "", "by which factor a recorded reference is played slower"),
    Metric("recovery_s", "recovery", "s", "less", "from a load's coming until the signal is back in the band", PERIOD),
    Metric("peak", "peak", SIGNAL, "less", "how far a load pushes the signal off its target", SENSOR),
    Metric("peak_power_w", "peak power", "W", "less", "that the main lands of all jacks draw", shown="kW"),
    Metric("energy_j", "energy", "J", "less", "that the main lands of all jacks draw; of a bench, beyond that at rest"),
    Metric("dynamic_stiffness", "stiffness", "N/m", "more", "disturbance force over position, linear, at null",
           shown="kN/mm"),
    Metric("command_rms", "noise of the command", "1", "less",
           "RMS of the command at rest, from the noise of the sensors", shown="%"),
    Metric("load_left", "left of the band", "1", "less", "mean error 0.2 to 0.3 s after a load came, over the band"),
    Metric("solve_us", "compute", "us", "less", "CPU time of the controller in a sample"),
    Metric("cross_percent", "other axes", "%", "less", "how far the other axes go, in percent of the step, angles "
           "times the radius of the joints"),
    Metric("coupling_percent", "surge into pitch at 5 Hz", "%", "less", "amplitude over the one asked for"),
    # drawn plants
    Metric("plants", "plants", "", "", "how many were drawn"),
    Metric("unstable", "unstable", "", "less", "on how many plants the linear loop is unstable somewhere"),
    Metric("hunting", "hunting", "", "less", "on how many plants the loop swings at rest without noise"),
    Metric("never", "never settled", "", "less", "on how many plants a step does not settle"),
    Metric("failing", "failing", "", "less", "on how many plants anything is wrong"),
    Metric("cavitating", "cavitating", "", "less", "on how many plants gas comes out in a chamber"),
    Metric("held_unstable", "unstable as measured", "", "less",
           "on how many plants the loop is unstable with what the controller has measured by the end of its steps"),
    Metric("held_ms", "Ms as measured", "1", "less", "with what the controller has measured by the end of its steps",
           0.01),
    Metric("failing_kg", "any of these: payload", "kg", "", "payloads on which anything is wrong"),
    Metric("unstable_kg", "unstable: payload", "kg", "", "payloads on which the linear loop is unstable"),
    # limits
    Metric("x_m", "from", "m", "", "position from mid stroke at which the motion starts", shown="mm"),
    Metric("stiffness_n_per_m", "specimen", "N/m", "", "stiffness of the specimen", shown="kN/mm"),
    Metric("limit_s", "limit", "s", "less", "the soonest that an optimiser settles the known rig"),
    Metric("limit_error", "least error, root mean square", SIGNAL, "less", "the nearest that an optimiser follows"),
    Metric("largest_error", "its largest error", SIGNAL, "less", "of the motion that follows nearest"),
    Metric("mesh_difference_s", "by the mesh", "s", "less", "change when the mesh was last halved", shown="ms"),
    Metric("mesh_difference_error", "by the mesh", SIGNAL, "less", "change when the mesh was last halved"),
    Metric("lowest_pressure", "lowest pressure", "Pa", "", "of any chamber, absolute", shown="bar"),
    Metric("played_off_percent", "engine off by", "%", "less", "how far the played motion is off the computed one, in "
           "percent of the step"),
    Metric("reason", "why none", "", "", "why there is no limit"),
    # records that repeat, sines, faults
    Metric("error_rms", "RMS error", SIGNAL, "less", "as the sensors have it"),
    Metric("error_rms_inverse", "with the inverse", SIGNAL, "less", "RMS error with an inverse before the loop"),
    Metric("factor", "factor", "1", "more", "RMS error without the inverse over that with it"),
    Metric("error_db", "change", "dB", "less", "of the RMS error since the first iteration"),
    Metric("true_error_rms", "true RMS error", SIGNAL, "less", "as the plant has it"),
    Metric("true_error_peak", "true peak error", SIGNAL, "less", "as the plant has it"),
    Metric("acceleration_error_rms", "acceleration", "m/s^2", "less", "RMS error of the true one, at the joints"),
    Metric("peak_drive", "drive, peak", SIGNAL, "", "largest absolute value of the learned drive"),
    Metric("frequency", "frequency", "Hz", "", "of the sine"),
    Metric("amplitude", "amplitude", "m", "", "of the sine", shown="mm"),
    Metric("amplitude_error_percent", "amplitude error", "%", "less", "of the first harmonic"),
    Metric("amplitude_percent", "amplitude error", "%", "less", "of the first harmonic"),
    Metric("phase_error_deg", "phase error", "deg", "less", "of the first harmonic"),
    Metric("phase_deg", "phase error", "deg", "less", "of the first harmonic"),
    Metric("third_db", "third harmonic", "dB", "less", "over the first"),
    Metric("cycles", "arrives after", "cycles", "less", "until amplitude and phase stay within what is asked for"),
    Metric("within_percent", "within", "%", "more", "share of the plants on which the sine arrives"),
    Metric("highest_hz", "up to", "Hz", "more", "where the valve saturates"),
    Metric("sine_error", "error of a sine", "1", "less", "RMS of the error over that of the reference"),
    Metric("worst_gain_margin_db", "worst gain margin", "dB", "more", "over stroke and intervals of the numbers", 0.01),
    Metric("detected_ms", "detected after", "ms", "less", "from the fault's beginning until the guard trips"),
    Metric("stop_speed", "speed at the stop", "m/s", "less", "at which the jack meets the end stop"),
    Metric("peak_force", "peak force", "N", "less", "of load cell or end stop", shown="kN"),
    Metric("beyond_percent", "beyond a limit", "%", "less", "of stroke, speed or force"),
    # records and responses
    Metric("rms", "RMS error", "", "less", "in the row's unit"),
    Metric("floor", "noise floor", "", "", "the error that a perfect model would still have, in the row's unit"),
    Metric("ratio", "error over noise", "1", "less", "RMS error over the noise floor"),
    Metric("chi2", "chi2", "1", "", "mean squared error over the squared noise floor; 1 is the floor"),
    Metric("value", "value", "", "", "in the row's unit"),
    Metric("f3db", "-3 dB", "Hz", "more", "where the response has fallen to -3 dB"),
    Metric("f90", "-90°", "Hz", "more", "where the response lags by 90 degrees"),
    Metric("null_zeta", "damping at null", "1", "more", "of the least damped pole"),
    Metric("error_percent", "off by", "%", "", "from the published value"),
)}
# fmt: on
