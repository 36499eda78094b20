"""A platform on six jacks: every number of payload, geometry and legs once, with its unit and source."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from ...base.columns import lookup
from ...base.errors import InputError, nearest
from ...base.units import Spec
from ..number import Number, number_entry
from ..rig import Rig
from .effects import PlatformEffect, effect_tables
from .kinematics import Geometry, forward, leg_lengths

LEGS = 6
PAYLOAD = {
    "mass": Spec("kg", 1e-3, 1e7, "mass of platform and payload"),
    "cx": Spec("m", -100.0, 100.0, "their centre of mass from the platform's origin, along x"),
    "cy": Spec("m", -100.0, 100.0, "along y"),
    "cz": Spec("m", -100.0, 100.0, "along z"),
    "Ixx": Spec("kg m^2", 1e-6, 1e9, "moment of inertia about their centre of mass, x axis"),
    "Iyy": Spec("kg m^2", 1e-6, 1e9, "y axis"),
    "Izz": Spec("kg m^2", 1e-6, 1e9, "z axis"),
    "Ixy": Spec("kg m^2", -1e9, 1e9, "product of inertia, the integral of -x y"),
    "Ixz": Spec("kg m^2", -1e9, 1e9, "of -x z"),
    "Iyz": Spec("kg m^2", -1e9, 1e9, "of -y z"),
}
PLACE = {
    "height": Spec("m", -100.0, 100.0, "height of the platform's origin above the base frame at home"),
    "gravity": Spec("m/s^2", 0.0, 100.0, "acceleration of gravity, against z"),
}
LEG = {
    "length": Spec("m", 0.01, 100.0, "length from joint to joint at mid stroke"),
    "cylinder_mass": Spec("kg", 0.0, 1e5, "mass of the half on the base joint"),
    "cylinder_centre": Spec("m", 0.0, 100.0, "its centre of mass from the base joint"),
    "cylinder_inertia": Spec("kg m^2", 0.0, 1e6, "its moment of inertia across the leg, about its centre of mass"),
    "rod_mass": Spec("kg", 0.0, 1e5, "mass of the half on the platform joint, the piston with it"),
    "rod_centre": Spec("m", 0.0, 100.0, "its centre of mass from the platform joint"),
    "rod_inertia": Spec("kg m^2", 0.0, 1e6, "its moment of inertia across the leg, about its centre of mass"),
}
HALVES = tuple(name for name in LEG if name != "length")  # the numbers of its two halves
COORDINATE = Spec("m", -100.0, 100.0, "coordinate of a joint")
JOINTS = {
    "base_angle": Spec("rad", 0.0, np.pi, "allowed angle of a base joint from home"),
    "platform_angle": Spec("rad", 0.0, np.pi, "allowed angle of a platform joint from home"),
}
Point = tuple[float, float, float]
T = TypeVar("T", bound=Any)


@dataclass(frozen=True)
class Leg:
    """One leg: its jack as a rig, its joints on base and platform [m], each in its frame, and the numbers of `LEG`.

    `sources` say where the joints come from, base first.
    """

    rig: Rig
    base: Point
    joint: Point
    numbers: Mapping[str, Number]
    sources: tuple[str, str] = ("", "")


def leg_masses(n: Mapping[str, T], length: T) -> tuple[T, T, T]:
    """The masses of a leg, of numbers n of `LEG` and length [m], numbers or symbols: mu, which it is at its platform
    joint across itself, kg, how that changes with the length, kg/m, and the mass whose weight that joint carries,
    kg."""
    rod, cylinder, reach = n["rod_mass"], n["cylinder_mass"], length - n["rod_centre"]
    turning = n["cylinder_inertia"] + cylinder * n["cylinder_centre"] ** 2 + n["rod_inertia"]
    mu = (turning + rod * reach**2) / length**2
    slope = 2 * (rod * reach / length - mu) / length
    return mu, slope, (cylinder * n["cylinder_centre"] + rod * reach) / length


@dataclass(frozen=True, eq=False)
class Platform:
    """Payload, geometry and six legs; `numbers` are those of PAYLOAD, PLACE and JOINTS, SI. Legs share one control
    period; `effects` are those of joints and payload, those of a jack are its rig's."""

    name: str
    title: str
    source: str
    numbers: Mapping[str, Number]
    legs: tuple[Leg, ...]
    effects: tuple[PlatformEffect, ...] = ()

    def __getitem__(self, name: str) -> float:
        """SI value of a number. Raises KeyError that names the nearest there is."""
        return lookup(self.numbers, name, f"number of platform {self.name}").value

    def __repr__(self) -> str:
        """Two lines: title, payload and jacks."""
        jacks = ", ".join(dict.fromkeys(leg.rig.name for leg in self.legs))
        return f"<Platform {self.name}: {self.title}\n payload {self['mass']:g} kg, jacks {jacks}>"

    @cached_property
    def geometry(self) -> Geometry:
        """The places of its joints."""
        base, joints = (np.array([getattr(leg, end) for leg in self.legs]) for end in ("base", "joint"))
        return Geometry(base, joints, self["height"])

    @property
    def middle(self) -> np.ndarray:
        """Lengths [6] of the legs at mid stroke, m."""
        return np.array([leg.numbers["length"].value for leg in self.legs])

    def poses(self, positions: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
        """Poses [n, 6] in which the jacks stand at positions [n, 6], m, near those of `start` (home). Raises InputError
        where there are none."""
        return forward(self.geometry, positions - [leg.rig.middle for leg in self.legs] + self.middle, start)

    def positions(self, pose: np.ndarray) -> np.ndarray:
        """Positions [.., 6] of the jacks in poses [.., 6], m: exact inverse kinematics."""
        return leg_lengths(self.geometry, pose) - self.middle + np.array([leg.rig.middle for leg in self.legs])

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self.legs[0].rig.period.value

    def of_rigs(self, make: Callable[[Rig], T]) -> list[T]:
        """What `make` makes of the rig of each leg [6], once for those that are one object."""
        rigs = {id(leg.rig): leg.rig for leg in self.legs}
        results = {key: make(rig) for key, rig in rigs.items()}
        return [results[id(leg.rig)] for leg in self.legs]

    def with_rigs(self, change: Callable[[Rig], Rig]) -> "Platform":
        """A copy with the rig of every leg changed."""
        pairs = zip(self.legs, self.of_rigs(change), strict=True)
        return replace(self, legs=tuple(replace(leg, rig=rig) for leg, rig in pairs))

    @property
    def leg_numbers(self) -> dict[str, np.ndarray]:
        """The numbers of LEG of all legs [6]."""
        return {name: np.array([leg.numbers[name].value for leg in self.legs]) for name in LEG}

    def limits(self, name: str) -> np.ndarray:
        """A limit of the jacks [6], SI."""
        return np.array([leg.rig.limit(name) for leg in self.legs])

    def with_values(self, **values: float) -> "Platform":
        """A copy with other SI values of payload, place and joints, or of all legs. Raises InputError for an unknown
        name or an impossible value."""
        own = {name: value for name, value in values.items() if name not in LEG}
        legs = {name: value for name, value in values.items() if name in LEG}
        numbers = self._with(self.numbers, {**PAYLOAD, **PLACE, **JOINTS}, own)
        changed = tuple(replace(leg, numbers=self._with(leg.numbers, LEG, legs)) for leg in self.legs)
        return replace(self, numbers=numbers, legs=changed)

    def without_leg_inertia(self) -> "Platform":
        """A copy whose legs have no mass, as tendons in a multibody program."""
        return self.with_values(**dict.fromkeys(("cylinder_mass", "cylinder_inertia", "rod_mass", "rod_inertia"), 0.0))

    def _with(
        self, numbers: Mapping[str, Number], specs: Mapping[str, Spec], values: Mapping[str, float]
    ) -> dict[str, Number]:
        for name, value in values.items():
            if name not in numbers:
                raise InputError(f'platform {self.name}: no number "{name}"; {nearest(name, specs)}')
            if problem := specs[name].problem(value):
                raise InputError(f"platform {self.name}: {name}: {problem}")
        return {key: replace(n, value=float(values.get(key, n.value))) for key, n in numbers.items()}

    def table(self) -> dict[str, Any]:
        """Tables of every number in SI with its source, for reports and for the identity of a run."""
        legs = [
            {"base": list(leg.base), "joint": list(leg.joint), "rig": leg.rig.table()}
            | {name: number_entry(number) for name, number in leg.numbers.items()}
            for leg in self.legs
        ]
        numbers = {name: number_entry(number) for name, number in self.numbers.items()}
        return {
            "name": self.name,
            "title": self.title,
            "source": self.source,
            "numbers": numbers,
            "legs": legs,
        } | effect_tables(self.effects)
