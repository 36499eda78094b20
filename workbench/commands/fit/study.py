"""Fit a rig's uncertain numbers to a campaign, and say which of them the recordings cannot see."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...base.numbers import finite
from ...base.process_pool import one_blas_thread
from ...identify.fit.predict import predict_whole, predict_windows, predictions
from ...identify.fit.rests import growing_pole
from ...identify.fit.session_numbers import session_plants
from ...identify.found.errors import rms_of
from ...identify.found.fitted import base_intervals, correlations, fitted, fitted_rig, pinned
from ...identify.found.session_fit import session_fits
from ...identify.trace.considered import with_considered
from ...identify.trace.problem import estimation_problem
from ...identify.trace.refit import fit_rig, heldout_errors
from ...identify.trace.stored import packed, unpacked
from ...records import Campaign
from ...report import Figure, Page
from ...rigs.rig import Rig
from ...rigs.rig_file import rig_text
from ..common.design_numbers import Subject
from ..common.error_page import record_tables
from ..common.outcome import Answer, Outcome, Progress, Stage
from ..common.sessions import sessions, sessions_json
from .ladder import ladder
from .page import fit_page
from .remains import remains
from .shares import shares
from .tells import signals_tell


@dataclass(frozen=True, repr=False)
class FitAnswer(Answer):
    """A rig as fitted, the report of the fit, and whether it `follows` the held-out records to their noise."""

    rig: Rig
    outcome: Outcome
    follows: bool

    @property
    def parameters(self) -> dict[str, list[float | None]]:
        """{"beta [Pa]": [value, low, high]}, 95 %."""
        return self.outcome.metrics["parameters"]

    @property
    def chi2(self) -> dict[str, float | None]:
        """Mean of (error / sigma)^2, "train" and "heldout"; 1 is the noise floor."""
        return self.outcome.metrics["chi2"]

    def __repr__(self) -> str:
        return repr(self.outcome)

    def _repr_html_(self) -> str:
        return self.outcome._repr_html_()


def run_fit(campaign: Campaign, rig: Rig, starts: int, stage: Stage, progress: Progress) -> Outcome:
    """The outcome of `fit_campaign`."""
    return fit_campaign(campaign, rig, starts, stage, progress).outcome


def fit_campaign(campaign: Campaign, rig: Rig, starts: int, stage: Stage, progress: Progress) -> FitAnswer:
    """Fit from several starts; parameters with intervals and correlations, errors on train and held-out records."""
    if starts < 1:
        raise InputError(f"--starts {starts}: must be 1 or more")
    with one_blas_thread():
        problem = estimation_problem(campaign, rig)
        stored = stage("fit", lambda: packed(fit_rig(problem, starts, progress)))
        model_fit = with_considered(problem, unpacked(stored, problem, ()))
        progress("errors of the rig file and of the fit")
        predict = predict_whole if problem.free_run else predict_windows
        plants = session_plants(campaign, rig)
        declared = [predict(plants[record.name], record, problem.floor) for record in campaign.heldout]
        heldout = heldout_errors(problem, model_fit)
    after = predictions(model_fit.model, problem.heldout, heldout.x0, model_fit.fit.p)
    numbers, differences = fitted(rig, model_fit.fit), sessions(problem, model_fit.fit)
    in_sessions = session_fits(problem, model_fit.fit)
    tells = signals_tell(problem, model_fit)
    of = shares(problem, model_fit, heldout.x0)
    if of:
        progress("how much structure the records bear")
    as_fitted = fitted_rig(problem, model_fit)
    metrics: dict[str, Any] = {
        "parameters": base_intervals(rig, model_fit.fit),
        "chi2": {"train": model_fit.fit.chi2, "heldout": finite(heldout.chi2)},
        "rms": rms_of(problem.floor, declared, after),
        "unseen": [entry.number.name for entry in numbers if entry.unseen],
        "at_an_end": [entry.number.name for entry in numbers if entry.at_bounds],
        "pinned": pinned(rig),
        "sessions": sessions_json(differences),
        **tells,
        **of,
        **remains(problem, as_fitted),
        **ladder(problem, of),
        **({"growing_pole": _shown(growing_pole(model_fit.model, model_fit.fit.p))} if rig.inner else {}),
        **({"session_numbers": [each.json() for each in in_sessions]} if in_sessions else {}),
        "correlations": {"names": [free.name for free in model_fit.fit.free], "matrix": correlations(model_fit.fit)},
    }
    tables = record_tables({"rig file": declared, "fitted": after})

    def draw() -> tuple[Page, Figure]:
        return fit_page(problem, numbers, in_sessions, differences, metrics)

    follows = bool(np.isfinite(heldout.chi2)) and not problem.misses(heldout.chi2, problem.heldout.samples)
    outcome = Outcome(metrics, draw, tables, {"rig.toml": rig_text(as_fitted)}, Subject(rig))
    return FitAnswer(as_fitted, outcome, follows)


def _shown(pole: complex | None) -> list[float] | None:
    """A pole [1/s] as what it grows by [1/s] and its frequency [Hz]."""
    return None if pole is None else [pole.real, abs(pole.imag) / (2 * np.pi)]
