"""The command line: reads arguments and hands them to the chosen command, which alone is imported."""

import argparse
import errno
import io
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import Any, NoReturn

from .base import trust
from .base.errors import ClusterError, InputError, LinkLost, clipped, short_path
from .commands import COMMANDS, GROUPS, STUDIES, folder
from .commands.examples import FIRST, help_text

_OF_THE_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO, errno.ENAMETOOLONG)
_LONGEST_WORD = 100
_RENAMED = {"--trials": "--designs"}  # options of 0.2
_INTERRUPTED = 130
_WITHOUT_RIG = ("compare", "completion", "doctor", "list", "new", "open", "trust")
_ENDS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))  # Windows has no HUP
_SAME_END = 10.0  # s: within them further ones belong to the first, as a closed terminal sends several
_ASKED = "_ARGCOMPLETE"  # in the environment when a shell asks for the end of a word


class Parser(argparse.ArgumentParser):
    """Complains in one line; keeps the lines of what stands below its options."""

    def __init__(self, **words: Any) -> None:
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, **words)

    def error(self, message: str) -> NoReturn:
        """Raise InputError instead of leaving the process."""
        raise InputError(f"{message}; see {self.prog} --help")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command. Status 0: done; 2: bad input, with one line on stderr; 130: interrupted, resumable, by Ctrl-C;
    143 by SIGTERM, and 129 by SIGHUP, as of a terminal that is closed."""
    return _ended("jackbench", sys.argv[1:] if arguments is None else arguments, _options)


def script(
    module: str, what: str, options: Callable[[argparse.ArgumentParser], None], arguments: Sequence[str] | None
) -> int:
    """Run a study of the repository, `python -m MODULE`, as `main` runs a command; `options` declares what it takes."""
    parser = Parser(prog=f"python -m {module}", description=what)
    options(parser)
    _trusts(parser)
    return _ended(parser.prog, sys.argv[1:] if arguments is None else arguments, parser.parse_args)


def _ended(program: str, words: Sequence[str], read: Callable[[Sequence[str]], argparse.Namespace]) -> int:
    """The status of a command, also of one that a signal ended."""
    with _ended_by_signals() as ends:
        status = _run(program, words, read)
    return 128 + ends[0] if status == _INTERRUPTED and ends else status


def _run(program: str, words: Sequence[str], read: Callable[[Sequence[str]], argparse.Namespace]) -> int:
    if _ASKED in os.environ:
        _complete()
    for threads in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
        os.environ.setdefault(threads, "1")  # matrices here are small, and the engine has a thread a core
    _print_what_the_console_has()
    os.environ["PYTHONSAFEPATH"] = "1"  # worker processes import nothing from the working folder either
    try:
        if not words and read is _options:
            print(_first_words())
            return 0
        options = read(words)
        if getattr(options, "trust", False):
            trust.allow_everything()
        options.call(options, [*program.split(), *words])
        sys.stdout.flush()  # on a full disk, this is where it shows
    except (InputError, ClusterError) as error:
        return _complaint(str(error))
    except LinkLost as error:
        return _complaint(f"the link is lost: {error}; the same command goes on where it was")
    except BrokenPipeError:  # the reader of our output has seen enough, as in `jackbench list effects | head`
        sys.stderr.close()
        return 0
    except UnicodeEncodeError as error:
        if not _no_text(error.object[error.start : error.end]):
            raise
        return _complaint(f"{error.object}: is no UTF-8; give that file or folder another name")
    except OSError as error:
        if error.errno not in _OF_THE_DISK:
            raise
        return _complaint(f"{error.filename or 'writing'}: {error.strerror}; mend that and repeat the command")
    except KeyboardInterrupt:
        exec("")  # an interrupt within an exec, as of a dataclass, would else make Python end itself by SIGINT
        again = "the same command resumes" if "--force" not in words else "with --force the same command begins anew"
        _say(f"interrupted; {again}")
        return _INTERRUPTED
    return 0


@contextmanager
def _ended_by_signals() -> Iterator[list[int]]:
    """SIGTERM and SIGHUP do what Ctrl-C does, unless whoever started this process has it ignore them (nohup); those
    that came."""
    came, last = list[int](), -_SAME_END

    def end(number: int, _: object) -> None:
        nonlocal last
        came.append(number)
        before, last = last, time.monotonic()
        if last - before >= _SAME_END:
            raise KeyboardInterrupt

    mine = _ENDS if threading.current_thread() is threading.main_thread() else ()
    before = {number: signal.signal(number, end) for number in mine if signal.getsignal(number) != signal.SIG_IGN}
    try:
        yield came
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _options(words: Sequence[str]) -> argparse.Namespace:
    """What the words ask for. Raises InputError for what they may not be, with the help of their command."""
    for word in words:
        if _no_text(word):
            raise InputError(f"{word}: is no UTF-8; give that file or folder another name")
    if study := STUDIES.get(_command(words) or ""):
        raise InputError(f"{_command(words)}: is a study now; in a clone run python -m experiments.studies.{study}")
    for place, word in enumerate(words):
        if now := _RENAMED.get(word.partition("=")[0]):
            _say(f"{word}: is called {now} now; the next version knows no other name")
            words = [*words[:place], word.replace(word.partition("=")[0], now), *words[place + 1 :]]
    options, unknown = _parser(words).parse_known_args(words)
    if unknown:
        raise InputError(f"unknown arguments: {' '.join(unknown)}; see jackbench {_command(words)} --help")
    return options


def _no_text(word: str) -> bool:
    """Whether a word has bytes that are no UTF-8, which Python keeps as surrogates."""
    return any("\ud800" <= sign <= "\udfff" for sign in word)


def _command(words: Sequence[str]) -> str | None:
    """The command that the words give."""
    return next((word for word in words if not word.startswith("-")), None)


def _print_what_the_console_has() -> None:
    """A sign that the encoding of a console or a pipe lacks is shown as "?", and ends no command."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _complaint(text: str) -> int:
    """One line on stderr, of words and paths that fit on one; the status of bad input."""
    line = " ".join(short_path(word, _LONGEST_WORD) for word in text.split())
    _say(clipped(line, 1000))
    return 2


def _say(line: str) -> None:
    """On stderr, where somebody still reads that: a closed terminal or pipe takes nothing."""
    with suppress(OSError):
        print(f"jackbench: {line}", file=sys.stderr)


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
    first_word = _command(words)
    for name, does in COMMANDS.items():
        command = commands.add_parser(name, description=f"{does[0].upper()}{does[1:]}.", epilog=help_text(name))
        if name == first_word:
            import_module(f".commands.{folder(name)}.options", __package__).options(command)
            if name not in _WITHOUT_RIG:
                _trusts(command)
    return parser


def _trusts(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--trust", action="store_true", help="run the effect_files of rigs, this once")


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
