"""Why do model and rig disagree? Traces a campaign's residual to the effects that the model lacks, and reports it."""

import json
from collections.abc import Callable, Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

from ...base.checkpoint import endless
from ...base.process_pool import one_blas_thread
from ...identify.acceptance.when_new import rig_when_new
from ...identify.found.detectability import detectability
from ...identify.found.fitted import fitted_rig
from ...identify.found.missing_shape import missing_shape
from ...identify.plan.questions import advice as record_advice
from ...identify.trace.problem import traced_problem
from ...identify.trace.tracer import trace
from ...plant.effects import Effect
from ...plant.effects.declared import effects_for
from ...records import Campaign, load_campaign
from ...records.fingerprint import fingerprint
from ...report import Figure, Page
from ...rigs.driven import driven, load_driven
from ...rigs.rig import Rig
from ...rigs.rig_file import load_rig, rig_text
from ..common.design_numbers import Subject
from ..common.error_page import record_tables
from ..common.outcome import Outcome, Progress, Stage, no_checkpoint
from ..common.run_folder import metrics_json
from ..common.shipped import campaign as campaign_folder
from .answer import TraceAnswer
from .metrics import compared, labels, more_json, numbers_of, trace_json
from .page import trace_page
from .when_new import beside_new


def trace_campaign(
    campaign: Campaign | str | Path,
    rig: Rig | str | None = None,
    effects: Sequence[str | Path] = (),
    without: Sequence[str] = (),
    several: bool = False,
    stage: Stage = no_checkpoint,
    progress: Progress = lambda _: None,
    jobs: int = 1,
    learns: bool = True,
    over: Callable[[], bool] = endless,
) -> TraceAnswer:
    """Why do model and rig disagree? Trace a campaign's residual to the effect that the model lacks.

    Parameters
    ----------
    campaign
        A campaign folder, or a Campaign.
    rig
        Another rig than the campaign names: a Rig, a bundled rig's name or a rig file.
    effects
        Python files with effects of your own.
    without
        Names of effects that are not to be tried.
    several
        Whether the rig is known to lack more than one effect, so that those which only explain a part are added too.
    stage
        How long stages are kept; nothing is kept by default.
    progress
        What is told of the progress.
    jobs
        Worker processes; the answer is the same. A script that asks for several needs `if __name__ == "__main__"`.
    learns
        Whether, where names leave a misfit, its shape is learned, which may take longer than all else.
    over
        Whether the time for a search is over, which then ends with what it has found.

    Returns
    -------
    The verdict, the effects with their numbers, and the rig that has them.

    Raises
    ------
    InputError
        For records, a rig or effects that cannot be read, and for records that are not of this rig.
    """
    if not isinstance(campaign, Campaign):
        campaign = load_campaign(campaign_folder(campaign))
    if not isinstance(rig, Rig):
        rig = load_rig(rig or campaign.rig, corrector=campaign.corrector)
    campaign = driven(campaign, rig)
    files = [str(Path(file).resolve()) for file in effects]
    library = effects_for(rig, files, without)
    return trace_answer(campaign, rig, library, stage, progress, files, without, several, jobs, learns, over=over)


def run_trace(
    campaign: Campaign,
    rig: Rig,
    library: Sequence[Effect],
    stage: Stage,
    progress: Progress,
    files: Sequence[str] = (),
    several: bool = False,
    jobs: int = 1,
) -> Outcome:
    """Trace a campaign to effects of `library` by `jobs` processes; `files` are where further effects come from."""
    return trace_answer(campaign, rig, library, stage, progress, files, (), several, jobs).outcome


def run_trace_since(
    source: str,
    rows: Mapping[str, Mapping[str, Any]],
    campaign: Campaign,
    rig: Rig,
    library: Sequence[Effect],
    stage: Stage,
    progress: Progress,
    files: Sequence[str] = (),
    jobs: int = 1,
) -> Outcome:
    """Trace from the rig on that a valve's sheet of `rows`, a file `source`, had when it was new; what has worn may
    be several, numbers among them."""
    progress("the rig as its valve's sheet has it")
    new = rig_when_new(rig, rows, source)
    answer = trace_answer(campaign, new.rig, library, stage, progress, files, (), True, jobs, suspects=new.names)
    return beside_new(answer, campaign, new, rows).outcome


def identity(
    campaign: Campaign, rig: Rig, files: Sequence[str], without: Sequence[str], several: bool
) -> dict[str, Any]:
    """What says that a trace is the same one."""
    return {
        "command": "trace",
        "campaign": fingerprint(campaign),
        "rig": rig.table(),
        "effects": digest((*rig.effect_files, *files)),
        "without": sorted(without),
        "several": several,
    }


def trace_answer(
    campaign: Campaign,
    rig: Rig,
    library: Sequence[Effect],
    stage: Stage,
    progress: Progress,
    files: Sequence[str],
    without: Sequence[str],
    several: bool,
    jobs: int,
    learns: bool = True,
    suspects: Sequence[str] = (),
    over: Callable[[], bool] = endless,
) -> TraceAnswer:
    """The answer of a campaign about effects of `library`; see trace_campaign."""
    with one_blas_thread():
        problem = traced_problem(campaign, rig)
        result = trace(problem, library, stage, progress, several, jobs, files, learns, suspects, over, without)
        answer, both = trace_json(result), compared(result)
    rig_found = fitted_rig(result.problem, result.final, files)
    texts = {"trace.json": metrics_json(answer), "rig.toml": rig_text(rig_found)}
    tables = record_tables(dict(zip(labels(result), both, strict=False)))

    def draw() -> tuple[Page, Figure]:
        with one_blas_thread():
            shape, none = missing_shape(result, stage, progress), result.verdict == "none"
            shown = detectability(result.problem, result.final, library, stage, progress) if none else None
            advice = record_advice(result, [each.number.name for each in numbers_of(result)], stage, progress)
        return trace_page(result, answer, both, library, shape, shown, advice)

    outcome = Outcome(answer | more_json(result), draw, tables, texts, Subject(rig))
    return TraceAnswer(result, rig_found, outcome, identity(campaign, rig, files, without, several))


def traced(folder: Path, removed: tuple[str, ...] = (), several: bool = False, learns: bool = True) -> dict[str, Any]:
    """The answer about a campaign folder without effects called `removed`: trace.json, and the fitted base numbers.

    `learns`: see trace_campaign.
    """
    campaign, rig = load_driven(folder)
    with one_blas_thread():
        library = effects_for(rig, without=removed)
        own = traced_problem(campaign, rig), library, no_checkpoint, lambda _: None, several
        result = trace(*own, learns=learns, without=removed)
        whole = trace_json(result) | more_json(result)
    return json.loads(metrics_json(whole))


def digest(files: Sequence[str]) -> dict[str, str]:
    """What says that effect files are the same ones."""
    return {Path(file).name: sha256(Path(file).read_bytes()).hexdigest()[:16] for file in files}
