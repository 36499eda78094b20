"""The door for Python: what a notebook's cells give, in short, and what is refused in one line."""

import re
import subprocess
import sys
from html.parser import HTMLParser
from inspect import Parameter, signature
from pathlib import Path
from types import FunctionType

import numpy as np
import pytest

import workbench as wb
from controllers import LapInverse, P, PressureFeedback
from workbench.base.errors import InputError
from workbench.commands.common.declared import keys_of
from workbench.commands.faults.options import FaultsConfig
from workbench.commands.inverse.options import InverseConfig
from workbench.commands.robustness.options import RobustnessConfig
from workbench.commands.sines.options import SinesConfig
from workbench.report import Curve, Figure, Panel

POSITIONAL = (Parameter.POSITIONAL_ONLY, Parameter.POSITIONAL_OR_KEYWORD)
ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def loop():
    rig = wb.load_rig("jack-10t")
    law = P(gain=3.7) + PressureFeedback(gain="2e-4 1/bar", corner="1 Hz", column="314 mm")
    return wb.ClosedLoop(rig, law + LapInverse(excess=0.0016, width=0.0021))


@pytest.fixture(scope="module")
def step(loop):
    return loop.step("10 mm")


@pytest.fixture(scope="module")
def best(loop):
    return wb.tune(loop, over={"gain": (1, 10)}, designs=4)


def lone(script, folder, *paths):
    """What a script prints in a process that finds only `paths`."""
    command = [sys.executable, "-c", f"import sys; sys.path[:0] = {list(map(str, paths))!r}\n{script}"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout.strip()


def assert_html(text):
    opened = []

    class Parser(HTMLParser):
        def handle_starttag(self, tag, attrs):
            if tag != "img":
                opened.append(tag)

        def handle_endtag(self, tag):
            assert opened.pop() == tag

    Parser().feed(text)
    assert not opened
    assert "<script" not in text
    assert "http" not in text.replace("http://www.w3.org", "")


# --- the snippet of the map


def test_the_lines_of_the_readme_run(loop):
    """As written there, but for the search and the trace, which take a minute and are tested with fewer designs."""
    text = (ROOT / "README.md").read_text()
    lines = text[text.index("    import workbench as wb\n") :].partition("\n\n")[0].splitlines()
    slow = [line for line in lines if "wb.tune" in line or "wb.trace" in line]
    assert len(slow) == 2
    names = {}  # the README's own lines are what is tested, so they are run from there
    exec("\n".join(line.strip() for line in lines if line not in slow), names)
    assert repr(names["loop"]) == repr(loop)
    compile("\n".join(line.strip() for line in slow), "README.md", "exec")


def test_a_step_has_signals_metrics_and_a_figure(step):
    assert step["position"][-1] == pytest.approx(0.01, abs=1e-5)
    assert step.t.shape == step["position"].shape
    assert step.metrics["settling_s"] == pytest.approx(0.127, abs=0.01)
    assert [panel.y_label for panel in step.plot().panels] == ["position [mm]", "command [1]", "pa [bar]"]
    assert step.plot("pb").panels[1].y_label == "pb [bar]"


def test_the_door_gives_the_numbers_of_the_experiment_file(loop, step):
    margins = loop.margins()
    assert step.metrics["ms"] == margins.ms
    assert step.metrics["gain_margin_db"] == margins.gain_margin_db
    assert margins.stable
    assert np.abs(loop.poles().null).max() < 1


def test_a_frequency_response_is_linear_or_at_an_amplitude(loop):
    linear, sine = loop.bode(), loop.bode(amplitude="10 %", low="2 Hz", high="20 Hz", points=5)
    assert sine.sine.amplitude == pytest.approx(0.1 * loop.rig.limit("stroke"))
    assert linear.f3db > sine.f3db
    assert sine.plot().panels[0].y_label == "gain [dB]"


def test_a_search_returns_a_loop_that_is_no_worse_and_a_benchmark_has_both(loop, best):
    assert best.controller.name == "p+pressure-feedback+lap-inverse-tuned"
    assert len(best.search.trials) == 4
    assert best.search.best.verdict.cost <= best.search.trials[0].verdict.cost
    bench = wb.benchmark([loop, best, loop])
    names = [row["controller"] for row in bench.rows]
    name = "p+pressure-feedback+lap-inverse"
    assert names == [name, f"{name}-tuned", f"{name}-2"]
    assert isinstance(bench.plot(), Figure)


def test_a_reference_is_a_scenario_samples_or_a_function_of_time(loop):
    ramp = loop.follow("position-ramp")
    assert ramp["reference"][-1] == pytest.approx(0.1)
    samples = loop.follow(np.full(50, 1e-3), start="20 mm")
    assert samples["reference"][0] == pytest.approx(0.021)
    assert samples.metrics["settling_s"] is None
    sine = loop.follow(lambda t: 1e-3 * np.sin(6 * t), seconds="0.1 s", seed=1)
    assert sine.t[-1] == pytest.approx(0.1)
    assert sine.metrics["iae"] > 0


# --- how it shows


def test_reprs_are_short_and_html_is_whole(loop, step, best):
    shown = [loop, step, step.metrics, step.plot(), loop.margins(), loop.bode(), best]
    for each in shown:
        assert len(repr(each).splitlines()) <= 4, each
        assert " object at 0x" not in repr(each)
    for each in (step, step.metrics, step.plot(), loop.margins(), loop.poles(), loop.bode(), best.search):
        assert_html(each._repr_html_())


def test_a_figure_is_saved_and_shown_without_waiting(tmp_path, monkeypatch):
    monkeypatch.setenv("CI", "1")
    figure = Figure("<A & B>", "time [s]", [Panel("x [mm]", [Curve("a", np.arange(3), np.arange(3))])])
    for suffix in ("png", "svg", "html"):
        assert figure.save(tmp_path / f"a.{suffix}").stat().st_size > 1000
    assert "plotly" in figure.show().read_text()
    assert_html(figure._repr_html_())
    with pytest.raises(InputError, match=r"saved as \.png, \.svg or \.html"):
        figure.save(tmp_path / "a.gif")
    with pytest.raises(InputError, match="no folder"):
        figure.save(tmp_path / "nowhere" / "a.png")


def test_pandas_is_asked_for_where_it_is_missing(step, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InputError, match="pandas is not installed"):
        step.to_pandas()


# --- what is refused, in one line


@pytest.mark.parametrize(
    ("ask", "complaint"),
    [
        (lambda loop: P(gain=-5), "gain: -5 1/m is outside 0.001 to 1000 1/m"),
        (lambda loop: P(gian=5), 'no number "gian"; did you mean "gain"'),
        (lambda loop: loop.step("10 bar"), 'unit "bar"'),
        (lambda loop: loop.step("ten mm"), "write a number and its unit"),
        (lambda loop: loop.step(0), "the size is 0"),
        (lambda loop: loop.step("1 mm", seconds="1 us"), "shorter than the control period"),
        (lambda loop: loop.follow("position-rampe"), 'did you mean "position-ramp"'),
        (lambda loop: loop.follow("force-20kn"), "force-20kn asks for a force, the loop controls the position"),
        (lambda loop: loop.follow([1.0, np.nan]), "finite samples"),
        (lambda loop: wb.ClosedLoop(loop.rig, PressureFeedback(gain=1e-9, corner=1)), "is a compensator"),
        (lambda loop: wb.ClosedLoop(loop.rig, 3.7), "is no controller"),
        (lambda loop: wb.ClosedLoop("jack-10", P(gain=1)), 'did you mean "jack-10t"'),
        (lambda loop: wb.ClosedLoop(loop.rig, P(gain=1).on_load_cell(1e7)), "give it a specimen"),
        (lambda loop: wb.tune(loop, over={"gian": (1, 10)}), 'did you mean "gain"'),
        (lambda loop: wb.tune(loop, over={"gain": (1, 10000)}), "outside 0.001 to 1000 1/m"),
        (lambda loop: wb.tune(loop, over={"gain": 3}), "write the least and the greatest"),
        (lambda loop: wb.tune(loop, over={}), "nothing is searched"),
        (lambda loop: wb.tune(loop, over={"gain": (50, 60)}, designs=1), "the nearest misses: stable on every"),
        (lambda loop: wb.benchmark([loop], rigs=["nominal", "mass50"]), 'did you mean "mass'),
        (lambda loop: wb.benchmark([]), "give a list of ClosedLoops"),
    ],
)
def test_bad_input_is_refused_in_one_line(loop, ask, complaint):
    with pytest.raises(InputError) as refused:
        ask(loop)
    assert complaint in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("ask", "near"), [(lambda run: run["postion"], "position"), (lambda run: run.metrics["setling_s"], "settling_s")]
)
def test_an_unknown_name_names_its_neighbour(step, ask, near):
    with pytest.raises(KeyError, match=f'did you mean "{near}"'):
        ask(step)


LAW = """
import control
import numpy as np
from workbench import design_numbers, number

class Mine:
    measures = ("position",)

    @design_numbers
    class Design:
        gain: float = number("1/m", 0.1, 20.0, "gain")

    def __init__(self, design, period):
        self.gain, self.period = design.gain, period

    def reset(self, reference, measurement, command):
        pass

    def compute(self, reference, measurement):
        return self.gain * (reference - measurement["position"])

    def update(self, realised):
        pass

    def linear(self):
        return control.StateSpace([], [], [], [[self.gain, -self.gain]], self.period, inputs=2, outputs=1)
"""


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("def update", "def updaet", "Mine has no method update"),
        ("return self.gain * (", "(", "Mine.compute: returns NoneType, no number"),
        ("return self.gain *", "return 1j *", "Mine.compute: returns complex, no number"),
        ("return self.gain *", "return np.ones(2) *", "Mine.compute: returns ndarray, no number"),
        ("return self.gain *", "return self.gian *", "Mine.compute: AttributeError"),
    ],
)
def test_a_controller_that_breaks_the_protocol_gives_a_sentence(tmp_path, old, new, complaint):
    path = tmp_path / "mine.py"
    path.write_text(LAW.replace(old, new))
    with pytest.raises(InputError) as refused:
        wb.ClosedLoop("jack-10t", wb.controller(f"{path}:Mine", gain=1)).step("1 mm", seconds="0.1 s")
    assert complaint in str(refused.value)


# --- the door itself


def test_dir_is_the_map_and_every_name_is_there():
    assert set(wb.__all__) <= set(dir(wb))
    assert all(getattr(wb, name) is not None for name in wb.__all__)
    assert len(wb.__doc__.splitlines()) <= 40


@pytest.mark.parametrize("name", [name for name in wb.__all__ if isinstance(getattr(wb, name), FunctionType)])
def test_every_parameter_is_said_in_its_docstring_with_kind_and_default(name):
    function = getattr(wb, name)
    takes, sections = signature(function), dict(re.findall(r"^(\w+)\n-+\n((?:.+\n?)+)", function.__doc__, re.MULTILINE))
    entries = re.findall(r"^(\S+) : (.*)\n    (\S.*)", sections["Parameters"], re.MULTILINE)
    assert [entry.lstrip("*") for entry, *_ in entries] == list(takes.parameters)
    for (_, kind, meaning), parameter in zip(entries, takes.parameters.values(), strict=True):
        shown = parameter.default is not Parameter.empty and not callable(parameter.default)
        assert f"default {parameter.default!r}" in kind if shown else "default" not in kind
        assert meaning[0] != "."
        assert not re.match(r"\w+\.\w+", kind)  # kinds have no modules
    assert "Returns" in sections or takes.return_annotation is None
    assert "InputError\n    " in sections.get("Raises", "") or "InputError" not in function.__doc__


@pytest.mark.parametrize(
    ("function", "kind"),
    [("robustness", RobustnessConfig), ("faults", FaultsConfig), ("sines", SinesConfig), ("inverse", InverseConfig)],
)
def test_what_an_experiment_declares_is_said_with_its_unit_and_bounds(function, kind):
    text, takes = getattr(wb, function).__doc__, signature(getattr(wb, function)).parameters
    declared = {name: key.of[1] for name, key in keys_of(kind).items() if name in takes and key.check and key.of}
    assert declared
    for name, asked in declared.items():
        (meaning,) = re.findall(rf"^{name} : .*\n    (.*)", text, re.MULTILINE)
        if spec := asked.get("spec"):
            assert f"[{spec.unit}]" in meaning
        elif "most" in asked:
            assert f"{asked['least']} to {asked['most']}" in meaning


def test_importing_the_door_loads_nothing_heavy(tmp_path):
    script = "import workbench; print([m for m in ('numpy', 'casadi', 'control', 'matplotlib') if m in sys.modules])"
    assert lone(script, tmp_path, ROOT) == "[]"


def test_the_workbench_stands_without_controllers_and_environments(tmp_path):
    (tmp_path / "workbench").symlink_to(ROOT / "workbench")
    script = """
sys.modules["controllers"] = sys.modules["envs"] = None
import workbench as wb
[getattr(wb, name) for name in wb.__all__]
rig = wb.load_rig("jack-10t")
print(wb.equilibrium(wb.build(rig)).speed)
"""
    assert lone(script, tmp_path, tmp_path) == "0.0"


# --- the wrong kind of thing

WRONG = {"nothing": None, "a number": 3, "an object": object(), "a list": [1], "a dict": {"a": 1}, "text": "no such"}


@pytest.mark.parametrize("name", [name for name in dir(wb) if isinstance(getattr(wb, name), FunctionType)])
@pytest.mark.parametrize("wrong", [*WRONG, "a rig", "a plant"])
def test_every_function_says_in_one_line_what_it_wants(name, wrong, tmp_path, monkeypatch):
    """It takes the thing, or refuses it as bad input; nothing else is raised."""
    monkeypatch.chdir(tmp_path)
    function, rig = getattr(wb, name), wb.load_rig("jack-10t")
    thing = {**WRONG, "a rig": rig, "a plant": wb.build(rig)}[wrong]
    needed = [p for p in signature(function).parameters.values() if p.default is p.empty and p.kind in POSITIONAL]
    said = ""
    try:
        function(*[thing] * len(needed))
    except InputError as error:
        said = str(error)
    assert "\n" not in said
    assert len(said) < 300


def test_a_rig_serves_where_a_plant_is_asked_for():
    rig = wb.load_rig("jack-10t")
    rest = wb.equilibrium(rig)
    assert np.array_equal(rest.x, wb.equilibrium(wb.build(rig)).x)
    assert wb.linearise(rig, rest).nstates == wb.build(rig).n
    with pytest.raises(InputError, match="equilibrium: plant is None; give a Plant"):
        wb.equilibrium(None)


def test_a_rig_is_a_mapping_of_its_numbers():
    rig = wb.load_rig("jack-10t")
    assert "beta" in rig
    assert "no_such_number" not in rig
    assert list(rig) == list(rig.keys()) == list(rig.numbers)
    assert len(rig) == len(rig.numbers)
    assert dict(rig)["beta"] == rig["beta"] == rig.get("beta")
    assert rig == wb.load_rig("jack-10t") != rig.with_values(beta=1.1e9)


# --- judgements of loops


def test_loops_are_judged_on_drawn_plants_as_the_experiment_file_says(loop, monkeypatch):
    from workbench.notebook import judgements

    asked = []
    monkeypatch.setattr(judgements, "run_robustness", lambda config, *_: asked.append(config))
    wb.robustness(loop, plants=50, within={"M": (0.5, 1.5)})
    (config,) = asked
    assert (config.plants, config.step, config.factors) == (50, 0.01, {"M": (0.5, 1.5)})
    assert config.controllers == (loop.controller,)
    with pytest.raises(InputError, match='within: no number "mass"'):
        wb.robustness(loop, within={"mass": (0.5, 1.5)})


def test_a_light_mass_is_the_worst_plant_of_a_loop_over_the_mass(loop):
    outcome = wb.robustness(loop, plants=8, within={"M": (0.5, 1.5)})
    (row,) = outcome.metrics["rows"]
    assert row["plants"] == 8
    assert row["ms_worst"] > max(loop.margins().null.ms, loop.margins().moving.ms)


def test_harmonic_cancellation_takes_the_third_harmonic_out(loop):
    rows = wb.sines(loop, [1.0]).metrics["rows"]
    third = {row["way"]: row["third_db"] for row in rows}
    assert min(third, key=lambda way: third[way]) == "apc+ahc"
    with pytest.raises(InputError, match="frequencies"):
        wb.sines(loop, [1000.0])


def test_an_inverse_before_loops_lessens_the_error_of_a_record(loop):
    (row,) = wb.inverse(loop).metrics["rows"]
    assert row["factor"] > 2
    with pytest.raises(InputError, match="force"):
        wb.inverse(loop, "force-20kn")


def test_faults_begin_in_a_step_of_the_loop_s_own_rig(loop, monkeypatch):
    from workbench.commands.faults.options import FaultsConfig
    from workbench.notebook import judgements

    asked = []
    monkeypatch.setattr(judgements, "run_faults", lambda trials, *_: asked.append(trials))
    wb.faults(loop, plants=3)
    (trials,), filed = asked, FaultsConfig.load(ROOT / "experiments/faults.toml")
    assert trials.loops[0].step == filed.loops[0].step
    assert (trials.stroke, trials.seconds) == (filed.stroke, filed.seconds)


def test_a_rig_as_found_is_tuned_on_as_its_file_is(tmp_path):
    from workbench.commands.retune.config import load_retune

    experiment, file = ROOT / "experiments/tune_festo_p.toml", ROOT / "tests/festo_found.toml"
    by_rig, by_file = load_retune(experiment, wb.load_rig(file)), load_retune(experiment, str(file))
    assert by_rig.found.rigs == by_file.found.rigs
    with pytest.raises(InputError, match="retune"):
        wb.retune(experiment, found=3)
