"""What recordings say by themselves.

noise_floor, signal_noise, white_part, static    how far a perfect model would still be from each signal
rounding            noise that a sensor's rounding hides at rest
scored_floor        what errors are held against, which for free runs is more
whiteness           whether a residual is noise
frequency_response  gain, phase, coherence and a 95 % band of a pair of signals
causality           whether one of them comes after the other

    from workbench.identify.data import measured_response, noise_floor
    floor = noise_floor(campaign)                                 # floor.sigma["pa"] in Pa, floor.kappa["pa"]
    response = measured_response(record, "command", "position")   # response.f in Hz, response.response in SI
"""

from .frequency_response import FrequencyResponse, measured_response, same_estimate
from .noise_floor import NoiseFloor, noise_floor, same_command
from .whiteness import Whiteness, whiteness

__all__ = [
    "FrequencyResponse",
    "NoiseFloor",
    "Whiteness",
    "measured_response",
    "noise_floor",
    "same_command",
    "same_estimate",
    "whiteness",
]
