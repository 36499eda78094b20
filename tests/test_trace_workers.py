"""A trace by several processes says what one says, whoever finishes first, and goes on where it was stopped."""

import pytest
from made_campaigns import LIBRARY, named, rubbing_campaign, unknown

from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.common.run_folder import metrics_json, open_run
from workbench.commands.trace.study import run_trace
from workbench.identify.trace import workers
from workbench.report import render
from workbench.rigs.rig_file import load_rig

RIG = load_rig("festo-tp511")


class Stopped(Exception):
    """The user's interrupt."""


def test_two_workers_say_what_one_says():
    """Of an unknown, shapes are learned too, and a refit that fails is named."""
    outcome = run_trace(rubbing_campaign(), RIG, LIBRARY[1:], no_checkpoint, lambda _: None, jobs=2)
    assert metrics_json(outcome.metrics) == metrics_json(unknown().metrics)


def test_a_trace_of_two_workers_that_was_stopped_goes_on_with_one(tmp_path):
    def stop(what: str) -> None:
        if "explains" in what:
            raise Stopped

    with pytest.raises(Stopped), open_run(tmp_path / "out", {"command": "trace"}) as run:
        run_trace(rubbing_campaign(), RIG, LIBRARY, run.stage, stop, jobs=2)
    assert list((tmp_path / "out.partial" / "stages").glob("refit-1-*.json"))
    with open_run(tmp_path / "out", {"command": "trace"}) as run:
        outcome = run_trace(rubbing_campaign(), RIG, LIBRARY, run.stage, lambda _: None)
        run.finish({}, "", {}, render(outcome.page))
    assert metrics_json(outcome.metrics) == metrics_json(named().metrics)


def test_the_fit_that_items_are_about_is_made_once(monkeypatch):
    made = []
    monkeypatch.setattr(workers, "packed", lambda fit: fit)
    monkeypatch.setattr(workers, "unpacked", lambda stored, *_: made.append(stored) or stored)
    with workers.trace_workers(1, None, (), ()) as work:
        about = [
            work(
                lambda problem, library, before, item: {item: before}, fit, {"own": item}, no_checkpoint, lambda _: None
            )
            for fit, item in (("one", 1), ("one", 2), ("other", 3))
        ]
    assert about == [[{1: "one"}], [{2: "one"}], [{3: "other"}]]
    assert made == ["one", "other"]
