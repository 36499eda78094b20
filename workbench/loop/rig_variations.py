"""What a loop is judged on: the set of rigs that it has to hold on, the nominal one and each uncertain number of it
moved by itself; its computing delay, and the noise and resolution of its sensors.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ..base.errors import InputError, echo, nearest
from ..base.units import quantity
from ..control.controller_spec import ControllerSpec
from ..rigs.linear_rig import LinearRig
from ..rigs.number import Number
from ..rigs.rig import EffectUse, Rig

_FACTORS = {
    "nominal": {},
    "mass-50": {"M": 0.5},
    "mass+50": {"M": 1.5},
    "beta-50": {"beta": 0.5},
    "supply-20": {"Ps": 0.8},
}
_DELAY = "drive.delay"
_STIFFNESSES = {f"stiffness-1e{power}": 10.0**power for power in range(6, 9)}  # N/m
RIG_SET = (*_FACTORS, *_STIFFNESSES)
ALL = 50.0  # % of a range, either way: all of it
Factors = Mapping[str, tuple[float, float]]


def variation(rig: Rig, name: str) -> Rig:
    """The rig that a name of RIG_SET makes of a nominal one: a factor on a number, or a specimen [N/m].

    Parameters
    ----------
    rig
        The nominal rig.
    name
        A name of RIG_SET, such as "mass+50".

    Returns
    -------
    The rig, under that name.

    Raises
    ------
    InputError
        For an unknown name, with the nearest known one, and for a number that the rig cannot have.
    """
    if name not in RIG_SET:
        raise InputError(f"no rig {echo(name)} in the set; {nearest(name[:80], RIG_SET)}")
    if name in _STIFFNESSES:
        return replace(rig.with_values(ks=_STIFFNESSES[name]), name=name)
    return replace(rig.with_values(**{key: factor * rig[key] for key, factor in _FACTORS[name].items()}), name=name)


def with_delay(rig: Rig, delay: float | str) -> Rig:
    """The rig whose commands come later; what its drive takes is added.

    Parameters
    ----------
    rig
        The rig.
    delay
        Delay [s], a number or text with a unit.

    Returns
    -------
    The rig with the delay.

    Raises
    ------
    InputError
        For text that is no time.
    """
    later = quantity(delay, "s")
    if not later:
        return rig
    if isinstance(rig, LinearRig):
        return rig.later(later)
    from ..plant import build

    there = {use.name: use for use in rig.effects}
    before = there.get(_DELAY, EffectUse(_DELAY, "shift", {}))
    whole = later + build(rig).lateness()  # a delay that is declared without a number has its typical one
    number = Number("delay", whole, "s", "s", f"{later:g} s of them to compute the command")
    after = replace(before, numbers={**before.numbers, "delay": number})
    return replace(rig, effects=tuple({**there, _DELAY: after}.values()))


def known_to(rig: Rig, factors: Factors, share: float) -> tuple[Rig, dict[str, tuple[float, float]]]:
    """A rig, and factors [low, high] on its numbers, known to +-`share` of their ranges.

    Each range shrinks towards the rig's own value to 2 `share` of its width: with 0.5 it is the range as declared, with
    0 the value is exact.
    """

    def shrunk(low: float, high: float, middle: float) -> tuple[float, float]:
        return middle + 2 * share * (low - middle), middle + 2 * share * (high - middle)

    def known(number: Number) -> Number:
        if number.uncertain is None:
            return number
        low, high = shrunk(*number.uncertain, number.value)
        return replace(number, low=low, high=high, interval=None)

    return rig.with_each_number(known), {name: shrunk(*ends, 1.0) for name, ends in factors.items()}


@dataclass(frozen=True)
class Conditions:
    """The computing delay, and sensor noise and resolution drawn from `seed`; none of them where `ideal`."""

    ideal: bool = False
    seed: int = 0

    @property
    def noise(self) -> int | None:
        """The seed of the sensors' noise; None without noise."""
        return None if self.ideal else self.seed

    def delay(self, spec: ControllerSpec, rig: Rig) -> float:
        """Computing delay [s] of a controller on a rig: its own where it has one, else the rig's."""
        if self.ideal:
            return 0.0
        return rig.computing_delay.value if spec.computing_delay is None else spec.computing_delay
