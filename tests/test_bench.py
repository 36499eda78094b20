"""The bench, tiny: rows of `run` over rigs, what else it measures held against simulations, refused files."""

import json
from copy import deepcopy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.commands.bench import study as study
from workbench.commands.bench.verdict import verdict_sentence
from workbench.commands.common.bench_experiment import BenchConfig
from workbench.commands.common.head import whole_page
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.common.run_folder import metrics_json
from workbench.control.protocol import graph_law
from workbench.linear.frequency_response import first_harmonic
from workbench.loop.envelope import envelope, steps
from workbench.loop.envelope_row import choice
from workbench.loop.hard_goals import linear_goals, motion_goals
from workbench.loop.limit import settling_limit
from workbench.loop.rig_variations import with_delay
from workbench.loop.rows import judge, linear_loops, loop_setup
from workbench.loop.sampled_loop import SampledLoop
from workbench.loop.scenarios import SCENARIOS, Limits
from workbench.loop.stiffness_and_noise import command_noise, dynamic_stiffness

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
BODE = """
[bode]
low_hz = 2
high_hz = 20
points = 3
amplitudes_percent = [1, 50]
"""
TINY = f"""
experiment = "bench"
rig = "jack-10t"
rigs = ["nominal", "mass+50"]
scenarios = ["position-10mm"]
[from]
"steps.toml" = ["p", "p-dp"]
{BODE}"""
FORCE = f"""
experiment = "bench"
rig = "jack-10t"
rigs = ["nominal"]
scenarios = ["force-moving-end"]
[specimen]
stiffness = {{value = 1e7, unit = "N/m"}}
damping = {{value = 1, unit = "kN s/m"}}
[from]
"{EXPERIMENTS / "force_step.toml"}" = ["p-dp"]
{BODE}"""


def loaded(folder, text):
    slow = (EXPERIMENTS / "position_step.toml").read_text().replace("{value = 0.24,", "{value = 0.12,", 1)
    (folder / "steps.toml").write_text(slow)  # its P meets every goal
    (folder / "tiny.toml").write_text(text)
    return BenchConfig.load(folder / "tiny.toml")


@pytest.fixture(scope="module")
def stages():
    return {}


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    return loaded(tmp_path_factory.mktemp("bench"), TINY)


@pytest.fixture(scope="module")
def outcome(config, stages):
    def stage(name, compute):
        stages[name] = compute()
        return stages[name]

    return study.run_bench(config, stage, lambda _: None)


@pytest.fixture(scope="module")
def on(config):
    return loop_setup(config.rig)


def controller(config, name):
    return next(chosen for chosen in config.loops[0].controllers if chosen.name == name)


def test_a_row_on_the_nominal_rig_is_the_one_of_run(config, outcome):
    wanted, steps = SCENARIOS["position-10mm"], config.loops[0]
    for found in (one for one in outcome.metrics["rows"] if one["rig"] == "nominal"):
        chosen = next(c for c in steps.controllers if c.name == found["controller"])
        setup = loop_setup(with_delay(steps.rig, 0.3e-3))
        _, alone = judge(chosen, wanted, setup, linear_loops(chosen, setup), seed=0)
        times = found["settling_s"] / settling_limit(steps.rig, wanted).settling if found["settling_s"] else None
        assert found == {**alone, "rig": "nominal", "times_limit": times}


def test_every_controller_meets_every_rig_and_the_spread_spans_them(outcome):
    rows = outcome.metrics["rows"]
    pairs = [(one["controller"], one["rig"]) for one in rows]
    assert pairs == [("p", "nominal"), ("p", "mass+50"), ("p-dp", "nominal"), ("p-dp", "mass+50")]
    settling = [one["settling_s"] for one in rows[2:]]
    assert settling[0] != settling[1]
    line = outcome.metrics["spread"][1]
    assert (line["settling_s_least"], line["settling_s_most"]) == (min(settling), max(settling))
    assert line["unsettled"] == line["unstable"] == []
    assert set(outcome.metrics["timing"]) == {"p", "p-dp"}
    firsts = next(section.items[0] for section in outcome.page.sections if section.title == "Position loops")
    assert "p-dp is settled on every rig first" in firsts


def test_a_position_controller_is_judged_over_the_envelope_of_the_free_rigs(config, outcome):
    """Goals and worst are those of the loop's room, on both rigs at five positions with the delay."""
    space = envelope({name: with_delay(rig, 0.3e-3) for name, rig in config.loops[0].rigs.items()})
    ten = SCENARIOS["position-10mm"]
    rows = {row["controller"]: row for row in outcome.metrics["envelope"]}
    assert list(rows) == ["p", "p-dp"]
    for name, row in rows.items():
        law = controller(config, name).build(1e-3)
        goals = [*linear_goals(space, law, Limits()), *motion_goals(space, law, [ten], Limits())]
        assert [goal["name"] for goal in row["goals"]] == [goal.name for goal in goals]
        assert [goal["where"] for goal in row["goals"]] == [goal.where for goal in goals]
        assert [goal["miss"] for goal in row["goals"]] == [
            None if goal.value is not None and np.isnan(goal.value) else goal.miss for goal in goals
        ]
        played = steps(space.played(law), law, ten, 0, ten.duration)
        assert row["settling_worst_s"] == played.settling.max()
        assert row["settling_nominal_s"] == played.settling[:5].max()
        assert row["where"] == played.names[int(played.settling.argmax())]
        assert row["overshoot_worst_percent"] == played.overshoot.max()
    assert rows["p"]["met"]
    assert not rows["p-dp"]["met"]


def test_the_report_opens_with_the_controller_to_take_and_where_it_is_weak(config, outcome):
    worst = {row["controller"]: row for row in outcome.metrics["envelope"]}
    verdict = outcome.page.verdict
    assert verdict.startswith("Take p: it meets every goal over stroke and rigs and settles position-10mm within ")
    assert "it is weakest in Ms on every plant" in verdict
    assert f"p-dp settles it sooner, within {worst['p-dp']['settling_worst_s']:.3g} s, but misses" in verdict
    section = outcome.page.sections[0]
    lines = {row[0]: dict(zip(section.items[0].columns, row, strict=True)) for row in section.items[0].rows}
    assert lines["p"]["goals missed"] == 0
    missed = [["p-dp", goal["name"], goal["where"]] for goal in worst["p-dp"]["goals"] if goal["miss"]]
    assert [[line[0], line[1], line[4]] for line in section.items[1].rows] == missed
    assert lines["p-dp"]["goals missed"] == len(missed) > 0
    assert lines["p"]["settling [s]"] == worst["p"]["settling_worst_s"]
    assert "on a specimen [s]" not in lines["p"]
    (mark,) = section.items[2].panels[0].curves
    assert (mark.name, mark.x[0], mark.y[0]) == ("p", worst["p"]["settling_worst_s"], worst["p"]["ms_worst"])
    assert section.items[2].note == "Unstable or unsettled on some plant: p-dp."
    charts = outcome.page.sections[1].items
    assert [chart.title.partition(":")[0] for chart in charts] == ["p", "p-dp"]
    assert [curve.name for curve in charts[0].panels[0].curves] == ["Ms 2.5", "nominal", "mass+50"]


def test_the_numbers_of_every_controller_and_rig_are_in_the_report(outcome):
    controllers, rigs, nominal = whole_page(outcome.page, outcome.subject).sections[-1].items
    assert controllers.rows[0] == ["p", "P", "gain 0.12 1/m"]
    assert rigs.rows == [["mass+50", "M 1500 kg (1.5 times)"]]
    assert "beta" in [row[0] for row in nominal.rows]


def test_where_none_meets_every_goal_the_report_names_the_nearest(config, outcome):
    metrics = deepcopy(outcome.metrics)
    p = metrics["envelope"][0]
    p["goals"][1] |= {"value": 2.1, "miss": 0.05}
    p["met"] = False
    sentence = verdict_sentence(config.loops[0], metrics)
    assert sentence.startswith(
        "No controller meets every goal and settles over stroke and rigs; nearest comes p: it settles"
    )
    assert sentence.endswith('and misses "Ms on the nominal rig" (nominal at +0 mm).')


def test_an_interrupted_bench_resumes_where_it_was(config, outcome, stages, monkeypatch):
    """What was stored is neither built nor played again, and the result is the same but for its timing."""
    kept = dict(list(stages.items())[:3])
    played = []
    monkeypatch.setattr(
        study,
        "benchmark_entry",
        lambda c, _loop, rig, _seed: played.append((c.name, rig)) or stages[f"{c.name} on {rig}"],
    )
    monkeypatch.setattr(study, "loop_setup", lambda rig: rig.name)
    again = study.run_bench(config, lambda name, compute: kept[name] if name in kept else compute(), lambda _: None)
    assert played == [("p-dp", "mass+50")]
    assert metrics_json(again.metrics) == metrics_json(outcome.metrics)


def test_a_stage_and_a_result_can_be_written(outcome, stages):
    assert json.loads(metrics_json(outcome.metrics))["rows"][0]["controller"] == "p"
    assert all(isinstance(entry["solve_us"], np.ndarray) for name, entry in stages.items() if " on " in name)
    assert "linear-p-dp-nominal" in outcome.tables
    assert outcome.tables["stiffness-p-nominal"]["n_per_m"].min() > 0


@pytest.mark.parametrize("name", ["p", "p-dp"])
def test_dynamic_stiffness_is_what_a_shaken_loop_shows(config, on, name):
    """A sine of 20 N and 10 Hz, too small to leave the lap's doubled gain, on the nonlinear loop."""
    chosen, f, force = controller(config, name), 10.0, 20.0
    period = on.rig.period.value
    loop = SampledLoop(on.engine, on.rig, chosen.build(period), on.null)
    t = np.arange(2001) * period
    run = loop.run(np.zeros(len(t)), {"disturbance": force * np.sin(2 * np.pi * f * t)})
    moved = abs(first_harmonic(run.record.signals["position"][-101:]))
    assert force / moved == pytest.approx(abs(dynamic_stiffness(chosen, on, np.array([f]))[0]), rel=0.03)


@pytest.mark.parametrize("name", ["p", "p-dp"])
def test_command_noise_is_what_noisy_sensors_leave(config, on, name):
    chosen = controller(config, name)
    loop = SampledLoop(on.engine, on.rig, chosen.build(on.rig.period.value), on.null, seed=1)
    command = loop.run(np.zeros(4000)).record.signals["command"]
    expected = command_noise(chosen, on, linear_loops(chosen, on).null)
    assert np.std(command[-3000:]) == pytest.approx(expected, rel=0.1)


def test_a_force_loop_tells_what_a_moving_end_costs_it(tmp_path):
    """0.012 of command over the gain of the deflection at 0.1 m/s, as the margins' operating point has it."""
    metrics = study.run_bench(loaded(tmp_path, FORCE), no_checkpoint, lambda _: None).metrics
    (line,) = metrics["moving_end"]
    assert line["error_n_per_m_s"] == pytest.approx(31e3 / 0.1, rel=0.15)
    (energy,) = metrics["energy"]
    assert energy["energy_j"] > energy["beyond_rest_j"] > 0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('experiment = "bench"', 'experiment = "step"', '"step" is not "bench"; jackbench run takes it'),
        ('"mass+50"', '"mass+5"', r'rigs: no rig "mass\+5" in the set; did you mean "mass\+50"'),
        ('"mass+50"', '"nominal"', 'rigs: "nominal" is listed twice'),
        ('rigs = ["nominal", "mass+50"]', "", r'rigs: missing; write rigs = \["nominal"\]'),
        ('"p-dp"', '"p-db"', 'no controller "p-db"; did you mean "p-dp"'),
        ("steps.toml", "stepz.toml", "no such file"),
        ("steps.toml", f"{EXPERIMENTS / 'paper.toml'}", "has no controllers"),
        ('"position-10mm"', '"force-20kn"', "p controls the position, which no scenario asks for"),
        ('["position-10mm"]', '["position-10mm", "force-20kn"]', "scenarios of the force, which no controller"),
        ("[from]", "[form]", 'form: unknown key; did you mean "from"'),
        ('["nominal", "mass+50"]', '{force = ["nominal"]}', 'rigs.force: unknown key; known: position'),
        ("[bode]", "[bodes]", 'bodes: unknown key; did you mean "bode"'),
        ("[1, 50]", "[-1]", "amplitudes_percent: -1: must be positive numbers"),
        ('"jack-10t"', '"jack-11t"', 'no bundled rig "jack-11t"'),
    ],
)  # fmt: skip
def test_a_bench_that_makes_no_sense_is_refused(tmp_path, old, new, message):
    assert old in TINY
    with pytest.raises(InputError, match=message):
        loaded(tmp_path, TINY.replace(old, new))


def test_a_force_needs_a_specimen(tmp_path):
    start, end = FORCE.index("[specimen]"), FORCE.index("[from]")
    with pytest.raises(InputError, match=r"a force needs something to act on; add a table \[specimen\]"):
        loaded(tmp_path, FORCE[:start] + FORCE[end:])


def test_sines_sweep_the_nominal_rig_at_parts_of_its_stroke_and_say_where_a_limit_acts(outcome):
    """At 1 percent of 240 mm the loop is nearly its linear self; half of them asks for more force than there is."""
    small, large = (outcome.tables[f"sine-p-dp-nominal-{size}mm"] for size in ("2.4", "120"))
    assert not small["cavitated"].any()
    assert large["cavitated"][-1]
    linear = outcome.tables["linear-p-dp-nominal"]
    closed = np.hypot(linear["closed_real"], linear["closed_imag"])
    expected = np.interp(small["f_hz"][0], linear["f_hz"], closed)
    assert np.hypot(small["real"], small["imag"])[0] == pytest.approx(expected, rel=0.1)
    assert not [name for name in outcome.tables if name.startswith("sine") and "mass" in name]


def test_the_shipped_bench_has_every_controller_in_loops_of_position_and_force():
    config = BenchConfig.load(EXPERIMENTS / "benchmark.toml")
    position, force = config.loops
    assert [chosen.name for chosen in position.controllers] == [
        "p",
        "pid-lead",
        "p-dp",
        "p-dp-notch",
        "p-dp-shaped",
        "tvc",
        "crone1",
        "crone2",
        "crone3",
        "lqg",
        "mpc",
        "automatic",
    ]
    assert [chosen.name for chosen in force.controllers] == ["p-dp-force"]
    assert tuple(position.rigs) == ("nominal", "mass-50", "mass+50", "beta-50", "supply-20", "stiffness-1e6")
    assert tuple(force.rigs) == tuple(position.rigs)
    assert force.bode.amplitudes == pytest.approx((900.0, 9e3, 45e3))


def test_a_bench_of_one_s_own_has_the_automatic_controller_that_the_shipped_one_has(config):
    said, shipped = [], BenchConfig.load(EXPERIMENTS / "benchmark.toml")
    (loop,) = study.beside_automatic(config, said.append).loops
    assert [spec.name for spec in loop.controllers] == ["p", "p-dp", "automatic"]
    assert said == []
    wanted = shipped.loops[0].controllers[-1]
    own, there = ([spec.design.gain, spec.compensators[0].design.gain] for spec in (loop.controllers[-1], wanted))
    assert own == pytest.approx(there, rel=0.03)  # its noise had another seed
    assert study.beside_automatic(shipped, said.append) == shipped


def judged(name, steps, met=True):
    """A row of the envelope: worst settling [s] by step."""
    goal = {"name": "Ms on every plant", "value": 2.0, "limit": 2.5, "miss": 0.0 if met else 0.1, "where": "bad corner"}
    goal["metric"] = "ms"
    every = [
        {"scenario": step, "settling_worst_s": took, "overshoot_worst_percent": 1.0} for step, took in steps.items()
    ]
    return {
        "controller": name,
        "met": met,
        "goals": [goal],
        "settling_worst_s": steps["10mm"],
        "where": "x",
        "steps": every,
    }


def test_the_choice_is_over_all_steps():
    """Who wins a few ms of one step and is slow in another is named, not taken; what none settles says nothing."""
    quick = judged("quick", {"10mm": 0.096, "100mm": 0.144, "1m": None})
    even = judged("even", {"10mm": 0.104, "100mm": 0.114, "1m": None})
    wild = judged("wild", {"10mm": 0.05, "100mm": 0.05, "1m": 0.1}, met=False)
    for rows in ([quick, even], [even, quick], [wild, quick, even]):
        sentence = choice(rows, "10mm")
        assert sentence.startswith(
            "Take even: it meets every goal over stroke and rigs and settles 10mm within 0.104 s"
        )
        assert "(100mm within 0.114 s, 1m never)" in sentence
    assert choice([quick, even], "10mm").endswith(
        "; quick settles it sooner, within 0.096 s, but 100mm takes it 0.144 s."
    )
    assert choice([quick], "10mm").startswith("Take quick")


def test_a_law_of_ones_own_is_judged_on_the_same_plants_as_the_others(config):
    """In Python, one loop at a time, it could be fine on the few plants that are quick to play, and bad elsewhere."""
    space = envelope({name: with_delay(rig, 0.3e-3) for name, rig in config.loops[0].rigs.items()})
    law = controller(config, "p").build(1e-3)
    alone = SimpleNamespace(measures=law.measures, compute=law.compute, update=law.update, reset=law.reset)
    assert graph_law(alone) is None
    assert space.played(alone).names == space.played(law).names == space.varied.names
