"""The book: sentences keep the house's rules, and notebooks are the chapters."""

import prose
import pytest
from notebooks import CHAPTERS, FOLDER, ROOT, notebook

READ_TWICE = [
    "What a found rig buys a controller says `jackbench retune`.",
    "It takes back what makes the error larger.",
    "Correctors fitted to a maker's corners, those that hunt at null refused.",
    "Equal chances.",
    "Only differences beyond the band count.",
    "Here what limits the loop is what drives it.",
]


@pytest.mark.parametrize("sentence", READ_TWICE)
def test_a_sentence_that_has_to_be_read_twice_is_found(sentence):
    assert [line for line, _ in prose.broken(f"A line.\n\n{sentence}\n")] == [3]


def test_code_is_no_sentence():
    assert not list(prose.broken(f"```text\n{READ_TWICE[0]}\n```\n\n    {READ_TWICE[4]}\n"))


def test_every_page_and_help_text_keeps_the_rules():
    assert not [(path.name, what) for path, text in prose.texts() for what in prose.broken(text)]


@pytest.mark.parametrize("name", CHAPTERS)
def test_a_notebook_is_its_chapter(name):
    """`python .ci/notebooks.py` writes them anew."""
    page = (ROOT / "docs" / "first_hour" / f"{name}.md").read_text("utf-8")
    assert (FOLDER / f"{name}.ipynb").read_text("utf-8") == notebook(page)
