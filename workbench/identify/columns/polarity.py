"""What the rig's model says of guessed columns: signs, pressures that changed places, factors, what it refuses."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ...base.errors import InputError
from ...records import Campaign
from ...rigs.rig import Rig
from ..data.scored_floor import scored_floor
from ..fit.checked_columns import found_mistake
from ..fit.mistakes import Mistake
from ..fit.session_numbers import session_plants
from ..fit.windows import compared
from .conversion import PRESSURES
from .guess import LIKELY, ColumnGuess


@dataclass(frozen=True)
class PolarityCheck:
    """Whether a rig's model can be held against a campaign; else what stands in the way, or what looks mistaken."""

    problem: str = ""
    mistake: Mistake | None = None


def held_against(campaign: Campaign, rig: Rig) -> PolarityCheck:
    """Do what every command on a campaign does before it computes."""
    try:
        floor = scored_floor(campaign, rig)
        plants = session_plants(campaign, rig)
        for record in campaign.heldout:
            compared(plants[record.name], record, floor)
        mistake = found_mistake(campaign, rig, floor)
    except InputError as error:
        return PolarityCheck(str(error))
    if mistake is not None and mistake.kind in ("shifted", "doubtful"):  # no line of a campaign mends it
        return PolarityCheck(f"{mistake.told(rig.name)}; {mistake.remedy}")
    return PolarityCheck(mistake=mistake)


def mended(guesses: Sequence[ColumnGuess], mistake: Mistake, rig: Rig) -> list[ColumnGuess]:
    """The guesses with a mistake undone: signs turned, two pressures exchanged, the rest left out.

    No pressure has another sign, no factor explains itself, and no rig has a force that nothing makes.
    """
    why = mistake.told(rig.name)
    turns_position = mistake.kind in ("turned", "swapped") and "position" in mistake.signals

    def undone(guess: ColumnGuess) -> ColumnGuess:
        if guess.signal not in (*mistake.signals, *(("reference",) if turns_position else ())):
            return guess
        if mistake.kind == "swapped" and guess.signal in ("pa", "pb"):
            other = "pb" if guess.signal == "pa" else "pa"
            return replace(guess, signal=other, confidence=LIKELY, reason=f"{guess.reason}; {why}")
        if mistake.kind in ("turned", "swapped") and guess.signal not in PRESSURES:
            return guess.turned(rig.middle if guess.signal in ("position", "reference") else 0.0, why)
        return guess.left_out(why)

    return [undone(guess) for guess in guesses]
