"""What a fit or a trace of one campaign works on: windows to fit, to select by and to judge by.

Three roles. Train windows are fitted. Where two models are compared, the records under `select` decide, or, where a
campaign has none, train windows that a search leaves out, or blocks of the train windows in turn, each predicted by the
others. Held-out windows are looked at once, when all is decided: every error that is quoted is theirs.

Where a campaign is scored by free runs, every record is one window; a select or held-out record is run through from
the state that fits its first rows. A fit begins in blocks of the train records, which are easier to fit.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...base.errors import InputError
from ...plant.effects import Effect
from ...records import Campaign
from ...records.campaign import FREE_RUN
from ...rigs.rig import Rig
from ..data.noise_floor import NoiseFloor
from ..data.scored_floor import scored_floor
from ..fit.checked_columns import MistakenColumns, check_columns
from ..fit.determined import FreeParameter
from ..fit.free_parameters import model_with, uncertain
from ..fit.informative import informative
from ..fit.model import Model
from ..fit.session_numbers import SessionNumber, session_numbers
from ..fit.windows import BLOCKS, WINDOW, Windows, cut_windows
from . import rule as decide
from .samples import variable_samples

_SHORTEST = 4  # windows of train and of heldout records: with fewer, numbers and initial states are one
MOST = 64  # windows in a search: 32 s; a fit of what it found takes all


@dataclass(frozen=True, eq=False)
class EstimationProblem:
    """Windows of one campaign by role; without `select` the train windows are rotated (see fit/rotation.py).

    `sessions`: the numbers that are others in some of the records. `late` [s]: how much later than the command a second
    logger recorded these channels, which the windows have put back.
    """

    campaign: Campaign
    rig: Rig
    floor: NoiseFloor
    train: Windows
    select: Windows | None
    heldout: Windows
    sessions: tuple[SessionNumber, ...] = ()
    late: Mapping[str, float] = field(default_factory=dict)

    @property
    def free_run(self) -> bool:
        """Whether held-out and select records are run through freely."""
        return self.campaign.score == FREE_RUN

    @property
    def free(self) -> tuple[FreeParameter, ...]:
        """What a fit of the rig may move: its uncertain numbers, and what differs in sessions."""
        return (*uncertain(self.rig), *(number.free() for number in self.sessions if number.fitted))

    def model(self, effects: Sequence[Effect] = (), brief: bool = False, coarse: bool = False) -> Model:
        """The rig with effects beyond those that it declares, in the signals that are compared (see Model); of free
        runs always a `coarse` one (see model_with)."""
        return model_with(self.rig, effects, self.train.names, brief, self.sessions, coarse or self.train.from_rest)

    @property
    def large(self) -> bool:
        """Whether there are more windows than a search needs."""
        return max(self.train.count, self.select.count if self.select else 0) > MOST

    def chosen(self) -> dict[str, list[int]]:
        """The windows that tell most of the rig's numbers, where there are more than a search needs, by role.

        Without select records those train windows select that are not fitted, if there are enough of them: a fit
        leans on the windows that tell most, so that blocks of these in turn would say more of the block left out than
        of the model.
        """
        model = self.model()
        train = informative(model, self.train, self.free, MOST)
        if self.select:
            return {"train": train, "select": informative(model, self.select, self.free, MOST)}
        rest = sorted(set(range(self.train.count)) - set(train))
        if len(rest) < MOST:
            return {"train": train}
        select = informative(model, self.train.some(rest), self.free, MOST)
        return {"train": train, "select": [rest[w] for w in select]}

    def in_blocks(self) -> "EstimationProblem":
        """With each train record cut into blocks that have initial states of their own."""
        return replace(self, train=self.train.cut(BLOCKS))

    def only(self, chosen: dict[str, list[int]]) -> "EstimationProblem":
        """With these windows only."""
        select = (self.select or self.train).some(chosen["select"]) if "select" in chosen else None
        return replace(self, train=self.train.some(chosen["train"]), select=select)

    @cached_property
    def samples(self) -> dict[str, np.ndarray]:
        """The values [n] SI that the slots' natural variables had in the train records, by word."""
        return variable_samples(self.rig, self.campaign.train)

    @cached_property
    def kappas(self) -> np.ndarray:
        """Autocorrelation factor of each compared signal of the train windows [signals]."""
        return np.array([self.floor.kappa[name] for name in self.train.names])

    def deviation(self, samples: int) -> float:
        """Standard deviation of the chi2 that noise alone leaves in so many samples, with the floor's own error; the
        signals share them as they do the train windows."""
        counts = self.train.samples_by_signal
        return self.floor.deviation({name: samples * n / self.train.samples for name, n in counts.items()})

    def misses(self, chi2: float, samples: int) -> bool:
        """Whether chi2 of so many samples that a fit did not see says that something is missing."""
        return decide.misfit(chi2, self.deviation(samples))

    def complete(self, before: float, samples: int, several: bool) -> float:
        """chi2 of so many held-out samples up to which names are all that is missing, of `before` without them; where a
        rig is known to lack `several` effects, nothing but noise is."""
        deviation = self.deviation(samples)
        return decide.gate(deviation) if several else decide.complete(before, deviation)

    @property
    def kappa(self) -> float:
        """Autocorrelation factor over all signals."""
        return float(np.mean(self.kappas))


def estimation_problem(campaign: Campaign, rig: Rig) -> EstimationProblem:
    """Windows and noise floor of a campaign. Raises InputError where it cannot be fitted, saying what to add."""
    if not campaign.train:
        raise InputError(f"{campaign.path}: no train record, so nothing can be fitted; list some under [records] train")
    sessions, floor = session_numbers(campaign, rig), scored_floor(campaign, rig)
    check_columns(campaign, rig, floor)
    plant = model_with(rig, (), ()).plant
    roles = {role: getattr(campaign, role) for role in ("train", "select", "heldout")}
    every = [record for records in roles.values() for record in records]
    if campaign.score == FREE_RUN:
        cut = {
            role: cut_windows(plant, own, floor, beside=every, late=0.0, length=math.inf)
            for role, own in roles.items()
            if own
        }
        return EstimationProblem(campaign, rig, floor, cut["train"], cut.get("select"), cut["heldout"], sessions)
    cut = {role: cut_windows(plant, own, floor, beside=every) for role, own in roles.items() if own}
    for role, windows in cut.items():
        seconds = sum(float(record.t[-1] - record.t[0]) + record.period for record in windows.records)
        if seconds < _SHORTEST * WINDOW - 1e-6:
            raise InputError(
                f"{campaign.path}: {role} records last {seconds:.2g} s in all; give {_SHORTEST * WINDOW:g} s at least"
            )
    return EstimationProblem(campaign, rig, floor, cut["train"], cut.get("select"), cut["heldout"], sessions)


def traced_problem(campaign: Campaign, rig: Rig) -> EstimationProblem:
    """What a trace works on: as `estimation_problem`, but where nothing is wrong with the columns but that a second
    logger recorded some of them later or earlier, these are put back, and the problem says by how much."""
    try:
        return estimation_problem(campaign, rig)
    except MistakenColumns as wrong:
        mistake = wrong.mistake
        if mistake.kind != "shifted" or mistake.beside:
            raise
        roles = {role: tuple(map(mistake.undone, getattr(campaign, role))) for role in ("train", "select", "heldout")}
        return replace(estimation_problem(replace(campaign, **roles), rig), late=mistake.late)
