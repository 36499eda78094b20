"""Experiments and campaigns: what the commands compute, without a folder being left."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..base.checkpoint import no_checkpoint
from ..base.toml import read_toml
from ..commands.bench.study import run_bench
from ..commands.common.bench_experiment import load_bench
from ..commands.common.outcome import Outcome
from ..commands.common.shipped import campaign as campaign_folder, experiment as experiment_file
from ..commands.faults.config import load_faults
from ..commands.faults.study import run_faults
from ..commands.fit.options import STARTS
from ..commands.fit.study import FitAnswer, fit_campaign
from ..commands.inverse.config import load_inverse
from ..commands.inverse.study import run_inverse
from ..commands.learn.config import load_learning
from ..commands.learn.study import run_learning
from ..commands.plan.study import run_plan
from ..commands.residual.study import run_residual
from ..commands.retune.config import load_retune
from ..commands.retune.study import run_retune
from ..commands.robustness.config import load_any
from ..commands.robustness.platform_study import run_any
from ..commands.run.config import load_config
from ..commands.run.study import study_of
from ..commands.sines.config import load_sines
from ..commands.sines.study import run_sines
from ..commands.trace.study import trace_campaign as trace
from ..commands.tune.config import load_tune
from ..commands.tune.study import run_tune
from ..records import Campaign, load_campaign
from ..rigs.rig import Rig
from ..rigs.rig_file import load_rig

__all__ = ["fit", "plan", "residual", "retune", "run", "trace"]

_BY_JOBS: dict[Any, tuple[Callable[..., Any], Callable[..., Outcome]]] = {
    "bench": (load_bench, run_bench),
    "tune": (load_tune, run_tune),
    "robustness": (load_any, run_any),
}
_OTHERS: dict[Any, tuple[Callable[..., Any], Callable[..., Outcome]]] = {
    "faults": (load_faults, run_faults),
    "sines": (load_sines, run_sines),
    "inverse": (load_inverse, run_inverse),
    "learn": (load_learning, run_learning),
}


def run(experiment: str | Path, rig: str | None = None, jobs: int = 1) -> Outcome:
    """An experiment file of any kind: what `jackbench run`, `bench`, `tune`, `robustness`, `faults`, `sines`,
    `inverse` and `learn` compute. Raises InputError.

    A shipped one is found by its bare name, such as "first_loop".
    """
    experiment = experiment_file(experiment)
    kind = read_toml(experiment).values.get("experiment")
    if kind in _BY_JOBS:
        load, study = _BY_JOBS[kind]
        return study(load(experiment, rig), no_checkpoint, _quiet, jobs)
    if kind in _OTHERS:
        load, study = _OTHERS[kind]
        return study(load(experiment, rig), no_checkpoint, _quiet)
    return study_of(load_config(experiment, rig))(no_checkpoint, _quiet)


def plan(campaign: Campaign | str | Path, rig: Rig | str | None = None) -> Outcome:
    """What to record next, to tell effects apart and to see numbers: `metrics` are those of `jackbench plan`.

    `rig` replaces the one that the campaign names. Raises InputError.
    """
    return run_plan(*_loaded(campaign, rig), no_checkpoint, _quiet)


def retune(
    experiment: str | Path,
    found: Rig | str | Path,
    controller: str | None = None,
    trials: int | None = None,
    jobs: int = 1,
) -> Outcome:
    """What a controller gains on the found rig: it is searched anew there, and judged on both rigs beside the old one.
    `metrics` are those of `jackbench retune`.

    experiment: a tune, run or bench experiment, by file or bare name. found: a rig, such as that of a trace's answer,
    or its file. controller: the one to retune, if there are several. trials: number of designs, else the experiment's.
    Raises InputError.
    """
    rig = found if isinstance(found, Rig) else str(found)
    config = load_retune(experiment_file(experiment), rig, None, controller, trials)
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
