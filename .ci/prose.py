"""Refuses sentences that have to be read twice: RULES on the pages of the site, the README and the commands' help.

Prints one line for each place, with the rule that it breaks.
"""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
RULES = {
    r"\bWhat [^.?|]{3,60} says `": "an inversion: begin with the subject that says it",
    r"\btakes back what\b": "name the thing that is taken back",
    r"\bthose that [^.|,]{3,40} refused\b": "a verb is missing: `are refused`, or `it refuses those that`",
    r"\b(?:un)?[Ee]qual chances\b": "no sentence, or no noun: say what was equal for whom",
    r"\bOnly \w+ beyond the \w+ count\b": "`count` reads as a noun: say what is ignored",
    r"\bwhat [^.?|]{3,60} is what\b": "what is what: name the thing",
    r"\b(?:behavior|linearize[ds]?|minimize[ds]?|optimize[ds]?|modeled)\b": "American spelling: British here",
}
HELP = ("workbench/commands/__init__.py", "workbench/commands/*/options.py")


def broken(text: str) -> Iterator[tuple[int, str]]:
    """(line, what is wrong) of each place in a text; code in fences, in lines that are indented, and links stay out."""
    words = re.sub(r"^```.*?^```|^    .*$", lambda code: re.sub(r"[^\n]", " ", code[0]), text, flags=re.M | re.S)
    for pattern, why in RULES.items():
        for match in re.finditer(pattern, words):
            yield text.count("\n", 0, match.start()) + 1, f"{' '.join(match[0].split())}: {why}"


def texts() -> Iterator[tuple[Path, str]]:
    """Every page that is written by hand, and the lines of the commands' help that are text."""
    docs = ROOT / "docs"
    for path in (ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted(docs.rglob("*.md"))):
        if not {"_build", "reference"} & set(path.relative_to(ROOT).parts):
            yield path, path.read_text("utf-8")
    for path in (path for pattern in HELP for path in sorted(ROOT.glob(pattern))):
        yield path, "\n".join(line.strip() for line in path.read_text("utf-8").splitlines())


def main() -> int:
    """Check all texts; 1 where a rule is broken."""
    lines = [f"{path.relative_to(ROOT)}:{line}: {what}" for path, text in texts() for line, what in broken(text)]
    print("\n".join(lines) or "every sentence keeps the rules")
    return bool(lines)


if __name__ == "__main__":
    sys.exit(main())
