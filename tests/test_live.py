"""`jackbench live`: its answers are those of the loops themselves."""

import gc
import os
import sys
from base64 import b64decode
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from random import Random

import numpy as np
import pytest

import workbench as wb
from workbench.base.errors import InputError
from workbench.commands.common.step_experiment import load_steps
from workbench.commands.live.answer import drawn_rows
from workbench.commands.live.config import load_live
from workbench.commands.live.plants import RigPoint, moved_lanes, set_lanes
from workbench.commands.live.session import Session
from workbench.commands.live.sliders import design_sliders
from workbench.commands.live.view import step_part
from workbench.control import law
from workbench.engine import kernel, object_cache
from workbench.loop.limit import settling_limit
from workbench.loop.rows import judge, linear_loops
from workbench.loop.tuning.problem import with_number

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
STEP = EXPERIMENTS / "position_step.toml"
ASKED = {"controller": "p-dp", "scenario": "position-10mm", "amplitude": 1, "numbers": {}, "rig": {}}


@pytest.fixture(scope="module")
def config():
    return load_live(STEP)


@pytest.fixture(scope="module")
def session(config):
    return Session(config)


@pytest.fixture(scope="module")
def at_rest(session):
    return session.after(ASKED)


def floats(text):
    return np.frombuffer(b64decode(text), "<f4").astype(float)


def closed_loop(config, name="p-dp", rig=None):
    return wb.ClosedLoop(rig or config.steps.rig, next(c for c in config.steps.controllers if c.name == name))


def test_the_nominal_rig_has_the_row_of_run(config, at_rest):
    loop = closed_loop(config)
    scenario = replace(wb.SCENARIOS["position-10mm"], duration=1.0)
    _, row = judge(loop.controller, scenario, loop.setup, linear_loops(loop.controller, loop.setup), 0)
    (shown, *_) = at_rest["rows"]
    assert shown["rig"] == "nominal"
    assert shown["stable"] is row["stable"] is True
    assert shown["settling_s"] == pytest.approx(row["settling_s"])
    assert shown["overshoot_percent"] == pytest.approx(row["overshoot_percent"], rel=1e-3)
    assert shown["ms"] == pytest.approx(row["ms"], rel=2e-3)
    assert shown["gain_margin_db"] == pytest.approx(row["gain_margin_db"], abs=0.02)
    assert shown["phase_margin_deg"] == pytest.approx(row["phase_margin_deg"], abs=0.05)


def test_a_moved_rig_is_the_rig_with_those_numbers(config, session):
    rig = config.steps.rig.with_values(M=1300.0, Ps=19e6)
    asked = {**ASKED, "rig": {"M": 1300, "Ps": 190}, "numbers": {"gain": 3.0}}
    loop = closed_loop(config, rig=rig)
    margins = loop.with_controller(
        wb.controller("controllers.p:P", gain=3.0) + loop.controller.compensators[0]
    ).margins()
    row = session.view(asked)["rows"][0]
    assert row["ms"] == pytest.approx(margins.ms, rel=2e-3)
    assert row["gain_margin_db"] == pytest.approx(margins.gain_margin_db, abs=0.02)


def test_a_moved_operating_point_is_one(config):
    lanes = moved_lanes(set_lanes(config.rigs, 0.0), RigPoint({"beta": 0.9e9}, 0.1))
    plant = lanes.engine.plant
    assert lanes.null.ok.all()
    assert lanes.moving.ok.all()
    assert lanes.null.x[:, plant.state("x")] == pytest.approx(0.1)
    beta = lanes.p[:, plant.parameters.index("beta")]
    assert beta == pytest.approx(np.where(np.array(lanes.names) == "beta-50", 0.45e9, 0.9e9))


def test_linear_loops_at_once_are_those_one_by_one(config):
    lanes = moved_lanes(set_lanes(config.rigs, 0.0), RigPoint(position=0.05))
    for spec in config.steps.controllers:
        controller = spec.build(lanes.rig.period.value)
        linear = lanes.linear(controller)
        for at_once, alone in zip((linear.null, linear.moving), lanes.margins(controller), strict=True):
            assert at_once.ms == pytest.approx(alone.ms, nan_ok=True)
        for lane, (f, loop) in enumerate(linear.curves):
            assert loop == pytest.approx(lanes.open_loops(controller, f)[lane])


def test_the_closed_loop_is_that_of_bode(config, at_rest):
    bode = closed_loop(config).bode()
    f, gain = floats(at_rest["linear"]["f"]), floats(at_rest["linear"]["gain"])
    inside = f < 100
    expected = np.interp(np.log(f[inside]), np.log(bode.f), 20 * np.log10(np.abs(bode.response)))
    assert gain[inside] == pytest.approx(expected, abs=0.05)


def test_the_sines_are_those_of_bode(config, at_rest):
    sines = at_rest["after"]["sines"]
    assert sines["amplitude"] == "1 mm"
    bode = closed_loop(config).bode("1 mm", 0.1, 50, 24)
    f, gain = floats(sines["f"]), floats(sines["gain"])
    common = np.isclose(f[:, None], bode.f, rtol=1e-6).any(axis=1)
    assert common.sum() > 15
    expected = {
        round(float(at), 4): value for at, value in zip(bode.f, 20 * np.log10(np.abs(bode.response)), strict=True)
    }
    for at, value in zip(f[common], gain[common], strict=True):
        assert value == pytest.approx(expected[min(expected, key=lambda k: abs(k - at))], abs=0.2)


def test_what_must_be_compiled_first_comes_afterwards(config):
    session = Session(config)
    first = session.view(ASKED)
    assert first["waits"] == "compiler"
    assert first["steps"] is None
    assert first["rows"][0]["stable"]
    session.after(ASKED)
    assert session.view({**ASKED, "numbers": {"gain": 3.1}})["waits"] == ""
    assert session.view({**ASKED, "numbers": {"compensators.1.corner": 0}})["waits"] == "compiler"  # one state less


def test_what_is_out_of_the_goals_is_named(at_rest):
    assert at_rest["rows"][0]["out"] == ["ms"]
    assert any(text.startswith("Ms above 2: nominal 2.1") for text in at_rest["missed"])


def test_the_limit_is_that_of_the_rig_as_it_is_moved(config):
    asked = []
    session = Session(config, lambda step: asked.append(step) or 0.02)
    moved = {"M": 1300, "position": 50}
    assert session.limit({**ASKED, "rig": moved}) == {"limit_s": 0.02}
    ((rig, scenario),) = asked
    assert rig["M"] == 1300
    assert scenario.position(rig.limit("stroke")) == pytest.approx(50e-3)
    assert scenario.size == pytest.approx(-10e-3)  # towards the middle, as it is played


def test_the_limit_of_the_declared_rig_is_the_one_of_the_bench(config, session):
    scenario = wb.SCENARIOS["position-10mm"]
    assert session.limit(ASKED)["limit_s"] == pytest.approx(settling_limit(config.steps.rig, scenario).settling)


def test_an_unstable_loop_has_no_margins(session):
    answer = session.view({**ASKED, "numbers": {"gain": 30}})
    assert answer["rows"][0]["stable"] is False
    assert answer["rows"][0]["ms"] is None
    assert answer["missed"][0].startswith("unstable: nominal, mass-50")
    assert np.isnan(floats(answer["linear"]["gain"])).all()


def test_goals_are_met_by_all_rigs_and_what_none_asks_is_said(config):
    lenient = replace(config.limits, ms_nominal=9.0, ms=9.0, gain_margin_db=0.0)
    session = Session(replace(config, limits=lenient))
    assert session.view(ASKED)["within"] == ("Within the goals on all 5 rigs: linear loops.", False)
    answer = session.after(ASKED)
    most = max(answer["rows"], key=lambda row: row["overshoot_percent"])
    words, all_said = answer["within"]
    assert answer["missed"] == []
    assert words.startswith("Within the goals on all 5 rigs: linear loops and scenario")
    assert f"at most {most['overshoot_percent']:.3g} % ({most['rig']})" in words
    assert not all_said
    strict = replace(lenient, overshoot_percent=most["overshoot_percent"] * 0.9)
    missed = Session(replace(config, limits=strict)).after(ASKED)["missed"]
    assert any(text.startswith("overshoot above") and most["rig"] in text for text in missed)


def test_a_step_that_turns_round_says_so(session, at_rest):
    turned = {at: session.view({**ASKED, "rig": {"position": at}})["steps"] for at in (-144, 0, 144)}
    assert turned[144]["end"] == pytest.approx(-10)
    assert turned[144]["turned"].startswith("-10 mm, towards mid stroke: the jack stands at +144 mm")
    assert [turned[at]["turned"] for at in (-144, 0)] == ["", ""]


def inside(values, axis):
    return axis[0] <= np.nanmin(values) and np.nanmax(values) <= axis[1]


@pytest.mark.parametrize("gain", [3.0, 30.0])
def test_axes_go_with_the_curves(session, at_rest, gain):
    answer = session.view({**ASKED, "numbers": {"gain": gain}})
    steps, linear = answer["steps"], answer["linear"]
    for name, axis in zip(("y", "command"), steps["axes"], strict=True):
        assert inside(floats(steps[name]), axis)
    for curve in linear["open"]:
        loud = np.abs(floats(curve["gain"])) < 30
        loud &= floats(curve["phase"]) > -450
        for name, axis in zip(("gain", "phase"), linear["open_axes"], strict=True):
            assert inside(floats(curve[name])[loud], axis)


@pytest.mark.parametrize("gain", [3.0, 30.0])
def test_a_step_is_drawn_as_it_is(session, at_rest, gain):
    asked = {**ASKED, "numbers": {"gain": gain}}
    request = session._request(asked)
    lanes = session._lanes_at(request)
    played = step_part(lanes, request.controller.build(lanes.rig.period.value), request.task)
    shown = session.view(asked)["steps"]
    curves = ("t", "y", 1e3 * played.y), ("command_t", "command", played.command)
    for (t, name, true), axis in zip(curves, shown["axes"], strict=True):
        for points, lane in zip(floats(shown[name]).reshape(len(true), -1), true, strict=True):
            assert np.interp(played.t, floats(shown[t]), points) == pytest.approx(lane, abs=0.01 * (axis[1] - axis[0]))
    assert len(floats(shown["t"])) < (100 if gain < 10 else 1100)


def test_curves_of_noise_have_a_bounded_number_of_points():
    noise = np.random.default_rng(0).standard_normal((3, 20_000))
    rows = drawn_rows(noise, 1e-3)
    assert len(rows) <= 2000
    assert rows[0] == 0


def test_nichols_curves_have_no_kinks(session):
    for curve in session.view(ASKED)["linear"]["open"]:
        gain, phase = floats(curve["gain"]), floats(curve["phase"])
        seen = (np.abs(gain) < 30)[:-1]
        assert np.abs(np.diff(phase))[seen].max() < 10
        assert np.abs(np.diff(gain))[seen].max() < 2


def test_what_is_remembered_of_moves_does_not_grow(session, at_rest):
    def objects(moves):
        for gain in moves:
            session.view({**ASKED, "numbers": {"gain": gain}, "rig": {"M": 900 + 10 * gain}})
        gc.collect()
        return len(gc.get_objects())

    before = objects(np.linspace(2.0, 3.0, 70).tolist())
    assert objects(np.linspace(3.0, 4.0, 30).tolist()) - before < 60


def test_machine_code_is_kept_of_the_latest_structures_alone(monkeypatch):
    monkeypatch.setattr(object_cache._RECENT, "room", 0)
    session = Session(load_live(EXPERIMENTS / "position_mpc.toml"))

    def looked_at(horizons):
        """The libraries that are in memory then."""
        before = set(object_cache._LOADED)
        for horizon in horizons:  # [ms]
            session.view({**ASKED, "controller": "mpc", "numbers": {"horizon": horizon}})
        gc.collect()
        return set(object_cache._LOADED) - before

    looked_at([10])  # what every horizon needs
    first = looked_at(range(11, 15))
    assert len(first) >= 4
    for latest in (kernel._code, kernel._graph):
        assert latest.cache_info().maxsize <= 64
        latest.cache_clear()
    for kept in (law._FILLED, law._SHARED):
        monkeypatch.setattr(kept, "room", 0)
    looked_at(range(15, 19))
    assert not first & set(object_cache._LOADED)


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_laws_of_a_hundred_states_are_kept_as_far_as_they_find_room():
    session, most = Session(load_live(EXPERIMENTS / "benchmark.toml")), []
    for delay in (80, 79, 78, 77, 76, 75):  # [ms], each of them a state
        session.view({"controller": "lqg", "scenario": "position-10mm", "numbers": {"delay": delay}, "rig": {}})
        most.append(resident())
    assert most[-1] - most[2] < 10  # MB; each has 15


class AtRandom:
    """Requests of a page on which everything is moved."""

    def __init__(self, session, seed):
        self.random, self.start = Random(seed), session.start()

    def number(self, slider):
        low, high = slider["low"], slider["high"]
        if self.random.random() < 0.1:
            return self.random.choice(slider["bounds"])
        if not slider["log"] or not low:
            return low if self.random.random() < 0.3 else self.random.uniform(low, high)
        return min(max(low * (high / low) ** self.random.random(), low), high)

    def numbers(self, sliders, most):
        moved = self.random.sample(sliders, self.random.randint(0, min(most, len(sliders))))
        return {slider["name"].removeprefix("rig."): self.number(slider) for slider in moved}

    def request(self):
        name = self.random.choice(list(self.start["controllers"]))
        return {
            "controller": name,
            "scenario": self.random.choice(self.start["scenarios"]),
            "amplitude": self.random.choice(self.start["amplitudes"]),
            "numbers": self.numbers(self.start["controllers"][name], 4),
            "rig": self.numbers(self.start["rigSliders"], 4),
        }


def resident():
    """Memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_memory_is_bounded_whatever_is_moved():
    """FUZZ_LIVE: how many requests, with machine code for other structures among them."""
    requests = int(os.environ.get("FUZZ_LIVE", "0"))
    session = Session(load_live(EXPERIMENTS / "benchmark.toml" if requests else STEP))
    page, most = AtRandom(session, 59), []
    for k in range(requests or 200):
        answer = session.after if requests and k % 50 == 0 else session.view
        with suppress(InputError):  # the rig that was asked for is none
            answer(page.request())
        most.append(resident())
    assert most[-1] - most[len(most) // 4] < (150 if requests else 30)  # MB


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"controller": "lqg"}, "no controller"),
        ({"numbers": {"gain": 1e9}}, "gain"),
        ({"numbers": {"gain": "much"}}, "must be a number"),
        ({"numbers": {"gian": 1.0}}, "gian"),
        ({"rig": {"M": -1}}, "mass"),
        ({"rig": {"A": 1}}, '"A"'),
        ({"numbers": [1]}, "table"),
    ],
)
def test_a_wrong_request_is_refused_in_a_line(session, change, word):
    with pytest.raises(InputError, match=word):
        session.view({**ASKED, **change})


def test_a_tune_experiment_gives_its_ranges_and_goals():
    config = load_live(EXPERIMENTS / "tune_p_dp.toml")
    gain = design_sliders(config, config.steps.controllers[0])[0]
    assert (gain.low, gain.high, gain.unit, gain.log) == (2, 10, "1/m", False)
    assert config.limits.ms == 2.15
    assert list(config.rigs) == ["nominal", "mass-50", "mass+50", "beta-50", "supply-20"]


def test_a_slider_can_go_to_its_ends():
    config = load_live(EXPERIMENTS / "benchmark.toml")
    for spec in config.steps.controllers:
        for slider in design_sliders(config, spec):
            for end in slider.bounds:
                with_number(spec, slider.path, end, slider.unit)


def test_a_bench_gives_its_position_loops():
    config = load_live(EXPERIMENTS / "benchmark.toml")
    assert config.steps.signal.name == "position"
    assert "crone1" in {spec.name for spec in config.steps.controllers}


@pytest.mark.parametrize("name", ["position_step", "tune_p_dp", "benchmark"])
def test_what_is_saved_is_taken_by_run(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    session = Session(load_live(EXPERIMENTS / f"{name}.toml"))
    asked = {**ASKED, "rig": {"M": 1200, "position": 50}, "name": "mine", "moved": {"p-dp": {"gain": 3.25}}}
    assert session.save(asked) == {"files": ["mine-rig.toml", "mine.toml"]}
    saved = load_steps(tmp_path / "mine.toml")
    assert next(c for c in saved.controllers if c.name == "p-dp").design.gain == 3.25
    assert saved.rig["M"] == 1200
    assert (saved.scenarios[0].name, saved.scenarios[0].start, saved.scenarios[0].size) == (
        "position-10mm-at+50mm",
        0.05,
        -0.01,
    )
    with pytest.raises(InputError, match="exists already"):
        session.save(asked)


@pytest.mark.parametrize("name", ["", "../mine", "/tmp/mine", "a/b", "x" * 65, ".hidden", "mine.toml", "a\nb"])
def test_a_name_is_no_path(session, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="name: use"):
        session.save({**ASKED, "name": name, "moved": {}})
    assert not list(tmp_path.iterdir())
