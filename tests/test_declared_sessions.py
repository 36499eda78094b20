"""Sessions and drifts that a campaign declares: numbers that are others in their records, fitted and predicted."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from made_campaigns import campaign, commands, made, written

from workbench.base.errors import InputError
from workbench.base.process_pool import one_blas_thread
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.common.sessions import session_lines, sessions
from workbench.commands.fit.study import FitAnswer, fit_campaign
from workbench.commands.residual.study import run_residual
from workbench.commands.show.describe import describe, describe_text
from workbench.identify.fit.free_parameters import uncertain
from workbench.identify.fit.normal_equations import directions
from workbench.identify.found.session_fit import session_fits
from workbench.identify.trace.problem import estimation_problem
from workbench.identify.trace.refit import fit_rig
from workbench.records import Campaign, load_campaign
from workbench.records.sessions import DeclaredSession, Drift
from workbench.rigs.rig import Rig
from workbench.rigs.rig_file import load_rig, rig_text

FREE = ("K3", "z0")
FACTOR, SHIFT = 1.03, 0.004


def few_free() -> Rig:
    """The small cylinder with two numbers free."""
    rig = load_rig("festo-tp511")
    kept = {key: n if key in FREE else replace(n, low=None, high=None) for key, n in rig.numbers.items()}
    return replace(rig, numbers=kept)


RIG = few_free()
WARM = RIG.with_values(K3=FACTOR * RIG["K3"], z0=RIG["z0"] + SHIFT)


@cache
def two_days(numbers: tuple[str, ...] = FREE) -> Campaign:
    """A cold and a warm day of steps and a triangle; sines of both are held out."""
    steps, triangle, sines = commands(1.0)
    train = tuple(
        made(rig, f"{day} {name}", command, seed)
        for seed, (rig, day, name, command) in enumerate(
            (rig, day, name, command)
            for rig, day in ((RIG, "cold"), (WARM, "warm"))
            for name, command in (("steps", steps), ("triangle", triangle))
        )
    )
    heldout = (made(RIG, "cold sines", sines, 8), made(WARM, "warm sines", sines, 9))
    warm = DeclaredSession("warm", ("warm steps", "warm triangle", "warm sines"), numbers)
    return replace(campaign(RIG, 1.0), train=train, heldout=heldout, sessions=(warm,))


@cache
def answer(numbers: tuple[str, ...] = FREE) -> FitAnswer:
    return fit_campaign(two_days(numbers), RIG, 1, no_checkpoint, lambda _: None)


def test_what_is_true_of_a_session_is_within_its_interval():
    factor, shift = answer().outcome.metrics["session_numbers"]
    assert (factor["session"], factor["number"]) == ("warm", f"K3 [{RIG.numbers['K3'].si}]")
    for entry, kind, true in ((factor, "factor", FACTOR), (shift, "shift", SHIFT)):
        value, low, high = entry[kind]
        assert low < true < high
        assert value == pytest.approx(true, rel=0.1 if kind == "shift" else 0.01)
    assert answer().rig["K3"] == pytest.approx(RIG["K3"], rel=0.01)


def test_held_out_records_of_a_session_are_predicted_with_its_numbers():
    apart, alike = (answer(numbers).chi2["heldout"] for numbers in (FREE, ()))
    assert apart is not None
    assert alike is not None
    assert apart < 1.1 < alike


def test_the_rig_as_found_has_the_session_and_other_commands_take_it(tmp_path):
    file = tmp_path / "found.toml"
    file.write_text(rig_text(answer().rig))
    found = load_rig(file)
    assert found == answer().rig
    assert found.in_session("warm")["K3"] == pytest.approx(WARM["K3"], rel=0.01)
    assert found.in_session(None).numbers == found.numbers
    residual = run_residual(two_days(), found, no_checkpoint, lambda _: None, free_run=True)
    assert residual.metrics["chi2"] == pytest.approx(answer().chi2["heldout"], rel=0.01)
    assert [row["records"] for row in residual.metrics["free_run"]][::4] == [["cold sines"], ["warm sines"]]
    assert "\n\nSession warm\nK3" in describe_text(describe(found))
    again = estimation_problem(two_days(), found)
    assert [number.start for number in again.sessions] == pytest.approx([FACTOR, SHIFT], rel=0.1)


def test_slopes_to_what_a_session_or_drift_changes_are_those_of_differences():
    drift = Drift("days", ("warm steps", "cold steps", "warm triangle"), FREE, "record")
    problem = estimation_problem(replace(two_days(), drifts=(drift,)), RIG)
    model, train = problem.model(), problem.train
    x0 = model.starts(train, model.p)
    along = directions(model, problem.free, np.zeros(len(problem.free)))
    slopes = model.slopes(train, x0, model.p, along)
    for k in range(len(problem.free)):
        ahead, behind = (model.errors(train, x0, model.p + sign * 1e-3 * along[k]) for sign in (1, -1))
        for slope, a, b in zip(slopes, ahead, behind, strict=True):
            exact = slope[..., model.plant.n + k]
            error = (a - b).reshape(exact.shape) / 2e-3 - exact
            assert np.linalg.norm(error) < 0.01 * np.linalg.norm(exact)  # what tangents are exact to


def test_nothing_differs_any_more_and_a_declared_session_is_asked_for_more():
    assert answer().outcome.metrics["sessions"] == []
    problem = estimation_problem(two_days(("z0",)), RIG)
    with one_blas_thread():
        (difference,) = sessions(problem, fit_rig(problem).fit)[:1]
    assert (difference.group, difference.number) == ("of session warm", "K3")
    assert session_lines(problem, difference) == ["[sessions.warm]", 'numbers = ["z0", "K3"]']


def test_a_group_that_differs_is_told_with_the_lines_that_declare_it():
    plain = replace(two_days(), sessions=())
    of_pb = replace(
        plain,
        train=tuple(replace(r, signals={n: v for n, v in r.signals.items() if n != ("pb", "pa")["warm" in r.name]})
                    for r in plain.train),
        heldout=tuple(replace(r, signals={n: v for n, v in r.signals.items() if n != ("pb", "pa")["warm" in r.name]})
                      for r in plain.heldout),
    )  # fmt: skip
    problem = estimation_problem(of_pb, RIG)
    with one_blas_thread():
        difference = sessions(problem, fit_rig(problem).fit)[0]
    assert session_lines(problem, difference)[1] in ('records = ["cold *"]', 'records = ["warm *"]')


def test_without_train_records_on_both_sides_a_session_is_not_fitted():
    days = two_days()
    warm_only = replace(days, train=days.train[2:], heldout=(*days.train[:2], *days.heldout))
    cold_only = replace(days, train=days.train[:2], heldout=(*days.train[2:], *days.heldout))
    for one_day in (warm_only, cold_only):
        problem = estimation_problem(one_day, RIG)
        assert problem.free == uncertain(RIG)
        assert len(problem.sessions) == 2


def folder(tmp_path, lines: str):
    """The two days as files, with further lines in campaign.toml."""
    path = written(replace(two_days(), sessions=()), tmp_path / "days")
    (path / "campaign.toml").write_text((path / "campaign.toml").read_text() + "\n" + lines)
    return path


def test_sessions_are_read_with_patterns_of_names_and_files(tmp_path):
    path = folder(tmp_path, '[sessions.warm]\nrecords = ["warm s*", "warm triangle.csv"]\ntemperature = "48 degC"')
    (warm,) = load_campaign(path).sessions
    assert sorted(warm.records) == ["warm sines", "warm steps", "warm triangle"]
    assert warm.numbers == ()
    assert warm.temperature == pytest.approx(321.15)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ('[sessions.warm]\nrecords = ["hot_*"]', 'sessions.warm.records: "hot_*" is no record; there are'),
        ('[sessions.warm]\nnumbers = ["K3"]', "sessions.warm.records: missing"),
        ('[sessions.warm]\nrecords = ["warm *"]\nnumber = ["K3"]', 'number: unknown key; did you mean "numbers"?'),
        ('[sessions.a]\nrecords = ["warm *"]\n[sessions.b]\nrecords = ["* steps"]', "warm steps is also in session a"),
        ('[sessions.warm]\nrecords = ["*"]\nnumbers = ["K3"]', "train record belongs to a session with its own K3"),
        ('[sessions.warm]\nrecords = ["warm *"]\ntemperature = "48 bar"', "temperature"),
        ("sessions = 3", "sessions"),
    ],
)  # fmt: skip
def test_a_bad_session_is_refused_in_one_line(tmp_path, lines, said):
    path = folder(tmp_path, lines if lines.startswith("[") else "")
    if not lines.startswith("["):
        (path / "campaign.toml").write_text(lines + "\n" + (path / "campaign.toml").read_text())
    with pytest.raises(InputError) as error:
        load_campaign(path)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(("number", "said"), [("K4", "has no number K4"), ("M", "has no bounds")])
def test_a_number_that_the_rig_lacks_or_holds_is_refused(number, said):
    with pytest.raises(InputError, match=f"sessions.warm.numbers: .*{said}"):
        estimation_problem(two_days((number,)), RIG)
    with pytest.raises(InputError, match=said):
        run_residual(two_days((number,)), RIG, no_checkpoint, lambda _: None)


def test_reports_name_the_numbers_of_a_session():
    page = answer().outcome.page
    assert "In session warm: K3 1.0" in page.verdict
    assert any(section.title == "In sessions" for section in page.sections)
    assert len(session_fits(estimation_problem(two_days(), RIG), fit_of())) == 2
    json.dumps(answer().outcome.metrics["session_numbers"])


STEP = 1.015


@cache
def warming_up(numbers: tuple[str, ...] = ("K3",)) -> Campaign:
    """Three repeats of steps and of a triangle in which the valve passes more each time; a fourth is held out."""
    steps, triangle, _ = commands(1.0)
    runs = [
        made(RIG.with_values(K3=RIG["K3"] * STEP**run), f"{name} {run}", command, 10 * run + len(name))
        for run in range(4)
        for name, command in (("steps", steps), ("triangle", triangle))
    ]
    names = tuple(record.name for record in runs)
    drifts = (Drift("warming", names, numbers, "repeat"),) if numbers else ()
    return replace(campaign(RIG, 1.0), train=tuple(runs[:6]), heldout=tuple(runs[6:]), drifts=drifts)


def test_a_drift_is_within_its_interval_and_predicts_the_next_repeat():
    alike, apart = (
        fit_campaign(warming_up(numbers), RIG, 1, no_checkpoint, lambda _: None).outcome for numbers in ((), ("K3",))
    )
    (drift,) = apart.metrics["session_numbers"]
    assert (drift["session"], drift["per"]) == ("warming", "repeat")
    value, low, high = drift["factor"]
    assert low < STEP < high
    assert value == pytest.approx(STEP, abs=2e-3)
    assert apart.metrics["chi2"]["heldout"] < 1.1 < alike.metrics["chi2"]["heldout"]
    assert "Drift warming: K3 1.01" in apart.page.verdict


def test_later_repeats_that_differ_are_told_with_the_lines_of_a_drift():
    problem = estimation_problem(warming_up(()), RIG)
    with one_blas_thread():
        difference = sessions(problem, fit_rig(problem).fit)[0]
    lines = ["[drifts.repeats]", 'records = ["*"]', 'numbers = ["K3"]', 'per = "repeat"']
    assert session_lines(problem, difference) == lines


def test_a_drift_counts_records_or_repeats_in_their_order(tmp_path):
    lines = '[drifts.a]\nrecords = ["warm *", "cold *"]\nnumbers = ["K3"]\nper = "{}"'
    for per, weights in (("record", [0, 1, 2, 3, 4, 5]), ("repeat", [0, 0, 0, 1, 1, 1])):
        days = load_campaign(folder(tmp_path / per, lines.format(per)))
        (number,) = estimation_problem(days, RIG).sessions
        assert list(number.weights.values()) == weights
        assert next(iter(number.weights)) == "warm steps"


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ('records = ["hot_*"]\nnumbers = ["K3"]\nper = "record"', 'drifts.a.records: "hot_*" is no record'),
        ('records = ["*"]\nnumbers = ["K3"]\nper = "hour"', "drifts.a.per"),
        ('records = ["*"]\nper = "record"', "drifts.a.numbers: missing"),
        ('records = ["*"]\nnumbers = ["K3"]\nper = "record"\nby = 2', "drifts.a.by: unknown key"),
    ],
)
def test_a_bad_drift_is_refused_in_one_line(tmp_path, lines, said):
    with pytest.raises(InputError) as error:
        load_campaign(folder(tmp_path, f"[drifts.a]\n{lines}"))
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_a_number_may_drift_within_sessions():
    drift = Drift("days", ("warm steps", "cold steps", "warm triangle"), ("K3",), "record")
    problem = estimation_problem(replace(two_days(), drifts=(drift,)), RIG)
    model = problem.model()
    p = model.p.copy()
    p[-3:] = [FACTOR, SHIFT, STEP]
    (group,) = problem.train.groups
    values = model.parameters_of(problem.train, group, p)[:, model.plant.parameters.index("K3")]
    power = {"cold steps": (0, 1), "cold triangle": (0, 0), "warm steps": (1, 0), "warm triangle": (1, 2)}
    of = [power[problem.train.records[problem.train.spans[w][0]].name] for w in group.which]
    assert values == pytest.approx([RIG["K3"] * FACTOR**a * STEP**b for a, b in of])


@cache
def fit_of():
    with one_blas_thread():
        return fit_rig(estimation_problem(two_days(), RIG)).fit
