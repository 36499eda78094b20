"""Linear systems inside the workbench: matrices with named signals, under python-control's names but without its wait.

python-control takes two seconds to import. What is named as here may be either; `StateSpace.to_control` and
`as_state_space` go from one to the other.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.errors import InputError
from ..base.numbers import sampling_period

if TYPE_CHECKING:
    import control

_DEPENDENT = 1e4  # condition of eigenvectors that would lose four digits of a response

Matrices = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class StateSpace:
    """x' = A x + B u (or x[k+1] with a period `dt` [s]; 0: continuous), y = C x + D u, with names of u and y.

    A is [n, n], B [n, inputs], C [outputs, n], D [outputs, inputs].
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    dt: float = 0.0
    input_labels: list[str] = field(default_factory=list)
    output_labels: list[str] = field(default_factory=list)

    @property
    def matrices(self) -> Matrices:
        """A, B, C, D."""
        return self.A, self.B, self.C, self.D

    def poles(self) -> np.ndarray:
        """Eigenvalues [n] of A, complex."""
        return np.linalg.eigvals(self.A).astype(complex)

    def __call__(self, at: complex | np.ndarray, squeeze: bool = True) -> np.ndarray:
        """Response at s [rad/s] or z, complex [outputs, inputs]; at [k] of them [outputs, inputs, k].

        Of one input and one output it is a number or [k], unless `squeeze` is False.
        """
        resolvent = np.asarray(at, complex)[..., None, None] * np.eye(len(self.A)) - self.A
        response = self.C @ np.linalg.solve(resolvent, np.broadcast_to(self.B, (*np.shape(at), *self.B.shape))) + self.D
        response = np.moveaxis(response, 0, -1) if np.ndim(at) else response
        return response[0, 0] if squeeze and self.D.size == 1 else response

    def relabelled(self, inputs: Sequence[str], outputs: Sequence[str]) -> "StateSpace":
        """This system with other names of its signals."""
        return replace(self, input_labels=list(inputs), output_labels=list(outputs))

    def to_control(self, **names: Any) -> "control.StateSpace":
        """The python-control system; `names` may give its states and its name."""
        import control

        labels = {"inputs": self.input_labels, "outputs": self.output_labels}
        return control.StateSpace(*self.matrices, self.dt, **labels, **names)


def state_space(a: Any, b: Any, c: Any, d: Any, dt: float, inputs: Sequence[str], outputs: Sequence[str]) -> StateSpace:
    """A StateSpace of nested lists or arrays; a law without states is written with a = b = c = []."""
    d = np.array(d, dtype=float, ndmin=2)
    n = len(a)
    shapes = (n, n), (n, d.shape[1]), (d.shape[0], n)
    a, b, c = (np.asarray(part, dtype=float).reshape(shape) for part, shape in zip((a, b, c), shapes, strict=True))
    return StateSpace(a, b, c, d, dt, list(inputs), list(outputs))


def transposed(system: StateSpace) -> StateSpace:
    """Outputs as inputs and inputs as outputs: the response of few outputs to many inputs is quicker so."""
    a, b, c, d = system.matrices
    return StateSpace(a.T, c.T, b.T, d.T, system.dt, system.output_labels, system.input_labels)


def as_state_space(system: "StateSpace | control.StateSpace") -> StateSpace:
    """A python-control system as a StateSpace; a StateSpace as it is.

    Raises InputError for what is no state space, and for one that is sampled at a period that it does not say.
    """
    if isinstance(system, StateSpace):
        return system
    if not all(hasattr(system, name) for name in "ABCD"):
        raise InputError(f"{type(system).__name__} is no state space; give a control.StateSpace")
    a, b, c, d = (np.asarray(part, dtype=float) for part in (system.A, system.B, system.C, system.D))
    return StateSpace(a, b, c, d, sampling_period(system), list(system.input_labels), list(system.output_labels))


def of_sum(system: StateSpace, weights: Mapping[str, float]) -> StateSpace:
    """A system with one input, driven by a weighted sum of signals: each by its name with its weight."""
    row = np.array([list(weights.values())])
    return replace(system, B=system.B @ row, D=system.D @ row, input_labels=list(weights))


def transfer_function(numerator: Sequence[float], denominator: Sequence[float]) -> Matrices:
    """A, B, C, D in controllable form of numerator(s)/denominator(s), highest power first.

    Raises ValueError for more zeros than poles.
    """
    den = np.array(denominator, dtype=float) / denominator[0]
    n = len(den) - 1
    if len(numerator) > n + 1:
        raise ValueError(f"{len(numerator) - 1} zeros but {n} poles")
    num = np.append(np.zeros(n + 1 - len(numerator)), np.array(numerator, dtype=float) / denominator[0])
    a = np.vstack((-den[1:], np.eye(n - 1, n))) if n else np.zeros((0, 0))
    return a, np.eye(n, 1), (num[1:] - num[0] * den[1:])[None], np.array([[num[0]]])


def tustin(matrices: Matrices, period: float) -> Matrices:
    """Sampled every `period` [s] by Tustin's rule, s = 2/T (z - 1)/(z + 1)."""
    a, b, c, d = matrices
    half = period / 2 * a
    left = np.eye(len(a)) - half
    entering = np.linalg.solve(left, period * b)
    return (
        np.linalg.solve(left, np.eye(len(a)) + half),
        entering,
        np.linalg.solve(left.T, c.T).T,
        d + 0.5 * (c @ entering),
    )


@dataclass(frozen=True)
class TriangularForm:
    """A discrete system in states in which A is upper triangular [n, n], so that all z are solved for at once.

    entering [n, inputs], leaving [outputs, n], direct [outputs, inputs]; complex. `diagonal`: A is.
    """

    upper: np.ndarray
    entering: np.ndarray
    leaving: np.ndarray
    direct: np.ndarray
    diagonal: bool = False

    def states(self, at: np.ndarray) -> np.ndarray:
        """What the inputs make of the states at z [k]: complex [n, inputs, k]."""
        if self.diagonal:
            return self.entering[..., None] / (at - self.upper.diagonal()[:, None])[:, None]
        x = np.empty((*self.entering.shape, len(at)), complex)
        for i in reversed(range(len(self.upper))):
            known = np.einsum("n,nmk->mk", self.upper[i, i + 1 :], x[i + 1 :])  # not by BLAS: its threads cost more
            x[i] = (self.entering[i][:, None] + known) / (at - self.upper[i, i])
        return x

    def outputs(self, states: np.ndarray, rows: list[int] | slice = slice(None)) -> np.ndarray:
        """Response [rows, inputs, k] of some outputs, from `states`."""
        return np.einsum("pn,nmk->pmk", self.leaving[rows], states) + self.direct[rows, :, None]


def schur_form(system: "StateSpace | control.StateSpace") -> TriangularForm:
    """By a complex Schur form of the balanced A: unitary, so that equal poles, such as a delay's, are no special case.

    Laub, IEEE Trans. Automatic Control 26(2), 1981, does it by a Hessenberg form.
    """
    a, b, c, d = (np.asarray(part) for part in (system.A, system.B, system.C, system.D))
    if not len(a):
        return TriangularForm(a, b, c, d)
    from scipy.linalg import schur

    balanced, scale = _balanced(a)
    upper, turn = schur(balanced, "complex")[:2]
    return TriangularForm(upper, turn.conj().T @ (b / scale[:, None]), (c * scale) @ turn, d)


def modal_form(system: StateSpace) -> TriangularForm:
    """By the eigenvectors of the balanced A, quicker to evaluate; the Schur form where they are nearly dependent."""
    a, b, c, d = system.matrices
    balanced, scale = _balanced(a)
    poles, modes = np.linalg.eig(balanced)
    if np.linalg.cond(modes) > _DEPENDENT:
        return schur_form(system)
    entering = np.linalg.solve(modes, (b / scale[:, None]).astype(complex))
    return TriangularForm(np.diag(poles), entering, (c * scale) @ modes, d, diagonal=True)


def _balanced(a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A of states in other units, [n], in which its rows and columns are of one size."""
    from scipy.linalg import matrix_balance

    balanced, (scale, _) = matrix_balance(a, permute=False, separate=True)
    return balanced, scale


def sampled_response(system: "StateSpace | control.StateSpace", at: np.ndarray) -> np.ndarray:
    """Response of a discrete system at z [k] = exp(j w T), complex [outputs, inputs, k]: C (z - A)^-1 B + D."""
    form = schur_form(system)
    return form.outputs(form.states(at))
