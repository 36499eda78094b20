"""A trace's answer in plain words: what is wrong with the rig, how sure that is, what to record next."""

from collections.abc import Sequence

import numpy as np

from ...base.words import listed
from ...identify.found.alike import explain_alike
from ...identify.found.fitted import fitted, pinned_sentence
from ...identify.found.missing_shape import UnexplainedDisturbance
from ...identify.found.shifted import SHIFT, LoggerShift, shifts
from ...identify.trace import rule as decide
from ...identify.trace.findings import CandidateFit, Trace
from ...identify.trace.localise import BETWEEN
from ...plant.effects import Effect
from ...plant.effects.declared import effects_for
from .cautions import at_end, of_the_logger, strange, title, with_ends
from .effect_words import ALL_EFFECTS
from .explained import explains, percent, shares
from .metrics import numbers_of, ranking
from .next_record import EQUATION, Said, advice_sentence, record_words
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
_BETWEEN = "between command and flow (the drive, the spool or the lands: the records do not tell which)"
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


def verdict(
    trace: Trace, shape: UnexplainedDisturbance | None, undetectable: Sequence[str] | None, advice: Said
) -> str:
    """The answer in a few sentences; `undetectable` are effects that the records could not have shown, `advice` what
    simulated records say of what to record next."""
    said = {"named": _named, "incomplete": _incomplete, "tied": _tied, "unknown": _unknown}
    text = "".join(map(_second_logger, shifts(trace))) + ("" if trace.finished else UNFINISHED)
    words = said[trace.verdict](trace, shape, advice) if trace.verdict in said else _none(trace, undetectable or ())
    text += words.rstrip()
    wrong = numbers_of(trace)
    text += "".join(f" {each.text}{_beside(trace, each.number.name, advice)}." for each in wrong)
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
        f"{SHIFT} explains {percent(shift.explained)} of what the model misses. Record all by one logger, or declare "
        "it in the rig file. What follows holds once they are put back. "
    )


def _beside(trace: Trace, number: str, advice: Said) -> str:
    """What explains the records as well as another value of a number, and what tells them apart."""
    alike = explain_alike(trace, number)
    if not alike:
        return ""
    said = f"; {listed(alike)} {'explains' if len(alike) == 1 else 'explain'} as much"
    if number not in advice or not (text := record_words(trace.problem.rig, advice[number])):
        return said
    return f"{said}; {text}" if text.startswith("no record") else f"{said}; to tell them apart record {text}"


def _trusted(trace: Trace, numbers: int) -> str:
    """How far the intervals of contradicted numbers hold, where something is missing beside them."""
    if trace.verdict != "incomplete" or not numbers:
        return ""
    error = f"of a model whose error is still {_times(times_noise(trace)[1])} times the noise"
    if numbers == 1:
        return f" The interval is that {error}: the true value may lie outside it."
    return f" The intervals are those {error}: the true values may lie outside them."


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


def _named(trace: Trace, _shape: UnexplainedDisturbance | None, advice: Said) -> str:
    before, after = times_noise(trace)
    said = f"{explains(trace)} The held-out error falls from {_times(before)} to {_times(after)} times the noise."
    if trace.by_numbers:
        said += " Its numbers fitted to all records leave nothing: the train records alone tell too little of them."
    elif trace.left:
        said += f" {percent(trace.left)} of the noise's variance is left, by its formula perhaps."
    beside = [(fit, share) for fit, share in ranking(trace) if _other(trace, fit)]
    if beside and trace.finished:
        fit, share = beside[0]
        far = f" No other effect comes near: the next, {fit.candidate.effect.name}, explains {percent(share)}."
        said += far if share < _FAR else f" The next best, {fit.candidate.effect.name}, explains {percent(share)}."
    return f"{said} {advice_sentence(trace, advice, 'To pin the numbers down')}"


def _incomplete(trace: Trace, shape: UnexplainedDisturbance | None, advice: Said) -> str:
    before, after = times_noise(trace)
    where = f", most likely {_in_either([shape.equation, *shape.rivals])}" if shape else ""
    falls = "falls" if after < before else "does not fall; it goes"
    left = trace.heldout[1].chi2 - 1
    if trace.learned and trace.at_floor:
        rest = "the formula is not all of it"
    elif after < before and left < decide.FORMULA:
        rest = f"{percent(left)} of the noise's variance is left, by its formula perhaps, or something else is missing"
    else:
        rest, falls = "something else is missing too", falls.replace("falls", "only falls")
    but = "But the" if falls != "falls" else "The"
    return (
        f"{explains(trace)} {but} held-out error {falls} from {_times(before)} to {_times(after)} times the noise: "
        f"{rest}{where}. {advice_sentence(trace, advice, 'To go on')}"
    )


def _tied(trace: Trace, _shape: UnexplainedDisturbance | None, advice: Said) -> str:
    before, after = times_noise(trace)
    first, *beside = trace.effects
    if beside:
        return (
            f"{explains(trace)} The held-out error falls from {_times(before)} to {_times(after)} times the noise. "
            f"{advice_sentence(trace, advice, 'To tell them apart')}"
        )
    names = [first.candidate.effect.name, *trace.tied]
    words = listed([ALL_EFFECTS.get(name, f"{name} acts") for name in names], "or")
    return (
        f"Either {words}: these records cannot tell {listed(names)} apart, {shares(trace, names)} of what the model "
        f"misses, and the held-out error falls from "
        f"{_times(before)} to {_times(after)} times the noise. {advice_sentence(trace, advice, 'To tell them apart')}"
    )


def _unknown(trace: Trace, shape: UnexplainedDisturbance | None, advice: Said) -> str:
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
    return f"{said} {advice_sentence(trace, advice, 'To learn more')}"


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
            gone, left = percent(before.explained(after)), _times(np.sqrt(after.chi2))
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
        return f"{said} only {percent(share)} of it{ends} ({100 * decide.NAMED:.0f} % would name it)"
    search = next(each for each in trace.passes if any(fit is other for other in each.tried))
    return f"{said} {percent(share)} of it: {reason(trace, search, fit)}"


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


def _other(trace: Trace, fit: CandidateFit) -> bool:
    added = [each.candidate.effect.name for each in trace.effects]
    return fit.candidate.effect.name not in (*added, *trace.tied)
