"""What a shell is answered that asks for the end of a word: options, and the names of what is shipped."""

import argparse
import os
from collections.abc import Callable, Iterator
from typing import Any

import argcomplete
from argcomplete.completers import FilesCompleter

from ...rigs.platform.platform_file import bundled_platforms
from ...rigs.rig_file import bundled
from ..common.shipped import campaign, experiment, shipped

Completer = Callable[..., list[str]]


def asked_words() -> list[str]:
    """The words of the line that is being typed, without the program's name."""
    return os.environ["COMP_LINE"][: int(os.environ["COMP_POINT"])].split()[1:]


def answer(parser: argparse.ArgumentParser) -> None:
    """Answer the shell, and end the process."""
    for action in _actions(parser):
        if names := _names(action):
            action.completer = _with_files(names)  # type: ignore[attr-defined]
    argcomplete.autocomplete(parser)


def _actions(parser: argparse.ArgumentParser) -> Iterator[Any]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from command._actions
        yield action


def _names(action: argparse.Action) -> list[str]:
    """The names that an argument takes beside paths of files."""
    if action.type is experiment:
        return [path.stem for path in shipped().glob("*.toml")]
    if action.type is campaign:
        return [path.parent.name for path in shipped().glob("*/campaign.toml")]
    return [*bundled(), *bundled_platforms()] if action.dest == "rig" else []


def _with_files(names: list[str]) -> Completer:
    files = FilesCompleter()
    return lambda prefix, **_: sorted([*(name for name in names if name.startswith(prefix)), *files(prefix)])
