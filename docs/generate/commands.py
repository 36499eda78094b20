"""Every command with its options, as its own parser has them."""

import argparse
from importlib import import_module
from textwrap import dedent

from workbench.commands import GROUPS, folder
from workbench.commands.examples import EXAMPLES

from .markdown import code, page, plain, table

_INTRODUCTION = """Every command computes into a folder of its own: `--out DIR`, by default `out/NAME`, gets
`report.html`, `metrics.json`, curves as `*.parquet` and the resolved `config.toml`. Exit status 0 says that it is
done, 2 bad input, with one line on stderr, and 130 an interrupt (143 by SIGTERM, 129 by SIGHUP): the same command
resumes. Where a command reads a rig it also takes `--trust`, which lets the Python files that the
rig names run this once."""


def pages() -> dict[str, str]:
    """The page of the commands."""
    every = [_overview(), *(part for group in GROUPS.values() for item in group.items() for part in _command(*item))]
    return {"commands.md": page("Commands", _INTRODUCTION, *every)}


def _overview() -> str:
    """The commands by what a person is at."""
    links = [[group, ", ".join(f"[{name}](#jackbench-{name})" for name in names)] for group, names in GROUPS.items()]
    return table(("to", "commands"), links)


def _command(name: str, what: str) -> list[str]:
    parser = argparse.ArgumentParser(prog=f"jackbench {name}", formatter_class=_Narrow, add_help=False)
    import_module(f"workbench.commands.{folder(name)}.options").options(parser)
    rows = [[_call(action), _help(action)] for action in parser._actions]
    usage = dedent(f"       {parser.format_usage().removeprefix('usage: ')}").rstrip()
    return [
        f"## jackbench {name}",
        plain(f"{what[0].upper()}{what[1:]}."),
        f"```text\n{usage}\n```",
        *([table(("argument", "meaning"), rows)] if rows else []),
        "For example:",
        "```console\n{}\n```".format("\n".join(f"$ {line}" for line in EXAMPLES[name])),
    ]


class _Narrow(argparse.HelpFormatter):
    """Usage in lines that a page has room for, whatever the terminal."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, width=76)


def _call(action: argparse.Action) -> str:
    value = action.metavar or (action.dest.upper() if action.nargs != 0 else "")
    words = " ".join(value) if isinstance(value, tuple) else value
    if not action.option_strings:
        return code(words.lower() if not action.metavar else words)
    return ", ".join(code(f"{flag} {words}".strip()) for flag in action.option_strings)


def _help(action: argparse.Action) -> str:
    choices = f"one of {', '.join(map(str, action.choices))}" if action.choices else ""
    said = (action.help or "").replace("%(default)s", str(action.default)).replace("%%", "%")
    return "; ".join(plain(part) for part in (said, choices) if part)
