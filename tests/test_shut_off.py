"""A shut-off valve in the lines of a jack: as rig files say it, closed on a trip, and what it saves."""

from dataclasses import replace

import numpy as np
import pytest

from controllers.p import P
from workbench.base.errors import InputError
from workbench.commands.show.describe import describe
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.loop.faults import FAULTS, FaultyLoop
from workbench.loop.sampled_loop import SampledLoop
from workbench.plant import build
from workbench.rigs.rig_file import load_rig, rig_text
from workbench.rigs.shut_off import closing_in

RIG = load_rig("jack-10t")
STUCK = next(fault for fault in FAULTS if fault.name == "valve stuck at 0.3")
SHUT_OFF = """
[shut_off]
closing_time = {value = 20, unit = "ms", source = "made up", bounds = [10, 50]}
leak = {value = 0.5, unit = "%", source = "made up"}
"""


def stuck_after(rig, milliseconds=100):
    """The furthest position of a loop at rest whose valve sticks open, and the sample at which it tripped."""
    plant = build(rig)
    loop = FaultyLoop(
        Engine(plant), rig, P(P.Design(gain=10.0), rig.period.value), equilibrium(plant), None, STUCK,
        lambda k, _: k >= milliseconds,
    )  # fmt: skip
    return np.abs(loop.run(np.zeros(700)).record.signals["position"]).max(), loop.tripped_at


def test_none_is_the_default():
    assert RIG.shut_off is None
    assert "shut_off" not in rig_text(RIG)


def test_a_rig_file_declares_one_and_gives_it_back(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(rig_text(RIG) + SHUT_OFF)
    rig = load_rig(path)
    assert rig.shut_off is not None
    assert (rig.shut_off.closing_time.value, rig.shut_off.leak.value) == (0.02, 0.005)
    assert rig.shut_off.closing_time.low == pytest.approx(0.01)
    path.write_text(rig_text(rig))
    assert load_rig(path).shut_off == rig.shut_off
    assert {"closing_time", "leak"} <= {number["name"] for number in describe(rig)["numbers"]}


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("value = 20", "value = -1", "closing_time"),
        ("value = 0.5", "value = 200", "leak"),
        ("leak", "leek", "leek"),
        ('"ms"', '"mm"', "closing_time"),
    ],
)
def test_what_cannot_be_is_refused(tmp_path, before, after, message):
    path = tmp_path / "mine.toml"
    path.write_text(rig_text(RIG) + SHUT_OFF.replace(before, after, 1))
    with pytest.raises(InputError, match=message):
        load_rig(path)


def test_it_closes_linearly_to_what_it_leaks():
    valve = replace(closing_in(0.02), leak=replace(closing_in(0.02).leak, value=0.1))
    assert [valve.opening(t) for t in (0.0, 0.01, 0.02, 1.0)] == pytest.approx([1.0, 0.55, 0.1, 0.1])


def test_it_stops_a_jack_whose_valve_sticks_open_and_the_faster_the_sooner():
    free, tripped = stuck_after(RIG)
    fast, slow = (stuck_after(replace(RIG, shut_off=closing_in(seconds)))[0] for seconds in (0.01, 0.05))
    assert tripped is not None
    assert free > RIG["S"] / 2 > fast
    assert slow > fast


def test_nothing_changes_without_a_trip_and_a_loop_with_one_stays_in_python():
    plant = build(RIG)
    engine, start = Engine(plant), equilibrium(plant)
    runs = []
    for rig in (RIG, replace(RIG, shut_off=closing_in(0.02))):
        loop = SampledLoop(engine, rig, P(P.Design(gain=5.0), rig.period.value), start, compiled=False)
        runs.append(loop.run(np.full(200, 1e-3)).record.signals["position"])
    assert np.array_equal(*runs)
    assert loop.compiled is None
