"""A commissioning computes no longer than it may: a trace that is out of time says what it has, and names less."""

import time
from dataclasses import replace
from types import SimpleNamespace

import pytest
from made_campaigns import LIBRARY, campaign, rubbing_campaign

from workbench.base.checkpoint import OutOfTime
from workbench.base.process_pool import process_pool
from workbench.cli import main
from workbench.commands.commission import rounds
from workbench.commands.commission.rounds import sentence
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.trace.study import trace_answer
from workbench.control.controller_type import controller
from workbench.link.commissioning.rig_time import Computing
from workbench.link.commissioning.verify import best_way
from workbench.plant.effects import find
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

RIG = load_rig("festo-tp511")


class Clock:
    """A clock that goes on by itself, a second at each look."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        self.now += 1.0
        return self.now


def answer(over):
    """The answer about a jack that rubs, and the stages that it took."""
    stages = []

    def stage(name, compute):
        stages.append(name)
        return no_checkpoint(name, compute)

    campaign, library = rubbing_campaign(), LIBRARY[:1]
    told = trace_answer(campaign, RIG, library, stage, lambda _: None, (), (), False, 1, False, over=over)
    return told, stages


@pytest.fixture(scope="module")
def whole():
    return answer(lambda: False)


def test_a_trace_that_is_out_of_time_names_nothing_that_it_has_not_judged(whole):
    told, stages = whole
    assert (told.verdict, told.effects) == ("named", ("jack.friction",))
    assert "finished" not in told.outcome.metrics
    cut, fewer = answer(ends(stages, "refit-1"))
    assert (cut.verdict, cut.effects) == ("unknown", ())
    assert cut.chi2["before"] == pytest.approx(told.chi2["before"])
    assert not [name for name in fewer if name.startswith("refit-1")]
    assert sentence(cut).startswith("Not finished: ")
    assert "no effect that was tried explains" in sentence(cut)


def test_a_trace_that_is_out_of_time_keeps_what_it_has_found(whole):
    """The effect whose fit explained all is named, though the time was over before its rivals were fitted."""
    told, stages = whole
    cut, fewer = answer(ends(stages, "refit-1", after=1))
    assert "without-1" not in fewer
    assert (cut.verdict, cut.effects) == ("named", ("jack.friction",))
    assert cut.outcome.metrics["finished"] is False
    assert sentence(cut).startswith("Not finished: ")
    assert "No other effect comes near" not in sentence(cut)
    assert cut.chi2["after"] == pytest.approx(told.chi2["after"], rel=0.02)
    assert [use.name for use in cut.rig.effects] == ["jack.friction"]


def ends(stages, name, after=0):
    """Whether the time is over, where it ends before a stage, or so many stages after it."""
    timed = [each for each in stages if each != "localise"]
    looks, end = iter(range(len(stages))), next(k for k, each in enumerate(timed) if each.startswith(name)) + after
    return lambda: next(looks) >= end


def test_a_trace_that_may_not_even_fit_the_rig_says_so():
    with pytest.raises(OutOfTime):
        answer(lambda: True)


def test_the_sentence_needs_no_page(whole):
    told, _ = whole
    assert told.sentence.startswith(f"{sentence(told)} To pin the numbers down, record ")
    assert "jack.friction" in sentence(told)


def test_time_in_which_the_rig_plays_does_not_count():
    clock = Clock()
    computing = Computing(10.0, clock)
    with computing.waits():
        clock.now += 100.0
    assert computing.spent < 5.0
    late = computing.over(0.5, "the trace of round 1")
    assert not late()
    assert computing.cut == []
    while not late():
        pass
    assert late()
    assert computing.cut == ["the trace of round 1"]


def test_a_busy_machine_takes_none_of_the_time_and_workers_do():
    """Time goes by in which nothing is computed; two processes compute twice as much as one."""
    computing = Computing(10.0)
    time.sleep(0.3)
    assert computing.spent < 0.2
    with process_pool(2, burning) as work:
        work({"a": 0.5, "b": 0.5}, no_checkpoint, lambda _: None)
    assert 1.0 <= computing.spent < 30.0


def burning():
    """A worker's work: so many seconds of CPU time."""

    def burn(seconds):
        end = time.process_time() + seconds
        while time.process_time() < end:
            pass

    return burn


def lagging_campaign():
    """The small cylinder behind a drive that lags by 2 ms."""
    lag = EffectUse("drive.lag", "command filter", {"tau": Number("tau", 2e-3, "s", "s", "made up")})
    return campaign(replace(RIG, effects=(lag,)))


def test_commission_uses_the_rig_as_found_where_the_time_ended_the_trace_that_found_it(tmp_path, monkeypatch):
    """A drive that lags explains all, and the time of the round's trace is over before its rivals are fitted."""
    played, fitted, searched = lagging_campaign(), [], []
    library = (*LIBRARY[:1], find("drive.lag", "command filter"))
    clock = Clock()

    def stage(name, compute):
        fitted.append(name)
        done = no_checkpoint(name, compute)
        if "refit-1-drive.lag" in name:
            clock.now += 1000.0
        return done

    def trace_campaign(_, effects, stage, progress, jobs, learns, over):
        return trace_answer(played, RIG, library, stage, progress, (), (), False, jobs, learns, over=over)

    def designs(self, rig, name):
        searched.append(rig)
        return [controller("controllers.p:P", gain=1.0)]

    monkeypatch.setattr(rounds, "trace_campaign", trace_campaign)
    monkeypatch.setattr(rounds.Searches, "designs", designs)
    computing = Computing(600.0, clock)
    searches = rounds.Searches(None, "position-10mm", 1, SimpleNamespace(stage=stage), lambda _: None, computing)
    found = rounds.found_by(tmp_path, searches, 1, RIG, lambda _, specs: specs[0])
    assert computing.cut == ["the trace of round 1"]
    assert not [name for name in fitted if "without-1" in name]
    assert sentence(found.answer).startswith("Not finished: ")
    assert [use.name for use in searched[0].effects] == ["drive.lag"]
    assert found.rig.effects[0].numbers["tau"].value == pytest.approx(2e-3, rel=0.2)
    assert found.explains
    settled = {"settling_s": {"predicted": 0.06, "measured": 0.061}, "overshoot_percent": {"measured": 0.0}}
    rows = [{"way": way, "scenario": "position-10mm", **settled} for way in ("automatic", "datasheet", "found")]
    rows[0]["settling_s"] = {"predicted": 0.05, "measured": 0.05}
    assert best_way(rows, "position-10mm", found.explains) == "found"


def test_too_short_a_time_is_refused(capsys, tmp_path):
    words = ["commission", "jack-10t", "--at", "udp://127.0.0.1:9", "--computing", "0.2", "--out", str(tmp_path / "o")]
    assert main(words) == 2
    assert "--computing 0.2: must be 1 or more" in capsys.readouterr().err
