"""Traces that are killed and go on, and input that cannot be traced."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_campaigns import (
    LIBRARY,
    campaign,
    made,
    rubbing_campaign,
    written,
)

from workbench.base.errors import InputError
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.common.run_folder import metrics_json, open_run
from workbench.commands.trace.study import run_trace
from workbench.plant.effects import LIBRARY as WHOLE
from workbench.plant.effects.declared import effects_for
from workbench.records import Record
from workbench.report import render
from workbench.rigs.rig_file import load_rig

ROOT = Path(__file__).parents[1]
RIG = load_rig("festo-tp511")


# --- killed, and resumed


def command(folder: Path, out: Path) -> list[str]:
    keep = ("jack.friction", "sensor.lag")
    without = sorted({effect.name for effect in WHOLE} - set(keep))
    words = ["trace", str(folder), "--without", *without, "--out", str(out)]
    return [sys.executable, "-m", "workbench.cli", *words]


def test_a_killed_trace_goes_on_from_its_last_stage(tmp_path):
    folder, out = written(rubbing_campaign(), tmp_path / "camp"), tmp_path / "out"
    process = subprocess.Popen(command(folder, out), cwd=ROOT, stderr=subprocess.PIPE, text=True)
    stage = tmp_path / "out.partial" / "stages" / "scores-1.json"
    waited = time.monotonic() + 120
    while not stage.exists():
        assert process.poll() is None, process.stderr and process.stderr.read()
        assert time.monotonic() < waited
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    assert not out.exists()
    done = subprocess.run(command(folder, out), cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert "scores of" not in done.stderr  # that stage was there
    assert json.loads((out / "trace.json").read_text())["effects"] == ["jack.friction"]
    assert {"trace.json", "rig.toml", "metrics.json", "report.html", "config.toml"} <= {p.name for p in out.iterdir()}


def test_a_resumed_trace_says_the_same_to_the_byte(tmp_path):
    """Every stage is read back instead of computed."""
    with open_run(tmp_path / "out", {"command": "trace"}) as run:
        first = run_trace(rubbing_campaign(), RIG, LIBRARY[:1], run.stage, lambda _: None)
        names = sorted(path.name for path in (run.dir / "stages").glob("[!@]*.json"))
        run._asked.clear()
        again = run_trace(rubbing_campaign(), RIG, LIBRARY[:1], run.stage, lambda _: None)
        assert metrics_json(again.metrics) == metrics_json(first.metrics)
        assert again.files == first.files
        stages = ("base", "heldout%20before", "heldout%20named", "localise", "refit-1-jack.friction-coulomb")
        assert names == [f"{stage}.json" for stage in (*stages, "scores-1", "without-1")]
        run.finish({}, "", {}, render(first.page))


# --- bad input


def still(name: str, signals: dict[str, float], seconds: float = 2.0) -> Record:
    t = np.arange(round(seconds / 2e-3)) * 2e-3
    random = np.random.default_rng(0)
    return Record(
        name, t, {key: value + 1e-3 * abs(value) * random.standard_normal(t.size) for key, value in signals.items()}
    )


def bad(what: str):
    """A campaign that cannot be traced, and words that say why."""
    good = rubbing_campaign()
    mute = replace(good.train[0], signals={k: v for k, v in good.train[0].signals.items() if k != "command"})
    return {
        "no train": (replace(good, train=()), ["no train record", "[records] train"]),
        "no command": (replace(good, train=(mute,)), ["no command"]),
        "short": (replace(good, train=(good.train[0].slice(0, 0.8),)), ["last 0.8 s", "2 s"]),
        "nothing shared": (replace(good, heldout=(still("b", {"command": 0.1, "current": 0.01}),)), ["b", "no signal"]),
        "few rows": (replace(good, heldout=(sparse(good.heldout[0]),)), ["sines", "0.08 s"]),
    }[what]


def sparse(record: Record) -> Record:
    """One row in 40."""
    return Record(record.name, record.t[::40], {name: values[::40] for name, values in record.signals.items()})


@pytest.mark.parametrize("what", ["no train", "no command", "short", "nothing shared", "few rows"])
def test_a_campaign_that_can_not_be_traced_is_refused(what):
    of, words = bad(what)
    with pytest.raises(InputError) as said:
        run_trace(of, RIG, LIBRARY, no_checkpoint, lambda _: None)
    for word in words:
        assert word in str(said.value)


def test_a_rig_without_bounds_is_refused():
    numbers = {name: replace(number, low=None, high=None) for name, number in RIG.numbers.items()}
    with pytest.raises(InputError, match="no number has bounds"):
        run_trace(rubbing_campaign(), replace(RIG, numbers=numbers), LIBRARY, no_checkpoint, lambda _: None)


@pytest.mark.parametrize(
    ("signal_", "factor", "words"),
    [
        ("command", -1.0, "the sign of command looks wrong"),
        ("position", 1000.0, "position goes over .*, and the stroke is .*unit"),
        ("pa", 14.5, "pa .* unit"),
    ],
)
def test_records_that_are_not_of_this_rig_are_refused(signal_, factor, words):
    """A reversed command, millimetres taken for metres, bar for psi."""
    good = rubbing_campaign()

    def spoilt(record: Record) -> Record:
        return replace(record, signals={**record.signals, signal_: factor * record.signals[signal_]})

    of = replace(good, train=tuple(map(spoilt, good.train)), heldout=tuple(map(spoilt, good.heldout)))
    with pytest.raises(InputError, match=words):
        run_trace(of, RIG, LIBRARY, no_checkpoint, lambda _: None)


def test_an_unknown_name_to_leave_out_is_refused():
    with pytest.raises(InputError, match=r'did you mean "jack.friction"'):
        effects_for(RIG, without=["jack.frictoin"])


def test_a_quiet_rig_of_ours_lacks_nothing():
    of = campaign(RIG)
    assert run_trace(of, RIG, LIBRARY[1:2], no_checkpoint, lambda _: None).metrics["verdict"] == "none"


def test_made_records_move_but_reach_no_stop():
    of = rubbing_campaign()
    for record in (*of.train, *of.heldout):
        assert 0.01 < np.ptp(record.signals["position"]) < 0.15
    assert made(RIG, "a", np.zeros(50), 1).period == pytest.approx(2e-3)
