"""Holds the figures of PAGES to what the commands beside them print; words choose commands that contain them.

With `--write` first, the numbers of tables by `{row}` are written anew, each in the digits that it has. What differs
still stays and is listed: rows of more numbers than paths, numbers that became words, words, blocks of other kinds.

A comment on a line of its own, `<!-- held: COMMAND: PATH ... -->`, says that each PATH of the command's metrics.json
(chi2.after, rows[id=main_100_f3db].value) stands in the block that follows, rounded as it is written there. Where the
paths name `{row}` the block is a table: they are read for the first cell of each row, and stand in that row in their
order. `a|b` in a path takes the larger, `*1e3` at its end is a factor, and a number that is null stands as a word
(never, trips). A block of code that begins with `$ jackbench` is what the command prints, `...` standing for any lines.
A table of numbers without a comment is refused, except in the pages and sections of NOT_HELD.
"""

import json
import re
import shlex
import sys
import tempfile
from collections.abc import Iterator
from contextlib import chdir, redirect_stderr, redirect_stdout
from functools import cache
from io import StringIO
from math import prod
from pathlib import Path
from typing import Any

from workbench import cli

ROOT = Path(__file__).parents[1]


def _is_ours(path: Path) -> bool:
    """Whether a page is written by hand."""
    return path.relative_to(ROOT / "docs").parts[0] not in ("_build", "reference")


PAGES = (
    "README.md",
    *(str(path.relative_to(ROOT)) for path in sorted((ROOT / "docs").rglob("*.md")) if _is_ours(path)),
)
HELD = re.compile(r"^<!-- held: (jackbench [^:]+): ([^>]+?) -->$", re.MULTILINE)
NOT_HELD = {
    "What a loop contains": "defaults that rig files declare, not results",
    "How often has a healthy rig an alarm?": "held by tests/test_watch_study.py to what was drawn",
    "How often is a watch right?": "two hours; held by tests/test_watch_study.py to the rigs that were run",
    "How well is a rig commissioned?": "an hour; held by tests/test_commission_study.py to the rigs that were run",
    "What knowledge buys": "two hours; held by tests/test_knowledge.py to the searches that were run",
    "What knowing buys": "twenty minutes; held by tests/test_knowledge.py to the searches that were run",
    "JackBench-v0": "a thousand episodes each, by examples/rl_baselines.py",
    "How do I use Stable-Baselines3?": "two minutes of training, by examples/rl/ppo_on_p_dp.py",
    "How often is a trace right?": "more than an hour",
    "How often is a trace of a rig by datasheet right?": "two hours; held by tests/test_study_tables.py",
    "How often is the leg right?": "two hours; held by tests/test_study_tables.py to the platforms that were traced",
    "How often is the joint right?": "fifteen minutes; held by tests/test_study_tables.py to what was traced",
    "How often does a sheet hold the truth?": "half an hour; held by tests/test_sheet_study.py to what was drawn",
    "Is it named for its neighbour?": "an hour; held by tests/test_study_tables.py to the campaigns that were traced",
    "Training a policy": "three searches of minutes; what the best of them does is held",
    "A search": "each search takes up to 80 s; one of them is held, and the bench holds what all of them left",
    "Memory and time of many plants": "of one machine; tests/test_robustness_memory.py holds what is kept of a plant",
    "Speed": "times, different in each run",
    "A real rig: what a trace finds": "data not shipped, and minutes",
    "A real rig: what two voltages do not tell": "fits of minutes, and data not shipped",
    "A real rig: how far a free run goes": "fits of minutes, and data not shipped",
    "A pump-controlled rig: what its model lacks": "data not shipped",
    "A pump-controlled rig, from the motor's voltage": "data not shipped",
    "A crane without units": "data not shipped",
    "An excavator whose repeats differ": "data not shipped",
    "A press whose valve command nobody recorded": "data not shipped; held by tests/test_press_page.py",
    "What do records of hidden loops tell?": "an hour and a half; held by tests/test_study_tables.py to what was drawn",
}
PRINTS = ("spread", "jack-model", "coefficients", "list", "show")  # which leave no folder
WORD = r"-?\d+(?:\.\d+)?|never|trips|unstable|none"
PRINTED = re.compile(r"^    \$ (jackbench .*)\n((?:    .*\n)+)", re.MULTILINE)


def claims(text: str) -> Iterator[tuple[str, list[str], str]]:
    """(command, paths, the block that states them) of every comment of a page."""
    for comment in HELD.finditer(text):
        block = HELD.sub("", text[comment.end() :].partition("\n\n")[0]).strip()
        yield comment[1], comment[2].split(), block


def value(metrics: Any, path: str) -> float | None:
    """The number at a path such as rows[id=main_100_f3db].value. Raises KeyError where there is none."""
    path, _, factor = path.partition("*")
    for key, selection in re.findall(r"([\w.@%]+?)(?:\[([^\]]+)\])?(?:\.|$)", path):
        metrics = [entry[key] for entry in metrics] if isinstance(metrics, list) else metrics[key]
        if selection:
            metrics = _selected(metrics, selection)
    numbers = metrics if isinstance(metrics, list) else [metrics]
    if not numbers:
        raise KeyError(path)
    return None if None in numbers else max(numbers) * float(factor or 1)


def _selected(rows: list[dict[str, Any]], selection: str) -> list[dict[str, Any]]:
    """The rows with these values, `key=a|b,other=c`; one for each combination."""
    choices = {key: values.split("|") for key, values in (part.split("=") for part in selection.split(","))}
    chosen = [row for row in rows if all(str(row[key]) in values for key, values in choices.items())]
    if len(chosen) != prod(map(len, choices.values())):
        raise KeyError(f"{selection}: {len(chosen)} rows")
    return chosen


def states(block: str, number: float | None) -> bool:
    """Whether a number of the block is this one, rounded as the block writes it, to two digits at least."""
    long = (text for text in re.findall(WORD, block) if len(re.sub(r"\D", "", text).lstrip("0")) > 1)
    return any(_rounded(number, text) for text in long)


def _rounded(number: float | None, text: str) -> bool:
    if number is None or text.isalpha():
        return number is None and text.isalpha()
    return float(f"{number:.{len(text.partition('.')[2])}f}") == float(text)


def misprinted_rows(block: str, metrics: Any, paths: list[str]) -> Iterator[str]:
    """One line for each row of a table in which the numbers of the paths do not stand in their order."""
    for line in block.splitlines()[2:]:
        name, _, cells = line.strip("| ").partition(" | ")
        words = iter(re.findall(WORD, cells))
        for path in paths:
            number = value(metrics, path.replace("{row}", name))
            if not any(_rounded(number, word) for word in words):
                yield f"{path.replace('{row}', name)} is {number}, which is not there or not in its order"
                break


def rewritten(text: str, only: str = "") -> str:
    """A page with the numbers of its tables by `{row}` as their commands give them."""
    for command, paths, block in claims(text):
        if only in command and "{row}" in paths[0]:
            head, lines = block.splitlines()[:2], block.splitlines()[2:]
            text = text.replace(block, "\n".join([*head, *(_filled(line, done(command)[1], paths) for line in lines)]))
    return text


def _filled(line: str, metrics: Any, paths: list[str]) -> str:
    name, _, cells = line.strip("| ").partition(" | ")
    if len(re.findall(WORD, cells)) != len(paths):
        return line
    numbers = iter([value(metrics, path.replace("{row}", name)) for path in paths])

    def written(word: re.Match[str]) -> str:
        number = next(numbers)
        stays = number is None or word[0].isalpha() or _rounded(number, word[0])
        return word[0] if stays else f"{number:.{len(word[0].partition('.')[2])}f}"

    return f"| {name} | {re.sub(WORD, written, cells)} |"


def unheld(text: str) -> Iterator[str]:
    """The first line of each table with numbers that no comment holds, outside the pages and sections of NOT_HELD."""
    if text.partition("\n")[0].removeprefix("# ") in NOT_HELD:
        return
    for section in re.split(r"^#{1,2} ", text, flags=re.MULTILINE):
        for block in section.split("\n\n"):
            rows = [line for line in block.splitlines() if line.startswith("|")]
            numbers = re.search(r"\d\.\d", "\n".join(rows))
            if numbers and "<!-- held:" not in block and section.partition("\n")[0] not in NOT_HELD:
                yield f"no command holds the table: {rows[0][:80]}"


@cache
def done(command: str) -> tuple[str, dict[str, Any]]:
    """What a command prints, and its metrics.json, where it leaves one."""
    with tempfile.TemporaryDirectory() as scratch:
        words = shlex.split(command)[1:]
        if "--rig-out" in words:
            place = words.index("--rig-out") + 1
            words[place] = f"{scratch}/{words[place]}"
        out = [] if words[0] in PRINTS else ["--out", f"{scratch}/out"]
        printed, told = StringIO(), StringIO()
        with chdir(ROOT), redirect_stdout(printed), redirect_stderr(told):
            status = cli.main([*words, *out])
        if status:
            raise RuntimeError(f"{command}: {told.getvalue().splitlines()[-1]}")
        metrics = Path(scratch, "out", "metrics.json").read_text(encoding="utf-8") if out else "{}"
        return printed.getvalue(), json.loads(metrics)


def misprints(text: str, only: str = "") -> Iterator[str]:
    """One line for each figure of a page that its command does not give, and for each table that none holds."""
    yield from unheld(text)
    for command, paths, block in claims(text):
        if not block:
            yield f"{command}: the comment holds nothing; its block has to follow it without an empty line"
        elif only in command:
            if "{row}" in paths[0]:
                yield from (f"{command}: {line}" for line in misprinted_rows(block, done(command)[1], paths))
                continue
            for path in paths:
                number = value(done(command)[1], path)
                if not states(block, number):
                    yield f"{command}: {path} is {number}, which is not in: {block.splitlines()[0][:80]}"
    for command, block in PRINTED.findall(text):
        if only in command:
            printed = re.sub(r"\s+", " ", done(command)[0])
            parts = [" ".join(part.split()) for part in re.split(r"^\s*\.\.\.\s*$", block, flags=re.MULTILINE)]
            yield from (f"{command}: does not print: {part}" for part in parts if part not in printed)


def main(only: str, write: bool = False) -> int:
    """Check the pages, written anew first if that is asked for; 1 where a figure is wrong."""
    pages = {page: (ROOT / page).read_text("utf-8") for page in PAGES}
    if not any(only in command for text in pages.values() for command, *_ in [*claims(text), *PRINTED.findall(text)]):
        print(f"no command of the pages contains {only!r}")
        return 2
    if write:
        for page, text in pages.items():
            if (anew := rewritten(text, only)) != text:
                (ROOT / page).write_text(anew, "utf-8")
                pages[page] = anew
    wrong = [f"{page}: {line}" for page, text in pages.items() for line in misprints(text, only)]
    print("\n".join(wrong) or "every figure is what its command gives")
    return bool(wrong)


if __name__ == "__main__":
    write = sys.argv[1:2] == ["--write"]
    sys.exit(main(" ".join(sys.argv[1 + write :]), write))
