"""The words of the house as a part that a page includes: reports have them from the same place."""

from workbench.report.glossary import WORDS

from .markdown import table


def parts() -> dict[str, str]:
    """A table of every word with its meaning."""
    return {"part_words.md": table(["word", "meaning"], WORDS.items())}
