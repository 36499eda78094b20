"""Under which conditions loops were judged, in words."""

from ...loop.rig_variations import Conditions
from ...rigs.rig import Rig


def played_words(conditions: Conditions, rig: Rig) -> str:
    """A sentence for the note of a table, on what was simulated."""
    return f"{_conditions(conditions, rig)}."


def judged_words(conditions: Conditions, rig: Rig) -> str:
    """That sentence where hunting was judged too."""
    return _conditions(conditions, rig) + ("." if conditions.ideal else "; lasting oscillations without noise.")


def _conditions(conditions: Conditions, rig: Rig) -> str:
    if conditions.ideal:
        return "Without computing delay, sensor noise and resolution"
    delay = rig.computing_delay.value * 1e3
    return (
        f"With a computing delay of {delay:g} ms, or the controller's own, and the sensors' noise (seed "
        f"{conditions.seed}) and resolution"
    )
