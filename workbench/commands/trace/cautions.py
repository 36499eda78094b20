"""What a trace's answer warns of: numbers that are not physical or at their ends, a logger that is like a delay."""

from ...base.units import from_si
from ...base.words import listed
from ...identify.fit.solver import Fit
from ...identify.found.fitted import effect_numbers, fitted, not_physical
from ...identify.trace.findings import CandidateFit, Trace
from ...plant.effects import Effect, EffectNumber
from ...plant.effects.declared import effects_alike
from .effect_words import ALL_EFFECTS


def title(effect: Effect) -> str:
    """ "jack.friction (stribeck)"."""
    return f"{effect.name} ({effect.formula})" if effect.formula else effect.name


def strange(effect: Effect, trace: Trace) -> str:
    """A warning where fitted numbers are what the formula's physics excludes."""
    limits = {number.name: number.at_least for number in effect.numbers}
    below = [f"{name} below {limits[name]}" for name in not_physical(effect, trace.named.fit)]
    if not below:
        return ""
    return f" Careful: {title(effect)} is fitted with {listed(below)}, which is not physical: its shape is another."


def of_the_logger(trace: Trace) -> str:
    """The effects that are not sought, for those named explain nearly all that they do, and what tells them apart."""
    tell = " Loop the command back into the logger, or declare the logger's setting and trace again."
    if any(fit.candidate.effect.alike for fit in trace.effects):
        return f" A part of the delay may be the command's own, which records of a plant cannot tell.{tell}"
    kin = dict.fromkeys(fit.candidate.effect.kin for fit in trace.effects)
    alike = dict.fromkeys(e.name for family in kin for e in effects_alike(trace.problem.rig, family))
    if not alike:
        return ""
    said = listed([f"{ALL_EFFECTS[name]} ({name})" for name in alike], "or")
    return (
        f" It may as well be that {said}, which looks much like a late command and is sought only where that leaves "
        f"a misfit.{tell}"
    )


def at_end(effect: Effect, trace: Trace) -> str:
    """A warning where fitted numbers stand at an end of what a fit may search, but for off."""
    fit = trace.named.fit
    ends = _effect_ends(effect, fit)
    if not ends:
        return ""
    values = effect_numbers(effect, fit)
    said = listed([f"{n.name} at {from_si(values[n.name], n.shown, n.si):.3g} {n.shown}" for n in ends])
    return f" Careful: {title(effect)} is fitted with {said}, the end of its range: the rig may be beyond it."


def _effect_ends(effect: Effect, fit: Fit) -> list[EffectNumber]:
    """The numbers of an effect that a fit left at an end of their ranges, but for off."""
    ends = [number for number in effect.fitted if effect.key(number.name) in fit.at_bounds]
    values = effect_numbers(effect, fit) if ends else {}
    return [number for number in ends if values[number.name] != number.off]


def with_ends(candidate_fit: CandidateFit, trace: Trace) -> str:
    """Which numbers a fit needed at an end of their ranges: it may fail for want of room, and not of another effect."""
    fit = candidate_fit.refitted.fit
    ends = [entry.number.name for entry in fitted(trace.problem.rig, fit) if entry.pushed]
    for effect in candidate_fit.refitted.effects:
        ends += [effect.key(number.name) for number in _effect_ends(effect, fit)]
    where = "the end of its range" if len(ends) == 1 else "the ends of their ranges"
    return f" with {listed(ends)} at {where}" if ends else ""
