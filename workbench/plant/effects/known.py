"""All effects that a rig can name, those of the library and those of its own files, and the ones it declares."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from types import TracebackType

from ...base import trust
from ...base.errors import InputError, nearest
from ...base.files import read_bytes
from ...base.units import from_si, to_si
from ...rigs.linear_rig import LinearRig
from ...rigs.number import Number
from ...rigs.rig import EffectUse, Rig
from ...rigs.valve import VALVES
from . import library
from .curves import check_knots
from .decorator import check, declared
from .effect import Effect, EffectNumber
from .grammar import LEARNED, refined_by
from .learned_pieces import find_learned
from .logger import LOGGER_SHIFT
from .slots import without

_ALONG = (
    "drive",
    "pilot",
    "friction",
    "rate",
    "lands",
    "supply",
    "hose",
    "air",
    "warming",
    "leakage",
    "relief",
    "load",
    "compliance",
    "backlash",
    "sensor",
)
_PUMPS = {kind.name for kind in VALVES.values() if not kind.has_lands}


def _shipped() -> Iterator[Effect]:
    """The effects of the files in `library`: along the way of a command, then those of files that are not there."""
    others = sorted({module.name for module in iter_modules(library.__path__)}.difference(_ALONG))
    for name in (*_ALONG, *others):
        yield from declared(vars(import_module(f"{library.__name__}.{name}")).values())


_SHIPPED = tuple(_shipped())
LIBRARY = tuple(effect for effect in _SHIPPED if not effect.valves <= _PUMPS)
PUMP_LIBRARY = tuple(effect for effect in _SHIPPED if effect.valves <= _PUMPS)
"""What pump drives show besides."""


def applies(effect: Effect, rig: Rig) -> bool:
    """Whether the plant of this rig has all the slots of the effect; a delay, which needs none, always applies."""
    return rig.valve in effect.valves


def acts(effect: Effect, rig: Rig) -> bool:
    """Whether it applies and this rig has what it acts on, losses a motor, and does not describe it already."""
    if effect.described in rig.numbers:
        return False
    needed = rig.valve_kind.slot_numbers
    return applies(effect, rig) and all(needed[slot] in rig.numbers for slot in effect.laws if slot in needed)


def missing(effect: Effect, kind: str) -> str:
    """Why an effect's formula is not on a kind of valve, to be read after "a ... valve has"; empty where it is."""
    if kind in effect.valves:
        return ""
    return without(kind, effect.laws) or effect.elsewhere or "no formula of it"


def known_effects(files: Iterable[str | Path] = ()) -> tuple[Effect, ...]:
    """Every effect of the library and of a rig's `effect_files`.

    Parameters
    ----------
    files
        Python files with further effects.

    Returns
    -------
    The effects.

    Raises
    ------
    InputError
        As `load_effects`, and for a formula that is there twice.
    """
    effects = {(effect.name, effect.formula): effect for effect in (*LIBRARY, *PUMP_LIBRARY)}
    for path in files:
        for effect in load_effects(path):
            if (effect.name, effect.formula) in effects:
                raise InputError(f"{path}: {effect.title} is there already; give it another formula")
            effects[effect.name, effect.formula] = effect
    return tuple(effects.values())


def load_effects(path: str | Path) -> tuple[Effect, ...]:
    """The effects that a Python file defines at its top level.

    Raises InputError with file and line: no such file, one that is not trusted, an error of Python, no effect in it,
    an effect that cannot be.
    """
    effects = declared(_executed(path).values())
    if not effects:
        raise InputError(f"{path}: no effect in it; put @effect(...) above a function of (value, s)")
    try:
        for effect in effects:
            check(effect)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return effects


def _executed(path: str | Path) -> dict[str, object]:
    """The names that a Python file defines, which runs only where the user trusts it, see base/trust.py.

    Executed rather than imported: no bytecode is left beside the rig, a name like that of a package hides nothing, and
    a file that has changed is read anew.
    """
    try:
        content = read_bytes(Path(path), kind="Python file")
        text = content.decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{path}: not text in UTF-8; effect_files are Python files") from None
    trust.check(Path(path), content)
    names: dict[str, object] = {"__name__": Path(path).stem, "__file__": str(path)}
    try:
        exec(compile(text, str(path), "exec"), names)
    except SyntaxError as error:
        raise InputError(f"{path}: line {error.lineno}: {error.msg}") from None
    except InputError as error:
        raise InputError(f"{path}: line {_line(error.__traceback__, path)}: {error}") from None
    except Exception as error:
        what = f"{type(error).__name__}: {' '.join(str(error).split())}"
        raise InputError(f"{path}: line {_line(error.__traceback__, path)}: {what}") from error
    return names


def _line(at: TracebackType | None, path: str | Path) -> int:
    """The last line of the file that a traceback passes through."""
    row = 0
    while at is not None:
        if at.tb_frame.f_code.co_filename == str(path):
            row = at.tb_lineno
        at = at.tb_next
    return row


def find(name: str, formula: str, files: Iterable[str | Path] = ()) -> Effect:
    """An effect of the library or of a rig's files, or a learned piece; refined where its formula says so after a ";".

    An empty formula takes the name's first. Raises InputError.
    """
    return _find(known_effects(files), name, formula)


def _find(known: Iterable[Effect], name: str, formula: str) -> Effect:
    if name.startswith(LEARNED):
        return find_learned(name, formula)
    known = (*known, LOGGER_SHIFT)
    named = [effect for effect in known if effect.name == name]
    if not named:
        raise InputError(f'no effect "{name}"; {nearest(name, {effect.name for effect in known})}')
    for effect in named:
        if formula in ("", effect.formula):
            return effect
    plain, refined, refinements = formula.partition(";")
    if refined:
        return refined_by(_find(known, name, plain.strip()), refinements)
    raise InputError(f'{name}: no formula "{formula}"; {nearest(formula, [effect.formula for effect in named])}')


def resolve(rig: Rig) -> tuple[tuple[Effect, Mapping[str, float]], ...]:
    """The effects a rig declares, with their numbers in SI; a number that it does not give is the usual one on it.

    Raises InputError for an effect that there is not, or that is there twice, or a number that it has not.
    """
    known = known_effects(rig.effect_files)
    names = [use.name for use in rig.effects]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"effect {name} is declared twice; keep one formula of it")
    resolved = []
    for use in rig.effects:
        effect, numbers = _resolve(use, rig, known)
        values = {name: number.value for name, number in numbers.items()}
        check_knots(effect, values)
        resolved.append((effect, values))
    return tuple(resolved)


def _resolve(use: EffectUse, rig: Rig, known: tuple[Effect, ...]) -> tuple[Effect, dict[str, Number]]:
    effect = _find(known, use.name, use.formula)
    specs = {number.name: number for number in effect.numbers}
    usual = effect.usual(rig) if effect.usual else {}
    numbers = {
        name: Number(
            name, usual.get(name, spec.typical), spec.si, spec.si, "usual on this rig" if name in usual else "typical"
        )
        for name, spec in specs.items()
    }
    for name, given in use.numbers.items():
        if name not in specs:
            raise InputError(f'{use.name}: no number "{name}"; {nearest(name, specs)}')
        numbers[name] = _in_si(use, specs[name], given)
    return effect, numbers


def numbers_of(rig: Rig | LinearRig) -> dict[str, Number]:
    """All numbers of a rig, its own and those of the effects that it declares, by the plant's names for them, SI; one
    of an effect that its file does not give is the usual one, without bounds.

    Raises InputError for an effect that there is not, or a number that it has not.
    """
    numbers = dict(rig.numbers)
    if isinstance(rig, LinearRig) or not rig.effects:
        return numbers
    known = known_effects(rig.effect_files)
    for use in rig.effects:
        effect, own = _resolve(use, rig, known)
        numbers |= {effect.key(name): replace(number, name=effect.key(name)) for name, number in own.items()}
    return numbers


def _in_si(use: EffectUse, spec: EffectNumber, given: Number) -> Number:
    """A declared number and its bounds in the SI unit of the effect, within whose range they must be."""

    def si(value: float) -> float:
        try:
            value = float(to_si(from_si(value, given.unit, given.si), given.unit, spec.si))
        except InputError as error:
            raise InputError(f"{use.name}: {spec.name}: {error}") from None
        if not spec.low <= value <= spec.high:
            raise InputError(
                f"{use.name}: {spec.name} = {value:g} {spec.si} is outside {spec.low:g} to {spec.high:g} {spec.si}"
            )
        return value

    low, high = (None if end is None else si(end) for end in (given.low, given.high))
    interval = None if given.interval is None else (si(given.interval[0]), si(given.interval[1]))
    return replace(given, value=si(given.value), si=spec.si, low=low, high=high, interval=interval)
