"""Every command of the command line as a function: `capability("jack-10t", pump="40 l/min")`.

What a command takes is declared once, as its options: a function has their names, with "_" for "-", and their defaults.
`import` is `import_` here, as Python keeps the word for itself.
"""

import argparse
import json
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, redirect_stdout
from functools import cache
from importlib import import_module
from inspect import Parameter, Signature
from io import StringIO
from numbers import Real
from os import PathLike
from pathlib import Path
from typing import Any, Literal, NoReturn

from ..base import trust
from ..base.errors import InputError
from ..commands import COMMANDS, GROUPS, folder
from ..commands.common.options import no_folder
from ..rigs.rig import Rig
from ..rigs.rig_file import save_rig
from .door import parameters_section, sentence

_OF_A_SHELL = (*GROUPS["start"], "serve", "live")  # which speak to a shell, or run until somebody ends them
_RIGS = ("rig", "subject", "like")
_DEFAULTS = {"jobs": 1}  # several worker processes would ask of a script that it can be imported
_UNITS = {"HZ": "Hz", "PERCENT": "%", "DB": "dB", "DEG": "deg", "M": "min"}  # of options, by how --help has them
_ANSWERS = """

Returns
-------
The report; of a command that prints, its tables, or its text where it has none.

Raises
------
InputError
    Where the command ends with status 2."""
FUNCTIONS = tuple(folder(name) for name in COMMANDS if name not in _OF_A_SHELL)


def __getattr__(name: str) -> Callable[..., Any]:
    if name not in FUNCTIONS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return _function(name)


@cache
def _function(name: str) -> Callable[..., Any]:
    """The function of a command."""
    command = next(command for command in COMMANDS if folder(command) == name)
    parser = _parser(command)
    takes = Signature([_parameter(action) for action in _asked(parser)])

    def call(*given: Any, **named: Any) -> Any:
        bound = takes.bind(*given, **named).arguments
        with ExitStack() as files:
            words = list(_words(parser, bound, files))
            options = parser.parse_args(words)
            if getattr(options, "trust", False):
                trust.allow_everything()
            return _answer(options, ["jackbench", command, *words])

    what = COMMANDS[command]
    call.__name__ = call.__qualname__ = name
    vars(call)["__signature__"] = takes
    said = parameters_section({action.dest: _meaning(action) for action in _asked(parser)})
    call.__doc__ = f"{sentence(what)}\n\nWhat `jackbench {command}` does.{said}{_ANSWERS}"
    return call


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise InputError(f"{self.prog}: {message}")


def _parser(command: str) -> argparse.ArgumentParser:
    parser = _Parser(prog=folder(command), add_help=False)
    import_module(f"..commands.{folder(command)}.options", __package__).options(parser)
    parser.add_argument("--trust", action="store_true", help="run the effect_files of rigs, this once")
    return parser


def _asked(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    """What a function takes: all but what only a screen needs, what is given by its place first."""
    actions = [action for action in parser._actions if action.dest not in ("json", "exit_code")]
    return sorted(actions, key=lambda action: bool(action.option_strings))


def _parameter(action: argparse.Action) -> Parameter:
    takes = _kind(action)
    if not action.option_strings and action.nargs not in ("?", "*"):
        return Parameter(action.dest, Parameter.POSITIONAL_OR_KEYWORD, annotation=takes)
    kind = Parameter.KEYWORD_ONLY if action.option_strings else Parameter.POSITIONAL_OR_KEYWORD
    default = _DEFAULTS.get(action.dest, action.default)
    return Parameter(action.dest, kind, default=default, annotation=takes | None if default is None else takes)


def _kind(action: argparse.Action) -> Any:
    """What an option takes, as an annotation."""
    one: Any = action.type if action.type in (int, float) else str | Path
    if action.dest in _RIGS:
        one = str | Path | Rig
    if action.choices:
        one = Literal[tuple(action.choices)]
    several = action.nargs not in (None, "?") or isinstance(action.default, list)
    return bool if action.nargs == 0 else Sequence[one] if several else one


def _meaning(action: argparse.Action) -> str:
    """What an option is, with its unit."""
    words = action.metavar if isinstance(action.metavar, tuple) else (str(action.metavar),)
    units = ", ".join(_UNITS[word] for word in words if word in _UNITS)
    return sentence((action.help or "") % vars(action) + (f" [{units}]" if units else ""))


def _words(parser: argparse.ArgumentParser, bound: Mapping[str, Any], files: ExitStack) -> Iterator[str]:
    """The command line that says the same; a Rig is a file for as long as `files` are open."""
    defaults = {} if "cluster" in bound else _DEFAULTS
    for action in _asked(parser):
        value = bound.get(action.dest, defaults.get(action.dest))
        if value is None or value is False:
            continue
        several = value if isinstance(value, Sequence) and not isinstance(value, str) else [value]
        option = action.option_strings[:1]
        if action.nargs in (None, "?") and option:
            yield f"{option[0]}={_word(parser, action, value, files)}"
        else:
            yield from option
            yield from (_word(parser, action, each, files) for each in several if action.nargs != 0)


def _word(parser: argparse.ArgumentParser, action: argparse.Action, value: Any, files: ExitStack) -> str:
    if isinstance(value, str | PathLike | Real):
        return str(value)
    if not isinstance(value, Rig):
        given = type(value).__name__
        raise InputError(f"{parser.prog}: {action.dest}: {given} is given; give text, a number, a path or a Rig")
    path = Path(files.enter_context(tempfile.TemporaryDirectory()), f"{value.name}.toml")
    save_rig(value, path)
    return str(path)


def _answer(options: argparse.Namespace, words: list[str]) -> Any:
    """The outcome of a command that computes; of one that prints what it prints, as tables where it has them."""
    if "json" in options:
        options.json = True
    with redirect_stdout(StringIO()) as printed, no_folder() as outcomes:
        options.call(options, words)
    if outcomes:
        return outcomes[0]
    text = printed.getvalue().strip()
    return json.loads(text) if "json" in options and text.startswith(("{", "[")) else text
