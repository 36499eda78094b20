"""The policies of several runs, judged beside the law that they stand on, on all drawn plants."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from ...base.checkpoint import Progress, Stage
from ...base.process_pool import Jobs, process_pool
from ...loop.envelope import DRAWN
from ...loop.tuning.goals import Goals, Trial, Verdict
from ...loop.tuning.problem import TuneProblem
from ...loop.tuning.search import nearest_trial, search, stored_verdict, verdict_of


@dataclass(frozen=True)
class TrainingRun:
    """A search of weights: its `seed`, every design that was tried, and the nearest one, judged on all drawn plants."""

    seed: int
    trials: Sequence[Trial]
    nearest: Trial
    verdict: Verdict

    @property
    def curve(self) -> list[tuple[int, float | None]]:
        """The least cost so far, None before any design met every hard goal, after each part of the evaluations."""
        best: float | None = None
        points: list[tuple[int, float | None]] = []
        for trial in self.trials:
            cost = trial.verdict.cost
            best = best if cost is None else cost if best is None else min(best, cost)
            points.append((trial.number + 1, best))
        step = max(len(points) // 50, 1)
        return [*points[:-1:step], points[-1]]


def run_searches(
    problem: TuneProblem, seeds: Sequence[int], stage: Stage, progress: Progress, jobs: Jobs
) -> tuple[list[TrainingRun], Verdict]:
    """A search from each seed, and the verdict of the start, weights as they were given, on all drawn plants."""
    searched = {
        seed: search(problem, _stage_of(seed, stage), _progress_of(seed, progress), jobs, seed) for seed in seeds
    }
    nearest = {seed: nearest_trial(trials) for seed, trials in searched.items()}
    progress(f"the best of each run on all {DRAWN} drawn plants")
    start = searched[seeds[0]][0].values
    designs = {"start": start, **{f"run-{seed}": trial.values for seed, trial in nearest.items()}}
    verdicts = _on_all(problem, designs, stage, jobs)
    runs = [TrainingRun(seed, searched[seed], nearest[seed], verdicts[f"run-{seed}"]) for seed in seeds]
    return runs, verdicts["start"]


def _on_all(
    problem: TuneProblem, designs: Mapping[str, Mapping[str, float]], stage: Stage, jobs: Jobs
) -> dict[str, Verdict]:
    drawn = tuple(range(DRAWN)) if problem.factors else ()
    tasks = {f"all-plants-{name}": partial(verdict_of, values=values, drawn=drawn) for name, values in designs.items()}
    with process_pool(jobs, partial(_at_work, problem)) as pool:
        stored = pool(tasks, stage, lambda _: None)
    return dict(zip(designs, map(stored_verdict, stored), strict=True))


def _at_work(problem: TuneProblem) -> Callable[[Callable[[Goals], Any]], Any]:
    goals = Goals(problem)
    return lambda task: task(goals)


def _stage_of(seed: int, stage: Stage) -> Stage:
    return lambda name, compute: stage(f"seed-{seed}-{name}", compute)


def _progress_of(seed: int, progress: Progress) -> Progress:
    return lambda text: progress(f"seed {seed}, {text}")
