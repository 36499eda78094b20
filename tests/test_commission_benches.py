"""Commissioning on rigs that are not jack-10t as its file has it: tight limits, coarse sensors, missing channels."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from made_links import at, served

from experiments.studies.commission.benches import OTHERS, datasheet_of
from experiments.studies.commission.plan import hidden_rig, other_plan
from workbench.base.checkpoint import no_checkpoint
from workbench.commands.commission.study import looks
from workbench.control.automatic_tuning import MOVE, Mode, SmallMoves, gains
from workbench.control.controller_type import controller
from workbench.link.bench import bench
from workbench.link.client import LinkClient
from workbench.link.commissioning import designs
from workbench.link.commissioning.allowed import allowed, doubted
from workbench.link.commissioning.designs import exactly, searched_designs
from workbench.link.commissioning.growth import safe_growth
from workbench.link.commissioning.obstacles import Barred
from workbench.link.commissioning.relay import GROWTH, WAY, check_sides, relay_ways
from workbench.link.commissioning.rig_time import RigTime
from workbench.link.commissioning.verify import Way, hidden_step, played_way
from workbench.link.joined import joined
from workbench.loop.automatic import automatic, small_way
from workbench.loop.rows import judge, linear_loops, loop_setup
from workbench.loop.scenarios import SCENARIOS
from workbench.rigs.number import Number
from workbench.rigs.rig_file import load_rig

RIG = load_rig("jack-10t")


def within(bar):
    """The rig with chambers that may have less."""
    pressure = Number("pressure", bar * 1e5, "Pa", "Pa", "")
    return replace(RIG, limits={**RIG.limits, "pressure": pressure})


def test_other_benches_are_served_as_they_are_said_to_be():
    for number, (name, other) in enumerate(OTHERS.items()):
        plan, datasheet = other_plan(number, 1), datasheet_of(name)
        live = hidden_rig(datasheet, plan)
        assert plan.id == name
        assert live.sensors.keys() == datasheet.sensors.keys() - set(other.lacks)
        assert live.period.value == (other.period or datasheet.period.value)
        assert all(live.limit(limit) == value for limit, value in other.limits.items())
        assert any(live[each.name] != each.value for each in datasheet.numbers.values())
        assert not any(number.uncertain for number in live.numbers.values())


SWING = {"both pressures": (), "a pressure and the acceleration": ("pb",), "nothing": ("pa", "pb", "acceleration")}
FED_BACK = {"both pressures": {"pa", "pb"}, "a pressure and the acceleration": {"acceleration"}, "nothing": set()}


def found_for(rig, law, tried, monkeypatch):
    """The controller that is searched for a rig in a few trials."""
    monkeypatch.setattr(designs, "DESIGNS", tried)
    return searched_designs(exactly(rig), law, "found", "position-10mm", no_checkpoint, lambda _: None, 1)[0][0]


@pytest.mark.parametrize("measured", SWING)
def test_a_searched_controller_feeds_back_what_is_measured_of_the_swing(measured, monkeypatch):
    sensors = {name: sensor for name, sensor in RIG.sensors.items() if name not in SWING[measured]}
    rig = replace(RIG, sensors=sensors)
    law = found_for(rig, automatic(rig, SmallMoves(11.0, 0.003, None)), 2, monkeypatch)
    assert set(law.build(rig.period.value).measures) == {"position"} | FED_BACK[measured]


def test_acceleration_damps_a_jack_of_one_pressure_so_that_it_settles(monkeypatch):
    """Without it the mode, damped by 3 %, allows a gain that leaves the jack on its way after a second."""
    rig = replace(RIG, sensors={name: sensor for name, sensor in RIG.sensors.items() if name != "pb"})
    law = found_for(rig, automatic(rig, SmallMoves(11.0, 0.003, None)), 8, monkeypatch)
    setup = loop_setup(rig)
    settling = judge(law, SCENARIOS["position-10mm"], setup, linear_loops(law, setup), None)[1]["settling_s"]
    assert settling < 0.3


def test_a_search_from_a_large_gain_stays_within_what_its_controller_takes():
    """A slow jack with a fast mode asks for a gain near the largest, about which the search goes."""
    law = controller("controllers.p:P", gain=900.0) + controller("controllers.pressure:PressureFeedback", gain=5e-7)
    bounds = designs._searched(law)
    assert [number.high for number in bounds] == [1000.0, 1e-6]
    gain, _ = gains(SmallMoves(0.09, 0.003, Mode(60.0, 0.3, 1e7, 0.5)))
    assert gain == 1000.0


def test_a_relay_grows_as_slowly_as_tight_limits_ask_for():
    """A command that grows half as fast swings the chambers by the root of it, the supply's half of 105 bar aside."""
    assert safe_growth(allowed(doubted(RIG)), MOVE) == GROWTH
    slower = safe_growth(allowed(doubted(within(150))), MOVE)
    assert GROWTH / 6 < slower < GROWTH / 2
    with served(bench(within(150), True)) as server, LinkClient(at(server)) as client:
        spent = RigTime(client, doubted(joined(RIG, client.hello)), 600.0, no_checkpoint)
        record = spent.relay(MOVE, 0.0, partial(check_sides, RIG), blind=True, growth=slower)
        assert server.trips == 0
        assert not spent.trips
    assert 115e5 < max(record.signals[name].max() for name in ("pa", "pb")) < 0.95 * 150e5


def test_limits_that_leave_no_room_for_small_moves_are_named_before_anything_moves():
    with served(bench(within(120), True)) as server, LinkClient(at(server)) as client:
        rig = doubted(joined(RIG, client.hello))
        spent = RigTime(client, rig, 600.0, no_checkpoint)
        with pytest.raises(Barred, match=r"no room for moves of 1 mm.*bar of 120 bar \(the live rig's hello\)"):
            looks(spent, allowed(rig), lambda _: None)
        assert server.trips == 0
        assert [each["record"] for each in spent.log] == ["static"]


def test_a_step_that_noise_hides_is_not_played_and_has_no_settling():
    """Three standard deviations of this sensor are 1.2 mm: a jack that stands still is settled."""
    rig = load_rig("festo-tp511")
    why = hidden_step(rig, SCENARIOS["position-1mm"])
    assert why is not None
    assert "within 1.2 mm" in why
    assert hidden_step(rig, SCENARIOS["position-10mm"]) is None
    assert hidden_step(RIG, SCENARIOS["position-1mm"]) is None
    with served(bench(rig, True)) as server, LinkClient(at(server)) as client:
        spent = RigTime(client, doubted(rig), 600.0, no_checkpoint)
        way = Way(automatic(rig, SmallMoves(0.5, 0.02, None)), allowed(exactly(doubted(rig))))
        assert not played_way(spent, "found", way, ("position-1mm",), lambda _: None)
    assert spent.smaller == [{"way": "found", "scenario": "position-1mm", "size": None, "why": why}]
    assert not spent.log


def test_small_moves_are_larger_than_the_noise_of_a_coarse_sensor_which_would_turn_them():
    """At 1 mm, 2.5 standard deviations of this sensor, speeds over commands were 0.5 to 420 m/s."""
    rig = load_rig("festo-tp511")
    way = small_way(rig)
    assert way == pytest.approx(20 * rig.sensors["position"].noise)
    assert small_way(RIG) == MOVE < WAY
    gains = []
    for seed in range(3):
        with served(bench(rig, True), seed=seed) as server, LinkClient(at(server)) as client:
            spent = RigTime(client, doubted(rig), 600.0, no_checkpoint)
            ways = relay_ways(spent.relay(way, 0.0, partial(check_sides, rig), blind=True))
            assert server.trips == 0
        assert ways is not None
        gains.append(ways.speed / ways.command)
    np.testing.assert_allclose(gains, np.mean(gains), rtol=0.03)
