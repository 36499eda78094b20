"""Experiments and campaigns: what the commands compute, without a folder being left."""

from collections.abc import Sequence
from inspect import signature
from pathlib import Path

from ..base.checkpoint import no_checkpoint
from ..base.toml import read_toml
from ..commands.common.outcome import Outcome
from ..commands.common.shipped import campaign as campaign_folder, experiment as experiment_file
from ..commands.fit.options import STARTS
from ..commands.fit.study import FitAnswer, fit_campaign
from ..commands.frequency.config import load
from ..commands.frequency.two_columns import PairAnswer, pair_answer
from ..commands.plan.study import run_plan
from ..commands.residual.study import run_residual
from ..commands.retune.config import load_retune
from ..commands.retune.study import run_retune
from ..commands.trace.study import trace_campaign as trace
from ..records import Campaign, load_campaign
from ..rigs.driven import driven
from ..rigs.rig import Rig
from ..rigs.rig_file import load_rig
from . import commands

__all__ = ["fit", "frequency_response", "plan", "residual", "retune", "run", "trace"]


def run(experiment: str | Path, rig: str | None = None, jobs: int = 1) -> Outcome:
    """An experiment file of any kind: what `jackbench run`, `bench`, `tune`, `robustness`, `faults`, `sines`,
    `inverse`, `learn` and `train` compute.

    Parameters
    ----------
    experiment
        Its file, or the bare name of a shipped one, such as "first_loop".
    rig
        A bundled rig or a rig file, instead of the one that the experiment names.
    jobs
        Worker processes, where the kind takes several.

    Returns
    -------
    The report with its `metrics`.

    Raises
    ------
    InputError
        For a file or a rig that cannot be.
    """
    kind = str(read_toml(experiment_file(experiment)).values.get("experiment"))
    command = getattr(commands, kind if kind in commands.FUNCTIONS else "run")
    return command(experiment, rig=rig, **({"jobs": jobs} if "jobs" in signature(command).parameters else {}))


def plan(campaign: Campaign | str | Path, rig: Rig | str | None = None) -> Outcome:
    """What to record next, to tell effects apart and to see numbers.

    Parameters
    ----------
    campaign
        A campaign folder, or a Campaign.
    rig
        Another rig than the campaign names: a Rig, a bundled rig's name or a rig file.

    Returns
    -------
    The report; `metrics` are those of `jackbench plan`.

    Raises
    ------
    InputError
        For records or a rig that cannot be read, and for records that are not of this rig.
    """
    return run_plan(*_loaded(campaign, rig), no_checkpoint, _quiet)


def frequency_response(
    recordings: str | Path | Sequence[str | Path], input: str, output: str, period: float | None = None
) -> PairAnswer:
    """How one column of recordings answers another, whatever they are: `jackbench frequency` without a rig.

    Parameters
    ----------
    recordings
        A file of any kind that `jackbench import` reads, or several, which are averaged.
    input
        Column that goes in, with or without its unit.
    output
        Column that comes out.
    period
        Length of one period [s] of periodic recordings; found in them without.

    Returns
    -------
    `response` [k] at `f` [k] Hz with its band, the `model` with its delay, and `plant`, that as a linear plant.

    Raises
    ------
    InputError
        For files without these columns or a clock, and for a column that never moves.
    """
    files = [recordings] if isinstance(recordings, str | Path) else list(recordings)
    return pair_answer(load(files, (input, output), period=period), _quiet)


def retune(
    experiment: str | Path,
    found: Rig | str | Path,
    controller: str | None = None,
    designs: int | None = None,
    jobs: int = 1,
) -> Outcome:
    """What a controller gains on the rig as found: it is searched anew there, and both are judged on both rigs.

    Parameters
    ----------
    experiment
        A tune, run or bench experiment, by file or bare name.
    found
        A rig, such as that of a trace's answer, or its file.
    controller
        The one to retune, if there are several.
    designs
        How many designs are tried; the experiment's number where none is given.
    jobs
        Worker processes.

    Returns
    -------
    The report; `metrics` are those of `jackbench retune`.

    Raises
    ------
    InputError
        For an experiment or a rig that cannot be.
    """
    rig = found if isinstance(found, Rig) else str(found)
    config = load_retune(experiment_file(experiment), rig, None, controller, designs)
    return run_retune(config, no_checkpoint, _quiet, jobs)


def residual(campaign: Campaign | str | Path, rig: Rig | str | None = None, free_run: bool = False) -> Outcome:
    """A rig's model beside the held-out records of a campaign.

    Parameters
    ----------
    campaign
        A campaign folder, or a Campaign.
    rig
        Another rig than the campaign names: a Rig, a bundled rig's name or a rig file.
    free_run
        Whether to add the error of one run through each whole record.

    Returns
    -------
    The report; `metrics` are those of `jackbench residual`.

    Raises
    ------
    InputError
        For records or a rig that cannot be read, and for records that are not of this rig.
    """
    return run_residual(*_loaded(campaign, rig), no_checkpoint, _quiet, free_run)


def fit(campaign: Campaign | str | Path, rig: Rig | str | None = None, starts: int = STARTS) -> FitAnswer:
    """The rig's numbers that have bounds, fitted to a campaign.

    Parameters
    ----------
    campaign
        A campaign folder, or a Campaign.
    rig
        Another rig than the campaign names: a Rig, a bundled rig's name or a rig file.
    starts
        How many searches are made, of which the best counts.

    Returns
    -------
    The `rig` with its fitted numbers, `parameters` with their intervals, `chi2`.

    Raises
    ------
    InputError
        For records or a rig that cannot be read, and for records that are not of this rig.
    """
    return fit_campaign(*_loaded(campaign, rig), starts, no_checkpoint, _quiet)


def _loaded(campaign: Campaign | str | Path, rig: Rig | str | None) -> tuple[Campaign, Rig]:
    if not isinstance(campaign, Campaign):
        campaign = load_campaign(campaign_folder(campaign))
    own = rig if isinstance(rig, Rig) else load_rig(rig or campaign.rig, corrector=campaign.corrector)
    return driven(campaign, own), own


def _quiet(_: str) -> None:
    """No report of progress."""
