"""Scores and refits that do not wait for one another: worker processes do them, a core each (see base/process_pool.py).

What workers are given and give back is what stages keep, so that no answer depends on how many there are.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ...base.checkpoint import Stage
from ...base.process_pool import ProcessPool, process_pool
from ...plant.effects import Effect, known_effects, number_effects, with_apart
from .problem import EstimationProblem
from .refit import FittedModel
from .stored import packed, unpacked

Work = Callable[[EstimationProblem, Sequence[Effect], FittedModel, Any], dict[str, Any]]
"""A module's function of a problem, its library, a fit and an item; its result is one that a stage keeps."""


@dataclass(frozen=True)
class _Task:
    work: Work
    number: int
    before: Mapping[str, Any]
    item: Any


class Workers:
    """`count` processes that work on items about a fit."""

    def __init__(self, count: int, pool: ProcessPool[_Task, dict[str, Any]]) -> None:
        self.count, self._pool = count, pool
        self._number, self._before = 0, None

    def __call__(
        self, work: Work, before: FittedModel, items: Mapping[str, Any], stage: Stage, done: Callable[[Any], None]
    ) -> list[dict[str, Any]]:
        """The results of `work` in the order of the items, each a stage by its name; `done` hears of each."""
        if before is not self._before:
            self._number, self._before = self._number + 1, before
        stored = packed(before)
        tasks = {name: _Task(work, self._number, stored, item) for name, item in items.items()}
        return self._pool(tasks, stage, done)


@contextmanager
def trace_workers(
    jobs: int, problem: EstimationProblem, library: Sequence[Effect], files: Sequence[str | Path]
) -> Iterator[Workers]:
    """Workers on a problem; with one job this process. Effects cannot be sent: other processes read `files` again."""
    here = partial(_Worker, problem, library)
    there = partial(_with_effects, problem, tuple(files))
    with process_pool(jobs, here if jobs == 1 else there) as pool:
        yield Workers(jobs, pool)


def _with_effects(problem: EstimationProblem, files: Sequence[str | Path]) -> Callable[[_Task], dict[str, Any]]:
    library = with_apart(known_effects(dict.fromkeys((*problem.rig.effect_files, *files))))
    return _Worker(problem, (*library, *number_effects(problem.rig)))


class _Worker:
    """The work of a process; a fit that items are about is made of what it is given once, as long as no other comes."""

    def __init__(self, problem: EstimationProblem, library: Sequence[Effect]) -> None:
        self._problem, self._library = problem, library
        self._number, self._before = 0, None

    def __call__(self, task: _Task) -> dict[str, Any]:
        if self._before is None or self._number != task.number:
            self._before, self._number = unpacked(task.before, self._problem, self._library), task.number
        return task.work(self._problem, self._library, self._before, task.item)
