"""What a report says of a plant that was fitted to a measured frequency response."""

from dataclasses import replace

from ...report import FrequencyCurve, Page, Section, bode
from ...rigs.linear_rig import LinearRig
from ...rigs.rig import Rig


def with_fit(page: Page, rig: Rig) -> Page:
    """The page, with the fit and its error behind the verdict and in a last section."""
    fit = rig.fit if isinstance(rig, LinearRig) else None
    if fit is None:
        return page
    curves = [FrequencyCurve("measured", fit.f, fit.response, "markers"), FrequencyCurve("fitted", fit.f, fit.fitted)]
    figure = bode(f"{rig.name}: measured and fitted", curves, f"{fit}.")
    verdict = f"{page.verdict} The plant: {fit}."
    return replace(page, verdict=verdict, sections=[*page.sections, Section("The plant's fit", [figure])])
