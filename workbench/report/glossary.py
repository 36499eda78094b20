"""The words of this house, each with its one meaning: the site lists all of them, a report those that it uses."""

import re
from html import escape

WORDS = {
    "campaign": "a folder of recordings of one rig, with a file that says what each record is for",
    "record": "one recording: signals over time",
    "train record": "a record that is fitted",
    "select record": "a record that chooses between models",
    "held-out record": "a record that is looked at once, when all is decided",
    "rig": "a jack with its valve or pump, oil, load, sensors and limits: a file of numbers",
    "declared rig": "the rig as its file says, before any recording",
    "found rig": "the rig file that a fit or a trace leaves: fitted numbers, and effects that were added",
    "bounds": "how far a fit may move a number",
    "interval": "where a fit says a number lies, with 95 % confidence",
    "not told": "the interval spans most of the bounds: the records do not tell the number",
    "noise floor": "the error that a perfect model would still have: the noise of the sensor",
    "chi2": "mean squared error over the squared noise floor; 1 is the floor",
    "misfit": "the part of the squared error above the noise floor",
    "effect": "what a rig may show and its model lacks: friction, leakage, a delay ...",
    "formula": "one equation for an effect; most effects have several",
    "learned piece": "a curve or filter that is fitted where no effect has the shape; it has no name",
    "verdict": "the answer of a trace: none, named, tied, incomplete or unknown",
    "tied": "two or more effects explain the records equally well",
    "law": "a controller: it computes the command from reference and signals",
    "compensator": "a part that is stacked on a controller: pressure feedback, feed-forward ...",
    "guard": "what keeps the rig's limits around every controller, and trips",
    "trip": "the guard closes the valve, and the run ends",
    "null": "the operating point at which the valve is closed",
    "null and moving": "the operating points of margins: valve closed, and moving at a tenth of a metre a second",
    "envelope": "all plants and places on which a design has to hold: rigs, stroke, bounds, drawn plants",
    "drawn plant": "a rig whose numbers are drawn at random within their bounds",
    "hunting": "a loop that goes on swinging at rest, with a small amplitude",
    "settled": "within 2 % of the step, or three standard deviations of the sensor if that is more, and staying there",
    "Ms": "peak of the sensitivity function: the smaller, the more margin",
    "hard goal": "a limit that a design has to keep before its cost counts",
    "scenario": "what a loop is asked to do: a step, a ramp, a sine, a file, a load",
    "lane": "one of several plants that are simulated side by side in one processor core",
    "lockstep": "the client of a served rig sets the pace: one command, one reading",
    "over the limit": "a time over the soonest in which an optimiser settles the known rig",
}
_MARKUP = re.compile(r"<(script|style)\b.*?</\1>|<[^>]*>", re.DOTALL)


def words_in(html: str) -> dict[str, str]:
    """The words of the house that a page shows, in one number or the other, with their meanings; scripts are unseen."""
    text = _MARKUP.sub(" ", html)
    return {word: meaning for word, meaning in WORDS.items() if _form(word).search(text)}


def _form(word: str) -> re.Pattern[str]:
    """Ms is no ms, and a word may begin a sentence."""
    first = word[0] if word[0].isupper() else f"[{word[0]}{word[0].upper()}]"
    return re.compile(rf"\b{first}{re.escape(word[1:])}s?\b")


def glossary_html(html: str) -> str:
    """What a reader unfolds below a page: its words with their meanings; nothing where it has none of them."""
    rows = "".join(f"<dt>{escape(word)}</dt><dd>{escape(meaning)}</dd>" for word, meaning in words_in(html).items())
    if not rows:
        return ""
    return f'<details class="words">\n<summary>The words of this page</summary>\n<dl>{rows}</dl>\n</details>\n'
