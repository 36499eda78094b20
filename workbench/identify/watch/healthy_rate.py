"""How often a healthy rig would raise an alarm: counted on histories that are drawn for it, with its interval."""

from dataclasses import dataclass

from scipy.special import gammaincinv

from .changes import healthy_gains, limits, years
from .history import FEWEST, History, marginal, wander

_AGAIN = 1  # the seed of histories that no limit follows from


@dataclass(frozen=True)
class HealthyRate:
    """`alarms` in so many `years` of healthy rigs, drawn; a year, with 95 %: `value`, `low`, `high`."""

    alarms: int
    years: float
    value: float
    low: float
    high: float


def healthy_rate(of: History, a_year: float) -> HealthyRate | None:
    """The rate of histories like this rig's, drawn anew, under the limits for `a_year`; None for too few sessions
    for an alarm. An alarm has to show in two sessions in a row, which is not asked here: the true rate is lower."""
    if len(of.days) < FEWEST:
        return None
    whole = marginal(of, wander(of))
    least = limits(of, whole, a_year)
    over = (healthy_gains(of, whole, _AGAIN) >= least[:, None]).any(axis=0)
    return poisson_rate(int(over.sum()), over.size * years(of))


def poisson_rate(alarms: int, time: float) -> HealthyRate:
    """A count over a time [years] as a rate, with the 95 % interval of a Poisson count (Garwood 1936)."""
    low = float(gammaincinv(alarms, 0.025)) if alarms else 0.0
    high = float(gammaincinv(alarms + 1, 0.975))
    return HealthyRate(alarms, time, alarms / time, low / time, high / time)
