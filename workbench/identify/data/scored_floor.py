"""What errors are held against: the noise, and in free runs what lies half way to the same share of every signal."""

from dataclasses import replace

import numpy as np

from ...records import Campaign
from ...records.campaign import FREE_RUN
from ...rigs.rig import Rig
from ..fit.carried_noise import with_carried
from .noise_floor import NoiseFloor, noise_floor

EVENED = "half way from the noise to the noisiest signal's, as a share of the spread"


def scored_floor(campaign: Campaign, rig: Rig) -> NoiseFloor:
    """The noise floor; for free runs raised half way, as a ratio, to the same share of each signal's spread.

    A free run drifts in what is integrated, position first, by many times its noise: held against the noise alone it
    would leave the other signals no weight. Held against one share of each signal's spread over the train records, that
    of the noisiest, what is known best would count no more than what is known least. Between the two is their geometric
    mean. A signal that only other records carry keeps its floor. Noise of inputs that were measured counts in both.
    """
    floor = noise_floor(campaign)
    if campaign.input_noise:
        floor = with_carried(floor, campaign, rig)
    if campaign.score != FREE_RUN:
        return floor
    floor = replace(floor, sigma={name: max(sigma, _rounding(rig, name)) for name, sigma in floor.sigma.items()})
    spread = {name: _spread(campaign, name) for name in floor.sigma}
    share = max((floor.sigma[name] / spread[name] for name in spread if spread[name] > 0), default=0.0)
    even = {name: share * spread[name] for name in floor.sigma}
    raised = {name: float(np.sqrt(sigma * even[name])) for name, sigma in floor.sigma.items() if even[name] > sigma}
    return replace(floor, sigma={**floor.sigma, **raised}, source={**floor.source, **dict.fromkeys(raised, EVENED)})


def _rounding(rig: Rig, name: str) -> float:
    """What the rig's sensor rounds a signal by, which a mean of its samples hides; 0 where none is declared."""
    return rig.sensors[name].resolution / float(np.sqrt(12)) if name in rig.sensors else 0.0


def _spread(campaign: Campaign, name: str) -> float:
    """Standard deviation of a signal over all train records."""
    values = [record.signals[name][record.valid[name]] for record in campaign.train if name in record.signals]
    return float(np.std(np.concatenate(values))) if values else 0.0
