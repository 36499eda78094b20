"""Noise of measured inputs, which a model takes for true and hands on to what it predicts."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...plant import build
from ...records import Campaign, InputNoise, Record
from ...rigs.rig import Rig
from ..data.noise_floor import NoiseFloor
from ..data.signal_noise import SignalNoise, together
from .initial_states import predicted_states
from .model import Model
from .windows import cut_windows

_DRAWS = 10  # of noise for every record: on 10 s of records they give the variance of the carried part within some 3 %


def with_carried(floor: NoiseFloor, campaign: Campaign, rig: Rig) -> NoiseFloor:
    """The floor with what noise of the inputs that a campaign calls measured does to each signal through the rig.

    A perfect model is driven by the measured input, so that its noise comes out in the errors as well. The records are
    simulated with draws of it and without, and not along tangents: those are stepped too coarsely for oil that rings
    on a light mass, and lose a fifth of it. How far windows differ, as ringing oil does more where no valve is open,
    is in `colour`.
    """
    plant, records = build(rig), (*campaign.train, *campaign.select, *campaign.heldout)
    windows = cut_windows(plant, records, floor)
    model = Model(plant, windows.names, brief=True)
    x0, _ = predicted_states(model, windows, plant.p)
    quiet, random = model.predict(windows, x0, plant.p), np.random.default_rng(0)
    answers: list[np.ndarray] = []
    for _ in range(_DRAWS):
        noisy = [_disturbed(record, campaign.input_noise, random) for record in records]
        predicted = model.predict(cut_windows(plant, noisy, floor), x0, plant.p)
        pairs = zip(windows.groups, predicted, quiet, strict=True)
        answers.extend(np.nan_to_num(y - still) * group.weight for group, y, still in pairs)
    for column, name in enumerate(windows.names):
        own, carried = floor.of(name), _noise([answer[..., column] for answer in answers])
        floor = floor.with_noise(name, together(own, carried._replace(sigma=carried.sigma * own.sigma)))
    return floor


def _disturbed(record: Record, noise: Mapping[str, InputNoise], random: np.random.Generator) -> Record:
    """A record with further noise of its measured inputs."""
    signals = dict(record.signals)
    for name, own in noise.items():
        white = own.sigma * random.standard_normal(record.t.size + len(own.weights) - 1)
        signals[name] = signals[name] + np.convolve(white, own.weights, "valid")
    return replace(record, signals=signals, notes=())


def _noise(answers: Sequence[np.ndarray]) -> SignalNoise:
    """The noise of one signal's answers [w, rows] to each draw in each group of windows, over its sigma.

    kappa and colour are how the means and the mean squares of windows scatter.
    """
    rows = np.concatenate([np.full(*answer.shape) for answer in answers])
    squares, means = (np.concatenate([np.mean(answer**power, axis=1) for answer in answers]) for power in (2, 1))
    variance = float(np.average(squares, weights=rows))
    if variance == 0.0:
        return SignalNoise(0.0, 1.0, 1.0, np.inf)
    kappa = float(np.mean(rows * means**2)) / variance
    colour = float(np.mean(rows * (squares / variance - 1.0) ** 2)) / 2.0
    return SignalNoise(float(np.sqrt(variance)), kappa, colour, float(rows.sum()) / colour)
