"""The pages of fit, plan and retune are drawn whatever was found: results that nobody computed.

FUZZ_PAGES in the environment says how many are drawn (`make fuzz`).
"""

from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from hypothesis import given, strategies as st
from made_campaigns import campaign, rubbing
from made_pages import MARKUP, NUMBERS, beyond_all, drawn, made_result, odd_fit, odd_numbers, plain_fit, rms

from workbench.commands.common.run_folder import metrics_json
from workbench.commands.fit.page import fit_page
from workbench.commands.plan.page import plan_page
from workbench.commands.retune.config import load_retune
from workbench.commands.retune.page import retune_page, steps_figure
from workbench.identify.fit.free_parameters import Candidate, at_strength
from workbench.identify.fit.session_numbers import SessionNumber
from workbench.identify.fit.sessions import SessionDifference
from workbench.identify.found.fitted import base_intervals, correlations, fitted, fitted_rig
from workbench.identify.found.session_fit import SessionFit
from workbench.identify.plan.family import PlannedRecord, family
from workbench.identify.trace.problem import EstimationProblem, estimation_problem
from workbench.identify.trace.refit import FittedModel
from workbench.loop.hard_goals import Goal
from workbench.loop.sampled_loop import LoopRun
from workbench.loop.tuning.goals import Trial, Verdict
from workbench.plant.effects import Effect, applies, known_effects
from workbench.records import Record
from workbench.records.excitation import Excitation
from workbench.rigs.number import Number
from workbench.rigs.rig_file import rig_text


@cache
def small() -> EstimationProblem:
    """A campaign with a session, from a folder whose name is markup."""
    made = campaign(rubbing())
    return estimation_problem(replace(made, path=Path(MARKUP)), rubbing())


def one_record(problem: EstimationProblem, draw: st.DrawFn) -> EstimationProblem:
    """All of it, or one train record alone."""
    if draw(st.booleans()):
        return problem
    return replace(
        problem, train=problem.train.some([0]), campaign=replace(problem.campaign, train=problem.campaign.train[:1])
    )


def odd_sessions(draw: st.DrawFn, number: Number) -> tuple[list[SessionDifference], list[SessionFit]]:
    """Groups of records that differ, those that only the train records have too; a number of a session."""
    three = st.tuples(*[st.sampled_from(NUMBERS)] * 3)
    differences = [
        SessionDifference(draw(st.sampled_from((number.name, MARKUP))), group, ("steps",), *draw(three))
        for group in draw(st.lists(st.sampled_from((f"of session {MARKUP}", "later repeats", "with pa")), max_size=2))
    ]
    own = SessionNumber(MARKUP, number.name, {}, 1.0, *draw(st.sampled_from(((0.1, 9.0), (-1.0, 1.0)))), True)
    return differences, [SessionFit(own, number, number.value, *draw(three))] * draw(st.integers(0, 1))


@beyond_all
@made_result
@given(st.data())
def test_the_page_of_any_fit_is_drawn(data):
    draw = data.draw
    problem = one_record(small(), draw)
    model = problem.model()
    fit = odd_fit(draw, plain_fit(problem.free, model.plant.p, problem.train.count, model.plant.n))
    numbers = fitted(problem.rig, fit)
    differences, sessions = odd_sessions(draw, numbers[0].number)
    metrics = {
        "parameters": base_intervals(problem.rig, fit),
        "chi2": {"train": fit.chi2, "heldout": draw(st.sampled_from((None, 0.97, 40.0)))},
        "rms": rms(draw, ("pa [bar]", "pb [bar]", "position [mm]")),
        "unseen": [entry.number.name for entry in numbers if entry.unseen],
        "correlations": {"names": [free.name for free in fit.free], "matrix": correlations(fit)},
    }
    page, picture = fit_page(problem, numbers, sessions, differences, metrics)
    drawn(page)
    assert picture._repr_html_()
    metrics_json(metrics)
    fitted_model = FittedModel((), model, fit, SimpleNamespace(squares=np.ones(1), samples=1))
    assert rig_text(fitted_rig(problem, fitted_model))


@cache
def library() -> list[Effect]:
    """The effects that the small campaign's rig may lack."""
    return [effect for effect in known_effects() if applies(effect, small().rig)]


def plan_metrics(draw: st.DrawFn, records: dict[str, PlannedRecord]) -> dict[str, Any]:
    """Pairs with a best record or none, played or not, numbers, and records that split and tell nothing too."""
    names, kept = list(records), draw(st.lists(st.sampled_from(list(records)), unique=True, max_size=4))
    cosine = st.sampled_from((0.0, 0.71, 1.0))
    pairs, numbers = [], []
    for _ in range(draw(st.integers(0, 3))):
        effects = [effect.name for effect in draw(st.lists(st.sampled_from(library()), min_size=2, max_size=2))]
        after = {name: draw(cosine) for name in names if draw(st.booleans()) or name in kept}
        best = draw(st.sampled_from((None, *kept)))
        played = (
            None if best is None else {"cosine": draw(cosine)} | dict.fromkeys(effects, draw(st.sampled_from(NUMBERS)))
        )
        pairs.append({"effects": effects, "cosine": draw(cosine), "after": after, "best": best, "played": played})
    for _ in range(draw(st.integers(0, 3))):
        after = {name: draw(st.sampled_from(NUMBERS)) for name in names}
        best = draw(st.sampled_from((None, *kept)))
        numbers.append({"number": draw(st.sampled_from(("M", MARKUP))), "share": 0.9, "after": after, "best": best})
    rows = [
        {
            "record": name, "file": f"{name}.csv", "information": draw(st.sampled_from(NUMBERS)),
            "splits": [row["effects"] for row in pairs if row["best"] == name],
            "tells": [row["number"] for row in numbers if row["best"] == name],
            "kind": records[name].design.kind, "signal": records[name].design.signal, "peak": records[name].peak,
            "seconds": 6.0, "band": None,
        }
        for name in kept
        if any(row["best"] == name for row in (*pairs, *numbers))
    ]  # fmt: skip
    return {
        "pairs": pairs,
        "numbers": numbers,
        "records": rows,
        "not_compared": draw(st.lists(st.just(MARKUP), max_size=1)),
    }


@beyond_all
@made_result
@given(st.data())
def test_the_page_of_any_plan_is_drawn(data):
    draw, still = data.draw, np.zeros(3)
    records = {
        name: PlannedRecord(name, design, Excitation(name, 1e-3, still, still + draw(st.sampled_from(NUMBERS))))
        for name, design in list(family(small().rig).items())[:4]
    }
    metrics = plan_metrics(draw, records)
    strengths = [Candidate(effect, at_strength(effect, draw(st.sampled_from((0.1, 1.0))))) for effect in library()]
    page, picture = plan_page(one_record(small(), draw), strengths, metrics, records)
    drawn(page)
    assert picture._repr_html_()
    metrics_json(metrics)


TESTS = Path(__file__).parent


@cache
def retune_config() -> Any:
    return load_retune(TESTS.parent / "experiments" / "tune_festo_p.toml", str(TESTS / "festo_found.toml"), designs=3)


def odd_run(draw: st.DrawFn, signal: str) -> LoopRun:
    """A run of a loop, of one sample where it tripped at once."""
    n = draw(st.sampled_from((1, 2, 50)))
    t = np.arange(n) * 1e-3
    signals = {
        name: np.full(n, draw(st.sampled_from((0.0, 0.4, 1e9, -3.0))))
        for name in ("reference", "command", "pa", signal)
    }
    return LoopRun(Record("run", t, signals), np.zeros(n), draw(st.sampled_from((None, MARKUP))))


@beyond_all
@made_result
@given(st.data())
def test_the_page_of_any_retuning_is_drawn(data):
    draw, config = data.draw, retune_config()
    found = config.found
    values = {number.name: draw(st.sampled_from((number.low, number.high))) for number in found.searched}
    misses = st.sampled_from((0.0, 1.0, np.inf))
    goals = [Goal(MARKUP, draw(odd_numbers), limit, MARKUP, draw(misses)) for limit in (None, 2.0)]
    goals = [replace(goal, limit=2.0) if goal.value is not None else goal for goal in goals]
    missed = Verdict(1, draw(st.sampled_from((MARKUP, "Ms"))), 1.0, None, draw(st.sampled_from(([], goals))))
    met = Verdict(0, None, 0.0, draw(st.sampled_from((0.0, 0.4, 1e9))), goals)
    trials = [Trial(k, values, draw(st.sampled_from((missed, met))), k) for k in range(draw(st.integers(1, 4)))]
    keys = ("settling_s", "overshoot_percent", "steady_state_error", "iae", "peak_deviation", "residual_oscillation")
    keys += ("ms", "gain_margin_db", "phase_margin_deg", "band")
    rows, runs = [], {}
    for what in ("old", "retuned"):
        for where in ("declared", "found"):
            runs[what, where] = {each.name: odd_run(draw, each.signal) for each in found.start.scenarios}
            for each in found.start.scenarios:
                named = {
                    "controller": what,
                    "rig": where,
                    "scenario": each.name,
                    "tripped": draw(st.sampled_from((None, MARKUP))),
                }
                rows.append(
                    {key: draw(odd_numbers) for key in keys}
                    | named
                    | {"margins": "full", "stable": draw(st.booleans())}
                )
    gain = {key: [draw(odd_numbers), draw(odd_numbers)] for key in keys}
    metrics = {"rows": rows, "gain": gain, "scenario": found.start.scenarios[-1].name, "trials": len(trials)}
    drawn(retune_page(config, trials, draw(st.sampled_from(trials)), runs, metrics))
    assert steps_figure(found, found.start.scenarios[-1], runs, rows)._repr_html_()
    metrics_json(metrics)
