"""The figures of a trace: errors over the noise, the evidence by equation, measured beside modelled."""

from collections.abc import Sequence

import numpy as np

from ...base.signals import SIGNALS
from ...base.units import from_si
from ...identify.data.noise_floor import NoiseFloor
from ...identify.fit.predict import Prediction
from ...report import Curve, Figure, Mark, Panel
from ..common.error_page import AFTER, BEFORE, GIVEN

SLICE = 1.0  # s, of the telling figure

Pair = tuple[Prediction, Prediction]


def evidence_figure(evidence: Sequence[tuple[str, float]], clear: float) -> Figure:
    """How far each equation is behind the best in log-likelihood; from `clear` on it is told apart from it."""
    places = np.arange(1.0, len(evidence) + 1)
    least = clear / 10
    behind = np.maximum([evidence[0][1] - gain for _, gain in evidence], least)
    curve = Curve("disturbance in this equation", places, behind, "markers", AFTER)
    ends = (0.8 * least, 1.5 * max(float(behind.max()), 2 * clear))
    panel = Panel("behind the best [1]", [curve], True, ends, (Mark(clear, "clear from here on"),))
    return Figure(
        "Evidence of a disturbance, by equation",
        "equation",
        [panel],
        note="A random disturbance is added to one equation at a time; the one that makes the errors most likely, here "
        f"at the lower edge, is where the model lacks something. One that is less than {clear:.0f} behind it in "
        "log-likelihood is not told apart from it.",
        x_names=[name for name, _ in evidence],
    )


def signal_figure(pair: Pair, name: str, floor: NoiseFloor, labels: Sequence[str], part: slice = slice(None)) -> Figure:
    """One signal of one record: measured and modelled, and what is left of it, with twice the noise as a band."""
    signal, record = SIGNALS[name], pair[0].record
    t = record.t[part]

    def shown(values: np.ndarray) -> np.ndarray:
        return from_si(values[part], signal.unit, signal.si)

    noise = float(from_si(2 * floor.sigma[name], signal.unit, signal.si) - from_si(0.0, signal.unit, signal.si))
    lines = list(zip(labels, pair[-len(labels) :], (BEFORE, AFTER)[-len(labels) :], strict=True))
    band = (np.full(2, -noise), np.full(2, noise))
    above = [Curve("measured", t, shown(record.signals[name]))]
    above += [Curve(label, t, shown(prediction.signals[name]), color=colour) for label, prediction, colour in lines]
    below = [Curve("noise, 2 sigma", t[[0, -1]], np.zeros(2), "dot", GIVEN, band=band)]
    below += [Curve(label, t, shown(prediction.error(name)), color=colour) for label, prediction, colour in lines]
    panels = [Panel(signal.label, above), Panel(f"measured - model [{signal.unit}]", below)]
    return Figure(f"{record.name}: {name}", "time [s]", panels)


def telling(pairs: Sequence[Pair], floor: NoiseFloor, changed: bool) -> tuple[int, str, slice]:
    """Where the difference is best seen: record, signal and the second of it."""
    best, place = -np.inf, (0, next(iter(pairs[0][0].signals)), slice(None))
    for index, (before, after) in enumerate(pairs):
        rows = max(2, round(SLICE / before.record.period))
        for name in before.signals:
            squares = _left(before, name, floor) - (_left(after, name, floor) if changed else 0.0)
            sums = np.convolve(squares, np.ones(min(rows, len(squares))), "valid")
            first = int(np.argmax(sums))
            if sums[first] > best:
                best, place = float(sums[first]), (index, name, slice(first, first + rows))
    return place


def _left(prediction: Prediction, name: str, floor: NoiseFloor) -> np.ndarray:
    """Squared errors over sigma, 0 where nothing is compared."""
    return np.nan_to_num((prediction.error(name) / floor.sigma[name]) ** 2)
