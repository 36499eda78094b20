"""The command line: reads arguments and hands them to the chosen command, which alone is imported."""

import argparse
import errno
import io
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import Any, NoReturn

from .base import trust
from .base.errors import ClusterError, InputError, LinkLost, clipped, short_path
from .commands import COMMANDS, GROUPS, folder
from .commands.examples import FIRST, help_text

_OF_THE_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO, errno.ENAMETOOLONG)
_LONGEST_WORD = 100
_WITHOUT_RIG = ("compare", "completion", "doctor", "list", "new", "open", "trust")
_ASKED = "_ARGCOMPLETE"  # in the environment when a shell asks for the end of a word


class Parser(argparse.ArgumentParser):
    """Complains in one line; keeps the lines of what stands below its options."""

    def __init__(self, **words: Any) -> None:
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, **words)

    def error(self, message: str) -> NoReturn:
        """Raise InputError instead of leaving the process."""
        raise InputError(f"{message}; see {self.prog} --help")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command. Status 0: done; 2: bad input, with one line on stderr; 130: interrupted, resumable."""
    words = sys.argv[1:] if arguments is None else list(arguments)
    if _ASKED in os.environ:
        _complete()
    for threads in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
        os.environ.setdefault(threads, "1")  # matrices here are small, and the engine has a thread a core
    _print_what_the_console_has()
    os.environ["PYTHONSAFEPATH"] = "1"  # worker processes import nothing from the working folder either
    try:
        if not words:
            print(_first_words())
            return 0
        options = _parser(words).parse_args(words)
        if getattr(options, "trust", False):
            trust.allow_everything()
        options.call(options, words)
        sys.stdout.flush()  # on a full disk, this is where it shows
    except (InputError, ClusterError) as error:
        return _complaint(str(error))
    except LinkLost as error:
        return _complaint(f"the link is lost: {error}; the same command goes on where it was")
    except BrokenPipeError:  # the reader of our output has seen enough, as in `jackbench list effects | head`
        sys.stderr.close()
        return 0
    except OSError as error:
        if error.errno not in _OF_THE_DISK:
            raise
        return _complaint(f"{error.filename or 'writing'}: {error.strerror}; mend that and repeat the command")
    except KeyboardInterrupt:
        print("jackbench: interrupted; the same command resumes", file=sys.stderr)
        return 130
    return 0


def _print_what_the_console_has() -> None:
    """A sign that the encoding of a console or a pipe lacks is shown as "?", and ends no command."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _complaint(text: str) -> int:
    """One line on stderr, of words and paths that fit on one; the status of bad input."""
    line = " ".join(short_path(word, _LONGEST_WORD) for word in text.split())
    print(f"jackbench: {clipped(line, 1000)}", file=sys.stderr)
    return 2


def _complete() -> NoReturn:
    """Answer a shell that asks for the end of a word."""
    from .commands.completion.answers import answer, asked_words

    answer(_parser(asked_words()))
    raise SystemExit  # answering has ended the process


def _first_words() -> str:
    """What people do first."""
    lines = [f"  {line:<51}# {what}" for line, what in FIRST.items()]
    after = "`jackbench --help` lists all commands, `jackbench COMMAND --help` has examples of one."
    return "\n".join([f"jackbench {_version()}: what people do first", "", *lines, "", after])


def _parser(words: Sequence[str]) -> argparse.ArgumentParser:
    """The parser of every command's name, with the options of the command that `words` give."""
    what = "Controller-design workbench for servo-hydraulic jacks."
    parser = Parser(prog="jackbench", description=what, epilog=_grouped())
    parser.add_argument("--version", action="version", version=f"jackbench {_version()}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND", help="one of those below")
    first_word = next((word for word in words if not word.startswith("-")), None)
    for name, does in COMMANDS.items():
        command = commands.add_parser(name, description=f"{does[0].upper()}{does[1:]}.", epilog=help_text(name))
        if name == first_word:
            import_module(f".commands.{folder(name)}.options", __package__).options(command)
            if name not in _WITHOUT_RIG:
                command.add_argument("--trust", action="store_true", help="run the effect_files of rigs, this once")
    return parser


def _grouped() -> str:
    """Every command with what it does, by what a person is at."""
    widest = max(map(len, COMMANDS))
    groups = [
        "\n".join([f"{title}:", *(f"  {name:<{widest}}  {what}" for name, what in group.items())])
        for title, group in GROUPS.items()
    ]
    return "\n\n".join([*groups, "`jackbench COMMAND --help` has the options of one, and examples."])


def _version() -> str:
    try:
        return version("jackbench")
    except PackageNotFoundError:
        return "unknown"


if __name__ == "__main__":
    sys.exit(main())
