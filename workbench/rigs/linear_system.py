"""A linear plant out of a system of python-control."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.errors import InputError
from ..base.numbers import sampling_period
from ..base.table import ConfigTable
from .linear_file import read_linear_rig
from .linear_rig import LinearRig
from .linear_signals import measured_as

if TYPE_CHECKING:
    import control

Quantity = float | str


def linear_plant(
    system: "control.StateSpace | control.TransferFunction",
    period: Quantity,
    stroke: Quantity,
    name: str = "plant",
    command: float = 1.0,
    position: str = "m",
    delay: Quantity = 0.0,
    noise: Quantity = 0.0,
    resolution: Quantity = 0.0,
    computing_delay: Quantity = 0.0,
    load: Quantity | None = None,
    **limits: Quantity,
) -> LinearRig:
    """A system from one input to the position, in the place of a rig: `ClosedLoop(linear_plant(...), controller)`.

    Where the position's unit is no length, the numbers in [m] are in its SI unit: rad, N, V, degC, ...

    Parameters
    ----------
    system
        A python-control system; one that is sampled with held inputs may have any period of its own.
    period
        Control period [s].
    stroke
        Allowed distance from rest [m].
    name
        Name of the plant.
    command
        Input of the system at full command, in the system's unit.
    position
        Unit of the system's output.
    delay
        Delay of the command [s].
    noise
        Standard deviation of the position sensor's noise [m].
    resolution
        Resolution of the position sensor [m].
    computing_delay
        Time that the controller takes [s].
    load
        Command to which a force amounts [1/N].
    **limits
        Limits of the guard: speed [m/s], force [N], command_rate [1/s], following_error [m].

    Returns
    -------
    The plant, in the place of a rig.

    Raises
    ------
    InputError
        For a system that cannot be taken.
    """
    model, si = _model(system), measured_as(position)
    units = {"period": "s", "delay": "s", "computing_delay": "s", "noise": si, "resolution": si}
    values = {"period": period, "delay": delay, "computing_delay": computing_delay}
    sensor = {"noise": noise, "resolution": resolution}
    further = {} if load is None else {"load": _text(load, "1/N")}
    ends = {"stroke": si, "speed": f"{si}/s", "following_error": si, "force": "N", "command_rate": "1/s"}
    tables: dict[str, Any] = {
        "name": name,
        **model,
        "signals": {"command": command, "position": position, "delay": _text(delay, "s"), **further},
        "limits": {key: _text(value, ends.get(key, "1")) for key, value in {"stroke": stroke, **limits}.items()},
        "control": {key: _text(values[key], units[key]) for key in ("period", "computing_delay")},
        "sensors": {"position": {key: _text(value, units[key]) for key, value in sensor.items()}},
    }
    return read_linear_rig(ConfigTable(tables, "linear_plant"), name)


def _model(system: Any) -> dict[str, Any]:
    """The table of a model."""
    if not (hasattr(system, "A") or hasattr(system, "num")):  # such as a frequency response, or a nonlinear one
        kind = type(system).__name__
        raise InputError(f"linear_plant: give a control.StateSpace or a control.TransferFunction, no {kind}")
    if (system.ninputs, system.noutputs) != (1, 1):
        raise InputError("linear_plant: give a system with one input, the command, and one output, the position")
    period = sampling_period(system)
    if hasattr(system, "num") and not period:
        numerator, denominator = (np.trim_zeros(np.ravel(part[0][0]), "f") for part in (system.num, system.den))
        return {"transfer_function": {"numerator": numerator.tolist(), "denominator": denominator.tolist()}}
    if not hasattr(system, "A"):
        import control

        system = control.ss(system)
    sampled = {"period": _text(period, "s")} if period else {}
    matrices = {key: np.asarray(getattr(system, key), float).tolist() for key in "ABCD"}
    return {"state_space": {**matrices, **sampled}}


def _text(value: Quantity, si: str) -> str:
    """A number in its SI unit as text, as a file has it."""
    return value if isinstance(value, str) else f"{float(value)!r} {si}"
