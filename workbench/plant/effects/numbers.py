"""A described number that is another one: candidates beside the effects, so that one rule judges both.

Such a candidate has no law. It shifts a number of the rig beyond the range that the rig file trusts it to.
"""

from ...rigs.load import LOADS
from ...rigs.rig import Rig
from ...rigs.schema import LOAD
from .effect import Effect, EffectNumber

_PREFIX = "number."
_SHIFT = "by"
_FARTHEST = 10.0  # times the described value
_LOAD = {*LOAD, *(name for own in LOADS.values() for name in own)}  # of the equation of motion; others are of flows


def number_effects(rig: Rig) -> tuple[Effect, ...]:
    """A candidate for every number of the rig that has a range."""
    return tuple(
        _shifted(rig, name)
        for name, number in rig.numbers.items()
        if number.low is not None and number.high is not None and number.low < number.high
    )


def _shifted(rig: Rig, name: str) -> Effect:
    number, spec = rig.numbers[name], rig.specs[name]
    assert number.low is not None
    assert number.high is not None
    reach = _FARTHEST * max(abs(number.value), number.high - number.low)
    low = max(spec.low - number.low, -reach) if spec.low < number.low else 0.0
    high = min(spec.high - number.high, reach)
    typical = min(number.high - number.low, high) or max(number.low - number.high, 0.95 * low)
    meaning = f"beyond its range: {spec.meaning}"
    by = EffectNumber(_SHIFT, number.si, number.unit, typical, 0.95 * low, high, meaning, off=0.0)
    return Effect(
        _PREFIX + name,
        "",
        "force" if name in _LOAD else "flow",
        "no physics: the described number is another one",
        "any",
        {},
        (by,),
        shifts=name,
    )
