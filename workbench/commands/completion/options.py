"""`jackbench completion bash|zsh|fish`: the lines by which a shell asks `jackbench` for the end of a word."""

import argparse

SHELLS = ("bash", "zsh", "fish")


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("shell", choices=SHELLS)
    parser.set_defaults(call=_completion)


def _completion(options: argparse.Namespace, _words: list[str]) -> None:
    from argcomplete.shell_integration import shellcode

    # argcomplete has one script for bash and zsh, which finds out by itself
    print(shellcode(["jackbench"], shell="fish" if options.shell == "fish" else "bash"))
