"""How far a valve was open, in units of its command: by the spool where it was recorded, else by a lagged command."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.optimize import least_squares

from ...engine import Engine
from ...linear.frequency_response import stepped_sine
from ...linear.operating_point import equilibrium
from ...plant import build_valve_bench
from ...records import Record
from ...rigs.rig import Rig
from .regression import Series, regress

SMOOTH = 5e-3  # s: over which a spool's noise is averaged, which moves no sum over time
_CALM, _STILL = 0.03, 3e-4  # of the command, and of full command: how far it may be from what it was
_GROUP = 0.5  # s
_LEAST = 2.5e-3  # of the travel: what a lag that is not quite the valve's leaves in it, in three practice campaigns
_SLOW, _SMALL, _DAMPING = 5.0, 0.1, 0.8  # Hz, of full command: where a model's delay is looked at; a usual damping
_FIRST, _RANGE = (60.0, 0.8), ((3.0, 0.2), (1000.0, 3.0))  # Hz, damping: where a search begins, and its bounds


@dataclass(frozen=True)
class ValveLag:
    """Natural frequency [Hz] and damping [1] with which the valve follows its command, for tests that are slow."""

    frequency: float
    damping: float

    def applied(self, command: np.ndarray, period: float, late: float = 0.0) -> np.ndarray:
        """What a command [k], held for each period [s], has come to at the instants at which it is logged."""
        from scipy.signal import lfilter  # here, as it takes a third of a second

        w = 2 * np.pi * self.frequency
        apart = np.sqrt(complex(self.damping**2 - 1, 1e-9))  # two poles, never one twice
        slow, fast = w * (-self.damping + apart), w * (-self.damping - apart)
        poles = np.exp(np.array([slow, fast]) * period)
        one, two = np.real(np.poly(poles))[1:]
        first = 1 - float(np.real((fast * poles[0] - slow * poles[1]) / (fast - slow)))  # of its step response
        numerator, denominator = np.array([0.0, first, 1 + one + two - first]), np.array([1.0, one, two])
        shifted = np.concatenate((np.full(round(late / period), command[0]), command))[: command.size]
        return command[0] + np.asarray(lfilter(numerator, denominator, shifted - command[0]))


@dataclass(frozen=True)
class Opening:
    """The lag, and the spool [m] at command 0 and per unit of command, None where no spool was recorded.

    `spread`: deviations of the bias, as a command, and of the travel, as a share of it.
    """

    lag: ValveLag
    bias: float = 0.0
    travel: float | None = None
    spread: tuple[float, float] = (0.0, 0.0)

    def follows(self, record: Record) -> np.ndarray:
        """The lagged command [k]."""
        return self.lag.applied(record.signals["command"], record.period, record.late)

    def of(self, record: Record) -> np.ndarray:
        """The opening [k] in units of the command: the spool's, where there is one."""
        if self.travel is None or "spool" not in record.signals:
            return self.follows(record)
        rows = 2 * int(SMOOTH / record.period / 2) + 1
        return (uniform_filter1d(record.signals["spool"], rows, mode="nearest") - self.bias) / self.travel


def spool_opening(records: Sequence[Record], rig: Rig) -> Opening | None:
    """By the lag that explains the recorded spool best; None where no record has a spool that moves."""
    carriers = [record for record in records if "spool" in record.signals and np.ptp(record.signals["command"]) > 0]
    if not carriers:
        return None

    follows, spool = np.zeros(0), np.concatenate([record.signals["spool"] for record in carriers])

    def errors(numbers: np.ndarray) -> np.ndarray:
        nonlocal follows
        lag = ValveLag(*np.exp(numbers))
        follows = np.concatenate([Opening(lag).follows(record) for record in carriers])
        columns = np.column_stack((np.ones_like(follows), follows))
        return (spool - columns @ np.linalg.lstsq(columns, spool)[0]) / rig["z3max"]

    found = least_squares(errors, np.log(_FIRST), bounds=np.log(_RANGE), loss="soft_l1", f_scale=1e-2, max_nfev=30)
    lag = ValveLag(*(float(number) for number in np.exp(found.x)))
    return _calibrated(lag, carriers)


def _calibrated(lag: ValveLag, records: Sequence[Record]) -> Opening:
    """Bias and travel by a straight line, where the command is nearly as it was: in motion a lag passes for a gain."""
    series = []
    for record in records:
        follows, command = Opening(lag).follows(record), record.signals["command"]
        calm = np.abs(command - follows) < _CALM * np.abs(command) + _STILL
        x = np.column_stack((np.ones(int(calm.sum())), follows[calm]))
        series.append(Series(record.signals["spool"][calm], x, max(1, round(_GROUP / record.period))))
    fit = regress(series, np.zeros(2), np.full(2, np.inf), summed=False)
    bias, travel = (float(number) for number in fit.coefficients)
    unit = np.eye(2) / travel
    return Opening(lag, bias, travel, (fit.deviation(unit[0]), max(_LEAST, fit.deviation(unit[1]))))


def command_opening(rig: Rig) -> Opening:
    """The opening where no spool was recorded: a lag as the rig's own valve has it, by its model at rest."""
    plant = build_valve_bench(rig)
    rest = equilibrium(plant, command=0.0, p=plant.without_dry_friction())
    sine = stepped_sine(Engine(plant), rest.x, rest.u, [_SLOW], _SMALL, ["spool"])
    late = -float(np.angle(sine.response["spool"][0])) / (2 * np.pi * _SLOW)
    return Opening(ValveLag(_DAMPING / (np.pi * late), _DAMPING))  # a second-order lag is late by 2 zeta/w
