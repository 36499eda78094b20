"""A datasheet asked for on the terminal, a number at a time.

Makers state leakage and hysteresis as what they are at most: such an answer is taken as the range up to that, and half
of it. The hysteresis, asked for last, need not be answered.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from ...base.errors import InputError, nearest
from ...base.toml_text import toml_text
from ...base.units import number_and_unit, quantity
from ...rigs.datasheet import KIND
from ...rigs.datasheet_keys import DatasheetEntry, figures
from ...rigs.jack import JACKS
from ...rigs.valve import VALVES

STAGES = {"two-stage": "second-order", "three-stage": "three-stage"}
"""How makers call a valve, and the kind of valve that such a datasheet is enough for."""
_GEOMETRY = "jack-10t"  # lends a three-stage valve the numbers that no maker publishes
_EXAMPLES = {
    "Ps": "210 bar",
    "Pr": "2 bar",
    "rated_flow": "40 l/min",
    "rated_drop": "70 bar",
    "hysteresis": "at most 3 %; an empty line where it is not stated",
    "leakage": "1 l/min, or at most 1 l/min",
    "leakage_drop": "210 bar",
    "n": "1",
    "pilot_flow": "20 l/min",
    "imax": "20 mA",
    "amplitude": "100 %",
    "reference": "5 Hz",
    "f3db": "60 Hz",
    "f90": "80 Hz",
    "Aj": "46.7 cm^2",
    "AA": "20 cm^2",
    "AB": "10 cm^2",
    "S": "500 mm",
    "M": "1000 kg",
}

_AT_MOST = re.compile(r"(?:at most|up to|below|max(?:imum|\.)?|<=?|\u2264)\s*(?P<end>.+)", re.IGNORECASE)
_LEAST = {"leakage": 0.05, "hysteresis": 0.0}  # of what a figure is at most, and of which it is half

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
    for key, spec in kind.further_figures.items():
        further = DatasheetEntry("valve", key, spec)
        try:
            answer = _asked(ask, _prompt(further), lambda text, of=further: _number(text, of) if text else None)
        except EOFError:
            break
        answers += [(further, answer)] if answer else []
    return toml_text({"experiment": KIND, "name": name, **_document(kind.name, jack, answers)})


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
    if (limit := _AT_MOST.fullmatch(answer)) and figure.key in _LEAST:
        most = _number(limit["end"], figure)
        half, bounds = most["value"] / 2, [_LEAST[figure.key] * most["value"], most["value"]]
        return {**most, "value": half, "source": f"datasheet: at most {limit['end']}, taken as half", "bounds": bounds}
    if problem := figure.spec.problem(quantity(answer, figure.spec.unit)):
        raise InputError(problem)
    value, unit = number_and_unit(answer, figure.spec.unit)
    return {"value": value, "unit": unit, "source": "datasheet"}


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
