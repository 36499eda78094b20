"""Which of the leading designs of a commissioning the rig decides on."""

from types import SimpleNamespace

import pytest

from workbench.link.commissioning import verify
from workbench.link.commissioning.designs import _leading
from workbench.loop.tuning.goals import Trial, Verdict

GOAL = "position-10mm"


def played(here, predicted, elsewhere=0.05):
    """A design's steps at mid stroke and elsewhere, settled in [s]."""
    steps = ((GOAL, here, predicted), (f"{GOAL}-at+50", elsewhere, 0.05))
    return [
        SimpleNamespace(scenario=SimpleNamespace(name=name), row={"settling_s": a}, prediction={"settling_s": b})
        for name, a, b in steps
    ]


@pytest.mark.parametrize(
    ("designs", "best"),
    [
        ([played(0.050, 0.050), played(0.045, 0.045), played(0.060, 0.060)], 1),
        ([played(0.050, 0.050), played(0.040, 0.060), played(None, 0.040)], 0),  # what was not foretold may be luck
        ([played(0.050, 0.050), played(0.040, 0.040, None)], 0),
        ([played(0.070, 0.040), played(0.060, 0.040)], 1),
        ([[], played(0.060, 0.040)], 1),
    ],
)
def test_the_rig_decides(monkeypatch, designs, best):
    assert decided(monkeypatch, designs, SimpleNamespace(client=None, trips=[], over=None)) == best


def test_after_a_trip_no_further_design_is_played(monkeypatch):
    spent = SimpleNamespace(client=None, trips=[], over=None)
    assert decided(monkeypatch, [played(0.050, 0.050), [], played(0.030, 0.030)], spent, trips=1) == 0


def decided(monkeypatch, designs, spent, trips=None):
    """The place of the design that is taken; the one at `trips` trips."""

    def play(spent, name, way, scenarios, say, number):
        place = int(name.removeprefix("leading-")) - 1
        spent.trips += [None] * (place == trips)
        return designs[place]

    monkeypatch.setattr(verify, "played_way", play)
    monkeypatch.setattr(verify, "allowed", lambda rig: None)
    monkeypatch.setattr(verify, "wire_rig", lambda rig, client: rig)
    return verify.rig_decides(spent, None, list(range(len(designs))), GOAL, 1, lambda _: None)


def trial(number, gain, cost, missed=None):
    verdict = Verdict(int(missed is not None), missed, 0.5 if missed else 0.0, None if missed else cost, [])
    return Trial(number, {"gain": gain, "corner": 10.0}, verdict, 0)


def test_the_leading_designs_are_unlike_and_miss_no_goal():
    trials = [trial(0, 1.0, 3.0), trial(1, 1.1, 2.0), trial(2, 2.0, 4.0), trial(3, 1.3, 9.0, "Ms"), trial(4, 1.05, 2.5)]
    assert [each.number for each in _leading(trials)] == [1, 2]
    assert [each.number for each in _leading([trial(0, 1.0, 1.0, "Ms"), trial(1, 3.0, 1.0, "Ms")])] == [0]
