"""A datasheet asked for on the terminal, a number at a time.

Makers state leakage, hysteresis and threshold as what they are at most: such an answer is taken as the range up to
that, and half of it. A piston may be told by its bore and rod, a hose by its bore and length. What is asked for last,
hysteresis, threshold and hose, need not be answered.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from ...base.errors import InputError, nearest
from ...base.toml_text import toml_text
from ...base.units import Spec, from_si, number_and_unit, quantity
from ...rigs.datasheet import HOSE, KIND
from ...rigs.datasheet_keys import DatasheetEntry, figures
from ...rigs.jack import JACKS
from ...rigs.valve import VALVES
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

_PAIR = re.compile(r"(?P<first>[^x]+?)\s*[x/]\s*(?P<second>\S.*)")
_AT_MOST = re.compile(r"(?:at most|up to|below|max(?:imum|\.)?|<=?|\u2264)\s*(?P<end>.+)", re.IGNORECASE)
_LEAST = {"leakage": 0.05, "hysteresis": 0.0, "threshold": 0.0}  # of what a figure is at most, and of which it is half

T = TypeVar("T")
Ask = Callable[[str], str]
"""Shows a prompt and returns the line that was typed; raises EOFError where there is none."""


def asked_datasheet(stages: str, name: str, ask: Ask = input) -> str:
    """The text of a datasheet, from answers. Raises InputError, with all that is missing, where the answers end."""
    kind = VALVES[STAGES[stages]]
    try:
        jack = _asked(ask, f"jack, {' or '.join(JACKS)}: ", _jack)
    except EOFError:
        kinds = " or ".join(JACKS)
        raise InputError(f"the answers ended before the kind of jack, {kinds}; answer every question") from None
    wanted = figures(kind, JACKS[jack])
    answers: list[tuple[DatasheetEntry, dict[str, Any]]] = []
    for figure in wanted:
        try:
            answers.append((figure, _asked(ask, _prompt(figure), lambda text, of=figure: _number(text, of))))
        except EOFError:
            names = ", ".join(_label(figure) for figure in wanted[len(answers) :])
            raise InputError(f"the answers ended before {names}; answer every question") from None
    extra = [DatasheetEntry("valve", key, spec) for key, spec in kind.further_figures.items()]
    for further in (*extra, DatasheetEntry("jack", "hose", HOSE)):
        try:
            answer = _asked(ask, _prompt(further), lambda text, of=further: _number(text, of) if text else None)
        except EOFError:
            break
        answers += [(further, answer)] if answer else []
    return toml_text({"experiment": KIND, "name": name, **_document(kind.name, jack, answers)})


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
    if problem := spec.problem(value):
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
    if figure.section == "jack" and (told := _by_diameters(answer, figure)):
        return told
    if (limit := _AT_MOST.fullmatch(answer)) and figure.key in _LEAST:
        most = _number(limit["end"], figure)
        half, bounds = most["value"] / 2, [_LEAST[figure.key] * most["value"], most["value"]]
        return {**most, "value": half, "source": f"datasheet: at most {limit['end']}, taken as half", "bounds": bounds}
    if problem := figure.spec.problem(quantity(answer, figure.spec.unit)):
        raise InputError(problem)
    value, unit = number_and_unit(answer, figure.spec.unit)
    return {"value": value, "unit": unit, "source": "datasheet"}


def _by_diameters(answer: str, figure: DatasheetEntry) -> dict[str, Any] | None:
    """The area of a piston by its bore and its rod, the volume of a hose by its bore and its length; None of another
    answer."""
    pair = _PAIR.fullmatch(answer)
    try:
        lengths = [quantity(part, "m") for part in (pair.groups() if pair else (answer,))]
    except InputError:
        return None
    bore, other = lengths[0], lengths[1] if pair else 0.0
    if figure.key == "hose" and pair:
        value, unit, words = math.pi / 4 * bore**2 * other, "l", "a hose"
    elif figure.key in ("Aj", "AA", "AB"):
        value, unit, words = math.pi / 4 * (bore**2 - other**2), "cm^2", "bore and rod" if pair else "a bore"
    else:
        return None
    if problem := figure.spec.problem(value):
        raise InputError(f"{answer}: {problem}")
    shown = float(f"{from_si(value, unit, figure.spec.unit):.5g}")
    return {"value": shown, "unit": unit, "source": f"datasheet: {words}, {answer}"}


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
