"""Refuses sentences that have to be read twice: RULES in the pages of the site, the README, and every text that a
command prints or a report shows; HELP in the lines of --help.

Prints one line for each place, with the rule that it breaks.
"""

import ast
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("workbench", "controllers", "envs")
SPELLING = (
    r"\b(?:[Bb]ehaviors?|[Cc]olors?|[Cc]enter(?:ed|s)?|[Gg]ray|[Nn]eighbors?|[Cc]atalogs?|[Mm]odel(?:ed|ing)"
    r"|[Ll]abel(?:ed|ing)|(?!(?:re)?siz|prize|seiz)[A-Za-z]{2,}[iy]z(?:e[ds]?|ing|ation))\b"
)
RULES = {
    r"\bWhat [^.?|]{3,60} says `": "an inversion: begin with the subject that says it",
    r"(?:^|[.;:] )[A-Za-z][a-z]+ed (?:is|are|was|were) (?:a |an |the )?[a-z]+": "an inversion: begin with the subject",
    r"\btakes back what\b": "name the thing that is taken back",
    r"\bthose that [^.|,]{3,40} refused\b": "a verb is missing: `are refused`, or `it refuses those that`",
    r"\b(?:un)?[Ee]qual chances\b": "no sentence, or no noun: say what was equal for whom",
    r"\bOnly \w+ beyond the \w+ count\b": "`count` reads as a noun: say what is ignored",
    r"\bwhat [^.?|]{3,60} is what\b": "what is what: name the thing",
    r"\b(?:is|are|was|were) of (?!course\b)[a-z]": "a noun is missing before `of`: what does it need, hold, belong to?",
    r"\bbuys? (?:a|an|the|its) (?:controller|loop|rig)\b": "say what the controller gains",
    r"\b[Ll]eave (?:it|them|this) away\b": "in English: leave out",
    r"\bcan(?:not)? be had\b": "say reached, made or found",
    SPELLING: "American spelling: British here",
}
HELP = {r"\A(?:of|such as|that|whose|where|which|what|how|who|when)\b": "a help line begins with a noun or a verb"}
CODE = re.compile(r"^```.*?^```|^    .*$|`[^`\n]*`|<!--.*?-->|\]\([^)]*\)", re.M | re.S)

WRAPPED = re.compile(r"(?<!\n)\n(?![\n#|>*-])")


@dataclass(frozen=True)
class Text:
    """Words of a file from a line on; `is_help` where --help prints them."""

    path: Path
    line: int
    words: str
    is_help: bool = False


def broken(text: str, rules: dict[str, str] = RULES) -> Iterator[tuple[int, str]]:
    """(line, what is wrong) of each place in a text; code, and what a link leads to, stay out."""
    words = WRAPPED.sub(" ", CODE.sub(lambda code: re.sub(r"[^\n`]", "_", code[0]), text))
    for pattern, why in rules.items():
        for match in re.finditer(pattern, words, re.M):
            yield text.count("\n", 0, match.start()) + 1, f"{' '.join(match[0].split())}: {why}"


def texts() -> Iterator[Text]:
    """Every page that is written by hand, and every text of the packages that a user may read."""
    docs = ROOT / "docs"
    for path in (ROOT / "README.md", ROOT / "CHANGELOG.md", ROOT / "CONTRIBUTING.md", *sorted(docs.rglob("*.md"))):
        if not {"_build", "reference"} & set(path.relative_to(ROOT).parts):
            yield Text(path, 1, path.read_text("utf-8"))
    for path in (path for name in PACKAGES for path in sorted((ROOT / name).rglob("*.py"))):
        yield from said(path, path.read_text("utf-8"))


def said(path: Path, code: str) -> Iterator[Text]:
    """The texts in Python code of three words or more, those that help= names among them; docstrings are none."""
    tree = ast.parse(code)
    helped = {id(word.value) for word in ast.walk(tree) if isinstance(word, ast.keyword) and word.arg == "help"}
    left_out = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            left_out |= {id(part) for part in ast.walk(node) if part is not node}
        words = _words(node)
        if id(node) not in left_out and len(words.split()) >= 3:
            yield Text(path, node.lineno, words, id(node) in helped)


def _words(node: ast.AST) -> str:
    """The text of a literal, `X` in the place of what it fills in; nothing of other nodes."""
    if isinstance(node, ast.JoinedStr):
        return "".join(_words(part) or "X" for part in node.values)
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""


def complaints() -> Iterator[str]:
    """One line for each place that breaks a rule."""
    for text in texts():
        rules = {**RULES, **HELP} if text.is_help else RULES
        for line, what in broken(text.words, rules):
            yield f"{text.path.relative_to(ROOT)}:{text.line + line - 1}: {what}"


def main() -> int:
    """Check all texts; 1 where a rule is broken."""
    lines = list(complaints())
    print("\n".join(lines) or "every sentence keeps the rules")
    return bool(lines)


if __name__ == "__main__":
    sys.exit(main())
