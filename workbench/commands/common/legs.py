"""The legs of a platform, each a jack: their campaigns, and the stages and outcomes of a computation on each."""

import argparse
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from ...base.checkpoint import Progress, Stage, within
from ...identify.wrench.leg_cut import CutLeg, cut_legs, whole_campaigns
from ...records import Campaign
from ...records.fingerprint import fingerprint
from ...report import Curve, Figure, Mark, Page, Panel, Section
from ...rigs.platform import LEGS, Platform, load_platform
from .outcome import Outcome

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class LegCampaigns:
    """A platform, and the campaigns of its legs [6], whole and cut out."""

    platform: Platform
    whole: Sequence[Campaign]
    cut: Sequence[CutLeg]

    @property
    def name(self) -> str:
        """The name of the folder."""
        return self.whole[0].path.resolve().name

    def identity(self, command: str, of_cut: bool = True, **more: Any) -> dict[str, Any]:
        """What says that a computation is the same one: by the campaigns that are cut, or whole."""
        prints = [fingerprint(each) for each in ([leg.campaign for leg in self.cut] if of_cut else self.whole)]
        return {"command": command, "campaigns": prints, "rig": self.platform.table(), **more}


def leg_campaigns(options: argparse.Namespace, name: str) -> LegCampaigns:
    """Those of a platform's campaign folder. Raises InputError."""
    platform, whole = load_platform(name), whole_campaigns(options.campaign, options.heldout)
    return LegCampaigns(platform, whole, cut_legs(platform, whole))


def chi2_figure(
    curves: Mapping[str, tuple[Sequence[float | None], str]],
    marks: Sequence[Mark] = (),
    ends: tuple[float, float] | None = None,
) -> Figure:
    """Held-out chi2 of every leg [6], by name with its colour; `ends` of a logarithmic axis."""
    places = np.arange(1.0, LEGS + 1)
    drawn = [Curve(name, places, np.array(chi2, float), "markers", color) for name, (chi2, color) in curves.items()]
    panel = Panel("held-out chi2 [1]", drawn, log_y=ends is not None, y_range=ends, marks=marks)
    return Figure("chi2 by leg", "leg", [panel], x_names=[f"leg {i + 1}" for i in range(LEGS)])


def of_leg(stage: Stage, progress: Progress, number: int) -> tuple[Stage, Progress]:
    """Stages and progress that say the leg, counted from 1."""
    return within(stage, f"leg{number}"), lambda said: progress(f"leg {number} of {LEGS}: {said}")


def each_leg(
    legs: Sequence[CutLeg], stage: Stage, progress: Progress, study: Callable[[CutLeg, Stage, Progress], T]
) -> list[T]:
    """What the study of a jack makes of each leg."""
    return [study(leg, *of_leg(stage, progress, number)) for number, leg in enumerate(legs, 1)]


def leg_sections(number: int, page: Page, but: Collection[str] = ()) -> list[Section]:
    """The sections of the page of a leg, counted from 1, without some items."""
    parts = [(section.title, [item for item in section.items if item not in but]) for section in page.sections]
    return [Section(f"Leg {number}: {title}", items) for title, items in parts if items]


def leg_tables(outcomes: Mapping[int, Outcome]) -> dict[str, Mapping[str, np.ndarray]]:
    """The tables of legs by number, named by the leg."""
    return {f"leg{leg}-{name}": table for leg, each in outcomes.items() for name, table in each.tables.items()}
