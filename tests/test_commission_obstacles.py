"""Where a commissioning must say no: what stands in the way, what it costs, what to mend or record."""

from dataclasses import replace

import numpy as np
import pytest
from made_links import at, served

from workbench.base.checkpoint import no_checkpoint
from workbench.commands.commission.study import looks
from workbench.control.controller_type import controller
from workbench.link.bench import bench
from workbench.link.client import LinkClient
from workbench.link.commissioning.allowed import allowed, doubted
from workbench.link.commissioning.designs import exactly
from workbench.link.commissioning.obstacles import obstacles, told
from workbench.link.commissioning.relay import with_dither
from workbench.link.commissioning.rig_time import RigTime
from workbench.link.commissioning.verify import Way, played_way
from workbench.link.course import rest_record
from workbench.loop.automatic import automatic
from workbench.loop.drive_simulation import drive
from workbench.loop.standard_records import standard_set
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

RIG, GOAL = load_rig("jack-10t"), "position-10mm"
LAW = controller("controllers.p:P", gain=0.2)


def with_gain(law, gain):
    return replace(law, design=replace(law.design, gain=gain))


def lacks(name, formula, **numbers):
    """The rig with an effect that its datasheet does not declare."""
    declared = {key: Number(key, value, unit, unit, "made") for key, (value, unit) in numbers.items()}
    use = EffectUse(name, formula, declared)
    return replace(RIG, effects=(use,))


def met(truth, law, waves=(), scenarios=(GOAL,)):
    """What a served rig answers: the goal's step by a law, the rig at rest, and excitations."""
    with served(bench(truth, True)) as server, LinkClient(at(server), "") as client:
        spent, rest = RigTime(client, RIG, 600.0, no_checkpoint), rest_record(client, RIG)
        records = [spent.played(wave, LAW, "excitation") for wave in waves]
        judged = played_way(spent, "found", Way(law, allowed(exactly(RIG))), scenarios, lambda _: None)
        assert server.trips == 0
    return judged, rest, records


def test_a_rig_that_rests_says_nothing():
    law = LAW + controller("controllers.pressure:PressureFeedback", gain=1e-9, corner=0.25)
    judged, rest, _ = met(RIG, with_gain(law, 2.0))
    assert judged[0].row["settling_s"] is not None
    assert obstacles(judged, GOAL, "none", (), rest, [], None) == []


def test_nothing_larger_is_played_after_a_step_that_did_not_settle():
    judged, _, _ = met(lacks("pilot.hysteresis", "play", r=(4e-4, "A")), LAW, scenarios=(GOAL, "position-100mm"))
    assert [each.scenario.name for each in judged] == [GOAL]


@pytest.mark.parametrize(
    ("effects", "mend"), [(("pilot.hysteresis",), "the pilot stage"), ((), "record small moves one after the other")]
)
def test_a_pilot_with_hysteresis_keeps_the_jack_from_resting_and_the_cause_is_told(effects, mend):
    judged, rest, _ = met(lacks("pilot.hysteresis", "play", r=(4e-4, "A")), LAW)
    (barred,) = obstacles(judged, GOAL, "named" if effects else "unknown", effects, rest, [], None)
    assert "brings the jack to rest" in barred.what
    assert all(name in barred.what for name in effects)
    assert mend in barred.mend
    (untraced,) = obstacles(judged, GOAL, "", (), rest, [], None)
    assert "no trace of the records was finished" in untraced.what
    assert "do not say why" not in untraced.what
    assert float(barred.costs.split()[0]) > 5.0  # mm: the command of a slow loop stays within the hysteresis


def test_a_valve_that_stays_open_is_freed_by_a_dither_and_told_with_what_it_costs():
    """Without it this jack sticks, or goes on to the end of its stroke between two moves."""
    said = []
    with served(bench(lacks("pilot.hysteresis", "play", r=(4e-4, "A")), True)) as server:
        with LinkClient(at(server), "") as client:
            spent = RigTime(client, doubted(RIG), 600.0, no_checkpoint)
            rest, moves = looks(spent, allowed(doubted(RIG)), said.append)
            law = with_dither(automatic(RIG, moves), spent.dither)
            judged = played_way(spent, "found", Way(law, allowed(exactly(RIG))), (GOAL,), lambda _: None)
        assert server.trips == 0
    assert judged[0].row["settling_s"] < 0.2
    (barred,) = obstacles(judged, GOAL, "unknown", (), rest, [], spent.dither)
    assert "stays open" in barred.what
    assert "torque motor" in barred.mend
    assert f"{100 * spent.dither.amplitude:.2g} % at 250 Hz" in barred.costs
    assert barred.costs.split("dither of ")[1].split(" on")[0] in said[-1]


def test_no_valve_that_closes_has_a_dither():
    with served(bench(RIG, True)) as server, LinkClient(at(server), "") as client:
        spent = RigTime(client, doubted(RIG), 600.0, no_checkpoint)
        looks(spent, allowed(doubted(RIG)), lambda _: None)
        assert spent.dither is None


def test_effects_that_no_record_tells_apart_are_told_with_what_the_controller_of_the_first_one_does():
    judged, rest, _ = met(RIG, with_gain(LAW, 0.4))
    (barred,) = [
        each
        for each in obstacles(judged, GOAL, "tied", ("drive.lag", "drive.delay"), rest, [], None)
        if "apart" in each.what
    ]
    assert "drive.lag and drive.delay" in barred.what
    assert "jackbench plan" in barred.mend


def test_a_supply_that_sags_under_a_larger_motion_is_told_with_the_flow_that_it_costs():
    (steps,) = [wave for name, wave in standard_set(drive(RIG)).items() if name == "steps"]
    plain = met(RIG, LAW, [steps])
    assert not [each for each in obstacles([], GOAL, "none", (), plain[1], plain[2], None) if "sags" in each.what]
    _, rest, records = met(sagging(), LAW, [steps])
    (barred,) = obstacles([], GOAL, "none", (), rest, records, None)
    assert "the supply sags" in barred.what
    assert "accumulator" in barred.mend
    lowest = np.percentile(records[0].signals["supply"], 1) / rest.signals["supply"].mean()
    assert f"{100 * np.sqrt(lowest):.0f} %" in barred.costs
    assert "To do: an accumulator" in told([vars(barred)])[0]


def sagging():
    return lacks("supply.sag", "laminar", sag=(2e7, "Pa"), tau=(5e-3, "s"))
