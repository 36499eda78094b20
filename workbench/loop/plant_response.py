"""A sampled plant with its frequency response: what loops of all designs at one operating point share."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..linear import Equilibrium
from ..linear.sampling import sampled_plant
from ..linear.state_space import StateSpace, TriangularForm, modal_form
from ..plant import Plant

_LOWEST = 1e-4  # Hz: crossings of the slowest loop that any controller allows
_POINTS = 600  # over all frequencies; more where something happens
_MODE = np.sinh(np.linspace(-3.5, 3.5, 21))  # half widths of a resonance, from its middle, at which it is looked at


@dataclass(frozen=True)
class PlantResponse:
    """A plant from its held command to all its outputs, sampled every `period` [s], and frequencies f [k] in Hz.

    f is even on a logarithmic scale up to the Nyquist frequency, and close where the plant resonates. `signals`: those
    of the operating point, as `linear_view` needs them.
    """

    model: StateSpace
    period: float
    signals: Mapping[str, float]

    @cached_property
    def f(self) -> np.ndarray:
        """Frequencies [k] in Hz: of the grid that is the plant's own."""
        even = np.geomspace(_LOWEST, 0.5 / self.period, _POINTS)
        return np.unique(np.append(even, near(self.model.poles(), self.period)))

    @cached_property
    def z(self) -> np.ndarray:
        """exp(j 2 pi f period) [k]."""
        return np.exp(2j * np.pi * self.f * self.period)

    @cached_property
    def _form(self) -> TriangularForm:
        return modal_form(self.model)

    @cached_property
    def on_grid(self) -> np.ndarray:
        """Response of all outputs at f, complex [outputs, k]."""
        return self._form.outputs(self._form.states(self.z))[:, 0]

    def rows(self, outputs: Sequence[str]) -> list[int]:
        """Where these outputs are. Raises ValueError for one that the plant does not have."""
        return [self.model.output_labels.index(name) for name in outputs]

    def at(self, z: np.ndarray, rows: list[int]) -> np.ndarray:
        """Response of some outputs at z [k], complex [rows, k]."""
        return self._form.outputs(self._form.states(z), rows)[:, 0]


def plant_response(plant: Plant, about: Equilibrium, period: float, p: np.ndarray | None = None) -> PlantResponse:
    """Of a plant about an operating point, with parameters p where they are not its own."""
    model = sampled_plant(plant, about, period, tuple(plant.outputs), p)
    return PlantResponse(model, period, signals_at(plant, about, p))


def signals_at(plant: Plant, about: Equilibrium, p: np.ndarray | None = None) -> dict[str, float]:
    """The plant's outputs, the command and the specimen's stiffness at an operating point, SI, by name.

    What a controller's linear view needs.
    """
    p = plant.p if p is None else p
    outputs = dict(zip(plant.outputs, np.array(plant.h(about.x, about.u, p)).ravel().tolist(), strict=True))
    stiffness = float(p[plant.parameters.index("ks")]) if "ks" in plant.parameters else 0.0
    return {**outputs, "command": float(about.u[0]), "stiffness": stiffness}


def near(poles: np.ndarray, period: float) -> np.ndarray:
    """Frequencies [Hz] below Nyquist's about those at which poles z resonate, as close as they are sharp."""
    turning = poles[(np.imag(poles) > 0) & (np.abs(poles) > 0)]
    middle, width = (part / (2 * np.pi * period) for part in (np.angle(turning), np.abs(np.log(np.abs(turning)))))
    f = (middle[:, None] + width[:, None] * _MODE).ravel()
    return f[(f > _LOWEST) & (f < 0.5 / period)]
