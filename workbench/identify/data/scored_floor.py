"""What errors are held against: the noise, and in free runs the same share of every signal's spread."""

from dataclasses import replace

import numpy as np

from ...records import Campaign
from ...records.campaign import FREE_RUN
from .noise_floor import NoiseFloor, noise_floor

EVENED = "the noisiest signal, as a share of its spread"


def scored_floor(campaign: Campaign) -> NoiseFloor:
    """The noise floor; for free runs raised to the same share of each signal's spread over the train records.

    A free run drifts in what is integrated, position first, by many times its noise: held against the noise alone it
    would leave the other signals no weight. The share is that of the noisiest signal. A signal that only other records
    carry keeps its floor.
    """
    floor = noise_floor(campaign)
    if campaign.score != FREE_RUN:
        return floor
    spread = {name: _spread(campaign, name) for name in floor.sigma}
    share = max((floor.sigma[name] / spread[name] for name in spread if spread[name] > 0), default=0.0)
    raised = {name: share * spread[name] for name, sigma in floor.sigma.items() if share * spread[name] > sigma}
    return replace(floor, sigma={**floor.sigma, **raised}, source={**floor.source, **dict.fromkeys(raised, EVENED)})


def _spread(campaign: Campaign, name: str) -> float:
    """Standard deviation of a signal over all train records."""
    values = [record.signals[name][record.valid[name]] for record in campaign.train if name in record.signals]
    return float(np.std(np.concatenate(values))) if values else 0.0
