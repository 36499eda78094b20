"""A datasheet asked for on the terminal, a number at a time, each checked against those before it.

Makers state leakage, hysteresis and threshold as what they are at most: such an answer is taken as the range up to
that, and half of it. A piston may be told by its bore and rod, a hose by its bore and length. What is asked for last,
hysteresis, threshold and hose, need not be answered.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from ...base.errors import InputError, clipped, nearest
from ...base.toml_text import toml_text
from ...base.units import Spec, from_si, number_and_unit, quantity, to_si
from ...rigs.datasheet import HOSE, KIND
from ...rigs.datasheet_keys import DatasheetEntry, figures
from ...rigs.datasheet_rules import RULES, SECOND_ORDER_RULES, DatasheetRule, check_together
from ...rigs.jack import JACKS
from ...rigs.valve import VALVES
from ...rigs.valve.lands import WIDTHS
from .closed_loop import EXAMPLES, LABEL

STAGES = {"two-stage": "second-order", "three-stage": "three-stage"}
"""How makers call a valve, and the kind of valve that such a datasheet is enough for."""
_GEOMETRY = "jack-10t"  # lends a three-stage valve the numbers that no maker publishes
_EXAMPLES = {
    "Ps": "210 bar",
    "Pr": "2 bar",
    "rated_flow": "40 l/min",
    "rated_drop": "70 bar",
    "hysteresis": "at most 3 %; an empty line where it is not stated",
    "threshold": "at most 0.5 %; an empty line where it is not stated",
    "hose": "19 mm x 2 m; an empty line where the valve sits on the jack",
    "leakage": "1 l/min, or at most 1 l/min",
    "leakage_drop": "210 bar",
    "n": "1",
    "pilot_flow": "20 l/min",
    "imax": "20 mA",
    "amplitude": "100 %",
    "reference": "5 Hz",
    "f3db": "60 Hz",
    "f90": "80 Hz",
    "Aj": "bore x rod, 100 mm x 63 mm, or 46.7 cm^2",
    "AA": "the bore, 50 mm, or 20 cm^2",
    "AB": "bore x rod, 50 mm x 36 mm, or 10 cm^2",
    "S": "500 mm",
    "M": "1000 kg",
}

_PAIR = re.compile(r"(?P<first>[^xX\u00d7]+?)\s*[xX\u00d7/]\s*(?P<second>\S.*)")
_BARE = re.compile(r"[0-9.]+")
_LENGTHS = {"Aj": 2, "AA": 1, "AB": 2, "hose": 2}  # that tell an area or a volume
_AT_MOST = re.compile(r"(?:at most|up to|below|max(?:imum|\.)?|<=?|\u2264)\s*(?P<end>.+)", re.IGNORECASE)
_LEAST = {"leakage": 0.05, "hysteresis": 0.0, "threshold": 0.0}  # of what a figure is at most, and of which it is half

T = TypeVar("T")
Ask = Callable[[str], str]
"""Shows a prompt and returns the line that was typed; raises EOFError where there is none."""


def asked_datasheet(stages: str, name: str, build: Callable[[str], T], ask: Ask = input) -> tuple[str, T]:
    """The text of a datasheet, from answers, and what `build` makes of it.

    Answers that contradict each other, or of which nothing can be built, are asked for again. Raises InputError, with
    all that is missing, where the answers end.
    """
    kind = VALVES[STAGES[stages]]
    try:
        jack = _asked(ask, f"jack, {' or '.join(JACKS)}: ", _jack)
    except EOFError:
        kinds = " or ".join(JACKS)
        raise InputError(f"the answers ended before the kind of jack, {kinds}; answer every question") from None
    wanted = figures(kind, JACKS[jack])
    extra = [DatasheetEntry("valve", key, spec) for key, spec in WIDTHS.items()]
    questions = (*wanted, *extra, DatasheetEntry("jack", "hose", HOSE))
    rules = RULES if kind.needs_geometry else (*RULES, *SECOND_ORDER_RULES)

    def finished(lines: Mapping[DatasheetEntry, str]) -> tuple[str, T]:
        answers = [(figure, _number(lines[figure], figure)) for figure in questions if lines.get(figure)]
        text = toml_text({"experiment": KIND, "name": name, **_document(kind.name, jack, answers)})
        return text, build(text)

    return _finished(ask, wanted, questions, rules, finished)


def _finished(
    ask: Ask,
    wanted: Sequence[DatasheetEntry],
    questions: Sequence[DatasheetEntry],
    rules: Sequence[DatasheetRule],
    finish: Callable[[Mapping[DatasheetEntry, str]], T],
) -> T:
    """What `finish` makes of the lines that answer the questions; only those `wanted` need to be answered.

    Several that are in doubt are asked for again together: an empty line keeps what was answered.
    """
    due, complaint = list(questions), ""
    lines: dict[DatasheetEntry, str] = {}
    kept: dict[DatasheetEntry, str] = {}
    while True:
        while due:
            figure = due[0]
            was = f"[{kept[figure]}] " if figure in kept else ""
            try:
                line = ask("\n".join(filter(None, (complaint, _prompt(figure) + was)))).strip() or kept.get(figure, "")
            except EOFError:
                missing = [_label(each) for each in due if each in wanted and not (complaint and each in kept)]
                ended = f"the answers ended before {', '.join(missing)}; answer every question" if missing else ""
                if complaint or ended:
                    raise InputError("; ".join(filter(None, (complaint, ended)))) from None
                break
            try:
                if line or figure in wanted:
                    _number(line, figure)
            except InputError as error:
                complaint = str(error)
                continue
            lines[figure], complaint = line, ""
            due.remove(figure)
            doubted, complaint = _contradicted(figure, lines, rules)
            kept = {**kept, **{each: lines.pop(each) for each in doubted}}
            if len(doubted) == 1:
                kept.pop(doubted[0])
            due = [*doubted, *due]
        try:
            return finish(lines)
        except InputError as error:
            complaint = str(error)
            named = [each for each in lines if re.search(rf"\b{each.key}\b", complaint)]
            due = [each for each in questions if each in (named or questions)]
            kept, lines = lines, {each: line for each, line in lines.items() if each not in due}


def _contradicted(
    figure: DatasheetEntry, lines: Mapping[DatasheetEntry, str], rules: Sequence[DatasheetRule]
) -> tuple[list[DatasheetEntry], str]:
    """Which answers contradict the one to this figure, it among them, and how; none and nothing where none does."""
    near = {each.key: each for each in lines if each.stage in ("", figure.stage) and lines[each]}
    values = {key: _largest(_number(lines[each], each), each.spec) for key, each in near.items()}
    for rule in rules:
        try:
            check_together([rule] if figure.key in rule.keys else [], values)
        except InputError as error:
            return [near[key] for key in rule.doubted or rule.keys], str(error)
    return [], ""


def _largest(answer: Mapping[str, Any], spec: Spec) -> float:
    """What the answer is at most [SI]."""
    return float(to_si(answer.get("bounds", [answer["value"]])[-1], answer["unit"], spec.unit))


def asked_label(ask: Ask = input) -> dict[str, float]:
    """The numbers [SI] of a label, from answers. Raises InputError, with all that is missing, where they end."""
    answers: dict[str, float] = {}
    for key, spec in LABEL.items():
        prompt = f"{spec.meaning} ({key}), such as {EXAMPLES[key]}: "
        try:
            answers[key] = _asked(ask, prompt, lambda text, of=spec: _within(text, of))
        except EOFError:
            names = ", ".join([*LABEL][len(answers) :])
            raise InputError(f"the answers ended before {names}; answer every question") from None
    return answers


def _within(text: str, spec: Spec) -> float:
    value = quantity(text, spec.unit)
    if problem := spec.problem(value, number_and_unit(text, spec.unit)[1]):
        raise InputError(problem)
    return value


def _asked(ask: Ask, prompt: str, check: Callable[[str], T]) -> T:
    """The first answer that passes the check, which raises InputError with what is wrong."""
    while True:
        answer = ask(prompt).strip()
        try:
            return check(answer)
        except InputError as error:
            prompt = f"{error}\n{prompt.splitlines()[-1]}"


def _jack(answer: str) -> str:
    if answer not in JACKS:
        raise InputError(nearest(answer[:80], JACKS))
    return answer


def _number(answer: str, figure: DatasheetEntry) -> dict[str, Any]:
    if figure.key in _LENGTHS and (told := _by_diameters(answer, figure)):
        return told
    if (limit := _AT_MOST.fullmatch(answer)) and figure.key in _LEAST:
        most = _number(limit["end"], figure)
        half, bounds = most["value"] / 2, [_LEAST[figure.key] * most["value"], most["value"]]
        return {**most, "value": half, "source": f"datasheet: half of at most {limit['end']}", "bounds": bounds}
    _within(answer, figure.spec)
    value, unit = number_and_unit(answer, figure.spec.unit)
    return {"value": value, "unit": unit, "source": "datasheet"}


def _by_diameters(answer: str, figure: DatasheetEntry) -> dict[str, Any] | None:
    """The area of a piston by its bore and its rod, the volume of a hose by its bore and its length, in any order; None
    of another answer. A unit may be written once."""
    pair = _PAIR.fullmatch(answer)
    parts = [pair["first"], pair["second"]] if pair else [answer]
    if pair and any(bare := [bool(_BARE.fullmatch(part)) for part in parts]):
        unit = max(part.lstrip("0123456789.") for part in parts)
        parts = [part + unit * lacks for part, lacks in zip(parts, bare, strict=True)]
    try:
        lengths = [quantity(part, "m") for part in parts]
    except InputError:
        lengths = []
    if len(lengths) != _LENGTHS[figure.key]:
        if pair or lengths:
            raise InputError(f"{clipped(answer)}: write {_EXAMPLES[figure.key]}")
        return None
    if figure.key == "hose":
        (bore, first), (length, second) = sorted(zip(lengths, parts, strict=True))
        value, unit, said = math.pi / 4 * bore**2 * length, "l", f"a hose, {first} x {second}"
    elif pair and lengths[1] >= lengths[0]:
        raise InputError(f"a rod of {parts[1]} is no thinner than a bore of {parts[0]}; write bore x rod")
    else:
        value, unit = math.pi / 4 * (lengths[0] ** 2 - sum(rod**2 for rod in lengths[1:])), "cm^2"
        said = f"{'bore and rod' if pair else 'a bore'}, {' x '.join(parts)}"
    if problem := figure.spec.problem(value, unit):
        raise InputError(f"{answer}: {problem}")
    shown = float(f"{from_si(value, unit, figure.spec.unit):.5g}")
    return {"value": shown, "unit": unit, "source": f"datasheet: {said}"}


def _label(figure: DatasheetEntry) -> str:
    return f"{figure.stage} {figure.key}" if figure.stage else figure.key


def _prompt(figure: DatasheetEntry) -> str:
    stage = f"{figure.stage} stage: " if figure.stage else ""
    return f"{stage}{figure.spec.meaning} ({figure.key}), such as {_EXAMPLES[figure.key]}: "


def _document(valve: str, jack: str, answers: Sequence[tuple[DatasheetEntry, Mapping[str, Any]]]) -> Mapping[str, Any]:
    sections: dict[str, dict[str, Any]] = {"supply": {}, "valve": {"kind": valve}, "jack": {"kind": jack}, "load": {}}
    if VALVES[valve].needs_geometry:
        sections["valve"]["like"] = _GEOMETRY
    responses: dict[str, dict[str, Any]] = {}
    for figure, answer in answers:
        if figure.stage:
            responses.setdefault(figure.stage, {"stage": figure.stage})[figure.key] = answer
        else:
            sections[figure.section][figure.key] = answer
    sections["valve"]["response"] = list(responses.values())
    return sections
