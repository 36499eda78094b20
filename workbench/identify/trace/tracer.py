"""Trace a residual to the effect that the model lacks: fit, gate, localise, shortlist, refit, decide, and again.

Every step is a stage that a resumed trace reads back. The rule is in rule.py: a wrong name is worse than "unknown".
"""

from collections.abc import Callable, Sequence
from pathlib import Path

from ...base.checkpoint import Progress, Stage, endless
from ...plant.effects import Effect
from .context import trace_context
from .findings import Trace
from .problem import EstimationProblem
from .search import search_effects
from .verdict import judge_search


def trace(
    problem: EstimationProblem,
    library: Sequence[Effect],
    stage: Stage,
    report_progress: Progress,
    several: bool = False,
    jobs: int = 1,
    files: Sequence[str | Path] = (),
    learns: bool = True,
    suspects: Sequence[str] = (),
    over: Callable[[], bool] = endless,
    without: Sequence[str] = (),
) -> Trace:
    """Trace the residual of a campaign to effects of `library` (those that the rig has room for).

    `several`: the rig is known to lack more than one; effects that explain only part of what is left are added too,
    the best first, until none passes. The verdict is then "incomplete" unless the residual reaches the floor.
    Held-out records are looked at when all is decided: they confirm what was found, or nothing is named.
    `jobs`: processes that share scores and refits; the answer is the same. `files` are where effects come from that
    are neither of the library nor named by the rig. `learns`: where names leave a misfit, what is left is learned.
    `suspects`: numbers of the rig whose ranges are so narrow that scores about their ends say little; each that goes to
    an end of its range is refitted, whatever its score. `over`: whether the time for a search is over, which then ends
    with what it has found, judged all the same but not `finished`. `without`: effects that are not to be named, though
    a family of the library looks like them. Raises OutOfTime where not even the rig alone was
    fitted.
    """
    own = several, jobs, files, suspects, over, without
    with trace_context(problem, library, stage, report_progress, *own) as context:
        return judge_search(context, search_effects(context), learns and not over())
