"""Under which conditions loops were judged, in words."""

from ...loop.conditions import Conditions
from ...rigs.rig import Rig


def judged_words(conditions: Conditions, rig: Rig) -> str:
    """A sentence for the note of a table."""
    if conditions.ideal:
        return "Without computing delay, sensor noise and resolution."
    delay = rig.computing_delay.value * 1e3
    return (
        f"With a computing delay of {delay:g} ms, or the controller's own, and the sensors' noise (seed "
        f"{conditions.seed}) and resolution; lasting oscillations without noise."
    )
