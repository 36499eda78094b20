"""Reads sessions: each one's evidence about the numbers of the first, and suspects fitted to it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from ...base.checkpoint import Progress
from ...base.errors import InputError
from ...base.private_cache import kept
from ...base.process_pool import one_blas_thread
from ...plant.effects.declared import effects_for
from ...records import Campaign
from ...records.dated_sessions import DatedSession
from ...records.fingerprint import fingerprint
from ...rigs.driven import driven
from ...rigs.rig import Rig
from ...rigs.rig_file import load_rig
from ..trace.problem import EstimationProblem, estimation_problem
from .naming import Explained, Explanations, Problem, Suspects, explainer
from .session_evidence import EffectModels, SessionEvidence, effect_models, from_json, rig_as_found, session_evidence

MOST = 16  # windows of a session: 8 s, in which numbers are known far better than rigs wander
_FEW = 12  # windows of a session that suspects are fitted to
_OTHER = 8.0  # a signal so many times larger, or smaller, than in the sessions before is in another unit
_FORM = 15  # of what the cache keeps


class SessionReader:
    """Reads sessions of one rig. What it computed stays in the user's cache: a session costs its fits once."""

    def __init__(self, rig: Rig, progress: Progress) -> None:
        self.rig, self._progress = rig, progress
        self._found: Rig | None = None
        self._models: dict[tuple[str, ...], EffectModels] = {}

    def evidence(self, campaign: Campaign, what: str) -> SessionEvidence:
        """The evidence of one session, about the rig as the first one found it. Raises InputError."""
        if self._found is None:
            self._found = self._as_found(campaign, what)
        rig = self._found

        def compute(own: Problem) -> dict[str, Any]:
            problem = own(rig)
            return session_evidence(problem, self._models_of(problem)).json()

        return from_json(self._kept(campaign, rig, [], what, compute))

    def _models_of(self, problem: EstimationProblem) -> EffectModels:
        """They take a while to build, and are the same for every session of these signals."""
        names = problem.train.names
        if names not in self._models:
            self._models = {names: effect_models(problem, effects_for(self.rig))}
        return self._models[names]

    def explained(self, campaign: Campaign, suspects: Sequence[Suspects], what: str) -> Explanations:
        """Suspects, one or several together, on one session, with the rig otherwise as the first one found it; without
        those whose fit ends far from the records."""
        rig, found = self._found or self.rig, Explanations()
        explained = explainer(lambda own: _problem(campaign, own, _FEW), rig, effects_for(self.rig))
        for axes in suspects:

            def compute(_: Problem, axes: Suspects = axes) -> dict[str, Any]:
                return {axis: asdict(each) for axis, each in explained(axes).items()}

            try:
                kept = self._kept(campaign, rig, list(axes), f"{' and '.join(axes)} on {what}", compute)
            except InputError:
                continue
            found[axes] = {axis: Explained(**each) for axis, each in kept.items()}
        return found

    def _as_found(self, campaign: Campaign, what: str) -> Rig:
        def compute(own: Problem) -> dict[str, Any]:
            found = rig_as_found(self.rig, own(self.rig))
            return {name: [n.value, n.low, n.high] for name, n in found.numbers.items()}

        kept = self._kept(campaign, self.rig, ["as found"], f"{what}, the rig as found", compute)
        numbers = {
            name: replace(n, value=kept[name][0], low=kept[name][1], high=kept[name][2], interval=None)
            for name, n in self.rig.numbers.items()
        }
        return replace(self.rig, numbers=numbers)

    def _kept(
        self, campaign: Campaign, rig: Rig, asked: Sequence[str], what: str, compute: Callable[[Problem], Any]
    ) -> Any:
        def told() -> Any:
            self._progress(what)
            with one_blas_thread():
                return compute(lambda own: _problem(campaign, own))

        key = {"campaign": fingerprint(campaign) | {"name": ""}, "rig": rig.table(), "asked": asked, "form": _FORM}
        return kept("session", key, told)


def read_sessions(
    reader: SessionReader, sessions: Sequence[DatedSession], left_out: list[str]
) -> tuple[list[DatedSession], list[SessionEvidence]]:
    """The sessions that can be read, with their evidence; a line in `left_out` for each other one."""
    kept, evidence, sizes = [], [], []
    for count, session in enumerate(sessions, 1):
        try:
            campaign = driven(session.load(), reader.rig)
            size = _sizes(campaign)
            _check_alike(campaign, reader.rig, size, sizes)
            each = reader.evidence(campaign, f"session {count} of {len(sessions)}: {session.day}")
        except InputError as error:
            left_out.append(f"{session.name}: {error}")
            continue
        kept.append(session)
        evidence.append(each)
        sizes.append(size)
    return kept, evidence


def _problem(campaign: Campaign, rig: Rig, most: int = MOST) -> EstimationProblem:
    """Windows of a session, so many at most, evenly over its records: the same ones of every week's run."""
    problem = estimation_problem(replace(campaign, rig=rig.name), rig)
    few = np.unique(np.linspace(0, problem.train.count - 1, most).round().astype(int))
    return replace(problem, train=problem.train.some(few.tolist()))


def _sizes(campaign: Campaign) -> dict[str, float]:
    """How large each signal is, RMS, in the records of a session: a supply that sags moves more, and is as large."""
    names = {name for record in campaign.train for name in record.signals}
    return {
        name: float(np.sqrt(np.mean([np.mean(r.signals[name] ** 2) for r in campaign.train if name in r.signals])))
        for name in names
    }


def _check_alike(
    campaign: Campaign, rig: Rig, size: Mapping[str, float], before: Sequence[Mapping[str, float]]
) -> None:
    """Raises InputError where a session is of another rig, or a signal in another unit than before."""
    if campaign.rig != rig.name and load_rig(campaign.rig).name.split("-")[0] != rig.name.split("-")[0]:
        raise InputError(f"was recorded on the rig {campaign.rig}, the others on {rig.name}")
    for name, value in size.items():
        usual = [other[name] for other in before if name in other]
        if len(usual) >= 2 and np.median(usual) > 0 and value > 0:
            ratio = value / float(np.median(usual))
            if not 1 / _OTHER < ratio < _OTHER:
                raise InputError(
                    f"{name} is {ratio:.3g} times as large as before; check its unit, or play the same run"
                )
