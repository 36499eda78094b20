"""The report: what a figure keeps of its data, and that the page is whole, safe and offline."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays

from workbench.base.gain_phase import gain_db, phase_deg
from workbench.report import Curve, Figure, FrequencyCurve, Mark, Page, Panel, Section, Table, bode, page_looks, render
from workbench.report.page import write_page
from workbench.report.palette import PALETTE, looks
from workbench.report.still import still_picture
from workbench.report.table import shown, table_html
from workbench.report.thin import DRAWN_POINTS, drawn_points, outline_points

F = np.geomspace(1, 500, 200)
VALVE = 1 / (1 + 2 * 0.7 * (1j * F / 70) + (1j * F / 70) ** 2)


def line(name: str, n: int = 3, **options) -> Curve:
    return Curve(name, np.arange(n) * 1.0, np.arange(n) * 2.0, **options)


def figure(*curves: Curve, title: str = "A figure", **options) -> Figure:
    return Figure(title, "time [s]", [Panel("position [mm]", curves)], **options)


def page(*items: Figure | Table | str, sections: int = 1, **words: str) -> Page:
    text = {"title": "A report", "verdict": "It holds."} | words
    return Page(text["title"], text["verdict"], [Section(f"Part {i}", items) for i in range(sections)], {"seed": "7"})


def charts(html: str) -> list[dict]:
    def refuse(word: str) -> None:
        raise AssertionError(f"{word} is no JSON")

    found = re.findall(r'<script type="application/json">(.*?)</script>', html, re.S)
    return [json.loads(text, parse_constant=refuse) for text in found]


def own_html(html: str) -> str:
    """The page without the plot library."""
    return re.sub(r"<script>/\*\*\n\* plotly\.js.*?</script>", "", html, flags=re.S)


# --- thinning


@given(arrays(float, st.integers(1, 400), elements=st.floats(-1e6, 1e6)), st.integers(4, 100))
def test_thinning_keeps_ends_and_extremes_and_is_short(y, points):
    keep = drawn_points(y, points)
    assert (np.diff(keep) > 0).all()
    assert {0, len(y) - 1} <= set(keep.tolist())
    assert y[keep].min() == y.min()
    assert y[keep].max() == y.max()
    assert len(keep) <= max(points, 1.5 * points + 2)


def test_an_outline_keeps_corners_and_gaps_and_passes_every_sample():
    t = np.linspace(0, 2 * np.pi, 2001)
    x, y = np.append(10 * np.cos(t), [np.nan, 0, 1, 2, 2]), np.append(np.sin(t), [0, 0, 0, 0, 5])
    keep = outline_points(x, y, 0.1, 0.01)
    assert len(keep) < 60
    assert keep[-4:].tolist() == [2001, 2002, 2004, 2005]
    bulges = 1 - np.cos(np.diff(t[keep[keep < 2001]]) / 2)  # of the circle over each chord, in radii
    assert bulges.max() <= 0.01


def test_thinning_keeps_every_extreme_of_its_bucket_and_a_gap():
    y = np.sin(np.arange(50000) / 700)
    y[12345] = 9
    y[30000:30800] = np.nan
    keep = drawn_points(y)
    assert 12345 in keep
    assert np.isnan(y[keep]).any()
    assert len(keep) <= 1.5 * DRAWN_POINTS + 2
    assert not np.isin(np.arange(30001, 30020), keep).all()


def test_a_series_of_gaps_alone_can_be_thinned():
    assert len(drawn_points(np.full(9000, np.nan))) > 0


# --- Bode


def test_bode_has_gain_over_phase_with_the_bandwidth_lines():
    made = bode("Valve", [FrequencyCurve("valve", F, VALVE)])
    gain, phase = made.panels
    at_70 = np.argmin(abs(F - 70))
    assert made.log_x
    assert gain.curves[0].y[at_70] == pytest.approx(-20 * np.log10(1.4), abs=0.3)
    assert phase.curves[0].y[at_70] == pytest.approx(-90, abs=1.5)
    assert [panel.marks[0].value for panel in made.panels] == [-3, -90]


def test_phase_is_unwrapped_and_gaps_stay_gaps():
    delayed = VALVE * np.exp(-2j * np.pi * F * 5e-3)
    delayed[40:44] = np.nan
    phase = phase_deg(delayed)
    assert np.isnan(phase[40:44]).all()
    assert phase[-1] == pytest.approx(-360 * 500 * 5e-3 + np.degrees(np.angle(VALVE[-1])))
    assert np.isnan(gain_db(np.array([0j, np.nan, np.inf]))).all()


@pytest.mark.parametrize("rounding", [1e-12j, -1e-12j])
def test_a_double_integrator_starts_at_minus_180(rounding):
    assert phase_deg(-1 / F**2 + rounding / F**2)[0] == pytest.approx(-180, abs=1e-6)


# --- what is written for the plot library


def test_numbers_that_are_not_finite_become_null_and_marks_without_value_vanish():
    y = np.array([1.0, np.nan, np.inf, -np.inf, 1 / 3])
    bad = Curve("a", np.array([0, 1, 2, np.nan, 4]), y, band=(y - 1, y + 1))
    made = Figure("t", "x", [Panel("y", [bad], marks=[Mark(float("nan")), Mark(2.0, "two", "x")])])
    (drawn,) = charts(render(page(made)))
    band, curve = drawn["data"]
    assert curve["y"] == [1, None, None, None, 0.333333]
    assert curve["x"] == [0, 1, 2, None, 4]
    assert band["x"] == [0, 0, None, 4, 4, None]
    assert [shape["x0"] for shape in drawn["layout"]["shapes"]] == [2]


def test_panels_share_one_x_axis_and_do_not_overlap():
    made = Figure("t", "time [s]", [Panel(f"y{i} [bar]", [line("a")]) for i in range(3)])
    (drawn,) = charts(render(page(made)))
    layout = drawn["layout"]
    domains = [layout[axis]["domain"] for axis in ("yaxis", "yaxis2", "yaxis3")]
    assert [trace["yaxis"] for trace in drawn["data"]] == ["y", "y2", "y3"]
    assert all("xaxis" not in trace for trace in drawn["data"])
    assert layout["xaxis"]["anchor"] == "y3"
    assert domains[0][0] > domains[1][1] > domains[1][0] > domains[2][1] > domains[2][0] >= 0


def test_a_range_on_a_log_axis_is_given_in_decades():
    made = Figure("t", "x", [Panel("y", [line("a")], log_y=True, y_range=(1e-3, 10))])
    assert charts(render(page(made)))[0]["layout"]["yaxis"]["range"] == [-3, 1]


def test_long_series_make_a_small_page_that_says_so():
    t = np.arange(20000) * 1e-3
    rng = np.random.default_rng(0)
    curves = [Curve(f"c{i}", t, rng.standard_normal(20000)) for i in range(10)]
    html = render(page(figure(*curves)))
    assert len(html) - len(render(page(figure(line("a"))))) < 600_000
    assert f"thinned to {DRAWN_POINTS} points" in html
    assert "thinned" not in own_html(render(page(figure(line("a")))))


def test_arrays_of_different_length_are_refused():
    with pytest.raises(ValueError, match='curve "a"'):
        Curve("a", np.zeros(3), np.zeros(4))
    with pytest.raises(ValueError, match='curve "a"'):
        Curve("a", np.zeros(3), np.zeros(3), band=(np.zeros(3), np.zeros(2)))


# --- colours


def test_a_name_has_one_colour_in_every_figure_of_a_page():
    made = page(figure(line("p"), line("mpc")), figure(line("mpc"), line("lqg"), line("p")))
    look = page_looks(made)
    for drawn in charts(render(made)):
        for trace in drawn["data"]:
            assert trace["line"]["color"] == look[trace["name"]].colour
    assert len({look[name].colour for name in ("p", "mpc", "lqg")}) == 3


def test_curves_beside_each_other_look_different_beyond_the_palette():
    first = figure(*(line(f"a{i}") for i in range(4)))
    many = figure(*(line(f"b{i}") for i in range(len(PALETTE) + 3)))
    look = looks([first, many])
    assert len({look[f"b{i}"] for i in range(len(PALETTE) + 3)}) == len(PALETTE) + 3
    assert {look[f"b{i}"].line for i in range(len(PALETTE))} == {"line"}


def test_a_stated_colour_holds_and_is_not_given_again():
    look = looks([figure(line("a"), line("b", color=PALETTE[0]))])
    assert look["b"].colour == PALETTE[0]
    assert look["a"].colour != PALETTE[0]


# --- tables


CELLS = {
    "–": None,
    "∞": float("inf"),
    "yes": True,
    "12": 12,
    "119.1": 119.1234,
    "0": 0.0,
    "0.061": 0.061,
    "12346": 12345.6,
    "-1.235e-7": -1.23456e-7,
    "10": 9.99999,
    "p-dp": "p-dp",
}


@pytest.mark.parametrize(("text", "cell"), CELLS.items())
def test_cells_are_short(text, cell):
    assert shown(cell) == text


@given(st.floats(-1e300, 1e300))
def test_a_shown_number_is_the_number_to_four_digits(value):
    assert float(shown(value)) == pytest.approx(value, rel=5.1e-4, abs=0)


def test_the_best_of_a_column_is_marked_and_what_is_missing_is_not():
    html = table_html(Table("T", ["name", "settling"], [["a", None], ["b", 0.2], ["c", 0.1]], best={"settling": "min"}))
    assert re.findall(r'class="num best"[^>]*>([^<]+)<', html) == ["0.1"]
    assert 'class="num best"' not in table_html(Table("T", ["a"], [[None]], best={"a": "max"}))


def test_a_table_that_does_not_fit_is_refused():
    with pytest.raises(ValueError, match="row 2"):
        Table("T", ["a", "b"], [[1, 2], [1]])
    with pytest.raises(ValueError, match="no column: c"):
        Table("T", ["a"], [], best={"c": "min"})


# --- the page


def test_text_with_markup_is_shown_as_text():
    bad = "</script><script>alert(1)</script><img src=x>"
    made = Page(
        bad,
        bad,
        [Section(bad, [figure(line(bad), title=bad, note=bad), bad, Table(bad, [bad], [[bad]], bad)])],
        {bad: bad},
    )
    html = own_html(render(made))
    assert "<img" not in html
    assert html.count("<script>") == 1  # page.js, after the library
    assert "alert(1)</script>" not in html
    assert charts(render(made))[0]["data"][0]["name"].startswith("&lt;/script&gt;")


def test_nothing_leaves_the_page():
    html = render(page(figure(line("a")), Table("T", ["a"], [[1]])))
    assert "default-src 'none'" in html
    assert "showSendToCloud: false" in html
    assert not re.findall(r'(?:src|href)="(?!#)', own_html(html))
    assert not re.findall(r"https?://", own_html(html))


def test_a_page_unfolds_the_words_of_the_house_that_it_shows():
    html = render(page("Two laws trip. chi2 is 1.2 after 5 ms.", figure(line("held-out records"))))
    shown = re.findall(r"<dt>([^<]*)</dt>", html.partition('<details class="words">')[2].partition("</details>")[0])
    assert shown == ["record", "held-out record", "chi2", "law", "trip"]
    assert '<details class="words">' not in render(page("x"))


def test_contents_are_listed_when_there_are_more_than_three_sections():
    assert "<nav" not in render(page("x", sections=3))
    assert render(page("x", sections=4)).count('<li><a href="#s') == 4


def test_a_page_without_plots_does_not_carry_the_library():
    assert len(render(page(Table("T", ["a"], [[1]])))) < 20_000


def test_the_same_page_is_the_same_file(tmp_path: Path):
    made = page(bode("Valve", [FrequencyCurve("ω", F, VALVE)]), verdict="±1 µm")
    write_page(made, tmp_path / "a.html")
    write_page(made, tmp_path / "b.html")
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()
    assert "±1 µm" in (tmp_path / "a.html").read_text(encoding="utf-8")


# --- still pictures


@pytest.mark.parametrize("suffix", [".png", ".svg"])
def test_a_still_picture_is_drawn_and_reproducible(tmp_path: Path, suffix: str):
    gap = np.array([0.0, np.nan, 2.0])
    made = [
        bode("Valve", [FrequencyCurve("valve", F, VALVE), FrequencyCurve("points", F, VALVE, "markers")], "note"),
        figure(Curve("a", np.arange(3.0), gap, band=(gap - 1, gap + 1)), line("hidden", visible=False)),
        Figure("log", "x", [Panel("y", [line("a", 9)], log_y=True, marks=[Mark(1, "one", "x")])], log_x=True),
    ]
    for index, one in enumerate(made):
        paths = [tmp_path / f"{index}{copy}{suffix}" for copy in "ab"]
        for path in paths:
            still_picture(one, path)
        assert paths[0].read_bytes() == paths[1].read_bytes()


def test_a_still_picture_has_the_colours_of_the_page(tmp_path: Path):
    first, second = figure(line("p")), figure(line("mpc"))
    look = page_looks(page(first, second))
    still_picture(second, tmp_path / "x.svg", look)
    text = (tmp_path / "x.svg").read_text()
    assert look["mpc"].colour in text
    assert look["p"].colour not in text


def test_a_still_picture_of_another_kind_is_refused(tmp_path: Path):
    with pytest.raises(ValueError, match=r"\.png or an \.svg"):
        still_picture(figure(line("a")), tmp_path / "x.pdf")
