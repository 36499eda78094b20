"""What effects explain of what a model misses, in words."""

from collections.abc import Sequence

from ...base.words import agreed, counted, listed
from ...identify.trace import rule as decide
from ...identify.trace.findings import CandidateFit, Trace
from ...plant.effects import Effect
from .cautions import title
from .effect_words import ALL_EFFECTS
from .metrics import MANY


def explains(trace: Trace) -> str:
    """Which effects explain how much."""
    effects = [fit.candidate.effect for fit in trace.effects]
    words = listed([_acts(effect) for effect in effects] if len(effects) <= MANY else _counted(effects))
    before, after, _ = (errors.chi2 for errors in trace.heldout)
    share = (before - after) / (before - 1)
    verb = "explains" if len(effects) == 1 else "explain together"
    part = percent(share) if share > 0 else "nothing"
    return (
        f"{words[0].upper()}{words[1:]}: {listed([title(effect) for effect in effects])} {verb} "
        f"{part} of what the model misses.{''.join(_as_good(trace, fit) for fit in trace.effects)}"
    )


def shares(trace: Trace, names: Sequence[str]) -> str:
    """How much each of several names that tie explains."""
    accepted = {fit.judgement.name: fit.judgement.explained for search in trace.passes for fit in search.accepted}
    shares = [accepted.get(name, trace.effects[0].judgement.explained) for name in names]
    if max(shares) - min(shares) <= decide.TIED:
        return f"each explains {percent(shares[0])}"
    return f"they explain {listed([percent(share) for share in shares])}, and other formulas might as much,"


def _acts(effect: Effect) -> str:
    """An effect in plain words; or the described number that is another one."""
    if effect.shifts:
        return f"{effect.shifts} is another number than described"
    return ALL_EFFECTS.get(effect.name, f"{effect.name} acts")


def _counted(effects: Sequence[Effect]) -> list[str]:
    """Many effects: the described numbers that are others, and how many effects act beside them."""
    numbers = [effect.shifts for effect in effects if effect.shifts]
    others = len(effects) - len(numbers)
    beside = f"{counted(others, 'effect')} {agreed('act', others)}"
    if not numbers:
        return [beside]
    verb = "is another number" if len(numbers) == 1 else "are other numbers"
    return [f"{listed(numbers)} {verb} than described", beside]


def _as_good(trace: Trace, fit: CandidateFit) -> str:
    """Which names would do in the place of an effect that was added."""
    names = [name for name in fit.tied if name in trace.tied]
    if not names:
        return ""
    explain = "explains" if len(names) == 1 else "explain"
    added = fit.candidate.effect.name
    return f" In the place of {added}, {listed(names)} {explain} as much: these records cannot tell them apart."


def percent(share: float) -> str:
    """A share; what fits better than the noise has it is all, no more."""
    return f"{100 * min(share, 1.0):.1f} %"
