"""What a watch leaves: watch.json by its contract, the page with its alarm, the exit status for cron."""

import argparse
import json

import numpy as np
import pytest

from workbench.cli import main
from workbench.commands.watch import study
from workbench.commands.watch.options import options
from workbench.identify.watch import reader
from workbench.identify.watch.naming import Explained
from workbench.identify.watch.reader import SessionReader
from workbench.identify.watch.session_evidence import Axis, SessionEvidence
from workbench.rigs.rig_file import load_rig

RIG = load_rig("jack-10t")
COUNT, BEGINS = 14, 9
B, PS = (RIG.numbers[name].value for name in ("b", "Ps"))
LANDS, FRICTION, BOTH = ("main.deadband",), ("jack.friction",), ("jack.friction", "main.deadband")
AXES = (
    Axis("b", "N s/m", 0.45 * B, B, 1 / 3, number=True),
    Axis("Ps", "Pa", 0.03 * PS, PS, 1 / 3, number=True),
    Axis("jack.friction", "typical"),
    Axis("main.deadband", "typical"),
)


def evidence(session: int) -> SessionEvidence:
    """Of a rig whose lands wear from BEGINS on."""
    random = np.random.default_rng(session)
    move = np.array([*0.3 * random.standard_normal(2), 0.0, 0.05 * max(session - BEGINS + 1, 0)])
    matrix = 1e5 * (np.eye(4) + 0.2)
    gradient = -matrix @ move + np.linalg.cholesky(matrix) @ random.standard_normal(4)
    return SessionEvidence(AXES, np.zeros(4), matrix, gradient, 1000, 1.0 + 5.0 * move[3], {"pa": 1.0})


def explained(self: SessionReader, campaign, suspects, what) -> dict[tuple[str, ...], dict[str, Explained]]:
    """Lands explain what is new, friction half of it."""
    return told_by(campaign, suspects, lambda grown: {LANDS: 3e4 * grown, FRICTION: 5e5 * grown})


def of_two(self: SessionReader, campaign, suspects, what) -> dict[tuple[str, ...], dict[str, Explained]]:
    """Lands and friction wear, friction two sessions later: each alone leaves much of what is new."""
    return told_by(campaign, suspects, lambda grown: {LANDS: 3e5 * grown, FRICTION: 5e5 * grown, BOTH: 1e3 * grown})


def told_by(campaign, suspects, leaves) -> dict[tuple[str, ...], dict[str, Explained]]:
    at = int(campaign.train[0].signals["position"][0])
    grown, later = (0.05 * max(at - begins + 1, 0) for begins in (BEGINS, BEGINS + 2))
    before, numbers = 1e6 * grown, {"b": B, "Ps": PS}
    found = {}
    for axes in suspects:
        after = leaves(grown).get(axes, before - 1)
        size = {"jack.friction": later if axes == BOTH else grown}
        found[axes] = {
            axis: Explained(1000 + before, 1000 + after, 1000, size.get(axis, grown), 0.001, numbers) for axis in axes
        }
    return found


@pytest.fixture
def months(tmp_path, monkeypatch):
    """A folder of dated sessions; what is read of each is made here, its number is its position in m."""
    for k in range(COUNT):
        own = tmp_path / "rig-3" / f"2026-01-{k + 1:02}"
        own.mkdir(parents=True)
        rows = "".join(f"{row / 1000},0,{k if row else k + 1e-9}\n" for row in range(20))
        (own / "a.csv").write_text(f"t [s],command [1],position [m]\n{rows}")
        (own / "b.csv").write_text(f"t [s],command [1],position [m]\n{rows}20,0,{k}\n")
        (own / "campaign.toml").write_text('rig = "jack-10t"\n[records]\ntrain = ["a.csv"]\nheldout = ["b.csv"]\n')
    monkeypatch.setattr(reader, "_check_alike", lambda *_: None)
    monkeypatch.setattr(SessionReader, "evidence", lambda self, campaign, what: evidence(_number(campaign)))
    monkeypatch.setattr(SessionReader, "explained", explained)
    assert study.read_sessions is reader.read_sessions
    return tmp_path / "rig-3"


def _number(campaign) -> int:
    return int(campaign.path.name[-2:]) - 1


def test_an_alarm_is_told_named_dated_and_shown_and_cron_hears_of_it(months, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("workbench.commands.watch.retuning.DESIGNS", 4)
    out = tmp_path / "out"
    with pytest.raises(SystemExit) as ended:
        main(["watch", str(months), "--out", str(out), "--controller", "p-dp", "--exit-code"])
    assert ended.value.code == 3
    watch = json.loads((out / "watch.json").read_text())
    assert set(watch) >= {"sessions", "alarms", "forecast"}
    assert [each["date"] for each in watch["sessions"]] == [f"2026-01-{k + 1:02}" for k in range(COUNT)]
    assert set(watch["sessions"][0]) >= {"date", "chi2", "numbers", "margins"}
    assert all(low <= value <= high for value, low, high in watch["sessions"][-1]["numbers"].values())
    (alarm,) = watch["alarms"]
    assert set(alarm) >= {"effect", "among", "since", "rate", "told"}
    assert (alarm["effect"], alarm["among"]) == ("main.deadband", ["main.deadband"])
    assert f"2026-01-{BEGINS - 1:02}" <= alarm["since"] <= f"2026-01-{BEGINS + 3:02}"
    assert watch["sessions"][-1]["margins"]["gain_margin_db"] > 0
    page = (out / "report.html").read_text()
    assert "main.deadband" in page
    assert "report_fault" not in (out / "metrics.json").read_text()
    assert "main.deadband" in capsys.readouterr().out


def test_two_wears_at_once_are_two_alarms_each_since_its_own_day(months, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("workbench.commands.watch.retuning.retuned", lambda *_: None)  # half a minute's search
    monkeypatch.setattr(SessionReader, "explained", of_two)
    out = tmp_path / "out"
    assert main(["watch", str(months), "--out", str(out), "--controller", "p-dp"]) == 0
    lands, friction = json.loads((out / "watch.json").read_text())["alarms"]
    assert (lands["effect"], lands["among"]) == ("main.deadband", ["main.deadband"])
    assert (friction["effect"], friction["among"]) == ("jack.friction", ["jack.friction"])
    since = [int(each["since"][-2:]) for each in (lands, friction)]
    assert since[1] - since[0] == 2
    assert all(each["told"] >= each["since"] for each in (lands, friction))
    said = capsys.readouterr().out
    assert said.index("main.deadband drifts by") < said.index("jack.friction drifts by")


def test_an_alarm_whose_cause_was_mended_is_told_as_past_and_rings_no_bell(months, tmp_path, monkeypatch, capsys):
    mended = BEGINS + 3
    monkeypatch.setattr(
        SessionReader,
        "evidence",
        lambda self, campaign, what: evidence(_number(campaign) * (_number(campaign) < mended)),
    )
    out = tmp_path / "out"
    assert main(["watch", str(months), "--out", str(out), "--exit-code"]) == 0
    (alarm,) = json.loads((out / "watch.json").read_text())["alarms"]
    assert (alarm["effect"], alarm["until"]) == ("main.deadband", f"2026-01-{mended + 1:02}")
    assert f"gone since {alarm['until']}" in capsys.readouterr().out
    assert "gone since" in (out / "report.html").read_text()


def test_a_cluster_is_for_several_rigs(months, tmp_path, capsys):
    assert main(["watch", str(months), "--out", str(tmp_path / "out"), "--cluster", "tcp://127.0.0.1:1"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_folder_of_rigs_has_the_urgent_first(months, tmp_path, monkeypatch):
    monkeypatch.setattr("workbench.commands.watch.rigs.process_pool", _here)
    monkeypatch.setattr("workbench.commands.watch.retuning.retuned", lambda *_: None)  # half a minute's search
    well = months.parent / "rig-1"
    (months / "2026-01-01").rename(well.parent / "kept")
    well.mkdir()
    (well.parent / "kept").rename(well / "2026-01-01")
    rigs = tmp_path / "rigs"
    rigs.mkdir()
    for folder in (months, well):
        folder.rename(rigs / folder.name)
    assert main(["watch", str(rigs), "--out", str(tmp_path / "out")]) == 0
    found = json.loads((tmp_path / "out" / "metrics.json").read_text())["rigs"]
    assert [(row["name"], bool(row["alarms"])) for row in found] == [("rig-3", True), ("rig-1", False)]


class _here:
    """A pool of no process."""

    def __init__(self, jobs, start):
        self.work = start()

    def __enter__(self):
        return lambda items, stage, done: [self._one(item, done) for item in items.values()]

    def _one(self, item, done):
        row = self.work(item)
        done(row)
        return row

    def __exit__(self, *_):
        return None


def test_the_loop_that_is_judged_is_there_in_any_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    parser = argparse.ArgumentParser()
    options(parser)
    assert parser.parse_args(["months"]).loop.is_file()
