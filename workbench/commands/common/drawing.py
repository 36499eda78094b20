"""A report, drawn from numbers that are computed and written already; where it cannot be, one sentence that says so."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from traceback import extract_tb
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ...report import Figure, Page, Section
    from .design_numbers import Subject

Draw = Callable[[], "tuple[Page, Figure | None]"]
"""Makes the page of a report, and its telling figure, None where there is nothing to draw."""

NO_REPORT = "No report could be drawn"


@dataclass(frozen=True, eq=False)
class Drawing:
    """A page and its telling figure; where there is none, `fault` says why."""

    page: "Page"
    picture: "Figure | None"
    fault: str = ""


def drawn(draw: Draw, subject: "Subject | None", kept: Sequence[str]) -> Drawing:
    """What `draw` gives, with the numbers of controllers and rig at the end; or why there is no report, in a sentence
    that names the files, `kept`, which have the numbers."""
    try:
        page, picture = draw()
        more = [_numbers(subject)] if subject else []
        return Drawing(replace(page, picture=picture, sections=[*page.sections, *more]), picture)
    except Exception as error:  # whatever it is: what was computed must not be lost to a picture of it
        fault = fault_words(error, kept)
        return Drawing(_without_report(fault), None, fault)


def rendered(page: "Page", kept: Sequence[str]) -> "tuple[Page, str, str]":
    """A page, its HTML and no fault; or a page with the fault alone."""
    from ...report import render

    try:
        return page, render(page), ""
    except Exception as error:  # as above
        fault = fault_words(error, kept)
        page = replace(_without_report(fault), title=page.title)
        return page, render(page), fault


def _numbers(subject: "Subject") -> "Section":
    from .design_numbers import numbers_section

    return numbers_section(subject)


def _without_report(fault: str) -> "Page":
    from ...report import Page

    return Page(NO_REPORT, fault, [])


def fault_words(error: Exception, kept: Sequence[str]) -> str:
    """What went wrong, and in which line of ours; where the numbers are."""
    places = [place for place in extract_tb(error.__traceback__) if "workbench" in Path(place.filename).parts]
    where = f" in {Path(places[-1].filename).name}, line {places[-1].lineno}" if places else ""
    said = " ".join(str(error).split())[:200]
    return f"{NO_REPORT} ({type(error).__name__}{where}: {said}). The numbers are all there: {', '.join(kept)}."
