"""Systems put together by the names of their signals: in series, in parallel, in feedback.

Signals of one name are one signal. Where two outputs have one name they add up.
"""

from collections.abc import Sequence

import numpy as np

from .state_space import StateSpace


def select(system: StateSpace, inputs: Sequence[str], outputs: Sequence[str]) -> StateSpace:
    """The system from and to these signals, in their order; an input that it does not have does nothing."""
    entering, leaving = _pick(system.input_labels, inputs), _pick(outputs, system.output_labels)
    d = leaving @ system.D @ entering
    return StateSpace(system.A, system.B @ entering, leaving @ system.C, d, system.dt, list(inputs), list(outputs))


def parallel(first: StateSpace, second: StateSpace) -> StateSpace:
    """Both beside each other, on all the inputs of either. States: the first's, then the second's."""
    inputs = _union(first.input_labels, second.input_labels)
    outputs = _union(first.output_labels, second.output_labels)
    upper, lower = (select(system, inputs, system.output_labels) for system in (first, second))
    to_upper, to_lower = (_pick(outputs, system.output_labels) for system in (first, second))
    return StateSpace(
        _beside(first.A, second.A),
        np.vstack((upper.B, lower.B)),
        np.hstack((to_upper @ first.C, to_lower @ second.C)),
        to_upper @ upper.D + to_lower @ lower.D,
        first.dt,
        inputs,
        outputs,
    )


def series(first: StateSpace, second: StateSpace) -> StateSpace:
    """What `second` makes of the outputs of `first` that it takes; its other inputs stay.

    States: the second's, then the first's.
    """
    inputs = _union(first.input_labels, [name for name in second.input_labels if name not in first.output_labels])
    taken = [name for name in first.output_labels if name in second.input_labels]
    lead = select(first, inputs, taken)
    rest = select(second, [name if name not in taken else "" for name in inputs], second.output_labels)
    driven = select(second, taken, second.output_labels)
    a, b, c, d = lead.matrices
    return StateSpace(
        np.block([[second.A, driven.B @ c], [np.zeros((len(a), len(second.A))), a]]),
        np.vstack((rest.B + driven.B @ d, b)),
        np.hstack((second.C, driven.D @ c)),
        rest.D + driven.D @ d,
        second.dt,
        inputs,
        second.output_labels,
    )


def feedback(system: StateSpace, law: StateSpace) -> StateSpace:
    """A system whose inputs have added to them what a law makes of its outputs; its own signals, then the law's others.

    States: the system's, then the law's. Raises ValueError where the system's outputs answer to those inputs at once.
    """
    taken = [name for name in law.input_labels if name in system.output_labels]
    given = [name for name in law.output_labels if name in system.input_labels]
    inputs = _union(system.input_labels, [name for name in law.input_labels if name not in taken])
    if np.any(select(system, given, system.output_labels).D):
        raise ValueError("outputs that answer at once to what a law gives make an algebraic loop")
    own, acting = select(system, inputs, system.output_labels), select(system, given, taken)
    heard, beside = select(law, taken, given), select(law, inputs, given)
    b, c = acting.B, acting.C
    return StateSpace(
        np.block([[system.A + b @ heard.D @ c, b @ heard.C], [heard.B @ c, law.A]]),
        np.vstack((own.B + b @ beside.D, beside.B)),
        np.hstack((system.C, np.zeros((len(system.C), len(law.A))))),
        own.D,
        system.dt,
        inputs,
        system.output_labels,
    )


def _beside(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Two square matrices on the diagonal of one."""
    n = len(first)
    both = np.zeros((n + len(second), n + len(second)))
    both[:n, :n], both[n:, n:] = first, second
    return both


def _pick(rows: Sequence[str], columns: Sequence[str]) -> np.ndarray:
    """The matrix [rows, columns] with 1 where the names are one."""
    return np.array([[float(row == column) for column in columns] for row in rows]).reshape(len(rows), len(columns))


def _union(names: Sequence[str], more: Sequence[str]) -> list[str]:
    return list(dict.fromkeys((*names, *more)))
