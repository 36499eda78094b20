"""Sentences of reports that give a reason or come to a conclusion, where the data are such that another one is true."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.base.signals import SIGNALS
from workbench.cli import main
from workbench.commands.bench.page import _first
from workbench.commands.common.loop_margins import margins_table
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.common.sheet_page import verdict as sheet_verdict
from workbench.commands.common.step_experiment import load_steps
from workbench.commands.drive.page import settled
from workbench.commands.drive.study import run_drive
from workbench.commands.fit.page import beside_noise
from workbench.commands.fit.platform import legs_sentence as fitted_legs
from workbench.commands.frequency.page import Comparison, page
from workbench.commands.import_ import study as import_study
from workbench.commands.residual.platform import legs_sentence
from workbench.commands.retune.page import _unseen
from workbench.commands.robustness.page import _verdict as robustness_verdict
from workbench.commands.robustness.platform_page import _verdict as platform_verdict
from workbench.commands.run.steps import _verdict as step_verdict
from workbench.commands.tune.page import reached
from workbench.commands.watch.page import _alarms, _forecast
from workbench.commands.watch.rigs import _page as rigs_page
from workbench.identify.acceptance.row import AcceptanceLimit, Row, judged, unsaid
from workbench.identify.columns.roles import RecordMotion, roles
from workbench.identify.watch.changes import Change
from workbench.identify.watch.forecast import unforeseen
from workbench.identify.watch.naming import Name
from workbench.identify.watch.told import NamedChange
from workbench.link.commissioning.allowed import allowed, safe
from workbench.loop.drive_simulation import drive
from workbench.loop.performance.reached import followed
from workbench.loop.scenarios import scenario
from workbench.records.excitation import excitation
from workbench.report import Table
from workbench.rigs.rig_file import load_rig

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
F = np.array([1.0, 2.0, 4.0])
ONE = np.ones(3, complex)
RECORD = Comparison("waves", ("command", "pa"), F, ONE, 1.1 * ONE, "multisine", np.ones(3), 0.1 * np.ones(3))
SHEET = Comparison("maker", ("command", "flow"), F, ONE, ONE, "sines of 100 %")


def test_a_wide_band_is_no_failing_model():
    wide = replace(RECORD, radius=0.6 * np.ones(3))
    assert "the 95 % band is nowhere narrower than half of the response" in page("here", "my rig", [wide]).verdict
    fails = replace(wide, model=np.full(3, np.nan + 0j))
    assert page("here", "my rig", [fails]).verdict == "waves: the model of my rig fails."


@pytest.mark.parametrize(
    ("beside", "says"),
    [([RECORD], ["recorded"]), ([SHEET], ["sheet's sines"]), ([RECORD, SHEET], ["recorded", "sheet's"])],
)
def test_nothing_is_recorded_beside_a_sheet(beside, says):
    table: Any = page("here", "my rig", beside).sections[0].items[0]
    assert [word for word in ("recorded", "sheet's") if word in table.note] == [word.split()[0] for word in says]


def stand_in(**parts: Any) -> Any:
    """What has no more than a sentence is made of."""
    return SimpleNamespace(**parts)


def row(**numbers):
    return {"scenario": "step", "settling_s": 0.1, "overshoot_percent": 2.0, "ms": 1.5} | numbers


def test_a_rig_on_which_a_tuned_loop_never_settles_is_not_passed_over():
    told = reached([row(), row(settling_s=None)], ["step"])
    assert told[0] == "1 of 2 runs never settled"
    assert "the others settled in 0.1 s at the latest" in told
    assert reached([row(scenario="sine", settling_s=None, overshoot_percent=None, ms=None)], ["step"]) == []
    assert reached([row()], ["step"])[-1] == "Ms 1.50 at most and 1.50 on the nominal one"


def plants(**counts):
    return {
        "controller": "p", "plants": 50, "unstable": 0, "tripped": 0, "hunting": 0, "held_unstable": 0, "failing": 0,
        "settling_p99_s": 0.1, "ms_worst": 1.5,
    } | counts  # fmt: skip


def test_a_plant_that_fails_in_two_ways_is_one_plant():
    twice = plants(controller="twice", unstable=10, tripped=10, failing=10)
    once = plants(controller="once", tripped=15, failing=15)
    assert "twice: 10 unstable, 10 tripped of 50" in robustness_verdict([twice, once])
    assert robustness_verdict([twice, once]).endswith("in all on 10 plants, the fewest of them.")
    assert "fewest" not in robustness_verdict([once])
    metrics = {"linear": [{"controller": "a", "failing": 3}, {"controller": "b", "failing": 2}], "rows": []}
    assert platform_verdict(metrics) == "No controller holds on all platforms; b fails on the fewest, on 2."


def test_where_no_step_was_played_no_controller_failed_to_settle():
    assert robustness_verdict([]).startswith("No law of this experiment runs in lanes")


def test_a_sine_is_not_settled():
    trips = {"scenario": "position-sine-5hz", "controller": "p", "stable": True, "settling_s": None, "iae": None}
    said = step_verdict([scenario("position-sine-5hz", "")], [trips | {"tripped": "speed"}])
    assert said == "position-sine-5hz: no stable controller goes through it to its end."


def test_a_run_that_was_cut_short_or_never_stands_did_not_settle_never():
    step, sine = scenario("position-10mm", ""), scenario("position-sine-5hz", "")
    none = {"settling_s": None, "tripped": None}
    assert settled(step, none | {"settling_s": 0.1}) == "settles in 0.1 s"
    assert settled(step, none) == "does not settle"
    assert settled(step, none | {"tripped": "Ctrl-C"}) == "is cut short"
    assert settled(sine, none) == "is followed"


def told(shape, sessions):
    numbers = {k: {} for k in range(sessions)}
    return NamedChange(
        Change(0, shape, 1, 2.0, 1.0, 1, 1), 2, Name("b", ("b",), 0.9), "b [1]", {}, numbers, None, "", (), {}
    )


def test_what_is_not_foreseen_has_its_own_reason():
    assert unforeseen(None) == "No alarm stands, so that nothing is foreseen."
    assert "did so at once" in unforeseen(told("step", 9))
    assert "in 3 sessions; to foresee how it goes on takes 4" in unforeseen(told("drift", 3))
    assert unforeseen(told("drift", 4)) == ""
    assert _forecast({"forecast": [], "no_forecast": "Beyond already: ms 2.5."}) == ["Beyond already: ms 2.5."]


ALARM = {
    "effect": None, "among": ["b"], "since": "2026-01-09", "since_between": ["2026-01-08", "2026-01-10"],
    "until": None, "shape": "drift", "rate": None, "share": 0.2, "told": "2026-01-11", "record": [],
}  # fmt: skip


def test_the_table_of_alarms_names_nothing_that_explains_too_little():
    unnamed, named = (_alarms([ALARM | {"effect": effect}]) for effect in (None, "b"))
    assert isinstance(unnamed, Table)
    assert isinstance(named, Table)
    assert unnamed.rows[0][0] == "Something that no suspect explains (nearest: b)"
    assert named.rows[0][0] == "b"


def test_a_rig_that_cannot_be_read_is_not_well():
    quiet = {"name": "a", "said": "", "alarms": [], "sessions": 9, "last": "", "margins": {}, "forecast": [],
             "left_out": []}  # fmt: skip
    said = rigs_page([quiet, quiet | {"name": "b", "sessions": 0}])[0].verdict
    assert said == "0 of 2 rigs need attention. Not read, so that nothing is known of them: b."


def test_errors_far_below_the_noise_are_not_as_they_should_be():
    assert beside_noise(1.01, missing=False, quiet=False) == ", as it should be."
    assert "the noise floor is too high" in beside_noise(0.3, missing=False, quiet=True)
    assert "the model misses something" in beside_noise(2.0, missing=True, quiet=False)


def test_legs_that_follow_may_still_share_no_number():
    legs = [{"leg": k, "follows": True, "chi2": {"heldout": 1.0}} for k in (1, 2, 3)]
    assert fitted_legs(legs, {}).startswith("No number has an interval in every one of them")
    one = [legs[0], *(each | {"follows": False} for each in legs[1:])]
    assert "Fewer than two legs follow" in fitted_legs(one, {})


def test_two_legs_that_cannot_be_simulated_are_both_named():
    assert legs_sentence({1: None, 2: 1.0, 3: None, 4: 4.0}) == (
        "Not to be simulated as declared: leg 1 and leg 3. Leg 4 is farthest from its declared jack of the others: "
        "chi2 4, the rest 1."
    )
    assert legs_sentence({1: 2.0}) == "Leg 1 is farthest from its declared jack: chi2 2."


def test_limits_of_lines_without_a_value_are_limits():
    rows = [Row("a", "", "1", 1.0, 1.0, 1.0), unsaid("b", "", "1", "no sensor"), Row("c", "", "1", 1.0, 1.0, 1.0)]
    only_b = judged(rows, {"b": AcceptanceLimit(high=2.0)})
    assert sheet_verdict(only_b) == "2 of 3 lines have a value. Limits of lines without a value judge nothing: b."
    both = judged(rows, {"a": AcceptanceLimit(high=2.0), "b": AcceptanceLimit(high=2.0)})
    assert "All 1 with limits and a value pass. Limits of lines without a value judge nothing: b." in sheet_verdict(
        both
    )
    assert sheet_verdict(judged(rows, {"a": AcceptanceLimit(maker=1.0)})).endswith("No limits were given.")


def test_what_has_no_linear_view_was_not_tried_at_one_hertz(monkeypatch):
    """The lines of capability give followed.uncontrolled as the reason."""
    monkeypatch.setattr("workbench.loop.performance.reached.played_sines", lambda *_: [point] * 9)
    point = stand_in(response=1.0, settled=True)
    blind = stand_in(closed=None)
    setup = stand_in(engine=None, null=None, rig=load_rig("jack-10t"))
    spec = drive(setup.rig).loop
    found = followed(setup, spec, stand_in(null=blind, moving=blind), np.array([1.0]), np.array([0.01]))
    assert np.isnan(found.control).all()
    assert found.uncontrolled == "a loop is unstable or has no linear view"


def test_an_empty_chamber_is_no_limit_to_be_widened():
    ready = drive(load_rig("jack-10t"))
    huge = excitation("huge", "command", 1e4 * np.ones(50), ready.rig.period.value, ready.rig["xmid"])
    with pytest.raises(InputError, match=r"huge: on jack-10t in simulation, however small, .*; look at the rig's file"):
        safe(allowed(ready.rig), ready.loop, [huge])


def written(folder: Path, name: str, before: str = "", moves: bool = True, seconds: float = 0.6) -> Path:
    """A recording of the bundled rig's signals; without a clock where a line `before` the table says the period."""
    t = np.arange(round(seconds * 1000)) * 1e-3
    command = (0.1 if moves else 0.0) * np.sin(2 * np.pi * 5 * t)
    head = "command [1],position [mm]" if before else "t [s],command [1],position [mm]"
    lines = [f"{u:.6g},{x:.6g}" for u, x in zip(command, 100 * command, strict=True)]
    lines = lines if before else [f"{at:.3f},{line}" for at, line in zip(t, lines, strict=True)]
    path = folder / f"{name}.csv"
    path.write_text("\n".join([*([before] if before else []), head, *lines]) + "\n")
    return path


def test_periods_that_differ_are_not_taken_from_the_first_file(tmp_path, capsys):
    files = [written(tmp_path, name, f"sample rate: {rate} Hz") for name, rate in (("a", 1000), ("b", 500))]
    assert main(["import", *map(str, files), "--rig", "jack-10t", "--out", str(tmp_path / "out")]) == 2
    assert "the period above the table is 0.001 s in a.csv and 0.002 s in b.csv" in capsys.readouterr().err


def test_a_period_above_the_table_is_no_matter_beside_a_clock(tmp_path):
    rated = tmp_path / "rated.csv"
    rated.write_text("sample rate: 1000 Hz\n" + written(tmp_path, "rated").read_text())
    files = [str(rated), str(written(tmp_path, "plain"))]
    assert main(["import", *files, "--rig", "jack-10t", "--out", str(tmp_path / "out")]) == 0


def test_where_nothing_moves_the_import_says_so(tmp_path):
    still = written(tmp_path, "still", moves=False)
    assert main(["import", str(still), "--rig", "jack-10t", "--out", str(tmp_path / "out")]) == 0
    problem = json.loads((tmp_path / "out" / "metrics.json").read_text())["problem"]
    assert problem == "nothing moves: record the rig with its command moving"


def test_the_last_mistake_that_was_undone_was_not_tried(tmp_path, monkeypatch):
    mistake = stand_in(told=lambda rig: f"pa looks turned on {rig}", signals=(), kind="turned")
    monkeypatch.setattr(import_study, "held_against", lambda *_: stand_in(mistake=mistake, problem=""))
    out = tmp_path / "out"
    assert main(["import", str(written(tmp_path, "a")), "--rig", "jack-10t", "--out", str(out)]) == 0
    problem = json.loads((out / "metrics.json").read_text())["problem"]
    assert problem == "4 mistakes were undone, and the last was not tried again: pa looks turned on jack-10t"


def test_an_unstable_loop_that_comes_to_rest_is_not_called_unsettled():
    loop = stand_in(rigs=["nominal"], controllers=[stand_in(name="p")])
    rows = [row(scenario="position-10mm", controller="p", rig="nominal", stable=False)]
    said = _first(loop, scenario("position-10mm", ""), {"rows": rows})
    assert said == "position-10mm: no stable controller settles."


def test_of_two_commands_none_lies_between_the_others():
    sizes = [RecordMotion(f"{k}", f"{k}.csv", 0.0, 1.0, float(k), np.full(200, k), None, False) for k in (1, 2, 3)]
    assert roles(sizes[:2]).reason == "held out: 1 of 2, the command that reaches 1, the smaller of two"
    assert roles(sizes).reason.endswith("reaches 2, between the others")


def test_a_drive_that_can_play_nothing_says_so_before_it_joins(tmp_path):
    text = (EXPERIMENTS / "first_loop.toml").read_text().replace("position-10mm", "position-load-20kn")
    (tmp_path / "load.toml").write_text(text)
    with pytest.raises(InputError, match="a command plays neither; add a step"):
        run_drive(load_steps(tmp_path / "load.toml"), "udp://127.0.0.1:1", "", None, no_checkpoint, lambda _: None)


@pytest.mark.parametrize("margins", ["sine", "linear"])
def test_margins_by_sines_leave_no_friction_out(margins):
    config = stand_in(start=stand_in(rig=load_rig("festo-tp511")))
    rubbing = replace(config.start.rig, effects=load_rig(str(Path(__file__).parent / "festo_found.toml")).effects)
    config.start.rig = rubbing
    said = _unseen(config, [{"margins": margins}])
    assert bool(said) == (margins == "linear")


def test_a_rig_without_a_spool_has_no_lap():
    assert "spool" not in margins_table({}, SIGNALS["position"]).note
