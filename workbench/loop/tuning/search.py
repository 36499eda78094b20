"""The search itself: designs asked for and judged in parts, and between them harder plants to judge them on.

Designs are tried by evolution of the searched numbers, each from 0 at its low to 1 at its high end, by the covariance
matrix adaptation of Hansen and Ostermeier, Evolutionary Computation 9(2), 2001.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from math import ceil
from typing import Any

import numpy as np
from cmaes import CMA

from ...base.checkpoint import Progress, Stage
from ...base.process_pool import Jobs, ProcessPool, process_pool
from ..hard_goals import Goal
from .goals import Goals, Plants, Trial, Verdict
from .problem import Searched, TuneProblem

TOGETHER = 12  # designs of a generation: none is learnt from before all are judged
_WIDTH = 0.15  # of the ranges: how far about the start the first generation lies
_OF_WEIGHTS = 0.2  # of that for a network's: most of the first generation are stable loops, as the start is
_NARROW = 1e-3  # of the ranges: a generation within it has come to rest
PARTS = 10  # of a search: after each the plants that are hardest for its best design join those that count
_LEADING = 25  # designs that are judged again when plants have joined

Values = Mapping[str, float]
Task = Callable[[Goals], Any]  # what a process does on the goals that it made
Pool = ProcessPool[Task, Any]


class Sampler:
    """Asks for designs, and learns from the scores of a generation at a time, small ones being good.

    Where the population has come to rest, a new one starts about the best design so far.
    """

    def __init__(self, searched: Sequence[Searched], seed: int) -> None:
        self._searched, self._seed = searched, seed
        self._best = np.array([_share(number, number.start) for number in searched]), np.inf
        self._evolution = self._about_the_best()
        self._judged: list[tuple[np.ndarray, float]] = []

    def ask(self) -> np.ndarray:
        """A design as shares of the ranges [k]."""
        return self._evolution.ask()

    def values(self, shares: np.ndarray) -> dict[str, float]:
        """The numbers of a design by name, each in its unit."""
        every = zip(self._searched, shares.tolist(), strict=True)
        return {number.name: number.rounded(_value(number, share)) for number, share in every}

    def tell(self, shares: np.ndarray, score: float) -> None:
        """How good a design is that was asked for."""
        self._judged.append((shares, score))
        if score < self._best[1]:
            self._best = shares, score
        if len(self._judged) == TOGETHER:
            self._evolution.tell(self._judged)
            if np.ptp([shares for shares, _ in self._judged], axis=0).max() < _NARROW:
                self._evolution = self._about_the_best()
            self._judged = []

    def _about_the_best(self) -> CMA:
        self._seed += 1
        bounds = np.tile([0.0, 1.0], (len(self._searched), 1))
        shape = np.diag([_OF_WEIGHTS**2 if number.is_weight else 1.0 for number in self._searched])
        return CMA(self._best[0], _WIDTH, bounds=bounds, seed=self._seed, population_size=TOGETHER, cov=shape)


def _share(number: Searched, value: float) -> float:
    if number.log:
        return float(np.log(value / number.low) / np.log(number.high / number.low))
    return (value - number.low) / (number.high - number.low)


def _value(number: Searched, share: float) -> float:
    if number.log:
        return float(number.low * (number.high / number.low) ** share)
    return number.low + share * (number.high - number.low)


def search(
    problem: TuneProblem, stage: Stage, progress: Progress, jobs: Jobs = 1, seed: int | None = None
) -> list[Trial]:
    """Every design that is tried, by the workers of `jobs`; the first is the start, the best is `nearest_trial`.

    `seed`: of the sampler, where it is another than that of the problem's drawn plants.

    The drawn plants that count are at first the hardest for the start. After each part of the trials those that are
    hardest for the best design join them, and the leading designs are judged again; at the end until the hardest for
    the best design count already, so that it meets the hard goals on every drawn plant. A generation is asked for at a
    time, however many processes judge it: the search is the same on any number.
    """
    with process_pool(jobs, partial(_at_work, problem)) as pool:
        state = _Search(problem, pool, stage, progress, problem.seed if seed is None else seed)
        for part in range(1, PARTS + 1):
            state.try_designs(ceil(problem.trials * part / PARTS))
            state.add_plants()
        while nearest_trial(state.trials).verdict.cost is not None and state.add_plants():
            pass
    return state.trials


def nearest_trial(trials: Sequence[Trial]) -> Trial:
    """The best design, or where none meets every hard goal the one that comes nearest."""
    return min(trials, key=lambda trial: trial.verdict.score)


def _at_work(problem: TuneProblem) -> Callable[[Task], Any]:
    """The work of one process."""
    goals = Goals(problem)
    return lambda task: task(goals)


class _Search:
    """The trials so far, each as it was judged last, and the drawn plants that count. Everything that takes long is a
    stage."""

    def __init__(self, problem: TuneProblem, pool: Pool, stage: Stage, progress: Progress, seed: int) -> None:
        self._problem, self._pool, self._stage, self._progress = problem, pool, stage, progress
        self._hardest: dict[int, list[list[int]]] = {}  # plants by kind, for the design of a trial
        self.trials: list[Trial] = []
        self._drawn: Plants = ()
        start = {n.name: n.rounded(n.start) for n in problem.searched}
        self._join(self._hardest_for(0, start))
        self._add(*self._judged({0: start}, ""))
        self._sampler = Sampler(problem.searched, seed)

    def try_designs(self, upto: int) -> None:
        """The trials up to a number."""
        while (first := len(self.trials)) < upto:
            asked = [self._sampler.ask() for _ in range(min(TOGETHER, upto - first))]
            designs = dict(enumerate(map(self._sampler.values, asked), first))
            for shares, trial in zip(asked, self._judged(designs, ""), strict=True):
                self._add(trial)
                self._sampler.tell(shares, trial.verdict.score)

    def _add(self, trial: Trial) -> None:
        self.trials.append(trial)
        place, best = f"trial {trial.number + 1} of {self._problem.trials}", _best_word(self.trials)
        self._progress(f"{place}: {_word(trial.verdict)}; {best}")

    def add_plants(self) -> bool:
        """The hardest plants for the best design join, and the leading designs are judged again.

        False where the hardest of every kind count already, and so nothing is to be done.
        """
        best = nearest_trial(self.trials)
        kinds = self._hardest_for(best.number, best.values)
        if {kind[0] for kind in kinds} <= set(self._drawn):
            return False
        self._join(kinds)
        self._progress(f"{len(self._drawn)} drawn plants count")
        while old := [trial for trial in self._leading() if trial.drawn < len(self._drawn)]:
            designs = {trial.number: trial.values for trial in old}
            for trial in self._judged(designs, f" on {len(self._drawn)}"):
                self.trials[trial.number] = trial
        return True

    def _leading(self) -> list[Trial]:
        """Judged on fewer plants they look better than they are, never worse."""
        return sorted(self.trials, key=lambda trial: trial.verdict.score)[:_LEADING]

    def _join(self, kinds: Sequence[Sequence[int]]) -> None:
        self._drawn = tuple(sorted({*self._drawn, *(plant for kind in kinds for plant in kind)}))

    def _hardest_for(self, number: int, values: Values) -> list[list[int]]:
        if number not in self._hardest:
            task = {f"hardest-{number:05d}": partial(Goals.hardest, values=values)}
            (self._hardest[number],) = self._pool(task, self._stage, lambda _: None)
        return self._hardest[number]

    def _judged(self, designs: Mapping[int, Values], where: str) -> list[Trial]:
        """Designs by number on the drawn plants that count."""
        tasks = {
            f"trial-{number:05d}{where}": partial(verdict_of, values=values, drawn=self._drawn)
            for number, values in designs.items()
        }
        verdicts = self._pool(tasks, self._stage, lambda _: None)
        return [
            Trial(number, values, stored_verdict(verdict), len(self._drawn))
            for (number, values), verdict in zip(designs.items(), verdicts, strict=True)
        ]


def verdict_of(goals: Goals, values: Values, drawn: Plants) -> dict[str, Any]:
    """The verdict on a design, as a stage can store it."""
    return asdict(goals.judge(values, drawn))


def stored_verdict(verdict: Mapping[str, Any]) -> Verdict:
    return Verdict(**{**verdict, "goals": [Goal(**goal) for goal in verdict["goals"]]})


def _word(verdict: Verdict) -> str:
    return f"cost {verdict.cost:.4g}" if verdict.cost is not None else f"misses: {verdict.missed}"


def _best_word(trials: Sequence[Trial]) -> str:
    costs = [trial.verdict.cost for trial in trials if trial.verdict.cost is not None]
    return f"best {min(costs):.4g}" if costs else "none yet meets every goal"
