"""Experiments and campaigns: what the commands compute, without a folder being left."""

from inspect import signature
from pathlib import Path

from ..base.checkpoint import no_checkpoint
from ..base.toml import read_toml
from ..commands.common.outcome import Outcome
from ..commands.common.shipped import campaign as campaign_folder, experiment as experiment_file
from ..commands.fit.options import STARTS
from ..commands.fit.study import FitAnswer, fit_campaign
from ..commands.plan.study import run_plan
from ..commands.residual.study import run_residual
from ..commands.retune.config import load_retune
from ..commands.retune.study import run_retune
from ..commands.trace.study import trace_campaign as trace
from ..records import Campaign, load_campaign
from ..rigs.rig import Rig
from ..rigs.rig_file import load_rig
from . import commands

__all__ = ["fit", "plan", "residual", "retune", "run", "trace"]


def run(experiment: str | Path, rig: str | None = None, jobs: int = 1) -> Outcome:
    """An experiment file of any kind: what `jackbench run`, `bench`, `tune`, `robustness`, `faults`, `sines`,
    `inverse`, `learn` and `train` compute. Raises InputError.

    A shipped one is found by its bare name, such as "first_loop".
    """
    kind = str(read_toml(experiment_file(experiment)).values.get("experiment"))
    command = getattr(commands, kind if kind in commands.FUNCTIONS else "run")
    return command(experiment, rig=rig, **({"jobs": jobs} if "jobs" in signature(command).parameters else {}))


def plan(campaign: Campaign | str | Path, rig: Rig | str | None = None) -> Outcome:
    """What to record next, to tell effects apart and to see numbers: `metrics` are those of `jackbench plan`.

    `rig` replaces the one that the campaign names. Raises InputError.
    """
    return run_plan(*_loaded(campaign, rig), no_checkpoint, _quiet)


def retune(
    experiment: str | Path,
    found: Rig | str | Path,
    controller: str | None = None,
    designs: int | None = None,
    jobs: int = 1,
) -> Outcome:
    """What a controller gains on the found rig: it is searched anew there, and judged on both rigs beside the old one.
    `metrics` are those of `jackbench retune`.

    experiment: a tune, run or bench experiment, by file or bare name. found: a rig, such as that of a trace's answer,
    or its file. controller: the one to retune, if there are several. designs: how many are tried. Raises InputError.
    """
    rig = found if isinstance(found, Rig) else str(found)
    config = load_retune(experiment_file(experiment), rig, None, controller, designs)
    return run_retune(config, no_checkpoint, _quiet, jobs)


def residual(campaign: Campaign | str | Path, rig: Rig | str | None = None, free_run: bool = False) -> Outcome:
    """A rig's model beside the held-out records of a campaign: a Campaign, or its folder. Raises InputError.

    `rig` is another one than the campaign names; `free_run` adds the error of one run through each whole record.
    """
    return run_residual(*_loaded(campaign, rig), no_checkpoint, _quiet, free_run)


def fit(campaign: Campaign | str | Path, rig: Rig | str | None = None, starts: int = STARTS) -> FitAnswer:
    """The rig's numbers that have bounds, fitted to a campaign: `rig`, `parameters` with their intervals, `chi2`.

    `rig` replaces the one that the campaign names; the best of `starts` searches counts. Raises InputError.
    """
    return fit_campaign(*_loaded(campaign, rig), starts, no_checkpoint, _quiet)


def _loaded(campaign: Campaign | str | Path, rig: Rig | str | None) -> tuple[Campaign, Rig]:
    if not isinstance(campaign, Campaign):
        campaign = load_campaign(campaign_folder(campaign))
    return campaign, rig if isinstance(rig, Rig) else load_rig(rig or campaign.rig, corrector=campaign.corrector)


def _quiet(_: str) -> None:
    """No report of progress."""
