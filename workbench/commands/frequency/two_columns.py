"""Frequency response of two recorded columns, whatever they are, and the linear plant that is fitted to it."""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...base.table import ConfigTable
from ...base.toml_text import toml_text
from ...base.words import counted
from ...identify.data.causality import lead_problem
from ...identify.data.frequency_response import FrequencyResponse, averaged, measured_response
from ...records.rational_fit import BENT, FitOrder, RationalFit, fit_judged, fit_rational
from ...report import Figure, Page
from ...rigs.linear_file import read_linear_rig
from ...rigs.linear_rig import LinearRig
from ...rigs.linear_signals import measured_as
from ..common.outcome import Answer, Outcome, Progress, Stage
from .config import FrequencyTask
from .page import Comparison, columns, figure, page, rows

PLANT = "plant.toml"
_Lines = tuple[np.ndarray, np.ndarray, np.ndarray]
_SURE, _VAGUE = 0.1, 0.5  # of the response: a line whose 95 % radius is less says much of a model, beyond nothing
_FEWEST = 12  # lines


@dataclass(frozen=True, eq=False)
class PairModel:
    """A transfer function with a delay near a response; `misfit` is the rms of its error at lines that chose its order
    and were not fitted, over their 95 % radius or 2 % of the response; `judged` says which lines."""

    fit: RationalFit
    misfit: float
    judged: str


def pair_model(responses: Sequence[FrequencyResponse]) -> PairModel:
    """Its order is chosen by the last record, or every second line of a single one; then all lines are fitted.

    Raises InputError where too few lines are sure enough.
    """
    sure = [_sure_lines(each) for each in responses]
    if len(sure) > 1:
        train, judge, judged = _joined(sure[:-1]), sure[-1], f"record {responses[-1].record}"
    else:
        (train, judge), judged = (_every_second(sure[0], k) for k in (0, 1)), "every second line"
    fit, misfit = fit_judged(train[0], train[1], judge)
    poles, zeros = len(fit.denominator) - 1, len(fit.numerator) - 1
    order = FitOrder(poles, zeros, int(poles - np.flatnonzero(fit.denominator)[-1]))
    f, response, _ = _joined(sure)
    return PairModel(fit_rational(f, response, order), misfit, judged)


def _sure_lines(response: FrequencyResponse) -> _Lines:
    """f, response and radius of the lines that say something: those that are _SURE, or the surest _FEWEST."""
    share = response.radius / np.maximum(np.abs(response.response), 1e-300)
    least = np.sort(share)[min(_FEWEST, share.size) - 1]
    if share.size < _FEWEST or least > _VAGUE:
        raise InputError(
            f"{response.record}: {response.output} answers {response.input} clearly at {np.sum(share < _VAGUE)} "
            f"frequencies, and a model needs {_FEWEST}; record more, or check that the columns belong together"
        )
    sure = share <= max(_SURE, least)
    f, h = response.f[sure], response.response[sure]
    return f, h, np.maximum(response.radius[sure], 1e-9 * np.abs(h))


def _every_second(lines: _Lines, first: int) -> _Lines:
    f, response, radius = (part[first::2] for part in lines)
    return f, response, radius


def _joined(parts: Sequence[_Lines]) -> _Lines:
    """The lines of several responses by rising frequency."""
    f, response, radius = (np.concatenate(each) for each in zip(*parts, strict=True))
    order = np.argsort(f, kind="stable")
    return f[order], response[order], radius[order]


@dataclass(frozen=True, repr=False)
class PairAnswer(Answer):
    """A measured `response`, the `model` near it (None where the recordings bear none), and the report on both."""

    response: FrequencyResponse
    model: PairModel | None
    outcome: Outcome

    @property
    def plant(self) -> LinearRig:
        """The model as a linear plant, in the place of a rig. Raises InputError where there is none."""
        if self.model is None:
            raise InputError(f"{self.response.record}: the recordings bear no model; record more")
        document = tomllib.loads(str(self.outcome.files[PLANT]))
        return read_linear_rig(ConfigTable(document, PLANT), self.response.record)

    def __repr__(self) -> str:
        return repr(self.outcome)

    def _repr_html_(self) -> str:
        return self.outcome._repr_html_()


def run_pairs(task: FrequencyTask, leaves: bool, stage: Stage, progress: Progress) -> Outcome:
    """The outcome of `pair_answer`; its plant is left, and has to be, where one is asked for."""
    answer = pair_answer(task, progress, leaves)
    if leaves:
        _ = answer.plant
    return answer.outcome if leaves else replace(answer.outcome, files={})


def pair_answer(task: FrequencyTask, progress: Progress, leaves: bool = False) -> PairAnswer:
    """The response of the pair over all recordings, with a model of a transfer function and a delay beside it.

    Raises InputError for an output that leads its input; that of another unit may, a little, unless its plant is left.
    """
    responses = []
    for pair in task.pairs:
        progress(f"{pair.record.name}: {pair.output} over {pair.input}")
        response = measured_response(pair.record, pair.input, pair.output, task.period)
        follows = pair.units[0] == pair.units[1] != "1"
        if problem := lead_problem(response, pair.record.period, follows, not (follows or leaves)):
            raise InputError(f"{pair.record.name}: {problem}")
        responses.append(response)
    progress("model")
    whole = _told(averaged(responses))
    try:
        model, said = pair_model(responses), ""
    except InputError as error:
        model, said = None, f"No model: {error}. "
    comparison = _comparison(task, whole, model)
    metrics: dict[str, Any] = {"rows": rows(comparison), "delay_s": None, "model": None}
    if model is not None:
        said, fit = _said(task, model), model.fit
        metrics["delay_s"] = fit.delay
        metrics["model"] = {
            "numerator": fit.numerator.tolist(),
            "denominator": fit.denominator.tolist(),
            "error_percent": 100 * fit.error,
            "misfit": model.misfit,
            "judged_by": model.judged,
        }

    def draw() -> tuple[Page, Figure]:
        return page(task.source, "a transfer function", [comparison], said), figure(comparison)

    files = {} if model is None else {PLANT: plant_text(task, model)}
    return PairAnswer(whole, model, Outcome(metrics, draw, {"response": columns(comparison)}, files))


def _told(response: FrequencyResponse) -> FrequencyResponse:
    """The response at the lines at which it is not all noise. Raises InputError where there is none."""
    told = response.radius < np.abs(response.response)
    if not told.any():
        raise InputError(
            f"{response.record}: {response.output} does not answer {response.input} at any frequency; check the columns"
        )
    columns = ("f", "response", "coherence", "radius", "instrument", "h2")
    return replace(response, **{name: getattr(response, name)[told] for name in columns})


def _comparison(task: FrequencyTask, whole: FrequencyResponse, model: PairModel | None) -> Comparison:
    """The response beside its model, which says nothing above what it was fitted to."""
    fitted, later = np.full(whole.f.size, complex(np.nan, np.nan)), {}
    if model is not None:
        near = whole.f <= model.fit.f.max() * (1 + 1e-9)
        fitted = np.where(near, replace(model.fit, f=whole.f).fitted, np.nan)
        early = np.where(near, whole.response * np.exp(2j * np.pi * whole.f * model.fit.delay), np.nan)
        later = {"measured, delay taken out": early}
    return Comparison(
        whole.record,
        task.pair,
        whole.f,
        whole.response,
        fitted,
        whole.method,
        whole.coherence,
        whole.radius,
        later,
        whole.notes,
        whole.h2,
        task.pairs[0].units,
    )


def _said(task: FrequencyTask, model: PairModel) -> str:
    fit, poles = model.fit, len(model.fit.denominator) - 1
    parts = f"{counted(poles, 'pole')} and {counted(len(fit.numerator) - 1, 'zero')}"
    return (
        f"{task.pair[1]} answers {task.pair[0]} after {round(1e3 * fit.delay, 6):.3g} ms with {parts}: within "
        f"{100 * fit.error:.2g} % rms of what was measured. Its order was chosen by {model.judged}, which it misses by "
        f"{model.misfit:.2g} times the 95 % band, or {100 * BENT:g} % of the response where that is more. "
    )


def plant_text(task: FrequencyTask, model: PairModel) -> str:
    """The file of a linear plant: its command is the input, 1 at the largest that was recorded."""
    fit, (_, above) = model.fit, task.pairs[0].units
    full = max(float(np.abs(pair.record.signals[pair.input]).max()) for pair in task.pairs)
    reach = max(float(np.abs(pair.record.signals[pair.output]).max()) for pair in task.pairs)
    try:
        measured_as(above)
    except InputError:
        above = "1"
    return toml_text({
        "title": f"{task.pair[1]} over {task.pair[0]} of {task.source}",
        "source": f"fitted to recordings, within {100 * fit.error:.2g} % rms from {fit.f[0]:.3g} to {fit.f[-1]:.3g} Hz",
        "transfer_function": {"numerator": fit.numerator.tolist(), "denominator": fit.denominator.tolist()},
        "signals": {"command": full, "delay": f"{fit.delay:.9g} s", "position": above},
        "limits": {"stroke": f"{2 * reach!r} {above}"},
        "control": {"period": f"{task.pairs[0].record.period:.9g} s"},
    })  # fmt: skip
