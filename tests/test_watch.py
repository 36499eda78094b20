"""A rig over months: dates are read as people write them, healthy rigs are left alone, a change is told and dated."""

import json
from dataclasses import replace
from datetime import date

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.watch.options import alarms_a_year
from workbench.identify.watch.changes import all_told, first_told
from workbench.identify.watch.healthy_rate import healthy_rate
from workbench.identify.watch.history import FEWEST, history
from workbench.identify.watch.naming import BESIDE, SECOND, Explained, name_of, pair_of, seems_two, suspects
from workbench.identify.watch.session_evidence import HELD, OF_ZERO, Axis, SessionEvidence, from_json
from workbench.identify.watch.smoothed import smoothed
from workbench.records.dated_sessions import dated_sessions

AXES = (
    Axis("b", "N s/m", scale=0.45, value=1.0, healthy=1 / HELD, number=True),
    Axis("Ps", "Pa", scale=0.03, value=1.0, healthy=1 / HELD, number=True),
    Axis("jack.friction", "typical"),
    Axis("main.deadband", "typical"),
    Axis("pa.zero", "Pa", scale=1.0, healthy=OF_ZERO),
)
WEEKLY = 7.0


def made(moves, seed=0, sharp=400.0):
    """Sessions [T] whose rigs are at moves [T, 5], as recordings of noise tell them; axes are correlated."""
    random = np.random.default_rng(seed)
    mix = np.eye(5) + 0.4 * np.random.default_rng(7).standard_normal((5, 5))
    sessions = []
    for move in moves:
        matrix = sharp**2 * mix.T @ mix
        vector = matrix @ move + np.linalg.cholesky(matrix) @ random.standard_normal(5)
        sessions.append(SessionEvidence(AXES, np.zeros(5), matrix, -vector, 1000, 1.0, {"pa": 1.0}))
    return sessions


def wandering(count, seed):
    """Moves [T, 5] of a healthy rig: viscosity and supply wander."""
    random = np.random.default_rng([seed, 1])
    moves = np.zeros((count, 5))
    moves[:, :2] = 0.3 * random.standard_normal((count, 2))
    return moves


def watched(moves, seed=0, repairs=None, temperatures=None):
    count = len(moves)
    warm = temperatures if temperatures is not None else [300.0 + k % 3 for k in range(count)]
    return history(made(moves, seed), [WEEKLY * k for k in range(count)], repairs or [False] * count, warm)


def test_healthy_rigs_raise_no_more_alarms_than_was_asked_for():
    """Twenty rig-years, at one alarm in two years: ten would be as asked."""
    told = sum(first_told(watched(wandering(52, seed), seed), 0.5)[0] is not None for seed in range(20))
    assert told <= 10


@pytest.mark.parametrize("axis", [2, 3, 4])
@pytest.mark.parametrize("shape", ["jump", "drift"])
def test_a_change_is_told_and_dated(axis, shape):
    moves = wandering(40, 3)
    begun = np.arange(40) - 19.0
    moves[:, axis] += 0.1 * (begun > 0) if shape == "jump" else 0.02 * np.maximum(begun, 0.0)
    change, told = first_told(watched(moves, 3), 0.5)
    assert change is not None
    assert change.shape == shape
    assert change.earliest - 2 <= 20 <= change.latest + 2
    assert 19 <= told <= 26


@pytest.mark.parametrize("axis", [2, 3])
def test_a_change_that_grows_faster_and_faster_began_before_it_was_told(axis):
    """The nearest straight line begins later than that: it passes by what was small at first."""
    moves = wandering(40, 3)
    moves[:, axis] += 0.004 * np.maximum(np.arange(40) - 19.0, 0.0) ** 3
    change, told = first_told(watched(moves, 3), 0.5)
    assert change is not None
    assert change.first <= told <= 24


def test_what_a_suspect_is_shows_beside_a_wandering_rig():
    moves = wandering(40, 5)
    moves[25:, 3] += 0.2
    known = watched(moves, 5)
    before = smoothed(known.until(25))[0].mean(axis=0)
    assert AXES[suspects(known, 26, before)[0]].name == "main.deadband"


def test_a_session_that_tells_nothing_of_an_axis_ranks_the_others():
    moves = wandering(40, 5)
    moves[25:, 3] += 0.2
    known = watched(moves, 5)
    known.matrix[-1, 1], known.matrix[-1, :, 1], known.vector[-1, 1] = 0.0, 0.0, 0.0
    before = smoothed(known.until(25))[0].mean(axis=0)
    assert AXES[suspects(known, 26, before)[0]].name == "main.deadband"


def test_a_number_of_the_rig_competes_as_an_effect_does():
    """A leak that grows beyond what healthy rigs do is the first suspect, by the sessions about its alarm, though on
    the newest session, to first order about numbers that are held, effects explain more."""
    moves = wandering(40, 5)
    moves[25:, 0] += 0.5 * np.arange(1, 16)
    known = watched(moves, 5)
    change, told = first_told(known, 0.5)
    assert change is not None
    assert AXES[suspects(known.until(told + 1), told, moves[:20].mean(axis=0))[0]].name == "b"


def test_an_effect_that_would_have_to_be_less_than_nothing_is_no_suspect():
    moves = wandering(40, 5)
    moves[25:, 2] -= 0.2
    known = watched(moves, 5)
    one_way = replace(known, axes=tuple(replace(axis, one_way=axis.name == "jack.friction") for axis in known.axes))
    before = smoothed(known.until(25))[0].mean(axis=0)
    assert AXES[suspects(known, 26, before)[0]].name == "jack.friction"
    assert AXES[suspects(one_way, 26, before)[0]].name != "jack.friction"


def test_one_odd_session_tells_nothing_and_two_do_and_so_does_one_that_is_far_off():
    odd = wandering(20, 8)
    odd[-1, 2] += 0.04
    assert first_told(watched(odd, 8), 0.5)[0] is None
    odd[-2, 2] += 0.04
    assert first_told(watched(odd, 8), 0.5)[0] is not None
    far = wandering(20, 8)
    far[-1, 2] += 0.5
    change, told = first_told(watched(far, 8), 0.5)
    assert change is not None
    assert told == 19


def test_the_rate_of_false_alarms_is_that_asked_for_or_less():
    """On histories that are drawn anew; an interval holds its value, and few sessions say nothing."""
    known = watched(wandering(40, 3), 3)
    rate = healthy_rate(known, 0.5)
    assert rate.years == pytest.approx(200 * 39 * WEEKLY / 365.25)
    assert rate.low <= rate.value <= rate.high
    assert rate.low <= 0.5
    assert healthy_rate(known, 20.0).alarms > rate.alarms
    assert healthy_rate(known.until(7), 0.5) is None


def test_a_sensor_that_some_sessions_lack_is_watched_in_the_others():
    moves = wandering(40, 9)
    moves[20:, 4] += 0.1 * np.arange(20)
    sessions = made(moves, 9)
    for k in (3, 11, 30):
        sessions[k] = without(sessions[k], "pa.zero")
    known = history(sessions, [WEEKLY * k for k in range(40)], [False] * 40, [300.0] * 40)
    assert [axis.name for axis in known.axes] == [axis.name for axis in AXES]
    change, told = first_told(known, 0.5)
    assert change is not None
    assert 20 <= told <= 26


def without(session, name):
    """The session as it is where nothing tells of an axis."""
    keep = [k for k, axis in enumerate(session.axes) if axis.name != name]
    return replace(
        session,
        axes=tuple(session.axes[k] for k in keep),
        at=session.at[keep],
        matrix=session.matrix[np.ix_(keep, keep)],
        gradient=session.gradient[keep],
    )


def test_a_repair_is_no_alarm():
    moves = wandering(40, 4)
    moves[20:, 2] += 0.3
    repairs = [k == 20 for k in range(40)]
    assert first_told(watched(moves, 4), 0.5)[0] is not None
    assert first_told(watched(moves, 4, repairs), 0.5)[0] is None


@pytest.mark.parametrize("shape", ["jump", "drift"])
@pytest.mark.parametrize("said", [True, False])
def test_a_change_that_was_mended_has_ended_and_the_next_one_is_told(shape, said):
    """Whether a remark tells of it or not; the lands wear out after the friction was mended."""
    moves = wandering(52, 4)
    moves[12:20, 2] += 0.1 if shape == "jump" else 0.02 * np.arange(1, 9)
    moves[35:, 3] += 0.2
    repairs = [said and k == 20 for k in range(52)]
    first, second = all_told(watched(moves, 4, repairs), 0.5)
    mended, worn = (each.change.among(each.left) for each in (first, second))
    assert AXES[mended.axis].name == "jack.friction"
    assert (mended.shape, mended.end) == (shape, 20)
    assert abs(mended.first - 12) <= 2
    assert (AXES[worn.axis].name, worn.end) == ("main.deadband", None)
    assert worn.earliest - 2 <= 35 <= worn.latest + 2


@pytest.mark.parametrize("oil", [0.0, 0.9])
def test_a_change_goes_on_where_something_else_was_mended(oil):
    moves = wandering(40, 4)
    moves[12:, 2] += 0.02 * (np.arange(28) + 1)
    moves[25:, 0] += oil
    (told,) = all_told(watched(moves, 4, [k == 25 for k in range(40)]), 0.5)
    assert AXES[told.change.axis].name == "jack.friction"
    assert told.change.end is None


def test_one_good_session_ends_no_change():
    moves = wandering(40, 4)
    moves[20:39, 2] += 0.04
    (told,) = all_told(watched(moves, 4), 0.5)
    assert told.change.end is None


@pytest.mark.parametrize("recorded", [True, False])
def test_the_season_of_the_oil_is_no_alarm(recorded):
    kelvin = 8.0 * np.sin(2 * np.pi * np.arange(52) / 52)
    moves = wandering(52, 6)
    moves[:, 0] += -0.03 * kelvin / 0.45
    temperatures = list(300 + kelvin) if recorded else [None] * 52
    assert first_told(watched(moves, 6, temperatures=temperatures), 0.5)[0] is None


def test_too_few_sessions_give_no_alarm():
    moves = wandering(FEWEST - 1, 0)
    moves[4:, 2] += 1.0
    assert first_told(watched(moves), 0.5) == (None, 0)


def test_evidence_is_kept_as_it_was():
    evidence = made(wandering(1, 0))[0]
    again = from_json(json.loads(json.dumps(evidence.json())))
    assert again.axes == evidence.axes
    assert np.array_equal(again.matrix, evidence.matrix)
    assert (again.samples, again.residuals) == (evidence.samples, dict(evidence.residuals))


def says(before, after):
    return Explained(before, after, 1000, 1.0, 0.1, {})


def test_a_name_leaves_little_of_what_is_new():
    name = name_of(1.0, {"jack.friction": [says(9000, 6500)], "main.deadband": [says(9000, 1050)]})
    assert name.axis == "main.deadband"
    assert name.among == ("main.deadband",)
    assert name.share == pytest.approx(0.99, abs=0.01)


def test_what_was_there_before_the_change_is_nobodys_to_explain():
    """Sessions had a chi2 of 3 all along, which friction takes away; the change is something else."""
    new = {"jack.friction": [says(9000, 7000)], "main.deadband": [says(9000, 3100)]}
    assert name_of(3.0, new).among == ("main.deadband",)


def test_what_looks_alike_is_said_beside_it_and_what_explains_little_is_no_name():
    alike = name_of(1.0, {"drive.delay": [says(5000, 1100)], "drive.lag": [says(5000, 1180)]})
    assert alike.among == ("drive.delay", "drive.lag")
    none = name_of(1.0, {"drive.delay": [says(5000, 4000)], "drive.lag": [says(5000, 4500)]})
    assert none.axis is None
    assert none.among == ("drive.delay",)


def test_every_session_counts_alike_in_a_name():
    """A formula that is not quite the rig's leaves most where the change is large; one that only bends may not win."""
    new = {
        "jack.friction": [says(1400, 1010), says(100_000, 9000)],
        "oil.air": [says(1400, 1350), says(100_000, 6000)],
    }
    assert name_of(1.0, new).axis == "jack.friction"


LEAK_AND_LANDS = {"Cl": says(9000, 4000), "K3": says(9000, 5000), "Kp": says(9000, 4500)}
LEAST = dict.fromkeys(LEAK_AND_LANDS, SECOND)


def test_two_wears_are_told_where_each_takes_what_the_other_leaves():
    pairs = {("Cl", "K3"): says(9000, 1020), ("Cl", "Kp"): says(9000, 3900), ("K3", "Kp"): says(9000, 4200)}
    assert seems_two(1.0, LEAK_AND_LANDS["Cl"], SECOND)
    both = pair_of(1.0, LEAK_AND_LANDS, pairs, LEAST)
    assert (both.axis, both.among) == ("Cl", ("K3",))
    assert both.share == pytest.approx(0.9975)
    alike = pair_of(1.0, LEAK_AND_LANDS, {**pairs, ("Cl", "Kp"): says(9000, 1010)}, LEAST)
    assert (alike.axis, alike.among) == ("Cl", ("Kp", "K3"))


def test_beside_a_number_little_that_is_left_is_a_second_wear_and_beside_an_effect_it_may_be_its_formula():
    one = {**LEAK_AND_LANDS, "Cl": says(9000, 1400)}
    pairs = {("Cl", "K3"): says(9000, 1020)}
    assert not seems_two(1.0, one["Cl"], SECOND)
    assert pair_of(1.0, one, pairs, LEAST) is None
    number = {**LEAST, "Cl": BESIDE}
    assert seems_two(1.0, one["Cl"], BESIDE)
    assert pair_of(1.0, one, pairs, number).among == ("K3",)
    assert pair_of(1.0, one, {("Cl", "K3"): says(9000, 1110)}, number) is None


def test_no_second_wear_is_told_where_a_pair_leaves_much_or_others_do_as_well():
    assert not seems_two(1.0, says(1040, 1025), SECOND)
    assert pair_of(1.0, LEAK_AND_LANDS, {("Cl", "K3"): says(9000, 1500)}, LEAST) is None
    rivals = {("Cl", "K3"): says(9000, 1020), ("K3", "Kp"): says(9000, 1015)}
    assert pair_of(1.0, {**LEAK_AND_LANDS, "K3": says(9000, 8000)}, rivals, LEAST) is None


@pytest.mark.parametrize(
    ("text", "a_year"), [("1 per 2 years", 0.5), ("1 per year", 1.0), ("2 per 6 months", 4.0), ("0.5 per 1 year", 0.5)]
)
def test_a_rate_of_false_alarms_is_read(text, a_year):
    assert alarms_a_year(text) == pytest.approx(a_year)


@pytest.mark.parametrize("text", ["often", "0 per year", "1 per 0 years", "-1 per year", "1 in 2 years"])
def test_what_is_no_rate_is_refused(text):
    with pytest.raises(InputError, match="1 per 2 years"):
        alarms_a_year(text)


def session(folder, name, more=""):
    own = folder / name
    own.mkdir(parents=True)
    rows = "".join(f"{k / 1000},0,{k}\n" for k in range(20))
    (own / "steps.csv").write_text(f"t [s],command [1],position [mm]\n{rows}")
    (own / "campaign.toml").write_text(f'rig = "jack-10t"\n[records]\ntrain = ["steps.csv"]\n{more}')


def test_sessions_are_dated_by_their_folder_or_by_what_they_say(tmp_path):
    session(tmp_path, "2026-01-12")
    session(tmp_path, "run_20260105_am")
    session(tmp_path, "first", '[session]\ndate = "2026-01-01"\noil_temperature = "42 degC"\nremark = "oil changed"\n')
    found = dated_sessions(tmp_path)
    assert [s.day for s in found.sessions] == [date(2026, 1, 1), date(2026, 1, 5), date(2026, 1, 12)]
    assert found.sessions[0].temperature == pytest.approx(315.15)
    assert [s.repair for s in found.sessions] == [True, False, False]


def test_a_campaign_is_dated_at_the_top_of_its_file_too(tmp_path):
    session(tmp_path, "first")
    file = tmp_path / "first/campaign.toml"
    dated = 'date = 2026-01-01\noil_temperature = "42 degC"\nremark = "oil changed"\n'
    file.write_text(dated + file.read_text())
    (found,) = dated_sessions(tmp_path).sessions
    assert (found.day, found.repair) == (date(2026, 1, 1), True)
    assert found.temperature == pytest.approx(315.15)
    assert [record.name for record in found.load().train] == ["steps"]


def test_sessions_of_one_campaign_are_dated(tmp_path):
    dated = "".join(
        f'[sessions.s{day}]\nrecords = ["{day}.csv"]\ndate = "2026-01-{day:02}"\nhours = {day}\n' for day in (12, 5)
    )
    session(tmp_path, "year")
    for day in (5, 12):
        (tmp_path / f"year/{day}.csv").write_text(
            "t [s],command [1],position [mm]\n" + "".join(f"{k / 1000},0,{day}\n" for k in range(20))
        )
    (tmp_path / "year/campaign.toml").write_text(
        f'rig = "jack-10t"\n[records]\ntrain = ["5.csv"]\nheldout = ["12.csv"]\n{dated}'
    )
    found = dated_sessions(tmp_path / "year")
    assert [(s.day.day, s.hours) for s in found.sessions] == [(5, 5.0), (12, 12.0)]
    assert [record.name for record in found.sessions[0].load().train] == ["5"]


@pytest.mark.parametrize(
    ("name", "more", "said"),
    [
        ("again", '[session]\ndate = "2026-01-05"\n', "one session a day is read"),
        ("lost", "", "is no date"),
        ("2026-13-40", "", "is no date"),
        ("2026-02-02", '[session]\noil_temperature = "42 parsec"\n', "oil_temperature"),
        ("2026-02-03", "[session]\nodd = 1\n", "odd"),
    ],
)
def test_a_bad_session_is_one_line_and_the_others_go_on(tmp_path, name, more, said):
    session(tmp_path, "2026-01-05")
    session(tmp_path, name, more)
    found = dated_sessions(tmp_path)
    assert [s.day for s in found.sessions] == [date(2026, 1, 5)]
    (line,) = found.left_out
    assert said in line
    assert name in line
    assert "\n" not in line


def test_a_folder_without_sessions_is_refused_in_a_line(tmp_path, capsys):
    assert main(["watch", str(tmp_path / "nowhere"), "--out", str(tmp_path / "out")]) == 2
    assert main(["watch", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 2
    assert "no such folder" in lines[0]
    assert "no dated session" in lines[1]
    assert not (tmp_path / "out").exists()
