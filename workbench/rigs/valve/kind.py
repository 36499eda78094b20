"""What rigs and datasheets know of a kind of valve; its equations have the same name in plant/valve."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from ...base.units import Spec


@dataclass(frozen=True)
class ValveKind:
    """A kind of valve.

    `numbers` are those of every valve of this kind, `correctors` the further ones of each spool loop that a rig may
    choose (empty: there is nothing to choose), `slots` the places in its equations where effects act. `stages` can be
    measured alone on a flow bench, the main one last. A datasheet states `figures`;
    where it `needs_geometry`, the remaining numbers are fitted from those printed for another rig of this kind.
    `slot_numbers`: slots that are only there with a corrector that has this number.
    """

    name: str
    numbers: Mapping[str, Spec]
    slots: tuple[str, ...]
    stages: tuple[str, ...]
    figures: Mapping[str, Spec]
    correctors: Mapping[str, Mapping[str, Spec]] = field(default_factory=dict)
    needs_geometry: bool = False
    slot_numbers: Mapping[str, str] = field(default_factory=dict)

    @property
    def has_pilot(self) -> bool:
        """Whether a pilot stage with an electric current drives the main spool."""
        return "pilot" in self.stages

    @property
    def has_lands(self) -> bool:
        """Whether a main spool's lands meter the flow: a pump displaces it."""
        return "K3" in self.numbers

    def schema(self, corrector: str) -> dict[str, Spec]:
        """Every number of a valve of this kind with this spool loop."""
        return {**self.numbers, **self.correctors.get(corrector, {})}
