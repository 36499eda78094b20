"""A closed loop swept by sines: a stepped sine at every amplitude of an experiment, and its Bode plot."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...base.signals import Signal
from ...base.units import from_si
from ...control.controller_spec import ControllerSpec
from ...control.protocol import NoLinearView
from ...linear.frequency_response import FLAGS, SteppedSine
from ...loop.describing_function import closed_loop_sweep, sweep_frequencies
from ...loop.margins import closed_poles
from ...loop.rows import LoopSetup
from ...report import Figure, FrequencyCurve, bode
from .experiment import BodeConfig

SineResponses = dict[str, dict[str, np.ndarray]]  # columns by amplitude, as it is shown


def sines(controller: ControllerSpec, signal: Signal, sweep: BodeConfig, setup: LoopSetup) -> SineResponses:
    """Reference -> controlled signal about null, with what the guard and the chambers did at each point."""
    period = setup.rig.period.value
    poles = loop_poles(controller, setup)
    f = sweep_frequencies(sweep.low, sweep.high, sweep.points, period, poles)
    responses: SineResponses = {}
    for amplitude in sweep.amplitudes:
        sine = closed_loop_sweep(setup.engine, setup.rig, lambda: controller.build(period), setup.null, f, amplitude)
        responses[f"{float(from_si(amplitude, signal.unit, signal.si)):g} {signal.unit}"] = packed(sine, signal.name)
    return responses


def loop_poles(controller: ControllerSpec, setup: LoopSetup) -> np.ndarray:
    """Poles z [k] of the linear loop at null, near which a sweep has more points; none without a linear view."""
    try:
        return closed_poles(setup.null_plant, controller.build(setup.rig.period.value))
    except NoLinearView:
        return np.zeros(0, complex)


def packed(sine: SteppedSine, output: str) -> dict[str, np.ndarray]:
    """The response of one output as columns, which a stage and a table can store."""
    response = np.asarray(sine.response[output], complex)
    columns = {"f_hz": sine.f, "real": np.real(response), "imag": np.imag(response)}
    return columns | {name: getattr(sine, name) for name in FLAGS}


def unpacked(columns: Mapping[str, np.ndarray], amplitude: float, output: str) -> SteppedSine:
    """What was packed, of a sine of this amplitude."""
    c = {name: np.asarray(column) for name, column in columns.items()}
    return SteppedSine(c["f_hz"], amplitude, {output: c["real"] + 1j * c["imag"]}, *(c[name] for name in FLAGS))


def closed_loop_figure(name: str, linear: Sequence[FrequencyCurve], swept: SineResponses) -> Figure:
    """Linear curves, dashed, and sines; the note says from which frequency a limit acts."""
    curves, notes = list(linear), []
    for size, columns in swept.items():
        curves.append(
            FrequencyCurve(f"sine, {size}", columns["f_hz"], columns["real"] + 1j * columns["imag"], "points")
        )
        for what, flagged in (
            ("the command or the current is limited", "saturated"),
            ("gas comes out of the oil in a chamber", "cavitated"),
        ):
            if np.any(columns[flagged]):
                notes.append(f"at {size} {what} from {np.min(columns['f_hz'][columns[flagged]]):.3g} Hz")
    return bode(f"Closed loop: {name}", curves, note="; ".join(notes))
