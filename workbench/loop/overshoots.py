"""How the overshoot of a position loop spreads when gain, jack or oil are not what the design took them for."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

from ..base.errors import InputError
from ..control.compensators import Compensator, MapsCommand
from ..control.controller_spec import ControllerSpec
from ..control.inner_loop import inner_loop_closed, overshoots
from ..control.protocol import linear_view
from ..linear import equilibrium
from ..linear.operating_point import moving_point
from ..plant import build
from ..rigs.rig import Rig

GAINS = (0.5, 0.71, 1.0, 1.41, 2.0)
FACTORS: Mapping[str, Sequence[float]] = {"M": (0.5, 0.75, 1.0, 1.25, 1.5), "beta": (0.5, 0.75, 1.0)}
STIFFNESS = (0.0, 1e5, 1e6, 1e7)  # N/m


def overshoot_spread(rig: Rig, spec: ControllerSpec) -> dict[str, dict[str, float | None]]:
    """Overshoot [percent] of a linear step by what varies and by how much; None where the loop is unstable.

    "gain" is of the controller alone, "speed" the operating point; M, beta and ks are the rig's. Of a linear plant, at
    rest, every number with bounds is at their ends. Compensators stay as they are. Raises InputError for a controller
    that measures more than the position.
    """
    period, plant = rig.period.value, build(rig)
    smooth = plant.without_dry_friction()
    law = linear_view(replace(spec, compensators=()).build(period))
    if law.input_labels != ["reference", "position"]:
        raise InputError(f"{spec.name}: measures {', '.join(law.input_labels[1:])}; a spread needs position laws")
    parts = [cast("Compensator | MapsCommand", part.build(period)) for part in spec.compensators]

    nominal = moving_point(plant, rig.passing_speed, p=smooth)[1] if rig.is_jack else 0.0

    def over(name: str = "", value: float = 0.0, speed: float = nominal, gains: Sequence[float] = (1.0,)) -> list[Any]:
        p = plant.without_dry_friction(plant.parameter_values(None, **{name: value})) if name else smooth
        return overshoots(inner_loop_closed(plant, equilibrium(plant, speed=speed, p=p), period, parts, p), law, gains)

    spread = {"gain": {f"x{gain:g}": value for gain, value in zip(GAINS, over(gains=GAINS), strict=True)}}
    if not rig.is_jack:
        for number in rig.numbers.values():
            if number.low is not None and number.high is not None:
                ends = (number.low, number.value, number.high)
                spread[f"plant {number.name}"] = {f"{end:g}": over(number.name, end)[0] for end in ends}
        return spread
    spread["speed"] = {f"{speed:g} m/s": over(speed=speed)[0] for speed in (0.0, nominal)}
    for name, factors in FACTORS.items():
        spread[name] = {f"x{factor:g}": over(name, factor * rig[name])[0] for factor in factors}
    spread["ks"] = {f"{stiffness:g} N/m": over("ks", stiffness)[0] for stiffness in STIFFNESS}
    return spread


def spread(overshoot: Mapping[str, float | None]) -> float | None:
    """Largest less least overshoot [percent]; None where one of the loops is unstable."""
    values = list(overshoot.values())
    there = [value for value in values if value is not None]
    return max(there) - min(there) if len(there) == len(values) else None
