"""A trace's answer in plain words: what is wrong with the rig, how sure that is, what to record next."""

from collections.abc import Sequence

import numpy as np

from ...base.words import agreed, counted, listed
from ...identify.found.alike import explain_alike
from ...identify.found.fitted import fitted, pinned_sentence
from ...identify.found.missing_shape import UnexplainedDisturbance
from ...identify.found.shifted import SHIFT, LoggerShift, shifts
from ...identify.trace import rule as decide
from ...identify.trace.findings import CandidateFit, Trace
from ...plant.effects import Effect
from ...plant.effects.declared import effects_for
from .cautions import at_end, of_the_logger, strange, title, with_ends
from .effect_words import ALL_EFFECTS
from .metrics import MANY, numbers_of, ranking
from .reasons import reason

CLUE = 0.5  # R2 below which a signal says nothing of what is missing
_FAR = 0.3  # explained share below which the next best is no rival

RETUNE = (
    "jackbench retune EXPERIMENT --found rig.toml tunes a controller anew on the found rig, and compares it with the "
    "old one. rig.toml lies beside this page; EXPERIMENT is a tune, run or bench experiment on this rig."
)
FREE_RUN = (
    "These windows set the model right twice a second. For simulations of whole records, fit its numbers to whole "
    "records: jackbench fit CAMPAIGN --rig rig.toml --free-run."
)
PLAN = (
    "jackbench plan CAMPAIGN simulates records within this rig's reach, says which of them tells most, and leaves it "
    "as files that the drive plays."
)
UNFINISHED = "Not finished: the time to compute ended the search, and what it did not try may explain as much. "
EQUATION = {
    "drive": "the drive (amplifier and spool loop)",
    "pilot": "the torque motor and pilot stage",
    "main": "the main spool",
    "flow": "the flows (lands, chambers, supply)",
    "force": "the motion of the load",
    "sensor": "the pressure sensors",
}
BETWEEN = {"drive", "flow"}
_BETWEEN = "between command and flow (the drive, the spool or the lands: the records do not tell which)"
_SPLIT = (
    "slow triangles of the command with reversals, steps and a fast multisine, with the spool recorded, which tells "
    "what is missing before it from what is missing behind it"
)
SIGNAL = {
    "current": "tells the amplifier and its loop from the torque motor",
    "spool": "tells the valve's electronics and stages from its lands",
    "pa": "with pb tells flows from forces",
    "pb": "with pa tells flows from forces",
    "load_pressure": "shows the force on the piston, though not what each chamber does",
    "supply": "shows a supply that sags",
    "position": "shows the jack's speed, so the flow through the valve",
    "velocity": "shows the flow through the valve",
    "acceleration": "tells a force on the load from a pressure sensor that is off",
    "force": "tells a force on the load from friction in the jack",
    "pump_speed": "tells the motor and its losses from the pump and what is behind it",
}
RECORD = {
    "drive": "steps and a fast multisine on the command, with current and spool recorded",
    "pilot": "slow triangles of the command with reversals, with current and spool recorded",
    "main": "slow triangles of the command through null, and small steps about a held opening, with current and spool "
    "recorded",
    "flow": "standing still under load, steady moves at several speeds in both directions, and hard braking, with both "
    "pressures and the supply recorded",
    "force": "slow triangles with reversals, standing still at several positions, and a fast multisine, with both "
    "pressures, acceleration and force recorded",
    "sensor": "steps and standing still, with a second pressure sensor at the same port",
}


def verdict(trace: Trace, shape: UnexplainedDisturbance | None, undetectable: Sequence[str] | None) -> str:
    """The answer in a few sentences; `undetectable` are effects that the records could not have shown."""
    said = {"named": _named, "incomplete": _incomplete, "tied": _tied, "unknown": _unknown}
    text = "".join(map(_second_logger, shifts(trace))) + ("" if trace.finished else UNFINISHED)
    text += said[trace.verdict](trace, shape) if trace.verdict in said else _none(trace, undetectable or ())
    wrong = numbers_of(trace)
    text += "".join(f" {each.text}{_beside(trace, each.number.name)}." for each in wrong)
    text += _trusted(trace, len(wrong)) + _learned(trace)
    beyond = [each.number.name for each in wrong]  # the rig's own stands at the end from which another one was found
    ends = [entry.number.name for entry in fitted(trace.problem.rig, trace.final.fit) if entry.pushed]
    ends = [name for name in ends if name not in beyond]
    text += "".join(strange(fit.candidate.effect, trace) + at_end(fit.candidate.effect, trace) for fit in trace.effects)
    text += of_the_logger(trace)
    if ends:
        text += f" Careful: {listed(ends)} went to the end of what the rig file allows."
    if ends or trace.verdict in ("incomplete", "unknown"):
        text += pinned_sentence(trace.problem.rig)
    return text


def _second_logger(shift: LoggerShift) -> str:
    """What a second logger recorded late, or early, and that it is put back."""
    late, low, high = (f"{1e3 * value:.4g}" for value in (shift.late, *shift.interval))
    return (
        f"A second logger recorded {shift.formula} {late} ms late (95 % from {low} to {high}; below 0 it was early): "
        f"{SHIFT} explains {_percent(shift.explained)} of what the model misses. Record all by one logger, or declare "
        "it in the rig file. What follows holds once they are put back. "
    )


def _beside(trace: Trace, number: str) -> str:
    """What explains the records as well as another value of a number, and what tells them apart."""
    alike, equation = explain_alike(trace, number)
    explain = "explains" if len(alike) == 1 else "explain"
    return f"; {listed(alike)} {explain} as much, to tell them apart record {RECORD[equation]}" if alike else ""


def _trusted(trace: Trace, numbers: int) -> str:
    """How far the intervals of contradicted numbers hold, where something is missing beside them."""
    if trace.verdict != "incomplete" or not numbers:
        return ""
    error = f"of a model whose error is still {_times(times_noise(trace)[1])} times the noise"
    if numbers == 1:
        return f" The interval is that {error}: the true value may lie outside it."
    return f" The intervals are those {error}: the true values may lie outside them."


def _acts(effect: Effect) -> str:
    """An effect in plain words; or the described number that is another one."""
    if effect.shifts:
        return f"{effect.shifts} is another number than described"
    return ALL_EFFECTS.get(effect.name, f"{effect.name} acts")


def times_noise(trace: Trace) -> tuple[float, float]:
    """Held-out error over the noise before, and with what was named, all signals together."""
    before, named, _ = trace.heldout
    return float(np.sqrt(before.chi2)), float(np.sqrt(named.chi2))


def _learned(trace: Trace) -> str:
    """What was learned of the rig's own shape."""
    if not trace.learned:
        return ""
    shapes = listed([shape_words(shape.effect, shape.words) for shape in trace.learned])
    after = _times(float(np.sqrt(trace.chi2[1])))
    beside = "Its shape is learned" if trace.effects else "A learned piece, which is no name, stands in for it"
    return f" {beside}: {shapes}; with that the held-out error is {after} times the noise."


def shape_words(effect: Effect, words: str) -> str:
    """A refinement or a learned piece in plain words: "jack.friction differs with the sign of velocity"."""
    kind, _, rest = words.partition(" ")
    variable = rest.split(" ")[-1].replace("_", " ")
    magnitude = f"the magnitude of {variable.strip('|')}" if "|" in variable else variable
    said = {
        "sign": f"differs with the sign of {variable}",
        "over": f"goes with {magnitude}",
        "spline": f"follows a curve of its own over {magnitude}",
        "apart": "differs between its places",
        "offset": "has an offset",
        "pole": "acts through a further lag",
        "resonance": "acts through a resonance",
        "linear": "acts through a linear element",
    }
    return f"{effect.name} {said.get(kind, words)}"


def _times(value: float) -> str:
    """A ratio to the noise: three digits after the point where it is near 1."""
    return f"{value:.3f}" if value < 1.1 else f"{value:.3g}"


def next_records(trace: Trace) -> list[tuple[str, str]]:
    """What to record next: an effect in question, or the equation, and the excitation that shows it best; of a loop
    that somebody else closed its reference is what can be moved."""
    moved = "reference" if trace.problem.rig.inner else "command"
    return [(about, record.replace("command", moved)) for about, record in _next_records(trace)]


def _next_records(trace: Trace) -> list[tuple[str, str]]:
    if trace.verdict == "none" or trace.equation is None:
        return []
    if not trace.effects and set(trace.equations) == BETWEEN:
        return [("the spool", _SPLIT)]
    if not trace.effects:
        return [(EQUATION[equation], RECORD[equation]) for equation in trace.equations]
    asked = [fit.candidate.effect for fit in trace.effects]
    asked += [fit.candidate.effect for search in trace.passes for fit in (*search.accepted, *search.tried)]
    first = {effect.name: RECORD[effect.equation] if effect.shifts else effect.shows for effect in reversed(asked)}
    names = dict.fromkeys((*(fit.candidate.effect.name for fit in trace.effects), *trace.tied))
    return [(name, first[name]) for name in names]


def _named(trace: Trace, _shape: UnexplainedDisturbance | None) -> str:
    before, after = times_noise(trace)
    said = f"{_explains(trace)} The held-out error falls from {_times(before)} to {_times(after)} times the noise."
    if trace.by_numbers:
        said += " Its numbers fitted to all records leave nothing: the train records alone tell too little of them."
    elif trace.left:
        said += f" {_percent(trace.left)} of the noise's variance is left, by its formula perhaps."
    beside = [(fit, share) for fit, share in ranking(trace) if _other(trace, fit)]
    if beside and trace.finished:
        fit, share = beside[0]
        far = f" No other effect comes near: the next, {fit.candidate.effect.name}, explains {_percent(share)}."
        said += far if share < _FAR else f" The next best, {fit.candidate.effect.name}, explains {_percent(share)}."
    return f"{said} {_advice(trace, 'To pin the numbers down, record')}"


def _incomplete(trace: Trace, shape: UnexplainedDisturbance | None) -> str:
    before, after = times_noise(trace)
    where = f", most likely {_in_either([shape.equation, *shape.rivals])}" if shape else ""
    falls = "falls" if after < before else "does not fall; it goes"
    left = trace.heldout[1].chi2 - 1
    if trace.learned and trace.at_floor:
        rest = "the formula is not all of it"
    elif after < before and left < decide.FORMULA:
        rest = f"{_percent(left)} of the noise's variance is left, by its formula perhaps, or something else is missing"
    else:
        rest, falls = "something else is missing too", falls.replace("falls", "only falls")
    but = "But the" if falls != "falls" else "The"
    return (
        f"{_explains(trace)} {but} held-out error {falls} from {_times(before)} to {_times(after)} times the noise: "
        f"{rest}{where}. {_advice(trace, 'To go on, record')}"
    )


def _tied(trace: Trace, _shape: UnexplainedDisturbance | None) -> str:
    before, after = times_noise(trace)
    first, *beside = trace.effects
    if beside:
        return (
            f"{_explains(trace)} The held-out error falls from {_times(before)} to {_times(after)} times the noise. "
            f"{_advice(trace, 'To tell them apart, record')}"
        )
    names = [first.candidate.effect.name, *trace.tied]
    words = listed([ALL_EFFECTS.get(name, f"{name} acts") for name in names], "or")
    return (
        f"Either {words}: these records cannot tell {listed(names)} apart, {_shares(trace, names)} of what the model "
        f"misses, and the held-out error falls from "
        f"{_times(before)} to {_times(after)} times the noise. {_advice(trace, 'To tell them apart, record')}"
    )


def _shares(trace: Trace, names: Sequence[str]) -> str:
    """How much each of several names that tie explains."""
    accepted = {fit.judgement.name: fit.judgement.explained for search in trace.passes for fit in search.accepted}
    shares = [accepted.get(name, trace.effects[0].judgement.explained) for name in names]
    if max(shares) - min(shares) <= decide.TIED:
        return f"each explains {_percent(shares[0])}"
    return f"they explain {listed([_percent(share) for share in shares])}, and other formulas might as much,"


def _unknown(trace: Trace, shape: UnexplainedDisturbance | None) -> str:
    before, _ = times_noise(trace)
    where = _in_either(trace.equations) if trace.equations else "in the model"
    error = f"the held-out error is {_times(before)} times the noise"
    if not trace.passes:
        tried = "no effect was tried, " + ("for want of time" if not trace.finished else "for nothing else shows it")
        said = f"Something is missing {where}: {error}; {tried}."
    else:
        said = f"Something is missing {where} that no {_those_tried(trace)} explains: {error}{_nearest(trace)}."
    if shape is not None and shape.explained and has_clue(shape) and len(trace.equations) == 1:
        name, share = shape.explained[0]
        said += f" The missing {shape.name} goes with {name.split(' [')[0]} (R2 {share:.2f})"
        said += f" and repeats at {shape.line:.3g} Hz." if shape.line else "."
    return f"{said} {_advice(trace, 'To learn more, record')}".rstrip()


def _those_tried(trace: Trace) -> str:
    """The effects of which none explains a misfit: all that act on the rig, or those that were tried."""
    rig, tried = trace.problem.rig, {candidate.effect.name for candidate, _ in trace.passes[0].scores}
    every = {effect.name for effect in effects_for(rig)}
    return "known effect" if trace.finished and every <= tried else "effect that was tried"


def _nearest(trace: Trace) -> str:
    """What comes nearest to an explanation, and why it is none."""
    if trace.refuted:
        names = listed([title(fit.candidate.effect) for fit in trace.refuted])
        ends = with_ends(trace.refuted[-1], trace)
        before, after = trace.heldout[0], trace.refuted_errors
        if after and before.explained(after) >= decide.NAMED:
            least = f"with so much left {100 * decide.asked(after.chi2):.0f} % would name it"
            gone, left = _percent(before.explained(after)), _times(np.sqrt(after.chi2))
            takes, leaves = ("take", "leave") if len(trace.refuted) > 1 else ("takes", "leaves")
            return f"; {names}{ends} {takes} away {gone} of it and {leaves} {left} times the noise ({least})"
        return f"; {names}{ends} would explain the train records, but the held-out records do not bear it out"
    best = ranking(trace)
    if not best:
        return ""
    fit, share = best[0]
    said = f", and the best effect, {title(fit.candidate.effect)}, takes away"
    if share < decide.NAMED:
        ends = with_ends(fit, trace)
        return f"{said} only {_percent(share)} of it{ends} ({100 * decide.NAMED:.0f} % would name it)"
    search = next(each for each in trace.passes if any(fit is other for other in each.tried))
    return f"{said} {_percent(share)} of it: {reason(trace, search, fit)}"


def has_clue(shape: UnexplainedDisturbance) -> bool:
    """Whether a signal explains enough of what is missing to say something of its cause."""
    return bool(shape.explained) and shape.explained[0][1] >= CLUE


def _in_either(equations: Sequence[str]) -> str:
    """The place of one equation, in words; of several where the evidence does not tell them apart."""
    if set(equations) == BETWEEN:
        return _BETWEEN
    words = listed([EQUATION[equation] for equation in equations], "or")
    return f"in {words}" if len(equations) == 1 else f"in {words} (the records do not tell which)"


def _none(trace: Trace, undetectable: Sequence[str]) -> str:
    before, _ = times_noise(trace)
    if trace.evidence:
        said = "No single equation lacks anything that these records could show: "
        said += f"the held-out error is {before:.3g} times the noise"
        if not trace.problem.misses(trace.heldout[0].chi2, trace.heldout[0].samples):
            return f"{said}, and what more the other records leave no disturbance in an equation explains."
        return (
            f"{said}, but a disturbance in no equation explains it. Check the noise floor: a longer static record "
            "would settle it."
        )
    said = "Nothing is missing that these recordings could show: once its numbers are fitted, the rig follows the "
    said += f"held-out records to {_times(before)} times the noise."
    if not trace.at_floor:
        said += " Fitted to these too, its numbers leave no more than noise: the train records tell too little of them."
    if undetectable:
        said += f" They could not have shown a typical {listed(undetectable, 'or')}."
    return said


def _explains(trace: Trace) -> str:
    """Which effects explain how much."""
    effects = [fit.candidate.effect for fit in trace.effects]
    words = listed([_acts(effect) for effect in effects] if len(effects) <= MANY else _counted(effects))
    before, after, _ = (errors.chi2 for errors in trace.heldout)
    share = (before - after) / (before - 1)
    verb = "explains" if len(effects) == 1 else "explain together"
    part = _percent(share) if share > 0 else "nothing"
    return (
        f"{words[0].upper()}{words[1:]}: {listed([title(effect) for effect in effects])} {verb} "
        f"{part} of what the model misses.{''.join(_as_good(trace, fit) for fit in trace.effects)}"
    )


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


def _other(trace: Trace, fit: CandidateFit) -> bool:
    added = [each.candidate.effect.name for each in trace.effects]
    return fit.candidate.effect.name not in (*added, *trace.tied)


def _advice(trace: Trace, begin: str) -> str:
    records = next_records(trace)
    if not records:
        return ""
    if len(records) == 1:
        return f"{begin} {records[0][1]}."
    most = len(records) if len(records) <= MANY else 1
    shown = "; ".join(f"{shows} ({name})" for name, shows in records[:most])
    return f"{begin}: {shown}; for the others see what to record next." if records[most:] else f"{begin}: {shown}."


def _percent(share: float) -> str:
    """A share; what fits better than the noise has it is all, no more."""
    return f"{100 * min(share, 1.0):.1f} %"
