"""A rig in the loop of its maker, watched by reference and position: what these tell, and no more."""

import json
from datetime import date, timedelta
from pathlib import Path

import numpy as np
import pytest

from experiments.studies.closed_loop.study import drawn_loop, played
from workbench.cli import main
from workbench.identify.data.noise_floor import noise_floor
from workbench.identify.watch.history import History
from workbench.identify.watch.known_then import intervals
from workbench.identify.watch.session_evidence import Axis
from workbench.records import write_csv
from workbench.records.dated_sessions import dated_sessions
from workbench.rigs.rig_file import load_rig, save_rig

SESSIONS = 2


@pytest.fixture(scope="module")
def press(tmp_path_factory) -> Path:
    """Two sessions of a drawn loop, as its maker's controller exports them, without a record at rest."""
    folder = tmp_path_factory.mktemp("months")
    rig, true = drawn_loop(0, 1)
    save_rig(rig, folder / "rig.toml")
    for k in range(SESSIONS):
        own = folder / str(date(2026, 1, 5) + timedelta(weeks=k))
        own.mkdir()
        write_csv(played(true, np.random.default_rng((1, k)), "a"), own / "a.csv")
        (own / "campaign.toml").write_text('rig = "../rig.toml"\n[records]\ntrain = ["a.csv"]\n')
    return folder


def test_a_record_in_two_roles_is_no_repeat_of_itself(press):
    """What is watched is held out, too; a floor of nothing would let no rig follow its records."""
    campaign = dated_sessions(press).sessions[0].load()
    floor, noise = noise_floor(campaign), 1e-4 * drawn_loop(0, 1)[0].limit("stroke")
    assert campaign.heldout
    assert floor.sigma["position"] == pytest.approx(noise, rel=0.05)


def test_a_loop_of_its_maker_is_watched_by_what_its_records_tell(press, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert main(["watch", str(press), "--out", str(tmp_path / "w")]) == 0
    found = json.loads((tmp_path / "w" / "watch.json").read_text())
    page = (tmp_path / "w" / "report.html").read_text()
    assert "No report could be drawn" not in capsys.readouterr().err
    assert len(found["sessions"]) == SESSIONS
    rig, true = drawn_loop(0, 1)
    for session in found["sessions"]:
        numbers = {name.split(" ")[0]: value for name, value in session["numbers"].items()}
        assert {"loop_gain", "loop_delay", "z0"} <= numbers.keys()
        for name in numbers.keys() & rig.numbers.keys():
            low, high = rig.numbers[name].low, rig.numbers[name].high
            assert low is not None
            assert high is not None
            assert low <= numbers[name][1] <= numbers[name][0] <= numbers[name][2] <= high, name
        assert numbers["loop_gain"][0] == pytest.approx(true["loop_gain"], rel=0.03)
        assert "V0" not in numbers  # position alone has nothing of it
        # the loop is asked for the reference itself, which it follows as slowly as its speed gain lets it
        assert (
            2.0
            < session["margins"]["settling_s"]
            * true["loop_gain"]
            * 2
            * rig["K3"]
            * rig["z3max"]
            * np.sqrt(rig["Ps"] / 2)
            / rig["Aj"]
            < 20.0
        )
    assert "loop inside on the rig of each session" in page
    assert "No session tells" in page


def test_a_number_that_a_session_does_not_tell_has_no_interval():
    rig = load_rig("jack-10t")
    axes = (Axis("b", "N s/m", 750.0, 500.0, number=True), Axis("jack.friction", "typical"))
    one = np.zeros((1, 2, 2))
    known = History(axes, 1, np.zeros(1), one, one[0], np.zeros(1, dtype=int), None)
    told = intervals(rig, known, np.zeros((1, 2)), np.array([[0.19, 0.19]]))
    assert told[:, 0, 0] == pytest.approx([500.0, 250.0, 500.0 + 1.96 * 0.19 * 750.0])  # its range
    assert told[:, 0, 1] == pytest.approx([0.0, -1.96 * 0.19, 1.96 * 0.19])
    assert np.isnan(intervals(rig, known, np.zeros((1, 2)), np.array([[0.21, 2.0]]))).all()
    worn = intervals(rig, known, np.array([[-0.8, 1.0]]), np.array([[0.1, 0.1]]))[:, 0, 0]
    assert worn == pytest.approx([0.0, 0.0, 1.96 * 0.1 * 750.0])  # past its range, and no friction drives
