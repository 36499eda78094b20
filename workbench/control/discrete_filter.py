"""Linear filters of a controller, sampled, as discrete state spaces."""

from collections.abc import Mapping, Sequence

from ..linear.state_space import StateSpace, of_sum, transfer_function, tustin


def weighted(
    numerator: Sequence[float], denominator: Sequence[float], period: float, inputs: Mapping[str, float]
) -> StateSpace:
    """numerator(s)/denominator(s), highest power first, by Tustin's rule at `period` [s], of a weighted sum of inputs.

    `inputs` gives each signal's weight; the output is called "out". Raises ValueError for more zeros than poles.
    """
    sampled = tustin(transfer_function(numerator, denominator), period)
    return of_sum(StateSpace(*sampled, period, ["in"], ["out"]), inputs)
