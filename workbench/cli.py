"""The command line: reads arguments and hands them to the chosen command, which alone is imported."""

import argparse
import errno
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import NoReturn

from .base import trust
from .base.errors import ClusterError, InputError, clipped, short_path
from .commands import COMMANDS, folder

_OF_THE_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO, errno.ENAMETOOLONG)
_LONGEST_WORD = 100
_WITHOUT_RIG = ("compare", "list", "new", "trust")


class Parser(argparse.ArgumentParser):
    """Complains in one line."""

    def error(self, message: str) -> NoReturn:
        """Raise InputError instead of leaving the process."""
        raise InputError(f"{message}; see {self.prog} --help")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command. Status 0: done; 2: bad input, with one line on stderr; 130: interrupted, resumable."""
    words = sys.argv[1:] if arguments is None else list(arguments)
    for threads in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
        os.environ.setdefault(threads, "1")  # matrices here are small, and the engine has a thread a core
    os.environ["PYTHONSAFEPATH"] = "1"  # worker processes import nothing from the working folder either
    try:
        options = _parser(words).parse_args(words)
        if getattr(options, "trust", False):
            trust.allow_everything()
        options.call(options, words)
        sys.stdout.flush()  # on a full disk, this is where it shows
    except (InputError, ClusterError) as error:
        return _complaint(str(error))
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


def _complaint(text: str) -> int:
    """One line on stderr, of words and paths that fit on one; the status of bad input."""
    line = " ".join(short_path(word, _LONGEST_WORD) for word in text.split())
    print(f"jackbench: {clipped(line, 1000)}", file=sys.stderr)
    return 2


def _parser(words: Sequence[str]) -> argparse.ArgumentParser:
    """The parser of every command's name, with the options of the command that `words` give."""
    parser = Parser(prog="jackbench", description="Controller-design workbench for servo-hydraulic jacks.")
    parser.add_argument("--version", action="version", version=f"jackbench {_version()}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND", parser_class=Parser)
    first_word = next((word for word in words if not word.startswith("-")), None)
    for name, what in COMMANDS.items():
        command = commands.add_parser(name, help=what, description=f"{what[0].upper()}{what[1:]}.")
        if name == first_word:
            import_module(f".commands.{folder(name)}.options", __package__).options(command)
            if name not in _WITHOUT_RIG:
                command.add_argument("--trust", action="store_true", help="run the effect_files of rigs, this once")
    return parser


def _version() -> str:
    try:
        return version("jackbench")
    except PackageNotFoundError:
        return "unknown"


if __name__ == "__main__":
    sys.exit(main())
