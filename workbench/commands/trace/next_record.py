"""What to record next, in words: the record, the channel that shows it, and how far above its noise."""

from collections.abc import Mapping

from ...base.signals import SIGNALS
from ...base.units import from_si
from ...base.words import listed
from ...identify.plan.advice import ASSUMED, Advice
from ...identify.plan.family import family
from ...identify.plan.questions import EQUATIONS
from ...identify.trace.findings import Trace
from ...loop.standard_records import Design
from ...rigs.rig import Rig
from .metrics import MANY

EQUATION = {
    "drive": "the drive (amplifier and spool loop)",
    "pilot": "the torque motor or magnet and the pilot stage",
    "main": "the main spool",
    "flow": "the flows (lands, chambers, supply)",
    "force": "the motion of the load",
    "sensor": "the pressure sensors",
}
HOW = (
    "Each record was simulated on the rig as fitted, at the largest size up to a usual one that its limits take, under "
    "the slow position loop of its drive. A difference is what is left once initial states and the rig's own numbers, "
    "in their ranges, have done what they could: its RMS in the channel, over the noise."
)
_ASSUMED = f"Nothing tells the noise of {{}}: {100 * ASSUMED:g} % of its largest value was assumed."
_MORE = "for the others see what to record next"
Said = Mapping[str, Advice]


def next_records(trace: Trace, said: Said) -> list[tuple[str, str]]:
    """What to record next: what it is about, and the record with what it shows; or that none does."""
    rig = trace.problem.rig
    asked = {fit.candidate.effect.name: fit.candidate.effect.shows for fit in trace.effects}
    kept = [(key, said[key]) for key in ((*asked, EQUATIONS)) if key in said]
    lines = [(_about(key, each), each, asked.get(key, "")) for key, each in kept]
    return [(about, text) for about, each, shows in lines if (text := record_words(rig, each, shows))]


def how(said: Said) -> list[str]:
    """How differences were found, and which noise was assumed."""
    played = [each for each in said.values() if not each.unplayed]
    unknown = dict.fromkeys(each.channel for each in played if each.assumed)
    return [HOW, *(_ASSUMED.format(name) for name in unknown)] if played else []


def advice_sentence(trace: Trace, said: Said, purpose: str) -> str:
    """The advice as a sentence, which begins with its purpose; empty where there is none."""
    lines = [text for _, text in next_records(trace, said)]
    shown = lines if len(lines) <= MANY else [lines[0], _MORE]
    told = [text for text in shown if not text.startswith("no record")]
    none = [f" {text[0].upper()}{text[1:]}." for text in shown if text not in told]
    return (f"{purpose}, record {'; '.join(told)}." if told else "") + "".join(none)[0 if told else 1 :]


def record_words(rig: Rig, advice: Advice, shows: str = "") -> str:
    """A record with what it shows; that none does; or, where none can be simulated, what `shows` an effect."""
    if advice.unplayed:
        return shows
    if not advice.record:
        apart = f"tells {advice.names[0]} from {listed(advice.names[1:], 'or')}"
        return f"no record that was simulated {apart if advice.names[1:] else f'shows {_effects(advice.names[0])}'}"
    added = f", with the {_channel(advice.added)} recorded too" if advice.added else ""
    return f"{wave_words(rig, family(rig)[advice.record], advice.peak)}{added}: {_difference(advice)}"


def wave_words(rig: Rig, design: Design, peak: float) -> str:
    """A record of the plan's family in words; of a loop that somebody else closed its reference is what moves."""
    if design.signal == "reference":
        moved, size = "the reference" if rig.inner else "the position", f"{peak:.3g} mm"
    elif rig.inner:
        signal = SIGNALS[rig.inner.reference]
        value = float(from_si(peak * rig.inner.full_command, signal.unit, signal.si))
        moved, size = "the reference", f"{value:.3g} {signal.unit}"
    else:
        moved, size = "the command", f"{100 * peak:.3g} %"
    if design.kind == "multisine" and design.band:
        low, high = design.band
        of = (
            f"sine of {moved} at {low:g} Hz"
            if design.lines == 1
            else f"multisine of {moved} from {low:g} to {high:g} Hz"
        )
        return f"a {of}, up to {size}"
    if design.kind == "triangle":
        return f"triangles of {moved} up to {size} and back, {design.seconds:g} s each"
    return f"steps of {moved} up to {size}"


def _difference(advice: Advice) -> str:
    times = f"{float(f'{advice.times:.2g}'):g}"
    names, channel = advice.names, _channel(advice.channel)
    if set(names) <= EQUATION.keys():
        if advice.channel == "spool" and len(names) > 1:
            return (
                f"what acts before the spool moves it there by about {times} times its noise, what acts behind it not"
            )
        places = listed([EQUATION[name] for name in names])
        if len(names) == 1:
            return f"known effects in {places} change the {channel} there by about {times} times its noise"
        return f"known effects in {places} differ there by about {times} times the noise of the {channel}"
    if len(names) == 1:
        return f"{names[0]} changes the {channel} there by about {times} times its noise"
    return f"{listed(names)} differ there by about {times} times the noise of the {channel}"


def _channel(name: str) -> str:
    """A channel in a sentence: "spool", "pressure pa"."""
    return f"pressure {name}" if name in ("pa", "pb") else f"{name} pressure" if name == "supply" else name


def _effects(name: str) -> str:
    return f"known effects in {EQUATION[name]}" if name in EQUATION else name


def _about(key: str, advice: Advice) -> str:
    """What a record is about: names that tie, or places."""
    return listed([EQUATION[name] for name in advice.names], "or") if key == EQUATIONS else listed(advice.names, "or")
