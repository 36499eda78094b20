"""A platform's model beside the held-out records of a campaign, leg by leg: each leg cut out by its measured force."""

from collections.abc import Mapping, Sequence
from typing import Any

from ...base.checkpoint import Progress, Stage
from ...base.words import listed, spanned
from ...identify.found.legs import mean_known
from ...identify.wrench.leg_cut import CutLeg
from ...report import Page, Section, Table
from ...rigs.platform import LEGS, Platform
from ..common.legs import each_leg, leg_sections, leg_tables
from ..common.outcome import Outcome
from .study import run_residual

_NOTE = (
    "Each leg as a jack under the force that its load cell measured, or that the payload's motion asks of it, so "
    "platform, payload and the other legs are not judged. That force's noise shakes what it carries; the floor "
    "includes what that adds to the errors of the pressures."
)


def run_platform_residual(platform: Platform, legs: Sequence[CutLeg], stage: Stage, progress: Progress) -> Outcome:
    """The residual of every leg: `rows` with signals such as `leg3.pa`, and chi2 over all and by leg."""
    outcomes = each_leg(legs, stage, progress, lambda leg, *own: run_residual(leg.campaign, leg.rig, *own))
    rows = [
        {**row, "signal": f"leg{leg}.{row['signal']}"}
        for leg, outcome in enumerate(outcomes, 1)
        for row in outcome.metrics["rows"]
    ]
    by_leg = [outcome.metrics["chi2"] for outcome in outcomes]
    told = [{"leg": leg, "chi2": chi2} for leg, chi2 in enumerate(by_leg, 1)]
    metrics = {"rows": rows, "chi2": mean_known(by_leg), "legs": told}
    tables = leg_tables(dict(enumerate(outcomes, 1)))

    def draw() -> Any:
        worst = max(range(LEGS), key=lambda leg: float("inf") if by_leg[leg] is None else by_leg[leg])
        return _page(platform, metrics, leg_sections(worst + 1, outcomes[worst].page)), outcomes[worst].picture

    return Outcome(metrics, draw, tables)


def legs_sentence(by_leg: Mapping[int, float | None]) -> str:
    """Which legs cannot be simulated, and which of the others is farthest from its declared jack."""
    failed = [f"leg {leg}" for leg, chi2 in by_leg.items() if chi2 is None]
    left = {leg: chi2 for leg, chi2 in by_leg.items() if chi2 is not None}
    said = f"Not to be simulated as declared: {listed(failed)}. " if failed else ""
    if not left:
        return said.rstrip()
    worst = max(left, key=lambda leg: left[leg])
    said += (
        f"Leg {worst} is farthest from its declared jack{' of the others' * bool(failed)}: chi2 {left.pop(worst):.3g}"
    )
    return f"{said}, the rest {spanned(left.values())}." if left else f"{said}."


def _page(platform: Platform, metrics: dict[str, Any], worst: Sequence[Section]) -> Page:
    by_leg = [[f"leg {each['leg']}", each["chi2"]] for each in metrics["legs"]]
    table = Table("chi2 by leg", ["leg", "chi2"], by_leg, _NOTE)
    verdict = legs_sentence({each["leg"]: each["chi2"] for each in metrics["legs"]})
    return Page(f"Residual of {platform.name}, leg by leg", verdict, [Section("Legs", [table]), *worst])
