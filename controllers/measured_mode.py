"""P with pressure feedback that measures mass, oil and velocity gain while it moves, and schedules itself by them."""

from collections.abc import Iterable
from dataclasses import replace
from typing import ClassVar

from workbench.control.jack_model import NominalJack
from workbench.control.law import LawController
from workbench.control.mode_law import NUMBERS, POWERS, ModeMeter, ModeSchedule, mode_law
from workbench.control.protocol import design_numbers, number


class OnMeasuredMode(LawController):
    """u = K (r* - x) - P s/(s + h) (pa - pb) (1 - (x/column)^2) + F s/(s/f + 1)^2 r*,

        r* = ((s/n)^2 + T s + 1)/(s/w + 1)^2 r

    as P with PressureFeedback, FeedForward and Shaping. Until a motion has told it more its numbers are `gain` to
    `notch`. A ModeMeter measures mass m, compliance c and velocity gain g over the nominal ones;
    with trust k in them each number goes over to k times that of the measured plant, whose mode is q = (m c)^-1/2
    times the nominal one:

        K q^a/g,  P (c/m)^1/2 q^b/g,  h q,  F/g,  f q,  w q^d,  T q^-e,  n q^e

    with the `known_` numbers. At rest r* = x, and neither filter gives anything: a number that changes makes no bump.
    """

    @design_numbers
    class Design(NominalJack):
        """Design numbers: of the nominal jack, of the law that knows nothing, and of the one that has measured."""

        column: float = number("m", 1e-3, 100.0, "as of the oil, for the pressure's gain: shorter evens out margins")
        gain: float = number("1/m", 1e-3, 1e3, "command per position error K")
        pressure: float = number("1/Pa", 0.0, 1e-6, "command per pressure difference P")
        high_pass: float = number("Hz", 0.01, 100.0, "corner of the pressure's high pass h")
        velocity: float = number("s/m", 0.0, 1e3, "command per velocity of the reference F")
        forward: float = number("Hz", 0.1, 1e4, "corner of the feed-forward f")
        shape: float = number("Hz", 0.1, 1e4, "corner of the reference's lags w")
        lead: float = number("s", 0.0, 10.0, "lead time of the reference's zeros T")
        notch: float = number("Hz", 0.1, 1e4, "frequency of the reference's zeros n")
        known_gain: float = number("1/m", 1e-3, 1e3, "K on the nominal jack, once measured")
        known_pressure: float = number("1/Pa", 0.0, 1e-6, "P there")
        known_high_pass: float = number("Hz", 0.01, 100.0, "h there")
        known_velocity: float = number("s/m", 0.0, 1e3, "F there")
        known_forward: float = number("Hz", 0.1, 1e4, "f there")
        known_shape: float = number("Hz", 0.1, 1e4, "w there")
        known_lead: float = number("s", 0.0, 10.0, "T there")
        known_notch: float = number("Hz", 0.1, 1e4, "n there")
        gain_power: float = number("1", -2.0, 3.0, "power of the mode in K a", 1.0)
        pressure_power: float = number("1", -2.0, 3.0, "power of the mode in P b", 0.0)
        shape_power: float = number("1", -2.0, 3.0, "power of the mode in w d", 1.0)
        notch_power: float = number("1", -2.0, 3.0, "power of the mode in T and n e", 1.0)

    measures: ClassVar[tuple[str, ...]] = ("position", "pa", "pb")

    def __init__(self, design: Design, period: float) -> None:
        self._meter = ModeMeter(design, period)
        super().__init__(mode_law(self._meter, schedule_of(design), design.column))

    @property
    def measured(self) -> tuple[float, ...]:
        """Mass, compliance and velocity gain over the nominal ones as measured by now, and the trust in them."""
        return tuple(map(float, self._meter.reading(self.state[: self._meter.states])))

    @property
    def taken(self) -> float:
        """How far it has gone over to what it has measured, from 0 to 1."""
        return float(self.state[self._meter.states])


def schedule_of(design: OnMeasuredMode.Design) -> ModeSchedule:
    """The numbers of a design that what is measured schedules."""

    def picked(names: Iterable[str]) -> list[float]:
        return [getattr(design, name) for name in names]

    return ModeSchedule(picked(NUMBERS), picked(f"known_{name}" for name in NUMBERS), picked(POWERS))


def frozen(design: OnMeasuredMode.Design, taken: float, m: float, c: float, g: float) -> OnMeasuredMode.Design:
    """A design whose start, and so its linear view, has taken over this share of m, c and g times nominal."""
    return replace(design, **dict(zip(NUMBERS, schedule_of(design).numbers(taken, m, c, g), strict=True)))
