"""What the guard makes of faults: it brakes within the stroke, sees signals that lie, and does so compiled alike."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.commands.run.options import load_config
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.loop.faults import FAULTS, FaultyLoop
from workbench.loop.guarded_controller import Guard
from workbench.loop.rig_variations import with_delay
from workbench.loop.sampled_loop import SampledLoop
from workbench.plant import build
from workbench.rigs.rig_file import load_rig, rig_text

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
SPECS = {spec.name: spec for spec in load_config(EXPERIMENTS / "position_tuned.toml").controllers}
PERIOD = 1e-3


@pytest.fixture(scope="module")
def late():
    """The rig with its computing delay, and its engine."""
    rig = with_delay(load_rig("jack-10t"), 3e-4)
    return rig, Engine(build(rig))


def runaway(late, position, command, seed=1, compiled=False, steps=500):
    """A loop with a command added to its own that takes it to +-1 whatever it demands."""
    rig, engine = late
    start = equilibrium(engine.plant, position=position)
    loop = SampledLoop(engine, rig, SPECS["p"].build(PERIOD), start, seed, compiled=compiled)
    return loop.run(np.full(steps, position), added=np.full(steps, 100.0 * command))


@pytest.mark.parametrize("position", [-0.2, 0.0, 0.1, 0.2])
@pytest.mark.parametrize("command", [1.0, -1.0])
def test_a_runaway_stands_before_the_end_stop(late, position, command):
    run = runaway(late, position, command)
    signals = run.record.signals
    assert np.abs(signals["position"]).max() < 0.25
    assert np.abs(signals["velocity"]).max() < 1.1 * 5
    assert (run.tripped or "").startswith(("too fast to stop within +-240 mm", "speed above 5 m/s"))


@pytest.mark.parametrize("seed", [None, 4])
@pytest.mark.parametrize("position", [0.0, 0.15])
def test_a_runaway_is_braked_compiled_as_in_python(late, position, seed):
    python, compiled = (runaway(late, position, 1.0, seed, way) for way in (False, True))
    assert python.tripped == compiled.tripped is not None
    for name, size in (("position", 0.1), ("command", 1.0)):
        was, now = python.record.signals[name], compiled.record.signals[name]
        assert np.abs(was - now).max() <= 1e-6 * size


def played(late, name, controller="p-dp", step=0.1):
    """A fault that begins when a tenth of a step is done."""
    rig, engine = late
    fault = next(fault for fault in FAULTS if fault.name == name)

    def due(_, y):
        return y["position"] > step / 10

    start = equilibrium(engine.plant)
    loop = FaultyLoop(engine, rig, SPECS[controller].build(PERIOD), start, 1, fault, due)
    return loop, loop.run(np.full(500, step))


SEEN = {
    "position frozen": 12, "position frozen with noise": 20, "position reversed": 10, "position x 2": 20,
    "position x 0.5": 40, "position lost": 0, "position not a number": 0, "position jumps by 20 mm": 0,
    "position ten lost samples": 11, "force frozen": 12, "pa frozen": 10, "pa and pb swapped": 20,
    "controller raises": 0, "controller returns None": 0, "controller demands +1": 60,
}  # fmt: skip


@pytest.mark.parametrize("name", SEEN)
def test_a_fault_on_the_way_is_detected_in_time_and_ends_within_the_stroke(late, name):
    loop, run = played(late, name)
    assert run.tripped is not None
    assert loop.tripped_at is not None
    assert loop.began is not None
    assert 0 <= loop.tripped_at - loop.began <= SEEN[name]
    assert np.abs(run.record.signals["position"]).max() < 0.25


def test_without_pressures_a_position_with_a_wrong_scale_is_not_seen(late):
    rig, engine = late
    blind = replace(rig, sensors={name: rig.sensors[name] for name in ("position", "force")})
    loop, run = played((blind, engine), "position x 2", "p")
    assert loop.began is not None
    assert run.tripped is None


def test_lost_samples_are_named_as_such(rig):
    guard = Guard(rig, noisy=True)
    for reading in (0.0, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 0.02):
        guard.watch({"position": reading})
        guard.limit(0.0)
    assert guard.tripped == "the position signal is lost: it stood still while the jack moved"


def test_noise_free_signals_that_stand_still_are_no_fault(rig, engine, rest):
    run = SampledLoop(engine, rig, SPECS["p"].build(PERIOD), rest).run(np.zeros(300))
    assert run.tripped is None


def test_ten_minutes_of_rest_with_noise_do_not_trip(late):
    rig, engine = late
    loop = SampledLoop(engine, rig, SPECS["p-dp"].build(PERIOD), equilibrium(engine.plant, position=0.216), 3)
    assert loop.compiled
    for _ in range(10):
        assert loop.run(np.full(60_000, 0.216)).tripped is None


def test_a_jack_that_is_to_be_held_stays_where_it_stopped(late):
    rig, engine = late
    places = {}
    for stop in ("close", "hold"):
        held = replace(rig, stop=stop)
        loop = SampledLoop(engine, held, SPECS["p"].build(PERIOD), equilibrium(engine.plant), 1, compiled=False)
        added, force = np.where(np.arange(4000) < 300, 100.0, 0.0), np.where(np.arange(4000) < 800, 0.0, 2e4)
        run = loop.run(np.zeros(4000), {"disturbance": force}, added)
        assert run.tripped is not None
        position = run.record.signals["position"]
        places[stop] = position[-200:].mean() - position[600:800].mean()
    assert abs(places["hold"]) < 0.3 * abs(places["close"])


def test_a_rig_says_how_it_stops(tmp_path):
    rig = replace(load_rig("jack-10t"), stop="hold")
    (tmp_path / "mine.toml").write_text(rig_text(rig))
    assert load_rig(tmp_path / "mine.toml").stop == "hold"
    (tmp_path / "mine.toml").write_text(rig_text(rig).replace('"hold"', '"depressurise"'))
    with pytest.raises(InputError, match="stop: write \\[shut_off\\] for a valve that does it; possible: close, hold"):
        load_rig(tmp_path / "mine.toml")
