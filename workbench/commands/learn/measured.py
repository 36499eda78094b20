"""The closed loop's response measured as on a rig: a multisine on the reference, with noise."""

from typing import Any

import numpy as np

from ...base.errors import InputError
from ...identify.data.frequency_response import measured_response
from ...loop.repeated_record import RepeatedRecord
from ...records import Record
from ...records.excitation import MultisineSpec, multisine
from ..common.record_experiment import RecordExperiment

PERIODS = 5  # of which the first is the transient
FAINT = 0.95  # coherence of a line that counts


def measured_loop(experiment: RecordExperiment, measure: MultisineSpec, played: RepeatedRecord) -> dict[str, Any]:
    """{"f": [k] Hz, "response": [k] complex}: reference -> controlled signal, up to where they are coherent.

    Raises InputError where the multisine trips the guard, or too little of it is coherent.
    """
    period = experiment.rig.period.value
    wave = multisine(measure.amplitude, measure.seconds, period, measure.band, "1/f", measure.lines)
    rows = round(measure.seconds / period)
    run = played.play(-2, np.tile(wave, PERIODS), 1.0)
    if run.tripped is not None:
        raise InputError(f"[measure] amplitude: {run.tripped}; make it smaller")
    name = experiment.signal.name
    t = np.arange((PERIODS - 1) * rows) * period
    record = Record("multisine", t, {"reference": run.drive[rows:], name: run.measured[rows:]})
    response = measured_response(record, "reference", name, rows * period)
    clear = response.coherence > FAINT
    last = len(clear) if clear.all() else int(np.argmin(clear))
    if last < 2:
        raise InputError("[measure] amplitude: the response drowns in noise; make it larger")
    return {"f": response.f[:last], "response": response.response[:last]}
