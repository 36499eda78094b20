"""What every part of a trace works with: its problem, the effects that it may find, and stages that keep its fits."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from ...base.checkpoint import Progress, Stage, endless, until
from ...plant.effects import Effect, applies, number_effects, with_apart
from . import rule as decide
from .locate import FaultLocation, locate_fault
from .problem import EstimationProblem
from .refit import FittedModel, HeldoutErrors, heldout_errors, numbers_explain, refit_all_windows
from .steps import TraceProgress
from .stored import packed, unpacked
from .told import ToldEffects, told_effects
from .workers import Workers, trace_workers


@dataclass(frozen=True, eq=False)
class TraceContext:
    """A trace's problem and stages: a search takes the windows of `problem`, which are all or a part of `whole`.

    Numbers that are `suspects` are refitted whatever their score. `over`: whether the time for a search is over.
    `without`: effects that are not to be named.
    """

    whole: EstimationProblem
    problem: EstimationProblem
    library: Sequence[Effect]
    stage: Stage
    report_progress: Progress
    several: bool
    workers: Workers
    steps: TraceProgress
    suspects: tuple[str, ...] = ()
    over: Callable[[], bool] = endless
    without: tuple[str, ...] = ()

    @property
    def timed(self) -> "TraceContext":
        """This context, whose stages raise OutOfTime where the time for a search is over."""
        return replace(self, stage=until(self.stage, self.over))

    @property
    def by_batches(self) -> bool:
        """Whether several effects are sought at once, in free runs from rest (see batches.py)."""
        return self.several and self.problem.train.from_rest

    def fit(self, name: str, compute: Callable[[], FittedModel]) -> FittedModel:
        """A fit on the windows of the search, kept as a stage."""
        return unpacked(self.stage(name, lambda: packed(compute())), self.problem, self.library)

    def fit_all_windows(self, name: str, model_fit: FittedModel) -> FittedModel:
        """A fit of the search refitted to all windows; where none were left out it stays."""
        if self.whole is self.problem:
            return model_fit
        stored = self.stage(name, lambda: packed(refit_all_windows(self.whole, model_fit)))
        return unpacked(stored, self.whole, self.library)

    def heldout(self, name: str, model_fit: FittedModel) -> HeldoutErrors:
        """The errors of a fit on the held-out records, kept as a stage."""
        return HeldoutErrors(**self.stage(f"heldout {name}", lambda: asdict(heldout_errors(self.whole, model_fit))))

    def numbers_explain(self, model_fit: FittedModel, heldout: HeldoutErrors) -> bool:
        """Whether numbers alone explain a misfit on the held-out records, kept as a stage."""
        name = "-".join(("both", *(effect.title for effect in model_fit.effects)))
        stored = self.stage(name, lambda: {"explained": numbers_explain(self.whole, model_fit, heldout)})
        return bool(stored["explained"])

    def location(
        self, name: str, model_fit: FittedModel, heldout: HeldoutErrors | None = None, ahead: int = 1
    ) -> FaultLocation:
        """In which equation the misfit of a fit sits, kept as a stage; so many steps are known to be `ahead`."""

        def compute() -> dict[str, Any]:
            self.steps.begin("in which equation", "equation", ahead=ahead)
            location = locate_fault(self.whole if heldout else self.problem, model_fit, heldout)
            self.steps.done()
            evidence = [list(gain) for gain in location.evidence]  # a stage keeps no tuples
            return asdict(location) | {"evidence": evidence}

        stored = self.stage(name, compute)
        return FaultLocation(
            stored["equation"], tuple((name, gain) for name, gain in stored["evidence"]), stored["parity_residuals"]
        )

    def told(self, base: FittedModel) -> ToldEffects:
        """Which effects the records tell about the rig alone, kept as a stage."""
        return ToldEffects(**self.stage("told", lambda: asdict(told_effects(self.problem, base, self.library))))

    def is_misfit(self, errors: FittedModel | HeldoutErrors) -> bool:
        """Whether chi2 on what a fit did not see says that something is missing."""
        return self.problem.misses(errors.chi2, errors.samples)

    def is_significant(self, place: FaultLocation) -> bool:
        """Whether a disturbance in the best equation explains more than noise would."""
        return place.evidence[0][1] >= decide.SIGNIFICANT * self.problem.kappa


@contextmanager
def trace_context(
    problem: EstimationProblem,
    library: Sequence[Effect],
    stage: Stage,
    report_progress: Progress,
    several: bool,
    jobs: int = 1,
    files: Sequence[str | Path] = (),
    suspects: Sequence[str] = (),
    over: Callable[[], bool] = endless,
    without: Sequence[str] = (),
) -> Iterator[TraceContext]:
    """The context of a trace, with the windows that a search needs and `jobs` processes."""
    search = problem
    if problem.large:
        search = problem.only(stage("windows", problem.chosen))
    able = [effect for effect in with_apart(library) if applies(effect, problem.rig)]
    able += number_effects(problem.rig) if several else ()
    with trace_workers(jobs, search, able, files) as workers:
        steps = TraceProgress(report_progress)
        own = tuple(suspects), over, tuple(without)
        yield TraceContext(problem, search, able, stage, report_progress, several, workers, steps, *own)
