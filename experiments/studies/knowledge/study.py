"""Knowledge: every structure tuned anew where the numbers are known better, and played on plants drawn within that."""

from collections.abc import Mapping, Sequence
from typing import Any

from workbench.base.checkpoint import Progress, Stage, within
from workbench.base.errors import InputError
from workbench.base.process_pool import Jobs
from workbench.base.toml_text import toml_text
from workbench.commands.common.outcome import Outcome
from workbench.commands.robustness.options import RobustnessConfig
from workbench.commands.robustness.study import run_robustness
from workbench.commands.tune.options import TuneConfig
from workbench.control.controller_spec import ControllerSpec
from workbench.control.protocol import graph_law
from workbench.loop.rig_variations import Conditions
from workbench.loop.tuning.goals import Trial
from workbench.loop.tuning.problem import TuneProblem
from workbench.loop.tuning.search import nearest_trial, search
from workbench.report import Figure, Page

from .config import KnowledgeConfig, known_problem
from .page import knowledge_figure, knowledge_page

_UNUSED = "as tuned for the widest"  # the name of a design that does not use what is known
_OF_THE_PLANTS = (
    *("plants", "unstable", "tripped", "hunting", "settling_p50_s", "settling_p99_s", "settling_worst_s"),
    *("overshoot_worst_percent", "ms_worst", "times_limit"),
)


def run_knowledge(config: KnowledgeConfig, stage: Stage, progress: Progress, jobs: Jobs = 1) -> Outcome:
    """`rows`: one a controller and share to which the numbers are known, the widest first.

    The first search of a controller starts from its experiment's numbers, each other one from the best before it, for
    what holds on wide ranges holds on narrower ones. `unused_p99_s`: the same plants under the first design.
    """
    for each in config.searches:
        if graph_law(each.start.controllers[0].build(config.rig.period.value)) is None:
            raise InputError(f"{each.name} does not run in lanes, which drawn plants need; leave its search out")
    rows: list[dict[str, Any]] = []
    files: dict[str, str] = {}
    limit: float | None = None
    for each in config.searches:
        values = {number.name: number.start for number in each.searched}
        first: ControllerSpec | None = None
        for share in config.known:
            part = f"{each.name} known to {100 * share:g} %"
            problem = known_problem(each, share, values)
            best = nearest_trial(search(problem, within(stage, part), progress, jobs))
            values = best.values
            spec = problem.design(values)
            designs = [spec] if first is None else [spec, first]
            first = first or spec.named(_UNUSED)
            played = run_robustness(_drawn(config, problem, designs), within(stage, part), progress, jobs).metrics
            limit = played["limit_s"]
            rows.append(_row(each, share, best, played["rows"]))
            files[f"{each.name}-{100 * share:g}.toml"] = toml_text(each.step_table(values, each.rig_name))
            p99 = rows[-1]["settling_p99_s"]
            progress(f"{part}: 99 % settled {'never' if p99 is None else f'within {p99:.3g} s'}")
    metrics = {"rows": rows, "limit_s": limit}

    def draw() -> tuple[Page, Figure]:
        return knowledge_page(config, metrics), knowledge_figure(metrics)

    return Outcome(metrics, draw, {}, files)


def _drawn(config: KnowledgeConfig, problem: TuneProblem, designs: Sequence[ControllerSpec]) -> RobustnessConfig:
    """Designs in the first scenario of their search on plants within what is known, which no search saw."""
    step = problem.scenarios[0]
    return RobustnessConfig(
        rig=problem.rig,
        plants=config.plants,
        conditions=Conditions(problem.conditions.ideal, config.seed),
        signal=problem.rig.signal(step.signal),
        step=step.size,
        seconds=problem.limits.seconds,
        stroke=max(map(abs, problem.positions)),
        positions=problem.positions,
        factors=problem.factors,
        controllers=tuple(designs),
        source=config.source,
        moves=problem.limits.moves,
    )


def _row(search: TuneConfig, share: float, best: Trial, played: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    used, *unused = played
    return {
        "controller": search.name,
        "known_percent": round(100 * share, 9),
        **{key: used[key] for key in _OF_THE_PLANTS},
        "unused_p99_s": (unused or [used])[0]["settling_p99_s"],
        "missed": best.verdict.missed,
        "numbers": {n.name: {"value": best.values[n.name], "unit": n.unit} for n in search.searched},
    }
