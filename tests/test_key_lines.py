"""Which line a key of a TOML document stands on, over generated documents and the awkward cases."""

import tomllib

import pytest
import tomli_w
from hypothesis import given, strategies as st

from workbench.base.key_lines import key_lines

WORD = st.text(st.sampled_from("abz09-_ .=#[]{}\"'\\\té"), min_size=1, max_size=6)
SCALAR = st.one_of(
    st.integers(-9, 9), st.booleans(), st.floats(allow_nan=False, allow_infinity=False), WORD, st.just("\"\"\"\n'''#[")
)
VALUE = st.recursive(
    SCALAR, lambda part: st.one_of(st.lists(part, max_size=3), st.dictionaries(WORD, part, max_size=3)), max_leaves=12
)
DOCUMENT = st.dictionaries(WORD, VALUE, max_size=5)


def paths(value, path=()):
    """Every key and list entry inside a value."""
    entries = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, part in entries:
        yield (*path, key)
        yield from paths(part, (*path, key))


@given(DOCUMENT, st.booleans())
def test_every_key_of_a_document_has_a_line(table, multiline):
    text = tomli_w.dumps(table, multiline_strings=multiline)
    rows, lines = text.split("\n"), key_lines(text)
    assert set(lines) == set(paths(tomllib.loads(text)))
    for path, line in lines.items():
        if isinstance(path[-1], str):
            escaped = tomli_w.dumps({path[-1]: 0}).removesuffix(" = 0\n")
            assert escaped in rows[line - 1]


@given(DOCUMENT, DOCUMENT)
def test_a_document_below_another_moves_down_by_its_lines(first, second):
    above = tomli_w.dumps({"above": first})
    below = tomli_w.dumps({"below": second})
    moved = above.count("\n")
    lines, alone = key_lines(above + below), key_lines(below)
    assert {path: line - moved for path, line in lines.items() if path[0] == "below"} == alone


@pytest.mark.parametrize(
    ("text", "path", "line"),
    [
        ("a = 1\nb.c = 2\n", ("b", "c"), 2),
        ("a = 1\nb.c = 2\n", ("b",), 2),
        ('[x]\n# a = 1\n"a" = 2', ("x", "a"), 3),
        ("[a.b]\r\nc = 1\r\nd = 2\r\n", ("a", "b", "d"), 3),
        ("a = [\n  1, # ]\n  2\n]\nb = 3", ("a", 1), 3),
        ("a = [\n  1, # ]\n  2\n]\nb = 3", ("b",), 5),
        ("[[e]]\nn = 1\n[[e]]\nn = 2\n[e.sub]\nk = 3\n", ("e", 1, "sub", "k"), 6),
        ("[[e]]\n[[e.f]]\n[[e.f]]\nk = 1\n[[e]]\n[[e.f]]\nk = 2", ("e", 1, "f", 0, "k"), 7),
        ("x = {a = 1, b = {c = [{d = 1}]}}\ny = 1", ("x", "b", "c", 0, "d"), 1),
        ('s = """\na = 1\n"quoted" \\"""\nb = 2\n"""\nb = 3', ("b",), 6),
        ("s = '''\nb = 2\n'''''\nb = 3", ("b",), 4),
        ('s = """x"""""\nb = 3', ("b",), 2),
        ("t = 2026-01-01 10:00:00\nb = 3", ("b",), 2),
        ("['a.b' . \"c\\u0021\"]\nd = 1", ("a.b", "c!", "d"), 2),
    ],
)
def test_awkward_documents(text, path, line):
    tomllib.loads(text)
    assert key_lines(text)[path] == line


@pytest.mark.parametrize("text", ["= 1", "[a", "a", "a = " + "[" * 10000, 'a = "'])
def test_a_text_that_cannot_be_followed_ends_the_search(text):
    assert isinstance(key_lines(text), dict)
