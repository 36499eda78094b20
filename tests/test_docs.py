"""The documentation's own tools: broken links are found, docstrings keep their words, pages have every name."""

import re
import sys
import time
from pathlib import Path

import pytest
from links import broken

from experiments.studies import FOLDER, kept

ROOT = Path(__file__).parents[1]


@pytest.fixture
def generate(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    import generate

    return generate


def test_broken_links_are_found(tmp_path):
    (tmp_path / "a.html").write_text(
        '<p id="here"><a href="b.html#there">b</a><a href="#nowhere">x</a><a href="c.html">c</a>'
        '<a href="https://example.org">far</a><script src="https://example.org/x.js"></script>'
    )
    (tmp_path / "b.html").write_text('<h1 id="there">b</h1><img src="none.png"><a href="a.html#here">a</a>')
    assert [line.partition(": ")[2] for line in broken(tmp_path)] == [
        "#nowhere: no such place on that page",
        "c.html: no such file",
        "https://example.org/x.js: is loaded from a network",
        "none.png: no such file",
    ]


def test_the_pages_have_every_number_effect_controller_and_command(generate):
    from generate import commands, controllers, effects, rig_keys

    from workbench.commands import COMMANDS
    from workbench.commands.list.catalogue import listing
    from workbench.rigs.rig_file import load_rig

    numbers = rig_keys.pages()["numbers.md"]
    for rig in ("jack-10t", "festo-tp511"):
        assert all(f"| `{name}` |" in numbers for name in load_rig(rig).numbers)
    page = effects.pages()["effects.md"]
    assert all(f"### {row['name']}: {row['formula']}" in page for row in listing("effects"))
    page = controllers.pages()["controllers.md"]
    assert all(f'`use = "{row["use"]}"`' in page for row in listing("controllers"))
    page = commands.pages()["commands.md"]
    assert all(f"## jackbench {name}\n" in page for name in COMMANDS)
    assert "| `--heldout NAME` |" in page


def test_the_page_of_the_architecture_is_true(generate):
    from generate import architecture

    from workbench.commands.list.catalogue import listing
    from workbench.control.load_class import load_class

    assert all("<svg" in picture for picture in architecture.pictures().values())  # each step is still in the code
    ranks = {room: rank for rank, rooms in enumerate(architecture.ranks()) for room in rooms}
    assert ranks.keys() == {path.parent.name for path in (ROOT / "workbench").glob("*/__init__.py")} | {"cli"}
    assert all(ranks[above] < ranks[below] for above, below in architecture.imports() if above in ranks)
    laws = {row["name"]: load_class(row["use"], "") for row in listing("controllers") if row["kind"] == "controller"}
    in_python = {name for name, law in laws.items() if not hasattr(law, "graph_law")}
    for page in ("architecture.md", "engine.md", "how/code.md"):
        text = (ROOT / "docs" / page).read_text("utf-8")
        assert in_python == {name for name in laws if f"`{name}`" in text}


def test_the_files_have_every_key_that_their_readers_know(generate):
    from generate import files

    pages = files.pages()
    assert "| `scenario.NAME.load_at` | number in `s`, 0 or more |" in pages["experiment_files.md"]
    assert "| `drifts.NAME.per` | one of `record`, `repeat` |" in pages["campaign_file.md"]
    assert "`limits.following_error`" in pages["linear_plants.md"]
    assert "`reward.trip.weight`" in pages["tasks.md"]


def test_a_key_that_no_file_has_is_missed(generate, tmp_path, monkeypatch):
    from generate import files

    text = (files.FOLDER / "corrector.toml").read_text()
    (tmp_path / "corrector.toml").write_text(text.replace("# dB, least and most", ""))
    monkeypatch.setattr(files, "FOLDER", tmp_path)
    with pytest.raises(RuntimeError, match=r"what is maker\.peak_db"):
        files._part(("run", files.CorrectorConfig, ("corrector.toml",)))


def test_the_readme_is_read_in_a_minute_and_its_links_lead_somewhere():
    text = (ROOT / "README.md").read_text()
    assert len(text.splitlines()) <= 130
    links = re.findall(r"\]\(([^)\s]+)\)", text)
    assert links
    assert not [link for link in links if not (ROOT / link).exists()]


def test_what_a_block_of_a_page_prints_and_draws_stands_below_it(generate, tmp_path, capfd):
    from generate.cells import page_runs, shown
    from generate.runs import run_all

    page = tmp_path / "page.md"
    page.write_text(
        "# A\n\n```{file} n.txt\n3\n```\n\n```{python}\nn = int(open('n.txt').read())\nn + 1\n```\n\n"
        "```{shell}\necho $((1 + 2)) > a.png\necho done\n```\n\nAnd so on.\n"
    )
    (tmp_path / "other.md").write_text("![as drawn](/_build/ran/page/made/a.png)")
    words = shown(tmp_path, "page", page.read_text())
    assert "`n.txt`:\n\n```text\n3\n```" in words
    assert ":class: printed" not in words
    assert shown(tmp_path, "other", (tmp_path / "other.md").read_text()) == "(as drawn)"
    run_all(page_runs(tmp_path))
    lines = capfd.readouterr().out.splitlines()
    assert [line.partition(" s  ")[2] for line in lines] == [
        "page, cell 2: n = int(open('n.txt').read())",
        "page, cell 3: echo $((1 + 2)) > a.png",
    ]
    assert all(0 <= float(line.partition(" s  ")[0]) < 60 for line in lines)
    source = shown(tmp_path, "page", page.read_text())
    assert "`n.txt`:\n\n```text\n3\n```" in source
    assert ":class: printed\n\n4\n```" in source
    assert ":class: printed\n\ndone\n```" in source
    assert "```{image} /_build/ran/page/made/a.png" in source
    assert source.endswith("And so on.\n")
    assert shown(tmp_path, "other", (tmp_path / "other.md").read_text()).startswith("![as drawn](/_build")
    run_all(page_runs(tmp_path))
    assert not capfd.readouterr().out  # kept
    assert ":class: printed" not in shown(tmp_path, "page", page.read_text().replace("n + 1", "n + 2"))


@pytest.mark.parametrize(
    ("kind", "text", "says"),
    [
        ("shell", "echo bad >&2\nfalse", "echo bad.*\n.*bad"),
        ("python", "1 / 0", "ZeroDivisionError"),
        ("python", "raise SystemExit", "SystemExit"),
        ("python", "while True: pass", "takes more than 1 s of CPU time"),
        ("shell", "python -c 'while True: pass'; echo", "takes more than 1 s of CPU time"),
    ],
)
def test_the_first_block_that_fails_or_computes_too_long_ends_the_build_by_name(
    kind, text, says, generate, tmp_path, monkeypatch
):
    from generate import runs
    from generate.cells import page_runs, shown

    monkeypatch.setattr(runs, "LONGEST", 1)
    bad = f"```{{python}}\nprint('first')\n```\n\n```{{{kind}}}\n{text}\n```\n"
    (tmp_path / "a.md").write_text("```{shell}\nsleep 100\n```\n")
    (tmp_path / "b.md").write_text(bad)
    (tmp_path / "c.md").write_text("```{shell}\ntouch ran\n```\n")
    began = time.monotonic()
    with pytest.raises(RuntimeError, match=rf"(?s)^b, cell 2: .*{says}"):
        runs.run_all(page_runs(tmp_path))
    assert time.monotonic() - began < 60  # it waits neither for what runs beside it
    assert not (tmp_path / "_build" / "ran" / "c").exists()  # nor for what would come
    assert ":class: printed" not in shown(tmp_path, "b", bad)


def test_an_example_and_a_report_that_left_nothing_are_words_alone(generate, tmp_path):
    from generate import examples, gallery

    pages = examples.pages(tmp_path, tmp_path / "examples", run=False)
    assert "examples/loop.py" in pages["tutorial_loop.md"]
    assert "What it prints" not in pages["tutorial_loop.md"]
    cards = gallery.parts(tmp_path / "gallery", run=False)["part_gallery.md"]
    assert "jackbench trace sample" in cards
    assert "<img" not in cards
    assert "href" not in cards


def test_a_section_of_a_docstring_is_a_list_of_definitions(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    from docstrings import restructured

    text = (
        "What it does.\n\nParameters\n----------\nf : float | None, default None\n    At `f` [Hz].\n**more\n    Others."
    )
    assert restructured(text) == (
        "What it does.\n\n.. rubric:: Parameters\n\n``f`` : float \\| None, default None\n    At ``f`` [Hz].\n"
        "``**more``\n    Others.\n"
    )


def test_docstrings_keep_their_words(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    from docstrings import restructured

    text = "x_ and `a_b` times |v| * 2.\n\nname     what it is\nother    what that is"
    expected = "x\\_ and ``a_b`` times \\|v\\| \\* 2.\n\n.. code-block:: text\n\n    name     what it is\n"
    assert restructured(text) == expected + "    other    what that is\n"


def test_a_table_keeps_bars_and_stars(generate):
    from generate.markdown import code, plain, table

    assert table(("a", "b"), [[code("x|y"), plain("2 * |v|, see `a_b`")]]) == (
        "| a | b |\n| --- | --- |\n| `x\\|y` | 2 \\* \\|v\\|, see `a_b` |\n"
    )
    assert "generate.markdown" in sys.modules


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*/*.json")), ids=lambda path: path.stem)
def test_a_page_names_every_table_that_a_study_left(path, generate):
    from generate.tables import dated

    table = kept(f"{path.parent.name}/{path.stem}")
    pages = {page: page.read_text() for page in (ROOT / "docs" / "results").glob("*.md")}
    (page, *_) = [
        page for page, text in pages.items() if f"`experiments/studies/{path.parent.name}/{path.name}`" in text
    ]
    assert table.command in " ".join(pages[page].split())
    assert f"by jackbench {table.version}, {table.date}" in dated(pages[page], table.version)


def test_a_table_of_a_version_before_the_last_is_refused(generate):
    from generate.tables import dated

    page, made = "in `experiments/studies/trace/campaigns.json`, and", kept("trace/campaigns")
    assert made.version == "0.1.0"
    assert (
        dated(page, "0.2.0") == f"in `experiments/studies/trace/campaigns.json` (by jackbench 0.1.0, {made.date}), and"
    )
    with pytest.raises(ValueError, match=r"too old for 0.3.0: run python -m experiments.studies.trace"):
        dated(page, "0.3.0")
