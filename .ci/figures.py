"""Holds the figures of the READMEs to what the commands beside them print; words choose commands that contain them.

Two forms are checked. A comment on a line of its own, `<!-- held: COMMAND: PATH ... -->`, says that each PATH of the
command's metrics.json (chi2.after, rows[id=main_100_f3db].value) stands in the block that follows, rounded as it is
written there. A block of code that begins with `$ jackbench` is what the command prints, `...` standing for any lines.
"""

import json
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PAGES = ("README.md", "experiments/README.md")
HELD = re.compile(r"^<!-- held: (jackbench [^:]+): ([^>]+?) -->$", re.MULTILINE)
PRINTED = re.compile(r"^    \$ (jackbench .*)\n((?:    .*\n)+)", re.MULTILINE)


def claims(text: str) -> Iterator[tuple[str, list[str], str]]:
    """(command, paths, the block that states them) of every comment of a page."""
    for comment in HELD.finditer(text):
        block = HELD.sub("", text[comment.end() :].partition("\n\n")[0]).strip()
        yield comment[1], comment[2].split(), block


def value(metrics: Any, path: str) -> float:
    """The number at a path such as rows[id=main_100_f3db].value. Raises KeyError where there is none."""
    for key, name, wanted in re.findall(r"(\w+)(?:\[(\w+)=([^\]]+)\])?", path):
        metrics = metrics[key]
        if name:
            rows = [row for row in metrics if str(row[name]) == wanted]
            if len(rows) != 1:
                raise KeyError(f"{path}: {len(rows)} rows with {name} = {wanted}")
            metrics = rows[0]
    return float(metrics)


def states(block: str, number: float) -> bool:
    """Whether a number of the block is this one, rounded as the block writes it, to two digits at least."""
    for text in re.findall(r"-?\d+(?:\.\d+)?", block):
        decimals = len(text.partition(".")[2])
        if len(text.strip("-").replace(".", "").lstrip("0")) > 1 and f"{number:.{decimals}f}" == text:
            return True
    return False


@cache
def done(command: str) -> tuple[str, dict[str, Any]]:
    """What a command prints, and its metrics.json, where it leaves one."""
    with tempfile.TemporaryDirectory() as scratch:
        words = shlex.split(command)[1:]
        if "--rig-out" in words:
            place = words.index("--rig-out") + 1
            words[place] = f"{scratch}/{words[place]}"
        call = [sys.executable, "-m", "workbench.cli", *words, "--out", f"{scratch}/out"]
        run = subprocess.run(call, cwd=ROOT, capture_output=True, text=True, check=False)
        if run.returncode:
            raise RuntimeError(f"{command}: {run.stderr.splitlines()[-1]}")
        return run.stdout, json.loads(Path(scratch, "out", "metrics.json").read_text(encoding="utf-8"))


def misprints(text: str, only: str = "") -> Iterator[str]:
    """One line for each figure of a page that its command does not give."""
    for command, paths, block in claims(text):
        if only in command:
            for path in paths:
                number = value(done(command)[1], path)
                if not states(block, number):
                    yield f"{command}: {path} is {number:.6g}, which is not in: {block.splitlines()[0][:80]}"
    for command, block in PRINTED.findall(text):
        if only in command:
            printed = re.sub(r"\s+", " ", done(command)[0])
            parts = [" ".join(part.split()) for part in re.split(r"^\s*\.\.\.\s*$", block, flags=re.MULTILINE)]
            yield from (f"{command}: does not print: {part}" for part in parts if part not in printed)


def main(only: str) -> int:
    """Check both pages; 1 where a figure is wrong."""
    wrong = [f"{page}: {line}" for page in PAGES for line in misprints((ROOT / page).read_text("utf-8"), only)]
    print("\n".join(wrong) or "every figure is what its command gives")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main(" ".join(sys.argv[1:])))
