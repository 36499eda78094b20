"""sensor.shift: channels that a second logger recorded late, or early.

No part of a plant: a rig file that declares it has them put back in the records that are held against it (see
rigs/driven.py). It is never sought among the effects: a trace finds it before any (identify/found/shifted.py).
"""

from ...base.signals import SIGNALS
from ...rigs.driven import LATEST, SHIFT
from .decorator import number
from .effect import Effect
from .slots import SENSED

LOGGER_SHIFT = Effect(
    SHIFT,
    "",
    "sensor",
    "two loggers whose clocks nobody joined",
    "one signal recorded by both loggers",
    {},
    tuple(
        number(
            name,
            0.0,
            "s",
            shown="ms",
            low=-LATEST,
            high=LATEST,
            off=0.0,
            given=True,
            meaning=f"that {SIGNALS[name].meaning} is late by; below 0: early",
        )
        for name in SENSED
    ),
)
