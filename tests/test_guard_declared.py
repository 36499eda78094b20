"""Rules of the guard that act where a rig declares them: following error, deadline; and signals that are lost."""

import re
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.commands.run.options import load_config
from workbench.control.controller_type import controller
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.linear.equilibria import equilibria
from workbench.loop.batch import play_lanes
from workbench.loop.faults import FAULTS, Fault, FaultyLoop
from workbench.loop.guard_numbers import guard_numbers, guard_shape
from workbench.loop.guarded_controller import Guard
from workbench.loop.sampled_loop import SampledLoop
from workbench.loop.sensors import Sensors
from workbench.plant import build
from workbench.plant.effects import LIBRARY, applies, find
from workbench.rigs import schema
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig, rig_text

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
SPECS = {spec.name: spec for spec in load_config(EXPERIMENTS / "position_tuned.toml").controllers}
PERIOD = 1e-3
RAMP = 0.5 * PERIOD * np.arange(600)  # m: half a metre a second
ASTRAY = "the position was off its reference by more than 50 mm for 20 ms"
ENGINE = Engine(build(load_rig("jack-10t")))
REST = equilibrium(ENGINE.plant)


def following(limit: float):
    """The rig with a limit [m] of the following error."""
    rig = load_rig("jack-10t")
    return replace(rig, limits={**rig.limits, "following_error": Number("following_error", limit, "m", "m", "")})


def stuck():
    """The engine of the rig with a torque motor that moves nothing, so that the spool stays at null."""
    return Engine(replace(ENGINE.plant, p=ENGINE.plant.parameter_values(Km=1e-6)))


@pytest.mark.parametrize("seed", [None, 1])
@pytest.mark.parametrize("compiled", [False, True])
def test_a_stuck_valve_is_a_following_error_once_it_has_lasted(seed, compiled):
    loop = SampledLoop(stuck(), following(0.05), SPECS["p-dp"].build(PERIOD), REST, seed, compiled=compiled)
    run = loop.run(RAMP)
    signals = run.record.signals
    assert run.tripped == ASTRAY
    beyond = int(np.argmax(signals["reference"] - signals["position"] > 0.05))
    stopped = 1 + int(np.flatnonzero(run.demanded).max())
    assert abs(stopped - (beyond + schema.FOLLOWING_TIME / PERIOD)) <= 2


def test_a_stuck_valve_is_a_following_error_of_a_law_in_lanes_too():
    p = np.tile(stuck().plant.p, (2, 1))
    points = equilibria(ENGINE.plant, p, np.zeros(2))
    ((_, lanes),) = play_lanes(ENGINE, following(0.05), SPECS["mpc"].build(PERIOD), points, p, RAMP, ("position",), 1)
    assert [lanes.why(lane) for lane in range(2)] == ["following", "following"]


def test_a_stuck_valve_is_no_following_error_where_no_limit_is_declared():
    run = SampledLoop(stuck(), load_rig("jack-10t"), SPECS["p-dp"].build(PERIOD), REST, 1).run(RAMP)
    assert run.tripped is None


@pytest.mark.parametrize("name", SPECS)
def test_no_shipped_loop_trips_on_a_step_below_the_declared_limit(name):
    run = SampledLoop(ENGINE, following(0.11), SPECS[name].build(PERIOD), REST, 1).run(np.full(600, 0.1))
    assert run.tripped is None


def test_an_error_that_does_not_last_is_none():
    run = SampledLoop(ENGINE, following(0.05), SPECS["p"].build(PERIOD), REST, 1)
    short = round(schema.FOLLOWING_TIME / PERIOD) - 1
    assert run.run(np.where(np.arange(200) < short, 0.06, 0.0)).tripped is None


def test_a_force_loop_has_no_following_error():
    spec = load_config(EXPERIMENTS / "force_tuned.toml").controllers[0]
    rig = following(1e-3).with_values(ks=1e7, cs=1e3)
    engine = Engine(build(rig))
    assert (
        SampledLoop(engine, rig, spec.build(PERIOD), equilibrium(engine.plant), 1).run(np.full(300, 5e3)).tripped
        is None
    )


class Slow:
    """A controller whose k-th `compute` takes times[k] s, on a clock of its own; 0 after the last."""

    measures = ("position",)

    def __init__(self, times):
        self.times, self.clock = list(times), 0.0

    def reset(self, reference, measurement, command):
        pass

    def compute(self, reference, measurement):
        self.clock += self.times.pop(0) if self.times else 0.0
        return 0.1

    def update(self, realised):
        pass


def burn(seconds):
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        pass


class ClockedLoop(SampledLoop):
    """A loop on the clock of its controller."""

    def _now(self):
        return round(self._controller.clock * 1e9)


def with_deadline(deadline: float):
    return replace(load_rig("jack-10t"), deadline=Number("deadline", deadline, "ms", "s", ""))


def clocked(rig, times):
    return ClockedLoop(ENGINE, rig, Slow(times), REST).run(np.zeros(20))


def test_a_controller_that_misses_its_deadline_trips():
    run = clocked(with_deadline(8e-4), [0.5, 7e-4, 8e-4, 1.25e-3])
    assert run.tripped == "the controller missed its deadline of 0.8 ms: it took 1.25"
    commands = run.record.signals["command"]
    assert commands[2] == pytest.approx(0.1)
    assert np.all(commands[5:] == 0)


@pytest.mark.parametrize("times", [[0.5], [8e-4] * 20])  # the first sample may take any time
def test_a_controller_in_time_does_not_trip(times):
    assert clocked(with_deadline(8e-4), times).tripped is None


@pytest.mark.parametrize(("waits", "trips"), [(time.sleep, False), (burn, True)])
def test_a_deadline_bounds_computing_not_the_clock_of_a_busy_machine(waits, trips):
    """A simulation that another process holds up for 50 ms has computed nothing."""

    class Waiting(Slow):
        def compute(self, reference, measurement):
            waits(0.05)
            return 0.1

    run = SampledLoop(ENGINE, with_deadline(2e-2), Waiting([]), REST).run(np.zeros(3))
    assert ("missed its deadline" in (run.tripped or "")) == trips


def test_without_a_deadline_any_time_will_do():
    assert clocked(load_rig("jack-10t"), [0.1] * 20).tripped is None


def test_the_fault_of_a_late_controller_is_seen_where_a_deadline_is_declared():
    fault = next(fault for fault in FAULTS if fault.computes)
    for rig in (with_deadline(1e-3), load_rig("jack-10t")):
        loop = FaultyLoop(ENGINE, rig, SPECS["p-dp"].build(PERIOD), REST, 1, fault, lambda k, _: k >= 30)
        run = loop.run(np.full(100, 0.01))
        if rig.deadline:
            assert loop.tripped_at == loop.began == 30
            assert "missed its deadline of 1 ms: it took 20" in (run.tripped or "")
        else:
            assert "deadline" not in (run.tripped or "")


def test_declared_limits_are_read_and_written(tmp_path):
    rig = replace(following(0.05), deadline=with_deadline(8e-4).deadline)
    (tmp_path / "mine.toml").write_text(rig_text(rig))
    again = load_rig(tmp_path / "mine.toml")
    assert again.limits["following_error"].value == 0.05
    assert again.deadline == rig.deadline
    (tmp_path / "mine.toml").write_text(rig_text(rig).replace("following_error", "folowing_error"))
    with pytest.raises(InputError, match='unknown key; did you mean "following_error"'):
        load_rig(tmp_path / "mine.toml")


@pytest.mark.parametrize(("share", "trip"), [(None, "the position signal does not move"), (1.2, "")])
def test_a_jack_that_an_overlap_holds_is_a_fault_unless_its_flow_may_be_another(share, trip):
    rig = load_rig("jack-10t")
    if share is not None:
        rig = replace(rig, limits={**rig.limits, "flow_error": Number("flow_error", share, "1", "1", "")})
    held = Engine(build(rig, also=[find("main.deadband", "lap")]))
    law = controller("controllers.p:P", gain=0.5).build(PERIOD)
    run = SampledLoop(held, rig, law, REST, 1).run(np.full(400, 0.02))
    assert (run.tripped or "").startswith(trip)
    assert (run.tripped is None) == (not trip)


def declaring(effect, formula, **numbers):
    """A rig whose file declares an effect without its numbers, or with some, and a loop of it that is slow."""
    given = {name: Number(name, value, "1", "1", "") for name, value in numbers.items()}
    rig = replace(load_rig("jack-10t"), effects=(EffectUse(effect, formula, given),))
    law = controller("controllers.p:P", gain=0.24).build(PERIOD)
    return Engine(build(rig)), rig, law, equilibrium(build(rig)), 1


FIRST = {each.name: each for each in reversed(LIBRARY) if applies(each, load_rig("jack-10t"))}


@pytest.mark.parametrize("effect", FIRST.values(), ids=FIRST.keys())
def test_no_declared_effect_at_typical_strength_trips_a_slow_loop(effect):
    """The first formula of each name."""
    assert SampledLoop(*declaring(effect.name, effect.formula)).run(np.full(400, 0.02)).tripped is None


@pytest.mark.parametrize("formula", ["lumped", "turbulent"])
@pytest.mark.parametrize("step", [0.1, 0.2])
def test_a_hose_between_pressures_and_chambers_is_no_disagreement_but_a_wrong_pressure_is(formula, step):
    loop = declaring("line.hose", formula)
    assert SampledLoop(*loop).run(np.full(600, step)).tripped is None
    wrong = Fault("wrong", "pa", readings=lambda y, _: y | {"pa": y["pa"] + 6e6})
    faulty = FaultyLoop(*loop, wrong, lambda k, _: k >= 300)
    assert faulty.run(np.full(600, step)).tripped == "force, pressures and acceleration do not agree"
    assert faulty.tripped_at < 450


def test_every_key_of_the_guard_is_in_the_table_of_the_documents(tmp_path):
    section = (EXPERIMENTS.parent / "docs/results/guard.md").read_text()
    rows = dict(re.findall(r"^\| `(\w+)` in `\[(?:limits|control)\]`(, optional)? \|", section, re.MULTILINE))
    assert rows.keys() == {*schema.LIMITS, "stop", "deadline"}
    optional = {*schema.OPTIONAL} & {*schema.LIMITS} | {"stop", "deadline"}
    assert {key for key, is_optional in rows.items() if is_optional} == optional
    assert all(f'`"{stop}"`' in section for stop in schema.STOPS)
    assert f"for {schema.FOLLOWING_TIME * 1e3:g} ms" in section
    for key, optional in rows.items():
        lines = rig_text(load_rig("jack-10t")).splitlines()
        (tmp_path / "mine.toml").write_text("\n".join(line for line in lines if not line.startswith(f"{key} = ")))
        if optional:
            load_rig(tmp_path / "mine.toml")
        else:
            with pytest.raises(InputError, match=key):
                load_rig(tmp_path / "mine.toml")


# signals that are lost


@pytest.mark.parametrize("samples", [1, 3, 10])
@pytest.mark.parametrize("broken", [{"position": np.nan}, {}], ids=["not a number", "missing"])
def test_a_single_sample_without_a_number_trips(rig, broken, samples):
    guard = Guard(rig, noisy=True)
    guard.watch({"position": 0.0})
    for _ in range(samples):
        guard.watch(broken)
    guard.watch({"position": 0.0})
    assert guard.tripped == ("the position signal is not finite" if broken else "the position signal is lost")


class Lossy:
    """Normal numbers of which those of a sensor are none for some samples."""

    def __init__(self, normal, sensors, of, samples):
        self.normal, self.width, self.of, self.samples, self.drawn = normal, len(sensors.names), of, samples, 0

    def standard_normal(self, shape):
        draws = np.reshape(self.normal.standard_normal(shape), (-1, self.width))
        rows = self.drawn + np.arange(len(draws))
        self.drawn += len(draws)
        draws[(rows >= self.samples.start) & (rows < self.samples.stop), self.of] = np.nan
        return draws.reshape(shape)


@pytest.mark.parametrize("samples", [1, 3, 10])
@pytest.mark.parametrize("signal", ["position", "pa", "force"])
def test_a_reading_that_is_no_number_trips_by_its_name_compiled_as_in_python(signal, samples):
    runs = []
    for compiled in (False, True):
        loop = SampledLoop(ENGINE, load_rig("jack-10t"), SPECS["p-dp"].build(PERIOD), REST, 1, compiled=compiled)
        sensors: Sensors = loop._sensors
        place = sensors.names.index(signal)
        sensors._random = Lossy(sensors._random, sensors, place, range(50, 50 + samples))
        runs.append(loop.run(np.full(200, 0.1)))
    python, compiled = runs
    assert python.tripped == compiled.tripped == f"the {signal} signal is not finite"
    assert 48 <= int(np.flatnonzero(python.demanded).max()) <= 50
    np.testing.assert_allclose(python.demanded, compiled.demanded, rtol=1e-6, atol=1e-9)


def held_for(samples: int) -> Fault:
    """A position that repeats for some samples, then goes on."""
    return Fault(
        "held", "position", readings=lambda y, f: y | {"position": f.began["position"]} if f.k < samples else y
    )


@pytest.mark.parametrize("step", [0.002, 0.02, 0.1, 0.2])
@pytest.mark.parametrize("samples", [1, 3, 10])
@pytest.mark.parametrize("seed", [None, 1])
def test_readings_that_repeat_on_the_way_are_bridged_or_called_lost(step, samples, seed):
    start = equilibrium(ENGINE.plant, position=-step / 2)

    def due(_, y):
        return y["position"] > 0

    rig = load_rig("jack-10t")
    loop = FaultyLoop(ENGINE, rig, SPECS["p-dp"].build(PERIOD), start, seed, held_for(samples), due)
    run = loop.run(np.full(500, step / 2))
    lost = "the position signal is lost: it stood still while the jack moved"
    assert run.tripped == (lost if samples > 1 and step >= 0.1 else None)


@pytest.mark.parametrize(
    ("effect", "formula", "name", "told", "si"),
    [
        ("drive.delay", "shift", "delay", (1.7, "ms"), (1.7e-3, "s")),
        ("jack.friction", "coulomb", "Fc", (2.0, "kN"), (2000.0, "N")),
        ("main.deadband", "lap", "overlap", (3.0, "%"), (0.03, "1")),
    ],
)
def test_numbers_of_effects_count_in_the_units_of_their_file(effect, formula, name, told, si):
    rig = load_rig("jack-10t")
    shape = guard_shape(rig, tuple(rig.sensors), ("position",))

    def numbers(*of):
        """Of the guard, where a file has the number as it is read from there."""
        uses = [EffectUse(effect, formula, {name: Number(name, value, unit, unit, "")}) for value, unit in of]
        return guard_numbers(replace(rig, effects=tuple(uses)), shape, ("position",), True)

    changed = {key for key, value in numbers(si).items() if not np.array_equal(value, numbers()[key])}
    assert changed
    assert all(numbers(told)[key] == pytest.approx(numbers(si)[key]) for key in changed)
