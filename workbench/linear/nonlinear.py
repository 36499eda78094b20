"""The plant as a python-control nonlinear system."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.errors import InputError

if TYPE_CHECKING:
    import control

    from ..plant import Plant


def nonlinear_system(plant: "Plant", p: np.ndarray | None = None) -> "control.NonlinearIOSystem":
    """A plant as a nonlinear system of python-control, all SI; stiff: integrate with Radau.

    Parameters
    ----------
    plant
        A Plant, or a Rig, whose plant is built.
    p
        Parameters [k] other than the plant's.

    Returns
    -------
    A control.NonlinearIOSystem with the plant's states, inputs and outputs.

    Raises
    ------
    InputError
        For a plant whose command is late: no ordinary differential equation is.
    """
    import control  # here, as it takes two seconds

    values = plant.p if p is None else p
    if plant.lateness(values) > 0:
        raise InputError(
            f"{plant.name}: a command that is late has no nonlinear system; take {plant.delay} out of the rig, or use "
            "ClosedLoop, or linearise"
        )

    def rates(_t: float, x: np.ndarray, u: np.ndarray, _params: Mapping[str, Any]) -> np.ndarray:
        return np.array(plant.f(x, u, values)).ravel()

    def outputs(_t: float, x: np.ndarray, u: np.ndarray, _params: Mapping[str, Any]) -> np.ndarray:
        return np.array(plant.h(x, u, values)).ravel()

    return control.NonlinearIOSystem(
        rates,
        outputs,
        inputs=[i.name for i in plant.inputs],
        outputs=list(plant.outputs),
        states=[state.name for state in plant.states],
        name=plant.name.replace(".", "_"),
    )
