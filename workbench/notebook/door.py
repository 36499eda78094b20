"""Functions as the door shows them: a rig serves where a plant is asked for, all else is refused in one line, and the
docstring says kind and default of each parameter."""

import re
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields
from functools import cache, wraps
from inspect import Parameter, Signature, formatannotation, getdoc, signature
from typing import Any

from numpy.typing import ArrayLike

from ..base.asked import asks
from ..base.errors import InputError, nearest
from ..commands.common.declared import Experiment, Key, keys_of
from ..plant import Plant, build
from ..rigs.linear_rig import LinearRig
from ..rigs.rig import Rig

_PARAMETERS, _RETURNS = "\n\nParameters\n----------\n", "\n\nReturns\n-------\n"


_OF_LOOPS = {
    "loops": "One loop or several, of one signal on one rig.",
    "rigs": "Names of the set, nominal first (see RIG_SET).",
    "within": "Factors (low, high) on numbers of the rig by name; others that have bounds are drawn within them.",
    "seed": "Seed of the draw and of the sensors' noise.",
    "jobs": "Worker processes.",
}
_REPORT = """

Returns
-------
The report; `metrics["rows"]` are those of `jackbench {}`.

Raises
------
InputError
    For loops of two rigs or signals, and numbers that cannot be."""


@cache
def shown(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, which raises InputError that says what it wants where it is given something else."""
    call = asks(function, _served, {"Plant": Plant, "Rig": Rig})
    call.__doc__ = _with_kinds(getdoc(function) or "", signature(function))
    return call


def _served(kind: Any, given: Any) -> Any:
    if kind is Plant and isinstance(given, Rig | LinearRig):
        return build(given)
    return given if kind is Rig and isinstance(given, LinearRig) else None


def takes_keys(kind: type[Experiment]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """A function that makes an experiment of a kind takes, by name, each key with a default that it does not name.

    Its docstring gets an entry for each parameter that has none, by what the experiment declares, and what it returns.
    """
    keys = keys_of(kind)
    free = {each.name: each for each in fields(kind) if each.default is not MISSING and keys[each.name].check}

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        *own, _keys = (each for each in signature(function).parameters.values())
        more = [each for name, each in free.items() if name not in {each.name for each in own}]
        known = [each.name for each in (*own, *more)]

        @wraps(function)
        def call(*given: Any, **named: Any) -> Any:
            for name in named:
                if name not in known:
                    raise InputError(f'{function.__name__}: no "{name}"; {nearest(name, known)}')
            return function(*given, **named)

        further = [
            Parameter(each.name, Parameter.KEYWORD_ONLY, default=each.default, annotation=each.type) for each in more
        ]
        takes = vars(call)["__signature__"] = signature(function).replace(parameters=[*own, *further])
        head, entries, _ = _parted(getdoc(function) or "")
        entries = {**_OF_LOOPS, **entries}
        said = {name: entries.get(name) or _meaning(keys[name]) for name in takes.parameters}
        call.__doc__ = f"{head}{parameters_section(said)}{_REPORT.format(function.__name__)}"
        return call

    return decorate


def parameters_section(entries: Mapping[str, str]) -> str:
    """The section of a docstring that says what each parameter is, as numpydoc has it."""
    return _PARAMETERS + "\n".join(f"{name}\n    {text}" for name, text in entries.items())


def sentence(text: str) -> str:
    """Words with a capital and a full stop."""
    return f"{text[:1].upper()}{text[1:]}."


def _parted(text: str) -> tuple[str, dict[str, str], str]:
    """A docstring before its section Parameters, the entries of that by name, and what comes after."""
    head, _, rest = text.partition(_PARAMETERS)
    section, gap, after = rest.partition("\n\n")
    entries = dict(re.findall(r"^(\S+)\n    (.*(?:\n    .*)*)", section, re.MULTILINE))
    return head, entries, gap + after


def _meaning(key: Key) -> str:
    """What a key of an experiment is, with its unit and bounds."""
    meaning, asked = next(iter(key.meanings.values())), dict(key.of[1] if key.of else {})
    if spec := asked.get("spec"):
        meaning += f" [{spec.unit}], {spec.low:g} to {spec.high:g}"
    elif "most" in asked:
        meaning += f", {asked['least']} to {asked['most']}"
    return sentence(meaning)


def _with_kinds(text: str, takes: Signature) -> str:
    """A docstring with kind and default behind each name of its Parameters, and the kind of what it returns."""
    head, entries, rest = _parted(text)
    said = {f"{name}{_kind_of(takes.parameters[name.lstrip('*')])}": each for name, each in entries.items()}
    before, title, returned = rest.partition(_RETURNS)
    if title:
        returned, gap, after = returned.partition("\n\n")
        lines = "\n".join(f"    {line}" for line in returned.splitlines())
        rest = f"{before}{title}{_kind(takes.return_annotation) or 'Any'}\n{lines}{gap}{after}"
    return f"{head}{parameters_section(said)}{rest}" if entries else text


def _kind_of(parameter: Parameter) -> str:
    kind, default = _kind(parameter.annotation), parameter.default
    said = "" if default is Parameter.empty or callable(default) else f"default {default!r}"
    return f" : {', '.join(filter(None, (kind, said)))}" if kind or said else ""


def _kind(annotation: Any) -> str:
    """An annotation without its modules."""
    if annotation is Parameter.empty:
        return ""
    if annotation == ArrayLike:
        return "ArrayLike"
    return re.sub(
        r"\b(?:\w+\.)+(?=\w)", "", annotation if isinstance(annotation, str) else formatannotation(annotation)
    )
