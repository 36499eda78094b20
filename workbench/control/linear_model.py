"""A linear plant as a law in the frequency domain is designed on it: its response, and what a law may cancel."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..base.errors import InputError
from ..linear.interconnect import feedback
from ..linear.state_space import StateSpace, modal_form
from ..rigs.linear_rig import LinearRig
from .linear_observer import sampled_model

_NULL = 1e-6  # rad/s over the largest pole: a root so slow counts as 0
_FAST = 0.25  # of the sampling frequency: faster roots stay in the plant
_SHARP = 0.2  # damping below which a zero stays in the plant: its cancellation would ring


@dataclass(frozen=True, eq=False)
class LinearModel:
    """A linear plant sampled every `period` [s] with its delay and the computing delay."""

    plant: LinearRig
    period: float

    def response(self, f: np.ndarray) -> np.ndarray:
        """position/command at f [k] in Hz, complex [k] in m."""
        form = modal_form(self._sampled)
        return form.outputs(form.states(np.exp(2j * np.pi * np.asarray(f) * self.period)))[0, 0]

    def stable(self, law: StateSpace) -> bool:
        """Whether the loop of a discrete law (error -> command) on it is stable."""
        of_position = replace(law, C=-law.C, D=-law.D).relabelled(["position"], ["command"])
        return bool(np.abs(feedback(self._sampled, of_position).poles()).max() < 1 - 1e-9)

    @property
    def modes(self) -> np.ndarray:
        """Poles [rad/s] that a law may cancel: stable, not 0, slow enough to be sampled."""
        return self._slow(self._poles[np.abs(self._poles) > self._null])

    @property
    def zeros(self) -> np.ndarray:
        """Zeros [rad/s] that a law may cancel: stable and damped, too."""
        zeros = self._zeros
        if np.any(np.abs(zeros) < self._null):
            raise InputError(f"{self.plant.name} does not answer to a lasting command; this law needs one that does")
        return self._slow(zeros[-np.real(zeros) > _SHARP * np.abs(zeros)])

    @property
    def integrators(self) -> int:
        """How many poles are 0."""
        return int(np.sum(np.abs(self._poles) <= self._null))

    @cached_property
    def _sampled(self) -> StateSpace:
        return sampled_model(self.plant, self.period)

    @cached_property
    def _poles(self) -> np.ndarray:
        return np.linalg.eigvals(self.plant.state_matrices()[0]).astype(complex)

    @cached_property
    def _zeros(self) -> np.ndarray:
        """The finite ones, by the pencil of Rosenbrock's system matrix."""
        from scipy.linalg import eigvals

        a, b, c, _ = self.plant.state_matrices()
        size = np.array(self.plant.sizes)
        system = np.block([[a * size / size[:, None], b / size[:, None]], [c[:1] * size, np.zeros((1, 1))]])
        passing = np.diag(np.append(np.ones(len(a)), 0.0))
        zeros = np.asarray(eigvals(system, passing), complex)
        return zeros[np.isfinite(zeros)]

    @property
    def _null(self) -> float:
        return _NULL * max(1.0, float(np.abs(self._poles).max(initial=0.0)))

    def _slow(self, roots: np.ndarray) -> np.ndarray:
        return roots[(np.real(roots) < 0) & (np.abs(roots) < 2 * np.pi * _FAST / self.period)]
