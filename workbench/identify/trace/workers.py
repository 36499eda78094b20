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
    before: Mapping[str, Any]
    item: Any


@dataclass(frozen=True, eq=False)
class Workers:
    """`count` processes that work on items about a fit."""

    count: int
    _pool: ProcessPool[_Task, dict[str, Any]]

    def __call__(
        self, work: Work, before: FittedModel, items: Mapping[str, Any], stage: Stage, done: Callable[[Any], None]
    ) -> list[dict[str, Any]]:
        """The results of `work` in the order of the items, each a stage by its name; `done` hears of each."""
        stored = packed(before)
        return self._pool({name: _Task(work, stored, item) for name, item in items.items()}, stage, done)


@contextmanager
def trace_workers(
    jobs: int, problem: EstimationProblem, library: Sequence[Effect], files: Sequence[str | Path]
) -> Iterator[Workers]:
    """Workers on a problem; with one job this process. Effects cannot be sent: other processes read `files` again."""
    here = partial(partial, _work_on, problem, library)
    there = partial(_with_effects, problem, tuple(files))
    with process_pool(jobs, here if jobs == 1 else there) as pool:
        yield Workers(jobs, pool)


def _with_effects(problem: EstimationProblem, files: Sequence[str | Path]) -> Callable[[_Task], dict[str, Any]]:
    library = with_apart(known_effects(dict.fromkeys((*problem.rig.effect_files, *files))))
    return partial(_work_on, problem, (*library, *number_effects(problem.rig)))


def _work_on(problem: EstimationProblem, library: Sequence[Effect], task: _Task) -> dict[str, Any]:
    return task.work(problem, library, unpacked(task.before, problem, library), task.item)
