"""The book: sentences keep the house's rules, and notebooks are the chapters."""

import re
from pathlib import Path

import prose
import pytest
from notebooks import CHAPTERS, FOLDER, ROOT, notebook

from workbench.commands import COMMANDS

READ_TWICE = [
    "What a found rig buys a controller says `jackbench retune`.",
    "It takes back what makes the error larger.",
    "Correctors fitted to a maker's corners, those that hunt at null refused.",
    "Equal chances.",
    "Only differences beyond the band count.",
    "Here what limits the loop is what drives it.",
    "Choose another sheet: traced are sheets of flow.",
    "A spread is of position laws.",
    "Records of another day are\nof another state of the rig.",
    "What does it buy a controller that its rig is known?",
    "Leave it away.",
    "That margin cannot be had.",
    "The behavior of the valve.",
    "The plant is linearized.",
]


@pytest.mark.parametrize("sentence", READ_TWICE)
def test_a_sentence_that_has_to_be_read_twice_is_found(sentence):
    assert {line for line, _ in prose.broken(f"A line.\n\n{sentence}\n")} == {3}


@pytest.mark.parametrize(
    "sentence", ["It is of course so.", "Its size is resized.", "The loop is stable.", "Leave it out."]
)
def test_a_plain_sentence_is_left_alone(sentence):
    assert not list(prose.broken(sentence))


def test_code_is_no_sentence():
    assert not list(prose.broken(f"```text\n{READ_TWICE[0]}\n```\n\n    {READ_TWICE[4]}\n"))


def test_messages_and_help_are_read_and_docstrings_are_not():
    code = '''
def f(parser, x):
    """A docstring is of no interest."""
    parser.add_argument("--band", help="of the drive file")
    raise InputError(f"{x}: is of a drive file")
'''
    read = sorted(prose.said(Path("f.py"), code), key=lambda text: text.line)
    assert [(text.line, text.words, text.is_help) for text in read] == [
        (4, "of the drive file", True),
        (5, "X: is of a drive file", False),
    ]
    assert list(prose.broken(read[0].words, prose.HELP))
    assert list(prose.broken(read[1].words))


def test_every_page_message_and_help_text_keeps_the_rules():
    assert not list(prose.complaints())


def test_a_page_of_the_site_has_900_words_at_most():
    pages = {text.path: prose.CODE.sub(" ", text.words) for text in prose.texts() if text.path.parent != prose.ROOT}
    long = {path.name: len(re.findall(r"[^\s|]{2,}", words)) for path, words in pages.items() if path.suffix == ".md"}
    assert not {name: count for name, count in long.items() if count > 900}


def test_a_page_that_answers_how_has_a_picture():
    pictured = re.compile(r"--picture|!\[|\.plot\(|wb\.Figure\(|\.figure\(")
    without = {
        "index.md": "a list",
        "cite.md": "two lines",
        "cluster.md": "no cluster is there when the site is built",
        "simulators.md": "takes a C compiler and another simulator",
        "platform_trace.md": "a trace of six legs takes minutes",
        "watch.md": "a year of sessions takes minutes",
    }
    pages = (prose.ROOT / "docs" / "how").glob("*.md")
    assert {page.name for page in pages if not pictured.search(page.read_text("utf-8"))} <= set(without)


def test_a_command_is_listed_by_a_verb():
    other = {"a", "an", "the", "from", "how", "of", "to", "what", "whether", "which", "why"}
    assert not [what for what in COMMANDS.values() if what.split()[0] in other]


@pytest.mark.parametrize("name", CHAPTERS)
def test_a_notebook_is_its_chapter(name):
    """`python .ci/notebooks.py` writes them anew."""
    page = (ROOT / "docs" / "first_hour" / f"{name}.md").read_text("utf-8")
    assert (FOLDER / f"{name}.ipynb").read_text("utf-8") == notebook(page)
