"""A platform fitted to its campaign: payload by the wrench of its legs, each leg as a jack, and what legs share."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.special import chdtrc

from ...base.checkpoint import Progress, Stage
from ...identify.found.fitted import Interval, interval_cells
from ...identify.found.legs import mean_known
from ...identify.wrench.balance import NUMBERS
from ...identify.wrench.fitted import PayloadFit, fit_payload
from ...identify.wrench.leg_cut import payload_problem
from ...report import Figure, Page, Section, Table
from ...rigs.platform import LEGS, Leg, Platform
from ...rigs.platform.platform_file import platform_files
from ...rigs.rig import Rig
from ..common.error_page import GIVEN
from ..common.legs import LegCampaigns, chi2_figure, each_leg, leg_tables
from ..common.outcome import Outcome
from .study import FitAnswer, fit_campaign

CHANCE = 0.01  # below which legs with one number would differ so much
CARRIED = "M"  # what a jack alone carries: a leg its rod
_NORMAL = 1.96
_PAYLOAD_NOTE = (
    "By least squares of the forces of load cells, or else of pressures, on the motion that the legs measured; what "
    "the legs weigh and turn across themselves is taken off as the platform's file has it. Products of inertia are the "
    "integrals of -x y and so on."
)
_SHARED_NOTE = (
    "The mean of the legs that follow their records, weighed by their intervals. Alike: were the number one, chance "
    f"alone would let these legs differ as they do in more than {CHANCE:.0%} of campaigns. The rods' masses are left "
    "out: their inertia is a small part of the measured force, and its noise biases them by more than the intervals "
    "say. A leg apart does not follow its records: what it lacks may have moved its numbers."
)


def run_platform_fit(legs: LegCampaigns, starts: int, stage: Stage, progress: Progress) -> Outcome:
    """Fit the payload to the train records of whole legs, and each leg to its cut records."""
    progress("payload")
    platform, payload = legs.platform, fit_payload(payload_problem(legs.platform, legs.whole))
    answers = each_leg(legs.cut, stage, progress, lambda leg, *own: fit_campaign(leg.campaign, leg.rig, starts, *own))
    metrics = _metrics(platform, payload, answers)
    found = found_platform(platform, payload, [answer.rig for answer in answers], legs.name)
    tables = leg_tables({i: each.outcome for i, each in enumerate(answers, 1)})
    return Outcome(metrics, lambda: _page(platform, payload, metrics, legs.name), tables, platform_files(found))


def found_platform(platform: Platform, payload: PayloadFit, rigs: Sequence[Rig], source: str) -> Platform:
    """The platform with payload and rigs of legs as fitted, but for the mass that a jack alone carries."""
    numbers = dict(platform.numbers)
    for name, value in zip(NUMBERS, payload.values.tolist(), strict=True):
        numbers[name] = replace(numbers[name], value=value, source=f"fitted to {source}")
    return replace(with_found_legs(platform, rigs, source), numbers=numbers)


def with_found_legs(platform: Platform, rigs: Sequence[Rig], source: str) -> Platform:
    """The platform with rigs of legs as fitted, and the payload as its file has it."""
    legs = tuple(_found_leg(leg, rig) for leg, rig in zip(platform.legs, rigs, strict=True))
    return replace(platform, legs=legs, source=f"{platform.name}, fitted to {source}")


def _found_leg(leg: Leg, rig: Rig) -> Leg:
    return replace(leg, rig=replace(rig.with_values(**{CARRIED: leg.rig[CARRIED]}), sensors=leg.rig.sensors))


def _metrics(platform: Platform, payload: PayloadFit, answers: Sequence[FitAnswer]) -> dict[str, Any]:
    own = {
        f"{name} [{platform.numbers[name].si}]": [value, value - half, value + half]
        for name, value, half in zip(NUMBERS, payload.values.tolist(), payload.halves.tolist(), strict=True)
    }
    legs = {f"leg{i}.{label}": each for i, answer in enumerate(answers, 1) for label, each in answer.parameters.items()}
    by_leg = [answer.chi2 for answer in answers]
    return {
        "parameters": own | legs,
        "chi2": {role: mean_known([chi2[role] for chi2 in by_leg]) for role in ("train", "heldout")},
        "rms": {
            f"leg{i}.{label}": row
            for i, each in enumerate(answers, 1)
            for label, row in each.outcome.metrics["rms"].items()
        },
        "unseen": [f"leg{i}.{name}" for i, each in enumerate(answers, 1) for name in each.outcome.metrics["unseen"]],
        "shared": shared_numbers([answer.parameters for answer in answers if answer.follows]),
        "legs": [{"leg": i, "chi2": answer.chi2, "follows": answer.follows} for i, answer in enumerate(answers, 1)],
        "wrench_left": (payload.left / payload.wrench).tolist(),
    }


def shared_numbers(legs: Sequence[Mapping[str, Interval]]) -> dict[str, dict[str, Any]]:
    """The weighed mean of each number that all these legs tell, with 95 % interval, and whether they are `alike`;
    nothing of fewer than two legs."""
    shared: dict[str, dict[str, Any]] = {}
    for label in legs[0] if len(legs) > 1 else ():
        if label.startswith(f"{CARRIED} "):
            continue
        rows = np.array([leg.get(label, [None] * 3) for leg in legs], float)
        values, sigma = rows[:, 0], (rows[:, 2] - rows[:, 1]) / (2 * _NORMAL)
        if not np.all(np.isfinite(rows)) or not np.all(sigma > 0):
            continue
        weights = sigma**-2
        mean, half = float(np.average(values, weights=weights)), _NORMAL / float(np.sqrt(weights.sum()))
        chance = float(chdtrc(len(legs) - 1, np.sum(((values - mean) / sigma) ** 2)))
        shared[label] = {"value": [mean, mean - half, mean + half], "chance": chance, "alike": chance > CHANCE}
    return shared


def _page(platform: Platform, payload: PayloadFit, metrics: Mapping[str, Any], campaign: str) -> tuple[Page, Figure]:
    parameters, shared = metrics["parameters"], metrics["shared"]
    rows = [
        [name, number.si, number.value, *interval_cells(parameters[f"{name} [{number.si}]"])]
        for name in NUMBERS
        for number in [platform.numbers[name]]
    ]
    head = ["number", "unit", "platform file", "fitted", "95 % low", "95 % high"]
    own = Table("Payload", head, rows, _PAYLOAD_NOTE)
    common = Table(
        "Numbers of the legs",
        ["number", "mean", "95 % low", "95 % high", "alike", *map(_head, metrics["legs"])],
        [
            [
                label,
                *interval_cells(each["value"]),
                each["alike"],
                *(parameters.get(f"leg{i + 1}.{label}", [None])[0] for i in range(LEGS)),
            ]
            for label, each in shared.items()
        ],
        _SHARED_NOTE,
    )
    (mass, low, high), left = parameters["mass [kg]"], 100 * max(metrics["wrench_left"])
    verdict = f"The payload is {mass:.5g} kg ({low:.5g} to {high:.5g}); its wrench leaves {left:.2g} %. "
    verdict += legs_sentence(metrics["legs"], shared)
    picture = chi2_figure({"as fitted": ([leg["chi2"]["heldout"] for leg in metrics["legs"]], GIVEN)})
    sections = [Section("Payload", [own]), Section("Legs", [picture, common])]
    return Page(f"{platform.name} fitted to {campaign}: payload and legs", verdict, sections), picture


def legs_sentence(legs: Sequence[Mapping[str, Any]], shared: Mapping[str, Mapping[str, Any]]) -> str:
    """Which legs do not follow their records, and in which numbers those that do differ."""
    strays = [f"leg {leg['leg']} ({_chi2(leg['chi2']['heldout'])})" for leg in legs if not leg["follows"]]
    apart = [label.split()[0] for label, each in shared.items() if not each["alike"]]
    said, which = "", "legs"
    if strays:
        said = f"Not following their records: {', '.join(strays)}; jackbench trace asks what they lack. "
        which = "the others"
    if len(legs) - len(strays) < 2:
        return said + "Fewer than two legs follow their records, so that nothing is said of what legs share."
    if not shared:
        return said + "No number has an interval in every one of them, so that nothing is said of what legs share."
    if not apart:
        return f"{said}No number differs between {which}."
    return f"{said}{which.capitalize()} differ in {', '.join(apart)}."


def _chi2(value: float | None) -> str:
    return "cannot be simulated" if value is None else f"chi2 {value:.3g}"


def _head(leg: Mapping[str, Any]) -> str:
    return f"leg {leg['leg']}" if leg["follows"] else f"leg {leg['leg']}, apart"
