"""A maker's curve as data: sheets read with gaps, and traced to the effect with which they were made."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.trace.sheet_page import model_curve, sheet_page, sheet_sentence
from workbench.commands.trace.sheets import sheet_json
from workbench.identify.sheet.element import ELEMENTS, Element
from workbench.identify.sheet.fit import Errors, SheetFit, fitted_sheets
from workbench.identify.sheet.model import SheetModel, bench_of, offsets
from workbench.identify.sheet.problem import sheet_problem
from workbench.identify.sheet.remainder import Band, bands, behind_elements, fitted_behind, with_element
from workbench.identify.sheet.tracer import SheetCandidate, trace_sheets
from workbench.plant.effects import LIBRARY, Effect, find
from workbench.records.sheet_points import SheetPoints, read_points
from workbench.report import render
from workbench.rigs.rig_file import load_rig

F = np.geomspace(10.0, 150.0, 12)
RIVALS = (find("drive.lag", "amplifier"), find("drive.delay", "shift"), find("main.deadband", "linear"))


pytestmark = pytest.mark.usefixtures("right_columns")


@cache
def rig():
    return load_rig("jack-10t-rounded")


def made(
    effects: tuple[Effect, ...],
    numbers: dict[str, float],
    amplitude: float,
    output: str = "flow",
    f: np.ndarray = F,
) -> SheetPoints:
    """A sheet of a rig with an effect, by default of its valve's flow, known to 0.1 dB and 1 degree."""
    random, nothing = np.random.default_rng(int(100 * amplitude)), np.zeros(f.size)
    blank = SheetPoints(f"{amplitude:g}", "command", output, amplitude, f, nothing, nothing, True)
    model = SheetModel(bench_of(rig(), "command", output), effects, output)
    deviation = model.deviations([blank], model.plant.parameter_values(None, **numbers)[None])[0][0]
    noisy = deviation + random.normal(0, (0.1, 1.0), deviation.shape)
    return SheetPoints(blank.name, "command", output, amplitude, f, noisy[:, 0], noisy[:, 1], True)


def test_a_lag_is_named_with_its_number():
    sheet = made(RIVALS[:1], {"drive.lag.tau": 1e-3}, 1.0)
    trace = trace_sheets(sheet_problem(rig(), "made", [sheet]), RIVALS, lambda _: None)
    assert trace.verdict == "named"
    assert [each.effect.name for each in trace.effects] == ["drive.lag"]
    fit = trace.final.fit
    low, high = fit.interval([free.name for free in fit.free].index("drive.lag.tau"))
    assert low < 1e-3 < high
    assert trace.judged[1].chi2 < 1 < trace.judged[0].chi2


def test_the_maker_s_corners_and_resonance_are_those_of_a_corrector():
    path = Path(__file__).parents[1] / "experiments" / "maker_main_stage.csv"
    correctors = [effect for effect in LIBRARY if effect.name == "drive.corrector"]
    problem = sheet_problem(rig(), "maker", [read_points(path, 1.0, "command", "flow")])
    trace = trace_sheets(problem, correctors, lambda _: None)
    assert [each.effect.title for each in trace.effects] == ["drive.corrector pi-lead"]
    assert trace.judged[1].chi2 < 0.1 < 10 < trace.judged[0].chi2


def test_sheets_at_three_amplitudes_show_a_dead_band():
    sheets = [made((RIVALS[2],), {"main.deadband.overlap": 0.03}, amplitude) for amplitude in (1.0, 0.25, 0.1)]
    trace = trace_sheets(sheet_problem(rig(), "made", sheets), RIVALS, lambda _: None)
    assert [each.effect.name for each in trace.effects] == ["main.deadband"]


def test_a_mount_that_gives_shows_in_the_position_far_from_where_a_fit_begins():
    mount = find("load.compliance", "mount")
    f = np.geomspace(5.0, 60.0, 12)
    true = {"load.compliance.c": 2e-8, "load.compliance.f": 100.0}  # the mode of the oil falls from 27 to 22 Hz
    trace = trace_sheets(
        sheet_problem(rig(), "made", [made((mount,), true, 0.1, "position", f)]), [mount], lambda _: None
    )
    assert trace.verdict == "named"
    fit = trace.final.fit
    low, high = fit.interval([free.name for free in fit.free].index("load.compliance.c"))
    assert low < true["load.compliance.c"] < high
    (named,) = trace.effects
    load = replace(named.effect, formula="load")
    for worse, said in ((0.001, "(load.compliance mount, or as well its load)"), (0.05, "(load.compliance mount)")):
        judgement = replace(named.judgement, formula="load", explained=named.judgement.explained - worse)
        both = replace(trace, tried=(*trace.tried, SheetCandidate(load, judgement, named.fit)))
        assert said in sheet_sentence(both, sheet_json(both))
        assert sheet_json(both)["alike"] == ["load.compliance load"] * ("as well" in said)


def responses(effect: Effect, numbers: dict[str, float], output: str, f: np.ndarray) -> np.ndarray:
    """Gain [k] in dB and phase in degrees of a rig with an effect."""
    nothing = np.zeros(f.size)
    blank = SheetPoints("", "command", output, 0.1, f, nothing, nothing, False)
    model = SheetModel(bench_of(rig(), "command", output), (effect,), output)
    given = {effect.key(name): value for name, value in numbers.items()}
    return model.deviations([blank], model.plant.parameter_values(None, **given)[None])[0][0]


@pytest.mark.parametrize(("output", "told"), [("position", False), ("load_pressure", False), ("acceleration", True)])
def test_a_mount_and_a_load_that_gives_are_one_from_the_valve_and_two_from_the_rod(output, told):
    c, f, zeta = 2e-8, 100.0, 0.03
    moved = c * (2 * np.pi * f) ** 2 * rig()["M"]  # what the mode adds to 1/M at high frequencies, over it
    alone = 1 / np.sqrt(1 + moved)
    as_load = {"mu": moved / (1 + moved), "f": f * alone, "zeta": zeta * alone}
    near = np.array([5.0, 25.0, 60.0])
    mount = responses(find("load.compliance", "mount"), {"c": c, "f": f, "zeta": zeta}, output, near)
    load = responses(find("load.compliance", "load"), as_load, output, near)
    apart = np.abs(load - mount)
    assert apart.max() > 3.0 if told else apart.max() < 1e-3


def test_a_sheet_of_corners_alone_is_drawn_with_the_whole_curve_of_the_model():
    nan = np.nan
    corners = SheetPoints(
        "corners", "command", "flow", 1.0, np.array([5.0, 70.0, 85.0]), np.array([0.0, -3.0, nan]),
        np.array([0.0, nan, -90.0]), True,
    )  # fmt: skip
    problem = sheet_problem(rig(), "corners", [corners])
    trace = trace_sheets(problem, (), lambda _: None)
    f, gain, phase = model_curve(trace.base, corners)
    assert (f[0], f[-1], f.size) == (5.0, 85.0, 61)
    assert np.all(np.diff(phase) < 0)
    at = np.searchsorted(f, corners.f)
    shown = np.column_stack((gain[at], phase[at])) - corners.values
    (deviation,) = _taken_off(trace.base, corners)
    np.testing.assert_allclose(shown, deviation, atol=1e-9)


def _taken_off(fit: SheetFit, sheet: SheetPoints) -> list[np.ndarray]:
    deviations = fit.model.deviations([sheet], fit.fit.p[None])
    return [deviations[0][0] - [offsets([sheet], deviations)[0, 0], 0.0]]


def test_a_valve_as_declared_lacks_nothing():
    trace = trace_sheets(sheet_problem(rig(), "made", [made((), {}, 1.0)]), RIVALS, lambda _: None)
    assert (trace.verdict, trace.effects, trace.tried) == ("none", (), ())


def test_every_third_frequency_or_a_named_sheet_judges():
    full, quarter = made((), {}, 1.0), made((), {}, 0.25)
    problem = sheet_problem(rig(), "made", [full, quarter])
    assert [sheet.f.size for sheet in (*problem.train, *problem.heldout)] == [8, 8, 4, 4]
    named = sheet_problem(rig(), "made", [full, quarter], heldout=["0.25"])
    assert [sheet.name for sheet in (*named.train, *named.heldout)] == ["1", "0.25"]
    with pytest.raises(InputError, match="leave one to be fitted"):
        sheet_problem(rig(), "made", [full], heldout=["1"])


def test_cells_may_be_empty(tmp_path):
    path = tmp_path / "corners.csv"
    path.write_text("frequency [Hz],gain [dB],phase [deg]\n5,0,\n70,-3,\n85,,-90\n")
    points = read_points(path, 1.0, "command", "flow")
    assert points.stated == 3
    assert points.relative
    np.testing.assert_allclose(points.phase, [np.nan, np.nan, -90])
    path.write_text("frequency [Hz],gain [dB]\n5,\n")
    with pytest.raises(InputError, match="no gain and no phase"):
        read_points(path, 1.0, "command", "flow")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ([], "needs --output"),
        (["--output", "flow", "--amplitude", "1"], "add --rig"),
        (["--output", "flow", "--rig", "jack-10t"], "at which amplitude"),
        (["--output", "flow", "--rig", "jack-10t", "--amplitude", "100 %", "25 %"], "2 for 1 sheets"),
        (["--output", "flow", "--rig", "jack-10t", "--several"], "--several is for campaigns"),
        (["--output", "flow", "--rig", "jack-10t", "--jobs", "2"], "--jobs is for campaigns"),
        (["--output", "flow", "--rig", "jack-10t", "--amplitude", "1", "--sigma", "0", "1"], "must be above 0"),
        (
            ["--output", "flow", "--rig", "jack-10t", "--amplitude", "1", "--input", "position"],
            "cannot be traced; take a sheet of",
        ),
    ],
)
def test_refused(tmp_path: Path, capsys, words, says):
    path = tmp_path / "sheet.csv"
    path.write_text("frequency [Hz],gain [dB],phase [deg]\n5,0,0\n70,-3,-80\n")
    assert main(["trace", str(path), *words, "--out", str(tmp_path / "out")]) == 2
    assert says in capsys.readouterr().err


def test_the_command_leaves_the_answer(tmp_path: Path):
    path = tmp_path / "sheet.csv"
    sheet = made((), {}, 1.0)
    rows = zip(sheet.f, sheet.gain, sheet.phase, strict=True)
    path.write_text("frequency [Hz],gain [dB],phase [deg]\n" + "".join(f"{f},{g},{p}\n" for f, g, p in rows))
    out = tmp_path / "out"
    words = ["--output", "flow", "--amplitude", "100 %", "--rig", "jack-10t-rounded"]
    assert main(["trace", str(path), *words, "--out", str(out)]) == 0
    answer = json.loads((out / "trace.json").read_text())
    assert (answer["verdict"], answer["effects"], answer["equation"]) == ("none", [], None)
    assert answer["rms"]["gain [dB]"]["floor"] == 0.2
    assert set(answer["rms"]) == {"gain [dB]", "phase [deg]"}
    assert load_rig(str(out / "rig.toml")).effects == ()


def behind(element: Element, numbers: tuple[float, ...], sheet: SheetPoints) -> SheetPoints:
    """A sheet of a rig with something linear behind it."""
    (change,) = element.deviations([sheet], np.array([numbers]))
    return replace(sheet, gain=sheet.gain + change[0, :, 0], phase=sheet.phase + change[0, :, 1])


PAIR = ELEMENTS[-1]
FREQUENCIES = np.array([0.1, 10.0, 40.0, 300.0])


@pytest.mark.parametrize(
    ("element", "numbers", "gain", "phase"),
    [
        (ELEMENTS[0], (0.004,), [0, 0, 0, 0], [-0.144, -14.4, -57.6, -432.0]),
        (ELEMENTS[1], (40.0,), [0.0, -0.2633, -3.0103, -17.578], [-0.143, -14.036, -45.0, -82.405]),
        (ELEMENTS[2], (40.0,), [0.0, 0.2633, 3.0103, 17.578], [0.143, 14.036, 45.0, 82.405]),
        (ELEMENTS[3], (300.0, 10.0), [0.0, 3.0055, 12.228, 26.5367], [0.554, 43.091, 68.369, 43.091]),
        (PAIR, (40.0, 0.25), [0.0, 0.4840, 6.0206, -34.8666], [-0.072, -7.595, -90.0, -176.117]),
    ],
)
def test_an_element_adds_what_textbooks_say(element, numbers, gain, phase):
    nothing = np.zeros(4)
    blank = SheetPoints("", "command", "flow", 1.0, FREQUENCIES, nothing, nothing, True)
    (added,) = element.deviations([blank], np.array([numbers]))
    np.testing.assert_allclose(added[0, :, 0], gain, atol=2e-3)
    np.testing.assert_allclose((added[0, :, 1] - phase + 180) % 360 - 180, 0, atol=2e-3)


def test_a_corrector_before_something_else_is_named_as_incomplete_and_the_rest_is_learned():
    corrector = find("drive.corrector", "first order")
    f = np.geomspace(10.0, 150.0, 12)
    sheet = behind(ELEMENTS[1], (200.0,), made((corrector,), {}, 1.0, f=f))
    trace = trace_sheets(sheet_problem(rig(), "made", [sheet]), (corrector, RIVALS[2]), lambda _: None)
    assert trace.verdict == "incomplete"
    assert [each.effect.name for each in trace.effects] == ["drive.corrector"]
    assert trace.judged[2].chi2 < 1 < 5 < trace.judged[1].chi2
    assert max(band.high for band in trace.left) > 60.0
    answer = sheet_json(trace)
    (learned,) = answer["learned"]
    _, low, high = learned["parameters"]["fp [Hz]"]
    assert learned["element"] == "pole"
    assert low < 200.0 < high
    assert "What is left shows from" in sheet_sentence(trace, answer)
    assert "behind the model takes away" in render(sheet_page(trace, answer)[0])


@pytest.mark.parametrize(("element", "number", "true"), [(ELEMENTS[0], "T [s]", 2e-3), (ELEMENTS[2], "fz [Hz]", 100.0)])
def test_a_sheet_that_is_late_or_early_for_no_known_cause_is_unknown_with_what_is_left(element, number, true):
    sheet = behind(element, (true,), made((), {}, 1.0))
    trace = trace_sheets(sheet_problem(rig(), "made", [sheet]), (), lambda _: None)
    assert (trace.verdict, trace.effects) == ("unknown", ())
    assert trace.final.model.element is element
    (learned,) = sheet_json(trace)["learned"]
    value, low, high = learned["parameters"][number]
    assert low < value < high
    assert value == pytest.approx(true, rel=0.1)
    assert trace.judged[2].chi2 < 1.5 < trace.judged[1].chi2


def test_where_an_error_is_plain():
    f, nothing = np.array([1.0, 2.0, 4.0, 8.0]), np.zeros(4)
    sheet = SheetPoints("s", "command", "flow", 1.0, f, nothing, nothing, True)
    deviation = np.array([[0.0, 0.0], [1.0, np.nan], [-2.0, 5.0], [0.1, -1.0]])
    assert bands([sheet], [deviation], (0.2, 2.0)) == [Band("s", 2.0, 4.0, 2.0, 5.0)]


def test_neighbours_of_both_roles_are_one_band():
    f = np.arange(1.0, 7.0)
    parts = [np.array([0, 1, 3, 4]), np.array([2, 5])]
    sheets = [SheetPoints("s", "command", "flow", 1.0, f[at], 0 * f[at], 0 * f[at], True) for at in parts]
    deviation = np.where(f < 2, 0.0, -f)[:, None] * [1.0, 10.0]
    assert bands(sheets, [deviation[at] for at in parts], (0.2, 2.0)) == [Band("s", 2.0, 6.0, 6.0, 60.0)]


def test_an_element_is_told_with_the_same_numbers_by_slopes_as_by_the_model(monkeypatch):
    pole = ELEMENTS[1]
    sheet = behind(pole, (60.0,), made((), {}, 1.0))
    problem = sheet_problem(rig(), "made", [sheet])
    model = problem.model()
    errors = Errors(problem, model, problem.uncertain(model), model.plant.p)
    base = fitted_sheets(problem, errors, np.zeros(len(errors.free)))
    runs: list[int] = []
    simulated = SheetModel.deviations
    monkeypatch.setattr(
        SheetModel, "deviations", lambda self, sheets, p: runs.append(len(p)) or simulated(self, sheets, p)
    )
    told = [fitted_behind(each) for each in behind_elements(problem, base)]
    assert runs == [1, len(errors.free)]  # the fit itself and its slopes: what is behind it only filters
    best = min(told, key=lambda fit: fit.squares)
    assert best.model.element is pole
    learned = with_element(problem, base)
    assert learned is not None
    assert learned.model.element is pole
    assert best.fit.p[-1] == pytest.approx(learned.fit.p[-1], rel=0.2)
    assert learned.fit.p[-1] == pytest.approx(60.0, rel=0.2)
