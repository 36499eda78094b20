"""Experiments and campaigns: what the commands compute, without a folder being left."""

from pathlib import Path

from ..base.checkpoint import no_checkpoint
from ..base.toml import read_toml
from ..commands.bench.study import run_bench
from ..commands.common.bench_experiment import load_bench
from ..commands.common.outcome import Outcome
from ..commands.common.shipped import campaign as campaign_folder
from ..commands.common.shipped import experiment as experiment_file
from ..commands.fit.options import STARTS
from ..commands.fit.study import FitAnswer, fit_campaign
from ..commands.residual.study import run_residual
from ..commands.run.config import load_config
from ..commands.run.study import study_of
from ..commands.trace.study import trace_campaign as trace
from ..commands.tune.config import load_tune
from ..commands.tune.study import run_tune
from ..records import Campaign, load_campaign
from ..rigs.rig import Rig
from ..rigs.rig_file import load_rig

__all__ = ["fit", "residual", "run", "trace"]


def run(experiment: str | Path, rig: str | None = None, jobs: int = 1) -> Outcome:
    """An experiment file of any kind: what `jackbench run`, `bench` and `tune` compute. Raises InputError.

    A shipped one is found by its bare name, such as "first_loop".
    """
    experiment = experiment_file(experiment)
    kind = read_toml(experiment).values.get("experiment")
    if kind == "bench":
        return run_bench(load_bench(experiment, rig), no_checkpoint, _quiet, jobs)
    if kind == "tune":
        return run_tune(load_tune(experiment, rig), no_checkpoint, _quiet, jobs)
    return study_of(load_config(experiment, rig))(no_checkpoint, _quiet)


def residual(campaign: Campaign | str | Path, rig: Rig | str | None = None, free_run: bool = False) -> Outcome:
    """A rig's model beside the held-out records of a campaign: a Campaign, or its folder. Raises InputError.

    `rig` is another one than the campaign names; `free_run` adds the error of one run through each whole record.
    """
    return run_residual(*_loaded(campaign, rig), no_checkpoint, _quiet, free_run)


def fit(campaign: Campaign | str | Path, rig: Rig | str | None = None, starts: int = STARTS) -> FitAnswer:
    """The rig's numbers that have bounds, fitted to a campaign from several starts. Raises InputError."""
    return fit_campaign(*_loaded(campaign, rig), starts, no_checkpoint, _quiet)


def _loaded(campaign: Campaign | str | Path, rig: Rig | str | None) -> tuple[Campaign, Rig]:
    if not isinstance(campaign, Campaign):
        campaign = load_campaign(campaign_folder(campaign))
    return campaign, rig if isinstance(rig, Rig) else load_rig(rig or campaign.rig, corrector=campaign.corrector)


def _quiet(_: str) -> None:
    """No report of progress."""
